// Connectivity of plain arrays of triangles and polygons: the corners at a vertex, the half-edges of an edge.
// Half-edge h begins at corner h and runs to the next corner of its face; triangle t has the half-edges 3 t to 3 t + 2.
#pragma once

#include "filigree/core/lists.h"
#include "filigree/types.h"

#include <algorithm>
#include <span>
#include <vector>

namespace filigree {

/// More have corners that 32 bits cannot count. triangulate and make_surface refuse more, so that
/// arrays of corners and half-edges are made of no more.
inline constexpr std::size_t kMostListedTriangles = kNoIndex / 3;

inline Index next_half_edge(Index h) { return h % 3 == 2 ? h - 2 : h + 1; }
inline Index previous_half_edge(Index h) { return h % 3 == 0 ? h + 2 : h - 1; }
/// Corners of triangles lie one after the other in memory, so the start needs no division.
inline Index half_edge_start(std::span<const Triangle> triangles, Index h) { return triangles.data()->data()[h]; }
inline Index half_edge_end(std::span<const Triangle> triangles, Index h) {
    return half_edge_start(triangles, next_half_edge(h));
}
/// The vertex across from a half-edge, in its triangle.
inline Index half_edge_apex(std::span<const Triangle> triangles, Index h) {
    return half_edge_start(triangles, previous_half_edge(h));
}
/// Whether a half-edge runs from the lower to the higher vertex of its edge.
inline bool runs_up(std::span<const Triangle> triangles, Index h) {
    return half_edge_start(triangles, h) < half_edge_end(triangles, h);
}

/// The corners of polygons: face f has the corners face_offsets[f] to face_offsets[f + 1] - 1.
class PolygonCorners {
public:
    PolygonCorners() = default;
    /// Keeps the span. Cost O(corners).
    explicit PolygonCorners(std::span<const Index> face_offsets);

    std::size_t count() const { return face_.size(); }
    Index face(Index corner) const { return face_[corner]; }
    Index size(Index corner) const { return end(corner) - begin(corner); } ///< of its face
    Index next(Index corner) const { return corner + 1 < end(corner) ? corner + 1 : begin(corner); }
    Index previous(Index corner) const { return (corner > begin(corner) ? corner : end(corner)) - 1; }

private:
    Index begin(Index corner) const { return face_offsets_[face_[corner]]; }
    Index end(Index corner) const { return face_offsets_[face_[corner] + std::size_t{1}]; }

    std::span<const Index> face_offsets_;
    std::vector<Index> face_; ///< of each corner
};

/// For each vertex the corners c with corners[c] at it, ascending. Every corner is below vertex_count, and there are
/// fewer than kNoIndex corners, as in every mesh that passes check_mesh. Cost O(V + corners).
IndexLists corners_at_vertices(std::span<const Index> corners, std::size_t vertex_count);

/// For each vertex the triangles that use it, ascending; a triangle that uses it twice stands there twice. At most
/// kMostListedTriangles. Cost O(V + F).
IndexLists triangles_at_vertices(std::span<const Triangle> triangles, std::size_t vertex_count);

/// The half-edges of each edge, ascending. Edges ascend by their lower vertex, then by their higher one. Half-edges
/// from a vertex to itself are in no list. Vertices are below vertex_count; at most kMostListedTriangles.
/// Cost O(V + F log d) where at most d half-edges begin or end at a vertex; memory 24 bytes a half-edge.
IndexLists edges_of(std::span<const Triangle> triangles, std::size_t vertex_count);

/// Groups the half-edges of each vertex by their higher vertex. keys: in list v, the higher vertex in the upper 32 bits
/// and the half-edge in the lower 32 bits of each half-edge whose lower vertex is v.
IndexLists group_by_edge(Lists<std::uint64_t> keys);

/// As edges_of, of other faces than triangles. for_each(add) calls add(from, to, half_edge) for every half-edge; it is
/// called twice and has to give the same half-edges both times. Fewer than kNoIndex.
template <class ForEach>
IndexLists edges_from(std::size_t vertex_count, const ForEach& for_each) {
    return group_by_edge(make_lists<std::uint64_t>(vertex_count, [&](const auto& add) {
        for_each([&](Index from, Index to, Index half_edge) {
            add(std::min(from, to), std::uint64_t{std::max(from, to)} << 32 | half_edge);
        });
    }));
}

/// The lower and the higher vertex of an edge.
inline std::array<Index, 2> edge_ends(std::span<const Triangle> triangles, std::span<const Index> edge) {
    const Index a = half_edge_start(triangles, edge[0]), b = half_edge_end(triangles, edge[0]);
    return {std::min(a, b), std::max(a, b)};
}
/// How many of an edge's half-edges run up, less those that run down: 0 where they cancel.
int edge_balance(std::span<const Triangle> triangles, std::span<const Index> edge);

/// Whether an edge has two triangles over the same three vertices.
inline bool is_one_face_twice(std::span<const Triangle> triangles, std::span<const Index> edge) {
    return edge.size() == 2 && half_edge_apex(triangles, edge[0]) == half_edge_apex(triangles, edge[1]);
}

/// For each of half_edge_count half-edges the other one of its edge, where the edge has exactly two and joins(a, b)
/// says yes; kNoIndex elsewhere.
template <class Joins>
std::vector<Index> pair_half_edges(const IndexLists& edges, std::size_t half_edge_count, const Joins& joins) {
    std::vector<Index> other(half_edge_count, kNoIndex);
    for (const std::span<const Index> edge : edges) {
        if (edge.size() != 2 || !joins(edge[0], edge[1])) continue;
        other[edge[0]] = edge[1];
        other[edge[1]] = edge[0];
    }
    return other;
}
/// The same, without the pairs that are one face twice: two triangles over the same three vertices.
std::vector<Index> neighbour_half_edges(std::span<const Triangle> triangles, const IndexLists& edges);

/// For each half-edge the one that runs back along it, kNoIndex on borders. triangles: of a manifold surface. Cost as
/// edges_of.
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
