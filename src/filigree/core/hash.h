// A hash of a few integers.
#pragma once

#include <cstdint>

namespace filigree {

/// 64 bits, each of which depends on every word: any of them may number a table's slots. Alike on every machine. With
/// the steps of SplitMix64 [Steele 2014], but for random numbers there is core/random.h.
template <class... Words>
constexpr std::uint64_t hash_words(Words... words) {
    std::uint64_t hash = 0;
    ((hash = (hash ^ (hash >> 29) ^ static_cast<std::uint64_t>(words)) * 0x9E3779B97F4A7C15u), ...);
    return hash ^ (hash >> 32);
}

} // namespace filigree
