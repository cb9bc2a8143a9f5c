// The edges of triangles, and whether the triangles at them cancel.
#pragma once

#include "filigree/mesh/mesh.h"

#include <algorithm>
#include <numeric>

namespace filigree {

/// An edge between two different vertices, low < high.
struct EdgeBalance {
    Index low, high;
    std::size_t triangles = 0; ///< that have it
    int net = 0;               ///< triangles that run from low to high, less those that run back
};

/// Calls visit(EdgeBalance) for each edge, in the order of low, then high. Vertices are below vertex_count.
/// Cost O(vertex_count + triangles); a vertex with d edges adds O(d log d). Memory 8 bytes a corner and a vertex.
template <class Visit>
void for_each_edge(std::size_t vertex_count, std::span<const Triangle> triangles, const Visit& visit) {
    struct End {
        Index high;
        int direction;
    };
    const auto for_each_side = [&](const auto& body) {
        for (const Triangle& t : triangles)
            for (std::size_t k = 0; k < 3; ++k) {
                const Index a = t[k], b = t[(k + 1) % 3];
                if (a != b) body(std::min(a, b), std::max(a, b), a < b ? 1 : -1);
            }
    };
    std::vector<std::size_t> first(vertex_count + 2);
    for_each_side([&](Index low, Index, int) { ++first[low + 2]; });
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<End> ends(first.back());
    for_each_side([&](Index low, Index high, int direction) { ends[first[low + 1]++] = {high, direction}; });

    for (Index low = 0; low < vertex_count; ++low) {
        const auto begin = ends.begin() + static_cast<std::ptrdiff_t>(first[low]);
        const auto end = ends.begin() + static_cast<std::ptrdiff_t>(first[low + 1]);
        std::sort(begin, end, [](const End& a, const End& b) { return a.high < b.high; });
        for (auto e = begin; e != end;) {
            EdgeBalance edge{low, e->high};
            for (; e != end && e->high == edge.high; ++e) {
                ++edge.triangles;
                edge.net += e->direction;
            }
            visit(edge);
        }
    }
}

} // namespace filigree
