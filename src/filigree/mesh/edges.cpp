#include "filigree/mesh/edges.h"

namespace filigree {

PolygonCorners::PolygonCorners(std::span<const Index> face_offsets)
    : face_offsets_(face_offsets), face_(face_offsets.empty() ? 0 : face_offsets.back()) {
    for (Index f = 0; f + 1 < face_offsets.size(); ++f)
        std::fill(face_.begin() + face_offsets[f], face_.begin() + face_offsets[f + 1], f);
}

IndexLists corners_at_vertices(std::span<const Index> corners, std::size_t vertex_count) {
    return make_lists<Index>(vertex_count, [&](const auto& add) {
        for (Index c = 0; c < corners.size(); ++c) add(corners[c], c);
    });
}

IndexLists triangles_at_vertices(std::span<const Triangle> triangles, std::size_t vertex_count) {
    return make_lists<Index>(vertex_count, [&](const auto& add) {
        for (Index t = 0; t < triangles.size(); ++t)
            for (const Index v : triangles[t]) add(v, t);
    });
}

IndexLists group_by_edge(Lists<std::uint64_t> keys) {
    IndexLists edges;
    edges.offsets.reserve(keys.items.size() / 2 + 1);
    edges.items.reserve(keys.items.size());
    for (std::size_t v = 0; v < keys.size(); ++v) { // a handful each: no sort over everything
        const auto begin = keys.items.begin() + keys.offsets[v], end = keys.items.begin() + keys.offsets[v + 1];
        std::sort(begin, end);
        for (auto key = begin; key != end; ++key) {
            if (key != begin && *key >> 32 != key[-1] >> 32)
                edges.offsets.push_back(static_cast<Index>(edges.items.size()));
            edges.items.push_back(static_cast<Index>(*key));
        }
        if (begin != end) edges.offsets.push_back(static_cast<Index>(edges.items.size()));
    }
    return edges;
}

IndexLists edges_of(std::span<const Triangle> triangles, std::size_t vertex_count) {
    assert(triangles.size() <= kMostListedTriangles);
    return edges_from(vertex_count, [&](const auto& add) {
        for (Index t = 0; t < triangles.size(); ++t)
            for (Index k = 0; k < 3; ++k)
                if (const Index a = triangles[t][k], b = triangles[t][k == 2 ? 0 : k + 1]; a != b) add(a, b, 3 * t + k);
    });
}

int edge_balance(std::span<const Triangle> triangles, std::span<const Index> edge) {
    int balance = 0;
    for (const Index h : edge) balance += runs_up(triangles, h) ? 1 : -1;
    return balance;
}

std::vector<Index> neighbour_half_edges(std::span<const Triangle> triangles, const IndexLists& edges) {
    return pair_half_edges(edges, 3 * triangles.size(), [&](Index a, Index b) {
        return half_edge_apex(triangles, a) != half_edge_apex(triangles, b);
    });
}

std::vector<Index> opposite_half_edges(std::span<const Triangle> triangles, std::size_t vertex_count) {
    return pair_half_edges(edges_of(triangles, vertex_count), 3 * triangles.size(), [](Index, Index) { return true; });
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
