#include "filigree/mesh/orientation.h"

#include "filigree/mesh/edges.h"

#include <algorithm>

namespace filigree {

namespace {

constexpr double kClearMajority = 0.75; // of a component's area

/// Twice the area, and six times the volume of the cone from `apex`.
struct Measures {
    double area, volume;
};
Measures measures_of(const Triangle& t, std::span<const Vec3f> positions, const Vec3d& apex) {
    const auto corner = [&](std::size_t i) -> Vec3d { return positions[t[i]].cast<double>() - apex; };
    const Vec3d a = corner(0), b = corner(1), c = corner(2);
    return {(b - a).cross(c - a).norm(), a.dot(b.cross(c))};
}

} // namespace

std::vector<std::uint8_t> triangles_to_turn(std::span<const Triangle> triangles, std::span<const Index> neighbour,
                                            std::span<const Vec3f> positions, OneSided one_sided) {
    std::vector<std::uint8_t> turn(triangles.size(), 0), seen(triangles.size(), 0);
    std::vector<Index> component;
    for (Index seed = 0; seed < triangles.size(); ++seed) {
        if (seen[seed]) continue;
        component.assign(1, seed);
        seen[seed] = 1;
        const Vec3d apex = positions[triangles[seed][0]].cast<double>();
        double kept = 0, turned = 0, volume = 0;
        bool has_one_side = false;
        for (std::size_t i = 0; i < component.size(); ++i) {
            const Index t = component[i];
            const Measures measures = measures_of(triangles[t], positions, apex);
            (turn[t] ? turned : kept) += measures.area;
            volume += turn[t] ? -measures.volume : measures.volume;
            for (Index h = 3 * t; h < 3 * t + 3; ++h) {
                const Index other = neighbour[h];
                if (other == kNoIndex) continue;
                const bool agree = half_edge_start(triangles, h) != half_edge_start(triangles, other);
                const std::uint8_t wanted = turn[t] ^ !agree;
                if (seen[other / 3]) {
                    has_one_side |= turn[other / 3] != wanted;
                    continue;
                }
                seen[other / 3] = 1;
                turn[other / 3] = wanted;
                component.push_back(other / 3);
            }
        }
        if (has_one_side && one_sided == OneSided::left) {
            for (const Index t : component) turn[t] = 0;
            continue;
        }
        const bool is_clear = std::max(kept, turned) >= kClearMajority * (kept + turned);
        if (is_clear ? turned > kept : volume < 0)
            for (const Index t : component) turn[t] ^= 1;
    }
    return turn;
}

std::size_t orient(std::span<Triangle> triangles, std::span<const Vec3f> positions) {
    const std::vector<Index> neighbour = neighbour_half_edges(triangles, edges_of(triangles, positions.size()));
    const std::vector<std::uint8_t> turn = triangles_to_turn(triangles, neighbour, positions, OneSided::left);
    for (std::size_t t = 0; t < triangles.size(); ++t)
        if (turn[t]) std::swap(triangles[t][1], triangles[t][2]);
    return std::size_t(std::ranges::count(turn, 1));
}

} // namespace filigree
