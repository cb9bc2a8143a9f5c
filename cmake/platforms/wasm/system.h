// Included before every C++ source that is compiled for WASM: what POSIX has and WASI has not. system.cpp answers for a
// system with one user, without permissions and locks.
#pragma once

#include <cstddef>
#include <sys/types.h>

#define PATH_MAX 4096
#define _SC_PHYS_PAGES 85
#define F_DUPFD_CLOEXEC 1030
#define DT_SOCK 20
#define SIGHUP 1
#define SIGPIPE 13
#define SIGXFSZ 25

extern "C" {
int chmod(const char* path, mode_t mode);
int fchmod(int descriptor, mode_t mode);
int fchmodat(int folder, const char* path, mode_t mode, int flags);
int mkstemp(char* name);
char* realpath(const char* path, char* real);
int truncate(const char* path, off_t size);
uid_t geteuid();
}
