/* Preloaded into a program: its n-th call of one function fails, and all before and after it work.
   FAILING_CALL: write, fsync, rename (and link), open, malloc; or any, for all that change files, folders too (these
   cannot fail, only kill). FAILING_NUMBER: n, from 1. FAILING_LOG: a file that is made when the call failed; where n is
   0, how many calls there were is written there.
   FAILING_HOW=kill: the process is killed before that call. Files of the system and the pipes to the terminal do not
   count. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static atomic_long calls;
static const char* failing;
static long number;
static int is_ready, kills;

static int make_log(void) {
    const char* log = getenv("FAILING_LOG");
    int (*real_open)(const char*, int, ...) = (int (*)(const char*, int, ...))dlsym(RTLD_NEXT, "open");
    return log && real_open ? real_open(log, O_CREAT | O_WRONLY, 0644) : -1;
}

__attribute__((constructor)) static void begin(void) {
    failing = getenv("FAILING_CALL");
    number = getenv("FAILING_NUMBER") ? atol(getenv("FAILING_NUMBER")) : 0;
    kills = getenv("FAILING_HOW") && strcmp(getenv("FAILING_HOW"), "kill") == 0;
    is_ready = 1;
}

__attribute__((destructor)) static void end(void) {
    if (!failing || number != 0) return;
    is_ready = 0;
    const int log = make_log();
    if (log >= 0) dprintf(log, "%ld", atomic_load(&calls)), close(log);
}

static int fails_now(const char* call) {
    if (!is_ready || !failing) return 0;
    if (strcmp(failing, call) != 0 && (strcmp(failing, "any") != 0 || strcmp(call, "malloc") == 0)) return 0;
    if (atomic_fetch_add(&calls, 1) + 1 != number) return 0;
    const int log = make_log();
    if (log >= 0) close(log);
    if (kills) kill(getpid(), SIGKILL);
    return 1;
}
static int is_a_file(int descriptor) {
    struct stat status;
    return descriptor > 2 && fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
}

#define REAL(type, name, ...) ((type(*)(__VA_ARGS__))dlsym(RTLD_NEXT, name))

ssize_t write(int descriptor, const void* bytes, size_t count) {
    if (is_a_file(descriptor) && fails_now("write")) return errno = ENOSPC, -1;
    return REAL(ssize_t, "write", int, const void*, size_t)(descriptor, bytes, count);
}
ssize_t writev(int descriptor, const struct iovec* pieces, int count) {
    if (is_a_file(descriptor) && fails_now("write")) return errno = ENOSPC, -1;
    return REAL(ssize_t, "writev", int, const struct iovec*, int)(descriptor, pieces, count);
}
ssize_t pwrite(int descriptor, const void* bytes, size_t count, off_t offset) {
    if (fails_now("write")) return errno = EIO, -1;
    return REAL(ssize_t, "pwrite", int, const void*, size_t, off_t)(descriptor, bytes, count, offset);
}
int fsync(int descriptor) {
    if (fails_now("fsync")) return errno = EIO, -1;
    return REAL(int, "fsync", int)(descriptor);
}
int fdatasync(int descriptor) {
    if (fails_now("fsync")) return errno = EIO, -1;
    return REAL(int, "fdatasync", int)(descriptor);
}
int rename(const char* from, const char* to) {
    if (fails_now("rename")) return errno = EIO, -1;
    return REAL(int, "rename", const char*, const char*)(from, to);
}
int renameat(int a, const char* from, int b, const char* to) {
    if (fails_now("rename")) return errno = EIO, -1;
    return REAL(int, "renameat", int, const char*, int, const char*)(a, from, b, to);
}
int linkat(int a, const char* from, int b, const char* to, int flags) {
    if (fails_now("rename")) return errno = EIO, -1;
    return REAL(int, "linkat", int, const char*, int, const char*, int)(a, from, b, to, flags);
}
int link(const char* from, const char* to) {
    if (fails_now("rename")) return errno = EIO, -1;
    return REAL(int, "link", const char*, const char*)(from, to);
}
int mkdir(const char* path, mode_t mode) {
    fails_now("folder");
    return REAL(int, "mkdir", const char*, mode_t)(path, mode);
}
int rmdir(const char* path) {
    fails_now("folder");
    return REAL(int, "rmdir", const char*)(path);
}
int unlink(const char* path) {
    fails_now("folder");
    return REAL(int, "unlink", const char*)(path);
}
int unlinkat(int a, const char* path, int flags) {
    fails_now("folder");
    return REAL(int, "unlinkat", int, const char*, int)(a, path, flags);
}
int open(const char* path, int flags, ...) {
    va_list more;
    va_start(more, flags);
    const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) ? va_arg(more, mode_t) : 0;
    va_end(more);
    if ((flags & (O_WRONLY | O_RDWR)) && fails_now("open")) return errno = EACCES, -1;
    return REAL(int, "open", const char*, int, ...)(path, flags, mode);
}
void* malloc(size_t size) {
    static __thread int is_inside; /* dlsym asks for memory itself */
    static void* (*real)(size_t);
    extern void* __libc_malloc(size_t);
    if (is_inside || size < 4096) return __libc_malloc(size);
    is_inside = 1;
    if (!real) real = REAL(void*, "malloc", size_t);
    const int fails = fails_now("malloc");
    is_inside = 0;
    if (fails) return errno = ENOMEM, NULL;
    return real(size);
}
