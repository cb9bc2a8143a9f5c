#include "filigree/mesh/weld.h"

#include "filigree/core/hash.h"

#include <array>
#include <bit>

namespace filigree {

namespace {

std::array<std::uint32_t, 3> position_key(const Vec3f& p) {
    std::array<std::uint32_t, 3> key;
    for (int k = 0; k < 3; ++k) key[k] = std::bit_cast<std::uint32_t>(p[k] + 0.0f); // -0 + 0 = 0
    return key;
}

} // namespace

std::vector<Index> weld_map(std::span<const Vec3f> positions) {
    const std::size_t slots = std::bit_ceil(positions.size() * 2 + 1);
    std::vector<Index> table(slots, kNoIndex), representative(positions.size());
    for (Index v = 0; v < positions.size(); ++v) {
        const auto key = position_key(positions[v]);
        std::size_t slot = hash_words(std::uint64_t{key[0]} << 32 | key[1], key[2]) & (slots - 1);
        while (table[slot] != kNoIndex && position_key(positions[table[slot]]) != key) slot = (slot + 1) & (slots - 1);
        if (table[slot] == kNoIndex) table[slot] = v;
        representative[v] = table[slot];
    }
    return representative;
}

} // namespace filigree
