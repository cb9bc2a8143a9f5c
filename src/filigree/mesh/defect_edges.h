// Where a mesh is not a closed, oriented manifold, edge by edge: for marking what TopologyReport counts.
#pragma once

#include "filigree/mesh.h"

namespace filigree {

/// An edge that a closed, oriented manifold mesh would not have, or, with a = b, a corner of a face without area.
/// Vertices of the finest mesh.
struct DefectEdge {
    Index a = 0, b = 0;
    bool is_open = false;
    bool is_opposed = false; ///< its two faces run along it the same way; neither: it has three faces or more
};
/// All of them, by the rules of TopologyReport: edges, ascending, then faces. The mesh is not checked. Cost
/// O(V + corners log d) where d edges meet at a vertex.
std::vector<DefectEdge> defect_edges(const Mesh& mesh);

} // namespace filigree
