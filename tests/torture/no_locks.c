/* Preloaded into a program: no file can be locked, as on some file systems. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>

int fcntl(int file, int what, ...) {
    va_list more;
    va_start(more, what);
    void* const argument = va_arg(more, void*);
    va_end(more);
    if (what == F_OFD_SETLK) return errno = ENOLCK, -1;
    return ((int (*)(int, int, void*))dlsym(RTLD_NEXT, "fcntl"))(file, what, argument);
}
int fcntl64(int file, int what, ...) __attribute__((alias("fcntl")));
