// Sets of up to 64 as bits of a word. Private to the library.
#pragma once

#include "filigree/core/lanes.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace filigree {

/// Bit k is set where holds(k), k < count, at most 64: sixteen at a time, so that the compiler uses vectors.
template <std::size_t count, class Holds>
FILIGREE_INLINE std::uint64_t bits_where(const Holds& holds) {
    constexpr std::size_t kAtOnce = 16;
    static_assert(count % kAtOnce == 0 && count <= 64);
    constexpr auto kBits = [] {
        std::array<std::uint32_t, kAtOnce> bits{};
        for (std::size_t k = 0; k < kAtOnce; ++k) bits[k] = 1u << k;
        return bits;
    }();
    std::uint64_t found = 0;
    for (std::size_t from = 0; from < count; from += kAtOnce) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < kAtOnce; ++k) bits |= kBits[k] & (0u - std::uint32_t{holds(from + k)});
        found |= std::uint64_t{bits} << from;
    }
    return found;
}

/// Calls visit(k) for each bit that is set, lowest first.
template <class Visit>
void for_each_bit(std::uint64_t bits, const Visit& visit) {
    for (; bits != 0; bits &= bits - 1) visit(std::countr_zero(bits));
}

} // namespace filigree
