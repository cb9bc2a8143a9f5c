// What simplification in clusters leaves behind for binding: where each removed vertex begins to look for its cell.
#pragma once

#include "filigree/types.h"

namespace filigree {

/// Vertices that the clusters removed from a mesh, round by round. Each follows a vertex that its round left.
struct RemovedVertices {
    std::vector<Index> nearest_left;   ///< for each vertex: the one it follows; kNoIndex: it stays, or none was left
    std::vector<std::uint8_t> removed; ///< for each vertex: the round, from 1 on; 0: it stays
    std::uint8_t rounds = 0;
    bool empty() const { return nearest_left.empty(); }
};

} // namespace filigree
