// What stands in for the system in the page's worker: one thread, and no exceptions.
#include "filigree/core/thread_pool.h"

#include <ctime>
#include <typeinfo>

namespace filigree {

unsigned processors() { return 1; }
void run_on_pool(std::size_t pieces, unsigned, std::atomic<unsigned>&, const LoopBody& body) { body(0, pieces); }

} // namespace filigree

// Only a result's value that nobody checked, and memory that has run out, are thrown. Here both stop the program, and
// the worker says that it was stopped. So nothing of it has to be unwound.
extern "C" {
void* __cxa_allocate_exception(std::size_t) throw() { __builtin_trap(); }
[[noreturn]] void __cxa_throw(void*, std::type_info*, void (*)(void*)) { __builtin_trap(); }
int clock_gettime(clockid_t, timespec* now) { // reports say how long a frame took: the page measures that itself
    *now = {};
    return 0;
}
int __cxa_atexit(void (*)(void*), void*, void*) { return 0; } // nothing ends before its memory does
}
