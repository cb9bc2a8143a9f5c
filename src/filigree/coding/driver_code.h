// A driver as vertices of a coded mesh: its faces, and which of the mesh's vertices its own are.
#pragma once

#include "filigree/types.h"

#include <optional>
#include <string>

namespace filigree {

struct DriverFaces {
    std::vector<Index> face_offsets = {0}, corners;
    std::vector<Index> vertices; ///< of each of the driver's vertices the mesh's
};
struct DriverCounts {
    std::size_t vertices, faces, corners, mesh_vertices;
};

/// vertices: of each of the driver's vertices, which of the coded mesh's it is.
std::string encode_driver(std::span<const Index> face_offsets, std::span<const Index> corners,
                          std::span<const Index> vertices, std::size_t mesh_vertices);
/// The same faces, perhaps in another order and beginning with other corners. None: damaged.
std::optional<DriverFaces> decode_driver(std::string_view stream, const DriverCounts& counts);

} // namespace filigree
