/* Runs a model by a run-time of another platform, in an emulator of it:
 *     elsewhere LIBRARY MODEL END COUNT STEPS
 * COUNT variables, whose value references are read from the standard input, at STEPS equal distances until END; every
 * number is printed with all its bits. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#ifdef _WIN32
#include <windows.h>
#define OPEN(name) LoadLibraryA(name)
#define FIND(library, name) ((void *)(size_t)GetProcAddress(library, name))
#else
#include <dlfcn.h>
#define OPEN(name) dlopen(name, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#endif

#define ROOM (1 << 26)
#define MOST 1000

typedef void *Open(const unsigned char *, size_t, char *);
typedef void *New(const void *);
typedef const char *Message(const void *);
typedef int Reset(void *, double, double, double, double);
typedef int Begin(void *);
typedef int Step(void *, double, int64_t, const uint32_t *, const double *, int64_t, const uint32_t *, double *);

int main(int count, char **words) {
    static unsigned char bytes[ROOM];
    static uint32_t references[MOST];
    static double values[MOST];
    char message[512] = "";
    if (count != 6) return 2;
    void *library = OPEN(words[1]);
    FILE *file = fopen(words[2], "rb");
    double end = atof(words[3]);
    int n = atoi(words[4]), steps = atoi(words[5]);
    if (library == NULL || file == NULL || n > MOST)
        return fprintf(stderr, "cannot open %s or %s\n", words[1], words[2]), 2;
    size_t size = fread(bytes, 1, ROOM, file);
    for (int k = 0; k < n; k++)
        if (scanf("%" SCNu32, &references[k]) != 1) return 2;
    void *model = ((Open *)FIND(library, "native_open"))(bytes, size, message);
    if (model == NULL) return fprintf(stderr, "%s\n", message), 1;
    void *run = ((New *)FIND(library, "native_new"))(model);
    Step *step = (Step *)FIND(library, "native_step");
    int failed = ((Reset *)FIND(library, "native_reset"))(run, 0, end, 1e-9, 1e-11);
    failed = failed || ((Begin *)FIND(library, "native_begin"))(run);
    for (int k = 1; k <= steps && !failed; k++) {
        failed = step(run, end * k / steps, 0, NULL, NULL, n, references, values);
        for (int i = 0; i < n; i++) printf("%" PRIx64 "%c", *(uint64_t *)&values[i], i < n - 1 ? ' ' : '\n');
    }
    if (failed) fprintf(stderr, "%s\n", ((Message *)FIND(library, "native_message"))(run));
    return failed;
}
