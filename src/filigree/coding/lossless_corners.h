// Lists of vertices as they are: faces in their order, corners of attributes, records of a model's blocks.
#pragma once

#include "filigree/types.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

/// Faces that lie beside recent ones take few bits [in the manner of meshoptimizer's index codec, Kapoulkine 2017, with
/// the corners next along the border besides]. Any numbers come back as they were. Cost O(corners).
std::string encode_corners(std::span<const Index> face_offsets, std::span<const Index> corners);
/// None: damaged. face_offsets: ascending, from 0. Memory is bounded by the stream's size.
std::optional<std::vector<Index>> decode_corners(std::string_view stream, std::span<const Index> face_offsets);

/// Which value each corner has: mostly the one that the corner's vertex had last, or the first that none has had.
std::string encode_values(std::span<const Index> corners, std::span<const Index> values);
std::optional<std::vector<Index>> decode_values(std::string_view stream, std::span<const Index> corners);

/// Of each vertex, the record that it has in its block: runs of so many records one after the other, each in the order
/// of its vertices. near: of the first vertices, one before each that probably has the same run.
std::string encode_records(std::span<const std::uint16_t> records, std::span<const std::uint32_t> runs,
                           std::size_t block, std::span<const Index> near);
std::optional<std::vector<std::uint16_t>> decode_records(std::string_view stream, std::size_t vertices,
                                                         std::span<const std::uint32_t> runs, std::size_t block,
                                                         std::span<const Index> near);

} // namespace filigree
