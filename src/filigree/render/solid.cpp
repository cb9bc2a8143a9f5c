#include "filigree/render/solid.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/mesh/weld.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace filigree {

bool is_solid(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
    const std::vector<Index> place = weld_map(positions);
    DisjointSets parts(positions.size());
    std::vector<std::uint64_t> sides; // of triangles: lower vertex, higher vertex, and which of them comes first
    sides.reserve(3 * triangles.size());
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k) {
            const Index a = place[t[k]], b = place[t[(k + 1) % 3]];
            if (a == b) continue;
            parts.join(a, b);
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
        const Index part = parts.root(place[t[0]]);
        volume[part] += a.dot(b.cross(c));
        is_part[part] = 1;
    }
    for (std::size_t part = 0; part < volume.size(); ++part)
        if (is_part[part] && !(volume[part] > 0)) return false;
    return true;
}

} // namespace filigree
