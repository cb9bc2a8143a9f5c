#include "filigree/coding/closed_map.h"

#include <algorithm>

namespace filigree {

namespace {

/// Gives every fan of triangles around a vertex a vertex of its own.
void number_fans(std::span<const Triangle> triangles, ClosedSurface& surface) {
    ClosedMap& map = surface.map;
    map.triangles.assign(triangles.size(), {kNoIndex, kNoIndex, kNoIndex});
    for (Index half_edge = 0; half_edge < 3 * triangles.size(); ++half_edge) {
        if (map.origin(half_edge) != kNoIndex) continue;
        const auto vertex = static_cast<Index>(surface.source.size());
        surface.source.push_back(triangles[half_edge / 3][half_edge % 3]);
        for (Index h = half_edge;;) { // clockwise, and where that ends the other way
            map.triangles[h / 3][h % 3] = vertex;
            if (map.opposite[h] == kNoIndex) break;
            h = map.turn_clockwise(h);
            if (h == half_edge) break;
        }
        for (Index h = map.opposite[previous_half_edge(half_edge)]; h != kNoIndex && map.origin(h) == kNoIndex;
             h = map.opposite[previous_half_edge(h)])
            map.triangles[h / 3][h % 3] = vertex;
    }
    map.closes_hole.assign(surface.source.size(), false);
}

/// A vertex for each hole, and triangles between it and the hole's edges.
void close_holes(ClosedSurface& surface) {
    ClosedMap& map = surface.map;
    const auto own = static_cast<Index>(map.opposite.size());
    std::vector<Index> open_from(surface.source.size(), kNoIndex); // the open half-edge from each vertex
    for (Index h = 0; h < own; ++h)
        if (map.opposite[h] == kNoIndex) open_from[map.origin(h)] = h;
    for (Index start = 0; start < own; ++start) {
        if (map.opposite[start] != kNoIndex) continue;
        const auto centre = static_cast<Index>(surface.source.size());
        surface.source.push_back(kNoIndex);
        map.closes_hole.push_back(true);
        const auto first = static_cast<Index>(map.triangles.size());
        for (Index h = start; map.opposite[h] == kNoIndex;) {
            const auto t = static_cast<Index>(map.triangles.size());
            const Index from = map.origin(h), to = map.origin(next_half_edge(h));
            map.triangles.push_back({to, from, centre});
            map.opposite.insert(map.opposite.end(), {h, kNoIndex, kNoIndex});
            map.opposite[h] = 3 * t;
            if (t > first) {
                map.opposite[3 * t + 1] = 3 * t - 1; // from -> centre, which the one before has as centre -> to
                map.opposite[3 * t - 1] = 3 * t + 1;
            }
            h = open_from[to];
        }
        const auto last = static_cast<Index>(map.triangles.size() - 1);
        map.opposite[3 * first + 1] = 3 * last + 2;
        map.opposite[3 * last + 2] = 3 * first + 1;
    }
}

} // namespace

ClosedMap map_of(std::vector<Triangle> triangles, std::vector<bool> closes_hole) {
    ClosedMap map{std::move(triangles), {}, std::move(closes_hole)};
    map.opposite.assign(3 * map.triangles.size(), kNoIndex);
    for (const std::span<const Index> edge : edges_of(map.triangles, map.vertex_count())) {
        auto waiting = edge.begin(); // the first that has no opposite yet
        for (auto h = edge.begin(); h != edge.end(); ++h) {
            if (waiting == h || map.origin(*waiting) == map.origin(*h)) continue;
            map.opposite[*waiting] = *h;
            map.opposite[*h] = *waiting;
            do ++waiting;
            while (waiting != h && map.opposite[*waiting] != kNoIndex);
            if (waiting == h) ++waiting; // it has one now
        }
    }
    return map;
}

ClosedSurface make_closed_surface(std::span<const Triangle> triangles) {
    ClosedSurface surface;
    std::size_t vertices = 0;
    for (const Triangle& t : triangles) vertices = std::max(vertices, std::size_t(std::ranges::max(t)) + 1);
    const auto run_apart = [&](Index a, Index b) { return runs_up(triangles, a) != runs_up(triangles, b); };
    surface.map.opposite = pair_half_edges(edges_of(triangles, vertices), 3 * triangles.size(), run_apart);
    number_fans(triangles, surface);
    close_holes(surface);
    return surface;
}

} // namespace filigree
