// Half-edges of plain triangles: half-edge 3 t + i of triangle t runs from its vertex i to the next.
#pragma once

#include "filigree/mesh/mesh.h"

#include <utility>
#include <vector>

namespace filigree {

inline Index next_half_edge(Index h) { return h % 3 == 2 ? h - 2 : h + 1; }
inline Index previous_half_edge(Index h) { return h % 3 == 0 ? h + 2 : h - 1; }
inline Index half_edge_start(std::span<const Triangle> triangles, Index h) { return triangles[h / 3][h % 3]; }
inline Index half_edge_end(std::span<const Triangle> triangles, Index h) {
    return triangles[h / 3][h % 3 == 2 ? 0 : h % 3 + 1];
}

/// All half-edges, those of an edge side by side: sorted by the edge's lower vertex, its higher vertex, and their own
/// number. triangles: without repeated vertices, over vertices 0 to vertex_count - 1, at most kMostListedTriangles
/// (mesh/incidence.h). Cost O(F log d) where at most d half-edges begin or end at a vertex.
std::vector<Index> half_edges_by_edge(std::span<const Triangle> triangles, std::size_t vertex_count);

/// Calls visit(std::span<const Index>) for the half-edges of each edge. sorted: from half_edges_by_edge.
template <class Visit>
void for_each_edge(std::span<const Triangle> triangles, std::span<const Index> sorted, const Visit& visit) {
    const auto ends = [&](Index h) {
        const Index a = half_edge_start(triangles, h), b = half_edge_end(triangles, h);
        return a < b ? std::pair(a, b) : std::pair(b, a);
    };
    for (std::size_t begin = 0; begin < sorted.size();) {
        const auto edge = ends(sorted[begin]);
        std::size_t end = begin + 1;
        while (end < sorted.size() && ends(sorted[end]) == edge) ++end;
        visit(sorted.subspan(begin, end - begin));
        begin = end;
    }
}

/// For each half-edge the one that runs back along it, kNoIndex on borders. triangles: of a manifold surface. Cost
/// O(F).
std::vector<Index> opposite_half_edges(std::span<const Triangle> triangles, std::size_t vertex_count);

/// A number for each half-edge or triangle, counted from 0 in order of the first with that number.
struct Labels {
    std::vector<Index> of;
    std::size_t count = 0;
};

/// The fan that each half-edge's start belongs to: corners joined around their vertex over edges that have an opposite.
/// Cost O(F).
Labels fans(std::span<const Index> opposite);

/// The component of each triangle, joined over edges that have an opposite. Cost O(F).
Labels components(std::span<const Index> opposite);

} // namespace filigree
