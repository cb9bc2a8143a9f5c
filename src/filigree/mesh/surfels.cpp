#include "filigree/mesh/surfels.h"

#include "filigree/core/math.h"
#include "filigree/core/text.h"
#include "filigree/mesh.h"
#include "filigree/mesh/normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

constexpr float kLeastFacing = 0.5f; ///< cosine to a triangle below which discs do not grow further
constexpr float kOverlap = 1.2f;     ///< of a disc's radius: edges fold between discs, and views are oblique
constexpr float kChildLength = 0.62f, kChildAt = 1 - kChildLength; ///< of the longest half axis; ends stay ends
constexpr std::array<const char*, 6> kAxisNames = {"ux", "uy", "uz", "vx", "vy", "vz"};

/// How far a point of the triangle may be from the nearest of its corners: the radius of its circumcircle, or where it
/// is obtuse, along its longest edge to where two corners are equally near.
float covering_radius(const Vec3f& p, const Vec3f& q, const Vec3f& r) {
    std::array<Vec3d, 3> corners = {p.cast<double>(), q.cast<double>(), r.cast<double>()};
    std::array<double, 3> edges; // across from each corner
    for (std::size_t k = 0; k < 3; ++k) edges[k] = (corners[(k + 1) % 3] - corners[(k + 2) % 3]).norm();
    std::sort(edges.begin(), edges.end());
    const auto [a, b, c] = edges;
    if (!(a > 0)) return float(c / 2);
    if (a * a + b * b <= c * c) { // obtuse across from c: cosines at the ends of c
        const double at_b_end = (b * b + c * c - a * a) / (2 * b * c), at_a_end = (a * a + c * c - b * b) / (2 * a * c);
        return float(std::max(b / (2 * at_b_end), a / (2 * at_a_end)));
    }
    const double area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm() / 2;
    return float(a * b * c / (4 * area));
}

template <class Values>
auto weighted(const Values& values, const Triangle& corners, const Vec3f& weights) {
    using Value = std::decay_t<decltype(values[0])>;
    if (weights[0] == 1) return Value(values[corners[0]]);
    return Value(weights[0] * values[corners[0]] + weights[1] * values[corners[1]] + weights[2] * values[corners[2]]);
}

/// The discs in a triangle: at the points of a lattice that divides its edges into so many steps. One step: its
/// corners alone.
struct TriangleDiscs {
    Vec3f normal;
    float radius; ///< that covers the triangle, of each disc
    int steps;
};

std::vector<TriangleDiscs> discs_of_triangles(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
    constexpr double kLargest = 2; ///< mean radii that a disc may have before a triangle gets more of them
    constexpr int kMostSteps = 64;
    std::vector<TriangleDiscs> discs;
    double sum = 0;
    for (const Triangle& t : triangles) {
        const std::array<Vec3f, 3> p = {positions[t[0]], positions[t[1]], positions[t[2]]};
        discs.push_back(
            {(p[1] - p[0]).cross(p[2] - p[0]).stableNormalized(), kOverlap * covering_radius(p[0], p[1], p[2]), 1});
        sum += double(discs.back().radius);
    }
    const double largest = kLargest * sum / double(std::max<std::size_t>(triangles.size(), 1));
    for (TriangleDiscs& d : discs) {
        if (!(largest > 0) || !(double(d.radius) > largest)) continue;
        d.steps = int(std::min(std::ceil(double(d.radius) / largest), double(kMostSteps)));
        d.radius /= float(d.steps);
    }
    return discs;
}

void add_disc(const Mesh& mesh, const Triangle& corners, const Vec3f& weights, const Vec3f& normal, float radius,
              Surfels& surfels) {
    if (normal.isZero(0)) return;
    const Vec3f across = normal.unitOrthogonal();
    surfels.positions.push_back(weighted(mesh.positions, corners, weights));
    surfels.u.push_back(radius * across);
    surfels.v.push_back(radius * normal.cross(across));
    if (!mesh.colors.empty()) surfels.colors.push_back(weighted(mesh.colors, corners, weights));
    surfels.rest_radius.push_back(radius);
    surfels.corners.push_back(corners);
    surfels.weights.push_back(weights);
}

/// The ellipse's half axes, longest first.
struct Axes {
    Vec3f longest, shortest;
};

Axes principal_axes(const Vec3f& u, const Vec3f& v) {
    const float uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
    const float angle = 0.5f * math::atan2(2 * uv, uu - vv);
    const Vec3f first = math::cos(angle) * u + math::sin(angle) * v,
                second = math::cos(angle) * v - math::sin(angle) * u;
    return {first, second}; // the angle turns towards the longer one
}

Vec3f unit_normal(const Vec3f& u, const Vec3f& v) { return u.cross(v).stableNormalized(); }

} // namespace

Result<Surfels> make_surfels(const Mesh& mesh, const RunContext& context) {
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    const Result<Triangulation> triangulation = triangulate(mesh, context);
    if (!triangulation) return triangulation.error();
    const std::vector<Triangle>& triangles = triangulation->triangles;
    const std::vector<Vec3f> normals = vertex_normals(triangles, mesh.positions, context);
    const std::vector<TriangleDiscs> covers = discs_of_triangles(mesh.positions, triangles);
    std::vector<float> radii(mesh.vertex_count(), 0);
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (const Index v : triangles[t]) {
            const float facing = std::max(std::abs(covers[t].normal.dot(normals[v])), kLeastFacing);
            radii[v] = std::max(radii[v], covers[t].radius / facing);
        }
    Surfels surfels;
    surfels.origin = mesh.origin;
    for (Index v = 0; v < mesh.vertex_count(); ++v)
        if (radii[v] > 0 && !normals[v].isZero(0)) add_disc(mesh, {v, v, v}, {1, 0, 0}, normals[v], radii[v], surfels);
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const int steps = covers[t].steps;
        for (int i = 0; i <= steps; ++i)
            for (int j = 0; i + j <= steps; ++j) {
                const Vec3f weights = Vec3f(float(i), float(j), float(steps - i - j)) / float(steps);
                if (weights.maxCoeff() < 1)
                    add_disc(mesh, triangles[t], weights, covers[t].normal, covers[t].radius, surfels);
            }
    }
    if (context.is_cancelled()) return cancelled_error();
    return surfels;
}

