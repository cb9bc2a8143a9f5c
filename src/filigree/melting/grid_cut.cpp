#include "filigree/melting/grid_cut.h"

#include <algorithm>

namespace filigree {

namespace {

std::uint64_t cut_key(Index a, Index b) { return std::uint64_t(std::min(a, b)) << 32 | std::max(a, b); }

} // namespace

GridCut::GridCut(const BlockGrid& grid, std::span<const Vec3f> positions)
    : grid_(grid), first_cut_(Index(positions.size())), positions_(positions.begin(), positions.end()),
      places_(positions.size()) {
    for (Index v = 0; v < first_cut_; ++v) {
        const GridNode below = grid.node_below(positions_[v].cast<double>());
        for (std::size_t a = 0; a < 3; ++a) places_[v][a] = 2 * below[a] + 1;
    }
}

void GridCut::cut(const Triangle& triangle, Index source) {
    for (auto& done : done_) done.clear();
    cut_along(0, triangle, done_[0]);
    for (int axis = 1; axis < 3; ++axis)
        for (const Triangle& part : done_[std::size_t(axis) - 1]) cut_along(axis, part, done_[std::size_t(axis)]);
    for (const Triangle& part : done_[2]) {
        Piece piece = {part, {}, source};
        for (int axis = 0; axis < 3; ++axis) {
            // A corner on a plane may belong to the cell above as well.
            std::int32_t low = place(part[0], axis);
            for (const Index v : part) low = std::min(low, place(v, axis));
            piece.cell[std::size_t(axis)] = low >> 1;
        }
        pieces_.push_back(piece);
    }
}

/// Planes in ascending order: so an edge is cut at the lowest plane first, whichever triangle comes to it.
void GridCut::cut_along(int axis, const Triangle& triangle, std::vector<Triangle>& done) {
    left_.assign(1, triangle);
    while (!left_.empty()) {
        const Triangle t = left_.back();
        left_.pop_back();
        const std::int32_t low = std::min({place(t[0], axis), place(t[1], axis), place(t[2], axis)});
        const std::int32_t high = std::max({place(t[0], axis), place(t[1], axis), place(t[2], axis)});
        const std::int32_t plane = (low >> 1) + 1;
        if (high <= 2 * plane) {
            done.push_back(t);
            continue;
        }
        const auto side = [&](Index v) { return place(v, axis) < 2 * plane ? -1 : place(v, axis) > 2 * plane; };
        int alone = 0; // the corner that is on a side, or on the plane, of its own
        for (int k = 0; k < 3; ++k)
            if (side(t[std::size_t(k)]) != side(t[std::size_t((k + 1) % 3)]) &&
                side(t[std::size_t(k)]) != side(t[std::size_t((k + 2) % 3)]))
                alone = k;
        for (int k = 0; k < 3; ++k) // three different sides: the one on the plane
            if (side(t[std::size_t(k)]) == 0) alone = k;
        const Index a = t[std::size_t(alone)], b = t[std::size_t((alone + 1) % 3)], c = t[std::size_t((alone + 2) % 3)];
        if (side(a) == 0) {
            const Index x = make_cut(b, c, axis, plane);
            left_.push_back({a, b, x});
            left_.push_back({a, x, c});
        } else {
            const Index x = make_cut(a, b, axis, plane), y = make_cut(a, c, axis, plane);
            left_.push_back({a, x, y});
            left_.push_back({x, b, c});
            left_.push_back({x, c, y});
        }
    }
}

Index GridCut::make_cut(Index a, Index b, int axis, std::int32_t plane) {
    const auto [found, is_new] = cuts_.try_emplace(cut_key(a, b), vertex_count());
    if (!is_new) return found->second;
    const Index from = std::min(a, b), to = std::max(a, b);
    const Vec3d p = positions_[from].cast<double>(), q = positions_[to].cast<double>();
    const double at = plane * grid_.cell() + grid_.shift()[axis];
    const double part = std::clamp((at - p[axis]) / (q[axis] - p[axis]), 0.0, 1.0);
    const Vec3d middle = p + part * (q - p);
    Vec3f position = middle.cast<float>();
    const GridNode below = grid_.node_below(middle);
    Place place;
    for (std::size_t k = 0; k < 3; ++k) {
        const std::int32_t low = std::min(places_[from][k], places_[to][k]);
        const std::int32_t high = std::max(places_[from][k], places_[to][k]);
        if (low == high)
            place[k] = low;
        else // strictly between the planes that the ends lie on
            place[k] = std::clamp(2 * below[k] + 1, low | 1, (high - 1) | 1);
        if (low == high && (low & 1) == 0) position[Eigen::Index(k)] = positions_[from][Eigen::Index(k)];
    }
    place[std::size_t(axis)] = 2 * plane;
    position[axis] = float(at);
    positions_.push_back(position);
    places_.push_back(place);
    between_.push_back({from, to, float(part)});
    return found->second;
}

Index GridCut::cut_between(Index a, Index b) const {
    const auto found = cuts_.find(cut_key(a, b));
    return found == cuts_.end() ? kNoIndex : found->second;
}

} // namespace filigree
