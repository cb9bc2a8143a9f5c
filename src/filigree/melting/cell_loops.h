// How a surface that parts the inside corners of a grid's cells from the outside ones crosses the cells' faces.
#pragma once

#include <array>
#include <cstdint>

namespace filigree {

/// Corner q of a cell has the coordinates q & 1, q >> 1 & 1, q >> 2. An edge's number is 8 * its axis + its lower
/// corner.
constexpr int edge_between(int p, int q) {
    const int axis = (p ^ q) == 1 ? 0 : (p ^ q) == 2 ? 1 : 2;
    return 8 * axis + (p & q);
}

/// The corners of a cell's face, counter-clockwise seen from outside the cell. side: 0 or 1, its coordinate along
/// `axis`.
constexpr std::array<int, 4> face_corners(int axis, int side) {
    const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
    if (side == 0) return {base, base + v, base + u + v, base + u};
    return {base, base + u, base + u + v, base + v};
}

/// Calls visit(from, to), two edges of the cell, for each segment of the surface on one of its faces: counter-clockwise
/// around the surface in the cell, seen from outside. Inside corners across the face's diagonal stay apart. inside: a
/// bit for each corner.
template <class Visit>
constexpr void for_face_segments(int inside, int axis, int side, const Visit& visit) {
    const std::array<int, 4> face = face_corners(axis, side);
    // From each edge where the boundary enters the inside back to the one where it left it.
    for (int i = 0; i < 4; ++i) {
        const int a = face[std::size_t(i)], b = face[std::size_t((i + 1) % 4)];
        if ((inside >> a & 1) || !(inside >> b & 1)) continue;
        int j = (i + 1) % 4; // the last inside corner of this run
        while (inside >> face[std::size_t((j + 1) % 4)] & 1) j = (j + 1) % 4;
        visit(edge_between(a, b), edge_between(face[std::size_t(j)], face[std::size_t((j + 1) % 4)]));
    }
}

/// The loops in which the surface crosses a cell's faces, for each pattern of inside corners.
struct CellLoops {
    struct Pattern {
        std::uint8_t loop_count = 0, edge_count = 0;
        std::array<std::uint8_t, 4> sizes = {};
        std::array<std::uint8_t, 12> edges = {}; ///< of one loop after the other, counter-clockwise from outside
    };
    std::array<Pattern, 256> patterns = {};

    constexpr CellLoops() {
        for (int inside = 0; inside < 256; ++inside) fill(inside, patterns[std::size_t(inside)]);
    }

private:
    static constexpr void fill(int inside, Pattern& pattern) {
        int next[24] = {};
        for (int& n : next) n = -1;
        for (int axis = 0; axis < 3; ++axis)
            for (int side = 0; side < 2; ++side)
                for_face_segments(inside, axis, side, [&](int from, int to) { next[from] = to; });
        for (int e = 0; e < 24; ++e) {
            if (next[e] < 0) continue;
            std::uint8_t size = 0;
            for (int at = e; next[at] >= 0; ++size) {
                pattern.edges[pattern.edge_count++] = std::uint8_t(at);
                const int to = next[at];
                next[at] = -1;
                at = to;
            }
            pattern.sizes[pattern.loop_count++] = size;
        }
    }
};

inline constexpr CellLoops kCellLoops;

} // namespace filigree
