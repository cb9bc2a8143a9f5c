// Random numbers by counter, so that each sample has its own whatever thread asks.
#pragma once

#include <cstdint>

namespace filigree {

/// 64 random bits for each (seed, counter): [Steele 2014], SplitMix64.
inline std::uint64_t random_bits(std::uint64_t seed, std::uint64_t counter) {
    std::uint64_t x = seed * 0xD1342543DE82EF95u + (counter + 1) * 0x9E3779B97F4A7C15u;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    return x ^ (x >> 31);
}

/// A number of [0, 1) for each (seed, counter).
inline double random_unit(std::uint64_t seed, std::uint64_t counter) {
    return double(random_bits(seed, counter) >> 11) * 0x1p-53;
}

} // namespace filigree