Surfels carried_surfels(const Surfels& rest, std::span<const Vec3f> positions, std::span<const Mat3f> gradients) {
    Surfels carried = rest;
    for (std::size_t i = 0; i < rest.size(); ++i) {
        const Mat3f gradient = weighted(gradients, rest.corners[i], rest.weights[i]);
        carried.positions[i] = weighted(positions, rest.corners[i], rest.weights[i]);
        carried.u[i] = gradient * rest.u[i];
        carried.v[i] = gradient * rest.v[i];
    }
    return carried;
}

Result<Surfels> split_surfels(const Surfels& surfels, std::size_t most) {
    constexpr std::size_t kMostParts = 1'000'000;
    Surfels split;
    split.origin = surfels.origin;
    struct Part {
        Vec3f position, u, v;
    };
    std::vector<Part> waiting;
    for (std::size_t i = 0; i < surfels.size(); ++i) {
        waiting = {{surfels.positions[i], surfels.u[i], surfels.v[i]}};
        for (std::size_t made = 1; !waiting.empty();) {
            const Part part = waiting.back();
            waiting.pop_back();
            const auto [longest, shortest] = principal_axes(part.u, part.v);
            const bool is_long = longest.norm() > kMostStretch * surfels.rest_radius[i];
            if (is_long && std::isfinite(longest.norm()) && made < kMostParts) {
                for (const float side : {kChildAt, -kChildAt})
                    waiting.push_back({part.position + side * longest, kChildLength * longest, shortest});
                ++made;
                continue;
            }
            if (split.size() == most)
                return Error{ErrorCode::unsuitable,
                             "The surfels are stretched so far that they take more than " + with_commas(most) +
                                 " pieces; deform the mesh less, or take one with more vertices where it stretches."};
            split.positions.push_back(part.position);
            split.u.push_back(part.u);
            split.v.push_back(part.v);
            split.rest_radius.push_back(surfels.rest_radius[i]);
            split.corners.push_back(surfels.corners[i]);
            split.weights.push_back(surfels.weights[i]);
            if (!surfels.colors.empty()) split.colors.push_back(surfels.colors[i]);
        }
    }
    return split;
}

Mesh surfel_points(const Surfels& surfels) {
    Mesh mesh;
    mesh.positions = surfels.positions;
    mesh.origin = surfels.origin;
    mesh.colors = surfels.colors;
    for (const char* name : kAxisNames) mesh.scalars.push_back({name, {}});
    for (std::size_t i = 0; i < surfels.size(); ++i) {
        mesh.normals.values.push_back(unit_normal(surfels.u[i], surfels.v[i]));
        for (int k = 0; k < 3; ++k) {
            mesh.scalars[std::size_t(k)].values.push_back(surfels.u[i][k]);
            mesh.scalars[std::size_t(k) + 3].values.push_back(surfels.v[i][k]);
        }
    }
    return mesh;
}

std::optional<Surfels> surfels_of_points(const Mesh& mesh) {
    std::array<const std::vector<float>*, 6> axes = {};
    for (std::size_t k = 0; k < 6; ++k)
        for (const VertexScalar& scalar : mesh.scalars)
            if (scalar.name == kAxisNames[k]) axes[k] = &scalar.values;
    if (std::find(axes.begin(), axes.end(), nullptr) != axes.end()) return std::nullopt;
    Surfels surfels;
    surfels.positions = mesh.positions;
    surfels.origin = mesh.origin;
    surfels.colors = mesh.colors;
    for (Index i = 0; i < mesh.vertex_count(); ++i) {
        surfels.u.emplace_back((*axes[0])[i], (*axes[1])[i], (*axes[2])[i]);
        surfels.v.emplace_back((*axes[3])[i], (*axes[4])[i], (*axes[5])[i]);
        surfels.rest_radius.push_back(std::sqrt(surfels.u[i].cross(surfels.v[i]).norm()));
        surfels.corners.push_back({i, i, i});
        surfels.weights.emplace_back(1, 0, 0);
    }
    return surfels;
}

Mesh surfel_polygons(const Surfels& surfels) {
    constexpr int kSides = 8;
    const float reach = 1 / math::cos(std::numbers::pi_v<float> / kSides); // so that the octagon holds the ellipse
    Mesh mesh;
    mesh.origin = surfels.origin;
    for (std::size_t i = 0; i < surfels.size(); ++i) {
        std::array<Index, kSides> corners;
        for (int k = 0; k < kSides; ++k) {
            const float angle = 2 * std::numbers::pi_v<float> * float(k) / kSides;
            corners[std::size_t(k)] = Index(mesh.positions.size());
            mesh.positions.push_back(surfels.positions[i] +
                                     reach * (math::cos(angle) * surfels.u[i] + math::sin(angle) * surfels.v[i]));
            if (!surfels.colors.empty()) mesh.colors.push_back(surfels.colors[i]);
            mesh.normals.corners.push_back(Index(i));
        }
        mesh.add_face(corners);
        mesh.normals.values.push_back(unit_normal(surfels.u[i], surfels.v[i]));
    }
    return mesh;
}

} // namespace filigree
