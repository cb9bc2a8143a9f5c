// What system.h declares, and the folder to begin in.
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

namespace {

// WASI's processes begin in /.
[[gnu::constructor]] void begin_in_folder() {
    if (const char* folder = std::getenv("PWD")) ::chdir(folder);
}

} // namespace

extern "C" {
int chmod(const char*, mode_t) { return 0; }
int fchmod(int, mode_t) { return 0; }
int fchmodat(int, const char*, mode_t, int) { return 0; }
uid_t geteuid() { return 0; } // as st_uid is
int flock(int, int) { return 0; }
int statvfs(const char*, struct statvfs*) { return errno = ENOSYS, -1; }
int truncate(const char*, off_t) { return errno = ENOSYS, -1; }

int mkstemp(char* name) {
    char* const ending = name + std::strlen(name) - 6;
    for (unsigned k = 0; k < 1000000; ++k) {
        std::snprintf(ending, 7, "%06u", k);
        const int descriptor = ::open(name, O_RDWR | O_CREAT | O_EXCL, 0600);
        if (descriptor >= 0 || errno != EEXIST) return descriptor;
    }
    return -1;
}

int __cxa_thread_atexit(void (*)(void*), void*, void*) { return 0; } // the one thread does not end
// The compiler's own 128-bit arithmetic looks after its stack.
unsigned long __stack_chk_guard = 0xc0ffee;
[[noreturn]] void __stack_chk_fail() { __builtin_trap(); }

/// Symbolic links stay in it.
char* realpath(const char* path, char* real) {
    struct stat status {};
    if (::stat(path, &status) != 0) return nullptr;
    std::filesystem::path absolute = path;
    if (!absolute.is_absolute()) {
        char folder[4096];
        if (!::getcwd(folder, sizeof folder)) return nullptr;
        absolute = folder / absolute;
    }
    const std::string text = absolute.lexically_normal().string();
    if (!real) return ::strdup(text.c_str());
    std::strcpy(real, text.c_str());
    return real;
}
} // extern "C"
