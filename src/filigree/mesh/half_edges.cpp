#include "filigree/mesh/half_edges.h"
#include "filigree/mesh/incidence.h"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace filigree {

std::vector<Index> half_edges_by_edge(std::span<const Triangle> triangles, std::size_t vertex_count) {
    assert(triangles.size() <= kMostListedTriangles);
    // buckets by the lower vertex hold a handful of half-edges each, sorted by the higher one: no sort over everything
    const auto lower = [&](Index h) { return std::min(half_edge_start(triangles, h), half_edge_end(triangles, h)); };
    const auto higher = [&](Index h) { return std::max(half_edge_start(triangles, h), half_edge_end(triangles, h)); };
    const Index count = static_cast<Index>(3 * triangles.size());
    std::vector<Index> offsets(vertex_count + 1, 0);
    for (Index h = 0; h < count; ++h) ++offsets[lower(h) + 1];
    std::inclusive_scan(offsets.begin(), offsets.end(), offsets.begin());
    std::vector<std::uint64_t> keys(count);
    std::vector<Index> next(offsets.begin(), offsets.end() - 1);
    for (Index h = 0; h < count; ++h) keys[next[lower(h)]++] = std::uint64_t{higher(h)} << 32 | h;
    std::vector<Index> sorted(count);
    for (std::size_t v = 0; v < vertex_count; ++v) {
        std::sort(keys.begin() + offsets[v], keys.begin() + offsets[v + 1]);
        for (Index i = offsets[v]; i < offsets[v + 1]; ++i) sorted[i] = static_cast<Index>(keys[i]);
    }
    return sorted;
}

std::vector<Index> opposite_half_edges(std::span<const Triangle> triangles, std::size_t vertex_count) {
    std::vector<Index> opposite(3 * triangles.size(), kNoIndex);
    const std::vector<Index> sorted = half_edges_by_edge(triangles, vertex_count);
    for_each_edge(triangles, sorted, [&](std::span<const Index> edge) {
        if (edge.size() != 2) return;
        opposite[edge[0]] = edge[1];
        opposite[edge[1]] = edge[0];
    });
    return opposite;
}

Labels fans(std::span<const Index> opposite) {
    Labels fan{std::vector<Index>(opposite.size(), kNoIndex), 0};
    for (Index first = 0; first < opposite.size(); ++first) {
        if (fan.of[first] != kNoIndex) continue;
        const Index label = static_cast<Index>(fan.count++);
        Index h = first;
        while (h != kNoIndex && fan.of[h] == kNoIndex) {
            fan.of[h] = label;
            h = opposite[previous_half_edge(h)];
        }
        if (h != kNoIndex) continue; // all the way round
        for (Index back = opposite[first]; back != kNoIndex; back = opposite[h]) {
            h = next_half_edge(back);
            fan.of[h] = label;
        }
    }
    return fan;
}

Labels components(std::span<const Index> opposite) {
    const std::size_t triangle_count = opposite.size() / 3;
    Labels component{std::vector<Index>(triangle_count, kNoIndex), 0};
    std::vector<Index> open;
    for (Index seed = 0; seed < triangle_count; ++seed) {
        if (component.of[seed] != kNoIndex) continue;
        const Index label = static_cast<Index>(component.count++);
        component.of[seed] = label;
        open.push_back(seed);
        while (!open.empty()) {
            const Index t = open.back();
            open.pop_back();
            for (Index h = 3 * t; h < 3 * t + 3; ++h) {
                if (opposite[h] == kNoIndex || component.of[opposite[h] / 3] != kNoIndex) continue;
                component.of[opposite[h] / 3] = label;
                open.push_back(opposite[h] / 3);
            }
        }
    }
    return component;
}

} // namespace filigree
