#include "filigree/physics/body/surface_points.h"

#include "filigree/core/hash.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <unordered_map>

namespace filigree {

namespace {

constexpr double kSampleSpacing = 0.25; // cubes
constexpr double kLeastArea = 0.05;     // of a cube's side: with less, a cube gets no point
constexpr double kAgreeing = 0.5;       // length of the mean of unit normals: below, they do not say what is outwards
constexpr double kSlant = 0.25;         // how far outwards counts against how far from the middle

/// Calls visit(position, normal, area) for samples of all triangles: their corners, and where they are larger than the
/// sampling, points inside. The areas add up to that of the surface.
template <class Visit>
void sample_surface(std::span<const Vec3f> positions, std::span<const Triangle> triangles, double scale, double step,
                    const Visit& visit) {
    for (const Triangle& triangle : triangles) {
        const Vec3d a = positions[triangle[0]].cast<double>() * scale,
                    b = positions[triangle[1]].cast<double>() * scale,
                    c = positions[triangle[2]].cast<double>() * scale;
        const Vec3d cross = (b - a).cross(c - a);
        const double length = cross.norm(), area = 0.5 * length;
        if (!(length > 0)) continue;
        const Vec3d normal = cross / length;
        const double longest =
            std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
        const bool small = longest <= step;
        // The corners stand for a third of the area, or for a quarter where there are points inside.
        for (const Vec3d& corner : {a, b, c}) visit(corner, normal, small ? area / 3 : area / 12);
        if (small) continue;
        const double count = std::ceil(std::max(area / (step * step), longest / (4 * step)));
        for (double n = 0; n < count; ++n) {
            double u = 1.0 / 3 + n * 0.7548776662466927, v = 1.0 / 3 + n * 0.5698402909980532; // [Roberts 2018], R2
            u -= std::floor(u);
            v -= std::floor(v);
            if (u + v > 1) {
                u = 1 - u;
                v = 1 - v;
            }
            visit(Vec3d(a + u * (b - a) + v * (c - a)), normal, 0.75 * area / count);
        }
    }
}

/// A cube of space, and the surface in it.
struct Cube {
    std::array<int, 3> key;
    double area = 0;
    Vec3d normal = Vec3d::Zero(), middle = Vec3d::Zero(); ///< times area

    double score = -std::numeric_limits<double>::infinity(); ///< of the sample found so far
    Vec3d chosen = Vec3d::Zero(), chosen_normal = Vec3d::Zero();
};

struct KeyHash {
    std::size_t operator()(const std::array<int, 3>& key) const { return hash_words(key[0], key[1], key[2]); }
};

} // namespace

SurfacePoints spread_on_surface(std::span<const Vec3f> positions, std::span<const Triangle> triangles, double scale,
                                double spacing) {
    Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity());
    for (const Triangle& triangle : triangles)
        for (const Index v : triangle) low = low.cwiseMin(positions[v].cast<double>() * scale);

    // The box's lowest faces run through the middle of cubes, not between two.
    std::vector<Cube> cubes;
    std::vector<Index> cube_of; // of each sample
    std::unordered_map<std::array<int, 3>, Index, KeyHash> index_of;
    std::array<int, 3> last_key = {-1, -1, -1};
    Index last = 0;
    const double step = kSampleSpacing * spacing;
    sample_surface(positions, triangles, scale, step, [&](const Vec3d& p, const Vec3d& normal, double area) {
        std::array<int, 3> key;
        for (int axis = 0; axis < 3; ++axis) key[axis] = int(std::floor((p[axis] - low[axis]) / spacing + 0.5));
        if (key != last_key) {
            const auto [found, is_new] = index_of.try_emplace(key, Index(cubes.size()));
            if (is_new) cubes.push_back({.key = key});
            last = found->second;
            last_key = key;
        }
        Cube& cube = cubes[last];
        cube.area += area;
        cube.normal += area * normal;
        cube.middle += area * p;
        cube_of.push_back(last);
    });

    std::size_t sample = 0;
    sample_surface(positions, triangles, scale, step, [&](const Vec3d& p, const Vec3d& normal, double) {
        Cube& cube = cubes[cube_of[sample++]];
        const Vec3d mean = cube.normal / cube.area, offset = p - cube.middle / cube.area;
        double score = -offset.norm();
        if (const double length = mean.norm(); length > kAgreeing) {
            const double outwards = offset.dot(mean) / length;
            score = outwards - kSlant * (offset - outwards / length * mean).norm();
        }
        if (score <= cube.score) return;
        cube.score = score;
        cube.chosen = p;
        cube.chosen_normal = normal;
    });

    double area = 0, kept = 0;
    for (const Cube& cube : cubes) {
        area += cube.area;
        if (cube.area >= kLeastArea * spacing * spacing) kept += cube.area;
    }
    std::sort(cubes.begin(), cubes.end(), [](const Cube& a, const Cube& b) {
        return std::tie(a.key[2], a.key[1], a.key[0]) < std::tie(b.key[2], b.key[1], b.key[0]);
    });
    SurfacePoints points;
    for (const Cube& cube : cubes) {
        if (kept > 0 && cube.area < kLeastArea * spacing * spacing) continue;
        const bool agree = cube.normal.norm() > kAgreeing * cube.area;
        points.positions.push_back(cube.chosen.cast<float>());
        points.normals.push_back((agree ? cube.normal.normalized() : cube.chosen_normal).cast<float>());
        points.areas.push_back(float(cube.area * (kept > 0 ? area / kept : 1)));
    }
    return points;
}

} // namespace filigree
