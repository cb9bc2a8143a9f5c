// The edges of triangles, and whether the triangles at them cancel.
#pragma once

#include "filigree/mesh/mesh.h"

#include <algorithm>
#include <numeric>

namespace filigree {

/// A triangle at an edge, seen from the edge's lower vertex.
struct TriangleSide {
    Index high; ///< the other vertex
    Index code; ///< twice the triangle, and 1 where it runs towards `high`

    Index triangle() const { return code / 2; }
    bool runs_up() const { return code % 2 == 1; }
    bool operator<(const TriangleSide& other) const {
        return high != other.high ? high < other.high : code < other.code;
    }
};

/// An edge between two different vertices, low < high.
struct EdgeBalance {
    Index low, high;
    std::size_t triangles = 0; ///< that have it
    int net = 0;               ///< triangles that run from low to high, less those that run back
    std::span<const TriangleSide> sides = {};
};

/// Calls visit(EdgeBalance) for each edge, in the order of low, then high. Vertices are below vertex_count, triangles
/// fewer than 2^31.
/// Cost O(vertex_count + triangles); a vertex with d edges adds O(d log d). Memory 8 bytes a corner and a vertex.
template <class Visit>
void for_each_edge(std::size_t vertex_count, std::span<const Triangle> triangles, const Visit& visit) {
    const auto for_each_side = [&](const auto& body) {
        for (Index t = 0; t < triangles.size(); ++t)
            for (std::size_t k = 0; k < 3; ++k) {
                const Index a = triangles[t][k], b = triangles[t][(k + 1) % 3];
                if (a != b) body(std::min(a, b), std::max(a, b), 2 * t + (a < b));
            }
    };
    std::vector<std::size_t> first(vertex_count + 2);
    for_each_side([&](Index low, Index, Index) { ++first[low + 2]; });
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<TriangleSide> ends(first.back());
    for_each_side([&](Index low, Index high, Index code) { ends[first[low + 1]++] = {high, code}; });

    for (Index low = 0; low < vertex_count; ++low) {
        const auto begin = ends.begin() + static_cast<std::ptrdiff_t>(first[low]);
        const auto end = ends.begin() + static_cast<std::ptrdiff_t>(first[low + 1]);
        std::sort(begin, end);
        for (auto e = begin; e != end;) {
            EdgeBalance edge{low, e->high};
            const auto first_side = e;
            for (; e != end && e->high == edge.high; ++e) {
                ++edge.triangles;
                edge.net += e->runs_up() ? 1 : -1;
            }
            edge.sides = {first_side, e};
            visit(edge);
        }
    }
}

} // namespace filigree
