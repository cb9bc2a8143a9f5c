// What a mesh has besides faces and places: texture coordinates, normals, colours, further numbers, labels of faces.
// Each is expected from what a reader knows by then, places included, in integers alone.
#pragma once

#include "filigree/coding/geometry_code.h"
#include "filigree/mesh.h"

namespace filigree {

/// Contexts of a SymbolWriter that attributes take, from 0 on.
inline constexpr unsigned kAttributeContexts = 185;

/// Writes what `mesh` has, and makes it what a reader will have: rounded, values in the order in which they are met.
/// places: of its vertices. Cost O(size), and O(log d) for each corner at a vertex with d corners.
void encode_attributes(Mesh& mesh, std::span<const FinePlace> places, SymbolWriter& out);

/// Into a mesh with the same faces, whose scalars are named. False: damaged.
bool decode_attributes(Mesh& mesh, std::span<const FinePlace> places, SymbolReader& in);

} // namespace filigree
