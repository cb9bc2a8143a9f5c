// Numbers bit for bit: each is expected from numbers before it, and the difference is written. Integers alone but for
// one rounded sum of floats, so that every machine reads the same.
#pragma once

#include "filigree/types.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

/// Where an item is expected: at near + across - behind, all of them items before it; at `near` where the others are
/// none, at the item before where that is none too.
struct Expectation {
    Index near = kNoIndex, across = kNoIndex, behind = kNoIndex;
};

/// Of each vertex of faces, the parallelogram over vertices with lower numbers beside it. vertices: how many there are;
/// corners beyond them are passed over. block: only vertices of the same block of so many count. Cost O(vertices
/// + corners log d) where at most d corners are at a vertex.
std::vector<Expectation> vertex_expectations(std::span<const Index> face_offsets, std::span<const Index> corners,
                                             std::size_t vertices, std::size_t block);

/// How items of words are read: `columns` words each, floats or integers.
struct WordLayout {
    unsigned columns = 1; ///< at most 16
    bool are_floats = false;
    bool second_order = false; ///< where nothing is expected: to change from the item before as that did
};

/// known: words of items before the first, which a reader has; expectations count from the first of these. expected: of
/// the items that are not known; of those beyond its end nothing is. Any words come back as they were. Cost O(words).
std::string encode_numbers(std::span<const std::uint32_t> known, std::span<const std::uint32_t> words,
                           WordLayout layout, std::span<const Expectation> expected);
/// None: damaged. Memory is bounded by the stream's size.
std::optional<std::vector<std::uint32_t>> decode_numbers(std::string_view stream, std::span<const std::uint32_t> known,
                                                         std::size_t items, WordLayout layout,
                                                         std::span<const Expectation> expected);

} // namespace filigree
