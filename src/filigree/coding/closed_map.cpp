#include "filigree/coding/closed_map.h"

#include <algorithm>

namespace filigree {

namespace {

/// Opposites of half-edges that are alone with one of the other direction at their edge; kNoIndex for others.
std::vector<Index> pair_half_edges(std::span<const Triangle> triangles) {
    struct Use {
        Index low, high, half_edge;
        bool operator<(const Use& b) const {
            return low != b.low ? low < b.low : high != b.high ? high < b.high : half_edge < b.half_edge;
        }
    };
    std::vector<Use> uses;
    uses.reserve(3 * triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [low, high] = std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]);
            uses.push_back({low, high, static_cast<Index>(3 * t + k)});
        }
    std::sort(uses.begin(), uses.end());
    std::vector<Index> opposite(uses.size(), kNoIndex);
    const auto origin = [&](Index half_edge) { return triangles[half_edge / 3][half_edge % 3]; };
    for (std::size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
        while (end < uses.size() && uses[end].low == uses[begin].low && uses[end].high == uses[begin].high) ++end;
        const Index a = uses[begin].half_edge, b = uses[end - 1].half_edge;
        if (end - begin != 2 || origin(a) == origin(b)) continue;
        opposite[a] = b;
        opposite[b] = a;
    }
    return opposite;
}

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
        for (Index h = map.opposite[ClosedMap::previous(half_edge)]; h != kNoIndex && map.origin(h) == kNoIndex;
             h = map.opposite[ClosedMap::previous(h)])
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
            const Index from = map.origin(h), to = map.origin(ClosedMap::next(h));
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
    const auto count = static_cast<Index>(3 * map.triangles.size());
    map.opposite.assign(count, kNoIndex);
    // Half-edges by their lower end: of those of a vertex, few, the ones to the same other end face each other.
    const auto ends = [&](Index h) {
        const Index from = map.origin(h), to = map.origin(ClosedMap::next(h));
        return std::pair(std::min(from, to), std::max(from, to));
    };
    std::vector<Index> offsets(map.vertex_count() + 2, 0), sorted(count);
    for (Index h = 0; h < count; ++h) ++offsets[ends(h).first + 2];
    for (std::size_t v = 2; v < offsets.size(); ++v) offsets[v] += offsets[v - 1];
    for (Index h = 0; h < count; ++h) sorted[offsets[ends(h).first + 1]++] = h;
    for (std::size_t v = 0; v < map.vertex_count(); ++v) {
        const auto low = sorted.begin() + offsets[v], high = sorted.begin() + offsets[v + 1];
        std::sort(low, high, [&](Index a, Index b) {
            const Index to_a = ends(a).second, to_b = ends(b).second;
            return to_a != to_b ? to_a < to_b : a < b;
        });
        for (auto begin = low, end = low; begin != high; begin = end) { // of one edge
            auto waiting = begin;                                       // the first that has no opposite yet
            for (; end != high && ends(*end).second == ends(*begin).second; ++end) {
                if (waiting == end || map.origin(*waiting) == map.origin(*end)) continue;
                map.opposite[*waiting] = *end;
                map.opposite[*end] = *waiting;
                do ++waiting;
                while (waiting != end && map.opposite[*waiting] != kNoIndex);
                if (waiting == end) ++waiting; // it has one now
            }
        }
    }
    return map;
}

ClosedSurface make_closed_surface(std::span<const Triangle> triangles) {
    ClosedSurface surface;
    surface.map.opposite = pair_half_edges(triangles);
    number_fans(triangles, surface);
    close_holes(surface);
    return surface;
}

} // namespace filigree
