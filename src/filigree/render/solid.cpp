#include "filigree/render/solid.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <vector>

namespace filigree {

namespace {

/// The first vertex at each one's place.
std::vector<Index> first_at_place(std::span<const Vec3f> positions) {
    std::vector<Index> order(positions.size()), first(positions.size());
    std::iota(order.begin(), order.end(), Index{0});
    const auto at = [&](Index v) { return std::array{positions[v].x(), positions[v].y(), positions[v].z()}; };
    std::sort(order.begin(), order.end(), [&](Index a, Index b) {
        const auto p = at(a), q = at(b);
        return p != q ? p < q : a < b;
    });
    for (std::size_t k = 0; k < order.size(); ++k)
        first[order[k]] = k > 0 && at(order[k]) == at(order[k - 1]) ? first[order[k - 1]] : order[k];
    return first;
}

Index part_of(std::vector<Index>& parent, Index v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
}

} // namespace

bool is_solid(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
    const std::vector<Index> place = first_at_place(positions);
    std::vector<Index> parent(positions.size());
    std::iota(parent.begin(), parent.end(), Index{0});
    std::vector<std::uint64_t> sides; // of triangles: lower vertex, higher vertex, and which of them comes first
    sides.reserve(3 * triangles.size());
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k) {
            const Index a = place[t[k]], b = place[t[(k + 1) % 3]];
            if (a == b) continue;
            parent[part_of(parent, a)] = part_of(parent, b);
            if (std::max(a, b) >= Index{1} << 31) return false;
            sides.push_back(std::uint64_t{std::min(a, b)} << 32 | std::uint64_t{std::max(a, b)} << 1 |
                            std::uint64_t{a < b});
        }
    std::sort(sides.begin(), sides.end());
    for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
        std::size_t forwards = 0;
        for (; end < sides.size() && sides[end] >> 1 == sides[begin] >> 1; ++end) forwards += sides[end] & 1;
        if (2 * forwards != end - begin) return false;
    }
    if (sides.empty()) return false;
    std::vector<double> volume(positions.size(), 0);
    const Vec3d middle = positions[triangles[0][0]].cast<double>();
    std::vector<char> is_part(positions.size(), 0);
    for (const Triangle& t : triangles) {
        const Vec3d a = positions[t[0]].cast<double>() - middle, b = positions[t[1]].cast<double>() - middle,
                    c = positions[t[2]].cast<double>() - middle;
        const Index part = part_of(parent, place[t[0]]);
        volume[part] += a.dot(b.cross(c));
        is_part[part] = 1;
    }
    for (std::size_t part = 0; part < volume.size(); ++part)
        if (is_part[part] && !(volume[part] > 0)) return false;
    return true;
}

} // namespace filigree
