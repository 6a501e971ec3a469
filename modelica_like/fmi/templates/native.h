/* What programs see that load this library. */
#ifndef NATIVE_H
#define NATIVE_H

#ifdef _WIN32
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

#endif
