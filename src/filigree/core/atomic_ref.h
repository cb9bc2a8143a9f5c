// std::atomic_ref, which LLVM's standard library has from version 19 on. Private to the library.
#pragma once

#include <atomic>

namespace filigree {

#if defined(__cpp_lib_atomic_ref)
using std::atomic_ref;
#else
/// As much of it as we use, by the compiler's own functions.
template <class T>
class atomic_ref {
public:
    explicit atomic_ref(T& value) : value_(&value) {}
    T load(std::memory_order order) const {
        T found;
        __atomic_load(value_, &found, number(order));
        return found;
    }
    void store(T value, std::memory_order order) const { __atomic_store(value_, &value, number(order)); }
    bool compare_exchange_strong(T& expected, T desired, std::memory_order order) const {
        return __atomic_compare_exchange(value_, &expected, &desired, false, number(order), __ATOMIC_RELAXED);
    }
    T fetch_add(T by, std::memory_order order) const { return __atomic_fetch_add(value_, by, number(order)); }
    T fetch_xor(T by, std::memory_order order) const { return __atomic_fetch_xor(value_, by, number(order)); }

private:
    static int number(std::memory_order order) { return static_cast<int>(order); }
    T* value_;
};
#endif

} // namespace filigree
