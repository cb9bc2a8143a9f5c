// Numbers from text, in every locale the same: std::from_chars, which LLVM's standard library lacks for floats before
// version 20; there it is fast_float's. Private to the library and the programs.
#pragma once

#include <charconv>

#if !defined(__cpp_lib_to_chars)
#include <fast_float/fast_float.h>
#endif

namespace filigree {

/// As std::from_chars. T: float or double.
template <class T>
std::from_chars_result number_from_chars(const char* first, const char* last, T& value) {
#if defined(__cpp_lib_to_chars)
    return std::from_chars(first, last, value);
#else
    const fast_float::from_chars_result read = fast_float::from_chars(first, last, value);
    return {read.ptr, read.ec};
#endif
}

} // namespace filigree
