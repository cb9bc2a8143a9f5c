// What stands in for the system in the page's worker: no clock and no exceptions.
#include "web/live/serial.h"

#include <filigree/result.h>

#include <cstdlib>
#include <ctime>
#include <string>
#include <typeinfo>

// What is thrown ends the program, as nothing unwinds; memory that has run out does too. Only its sentence is left.
namespace {
std::string sentence;
}
extern "C" {
__attribute__((export_name("thrown"))) const char* thrown() { return sentence.c_str(); }
void* __cxa_allocate_exception(std::size_t size) throw() { return std::malloc(size); }
[[noreturn]] void __cxa_throw(void* what, std::type_info* type, void (*)(void*)) {
    const std::string_view name = type->name();
    if (name == "N8filigree15BadResultAccessE")
        sentence = static_cast<const filigree::BadResultAccess*>(what)->what();
    else
        sentence = filigree::sentence_of(what, name);
    __builtin_trap();
}
int clock_gettime(clockid_t, timespec* now) { // reports say how long a frame took: the page measures that itself
    *now = {};
    return 0;
}
int __cxa_atexit(void (*)(void*), void*, void*) { return 0; } // nothing ends before its memory does
}
