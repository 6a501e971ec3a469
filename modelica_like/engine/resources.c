/* Finds the file of a model in the folder of resources, which importers name in many ways. */
#include "model.h"

#define NAME "model.bin"
#define LONGEST_PATH 4096
#ifdef _WIN32
#include <wchar.h>
enum { ON_WINDOWS = 1, UTF8 = 65001 };
/* Declared here: windows.h defines words such as `near`. */
__declspec(dllimport) int __stdcall MultiByteToWideChar(unsigned, unsigned long, const char *, int, wchar_t *, int);
FILE *_wfopen(const wchar_t *, const wchar_t *);
static FILE *open_file(const char *path) {
    wchar_t wide[LONGEST_PATH];
    return MultiByteToWideChar(UTF8, 0, path, -1, wide, LONGEST_PATH) > 0 ? _wfopen(wide, L"rb") : NULL;
}
#else
enum { ON_WINDOWS = 0 };
static FILE *open_file(const char *path) { return fopen(path, "rb"); }
#endif

static int is_letter(char c) { return (c | 32) >= 'a' && (c | 32) <= 'z'; }

static int starts(const char *text, const char *with) {
    for (; *with; text++, with++)
        if (*text == 0 || (is_letter(*text) ? *text | 32 : *text) != *with) return 0;
    return 1;
}

/* The path behind "file:", or NULL: what has no host, or this machine, is local; another host is a share of Windows. */
static const char *after_scheme(const char *uri, int windows) {
    const char *rest = uri + strlen("file:");
    if (rest[0] == '/' && rest[1] == '/') {
        const char *host = rest + 2;
        if (*host == '/') rest = host;
        else if (starts(host, "localhost/")) rest = host + strlen("localhost");
        else if (windows && is_letter(host[0]) && (host[1] == ':' || host[1] == '|')) rest = host;
        else if (!windows) return NULL;
    }
    if (windows && rest[0] == '/' && is_letter(rest[1]) && (rest[2] == ':' || rest[2] == '|')) rest++;
    return rest;
}

/* The folder of resources as a path: from a URI (FMI 2.0), or as it is (FMI 3.0). Returns 0 if it names none. */
int resource_path(const char *location, int windows, char *path, size_t room) {
    int encoded = starts(location, "file:");
    const char *from = encoded ? after_scheme(location, windows) : location;
    size_t n = 0;
    if (from == NULL || *from == 0 || (!encoded && strstr(from, "://") != NULL)) return 0;
    for (; *from; from++) {
        char c = *from;
        if (encoded && c == '%') {
            const char code[] = {from[1], from[1] ? from[2] : 0, 0};
            c = (char)strtol(code, NULL, 16);
            if (c == 0 || strspn(code, "0123456789abcdefABCDEF") != 2) return 0;
            from += 2;
        } else if (encoded && (c == '?' || c == '#')) break;
        if (encoded && windows && c == '|' && n == 1) c = ':';
        if (n + sizeof NAME + 1 >= room) return 0;
        path[n++] = c;
    }
    if (path[n - 1] != '/' && !(windows && path[n - 1] == '\\')) path[n++] = '/';
    memcpy(path + n, NAME, sizeof NAME);
    return 1;
}

static Model *read_all(FILE *file, Allocate allocate, Release release, char *message) {
    long size = fseek(file, 0, SEEK_END) == 0 ? ftell(file) : -1;
    unsigned char *bytes = size > 0 && fseek(file, 0, SEEK_SET) == 0 ? allocate((size_t)size, 1) : NULL;
    Model *m = NULL;
    if (bytes == NULL) return REFUSE("The model file is empty, or there is not enough memory for it.");
    if (fread(bytes, 1, (size_t)size, file) != (size_t)size) (void)REFUSE("The model file cannot be read completely.");
    else m = model_read(bytes, (size_t)size, allocate, release, message);
    if (m == NULL) release(bytes);
    else m->own = bytes;
    return m;
}

Model *model_open(const char *location, Allocate allocate, Release release, char *message) {
    char path[LONGEST_PATH];
    if (location == NULL || *location == 0)
        return REFUSE("The importer does not say where the FMU's resources are, so its model cannot be read. Export it "
                      "with the model compiled in (--embed).");
    if (!resource_path(location, ON_WINDOWS, path, sizeof path))
        return REFUSE("The location of the FMU's resources names no folder: '%.300s'.", location);
    FILE *file = open_file(path);
    if (file == NULL) return REFUSE("The model file cannot be opened: '%.400s'.", path);
    Model *m = read_all(file, allocate, release, message);
    fclose(file);
    return m;
}
