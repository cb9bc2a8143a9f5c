// Vertices at one place made one, as other programs count them: glTF keeps corners with other normals or UVs apart.
#pragma once

#include "filigree/mesh.h"
#include "filigree/mesh/weld.h"

namespace filigree_test {

/// Positions and faces alone; vertices in the order of the first of each place.
inline filigree::Mesh welded(const filigree::Mesh& mesh) {
    using filigree::Index;
    const std::vector<Index> lowest = filigree::weld_map(mesh.positions);
    std::vector<Index> number(lowest.size());
    filigree::Mesh result;
    result.origin = mesh.origin;
    for (Index v = 0; v < lowest.size(); ++v) {
        if (lowest[v] == v) {
            number[v] = static_cast<Index>(result.positions.size());
            result.positions.push_back(mesh.positions[v]);
        } else {
            number[v] = number[lowest[v]];
        }
    }
    result.face_offsets = mesh.face_offsets;
    for (const Index corner : mesh.corners) result.corners.push_back(number[corner]);
    return result;
}

} // namespace filigree_test
