// Based on: [Knupp 2003], the scaled Jacobian of a quadrilateral, on quads that need not be flat: the normal is that of
// both diagonals.
#include "filigree/remesh/quad_quality.h"

#include "filigree/core/lists.h"
#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <cmath>

namespace filigree {
namespace {

constexpr std::size_t kQuadQualityGrain = 4096;
constexpr double kLowFraction = 0.01; // what the low scaled Jacobian is the percentile of

std::vector<Index> quads_of(const Mesh& mesh) {
    std::vector<Index> quads;
    quads.reserve(mesh.face_count());
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        if (mesh.face_size(f) == 4) quads.push_back(static_cast<Index>(f));
    return quads;
}

std::vector<double> scaled_jacobians(const Mesh& mesh, std::span<const Index> quads, const RunContext& context) {
    std::vector<double> result(quads.size());
    parallel_for(context, quads.size(), kQuadQualityGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t q = begin; q < end && !context.is_cancelled(); ++q) {
            const std::span<const Index> face = mesh.face(quads[q]);
            const auto corner = [&](std::size_t k) { return Vec3d(mesh.positions[face[k]].cast<double>()); };
            result[q] = scaled_jacobian(corner(0), corner(1), corner(2), corner(3));
        }
    });
    return result;
}

IndexLists quads_at_vertices(const Mesh& mesh, std::span<const Index> quads) {
    return make_lists<Index>(mesh.vertex_count(), [&](const auto& add) {
        for (const Index q : quads)
            for (const Index v : mesh.face(q)) add(v, q);
    });
}

/// Whether the vertex has other than four quads, and each of its edges exactly two of them.
bool is_irregular_inside(const Mesh& mesh, std::span<const Index> quads, Index vertex, std::vector<Index>& neighbours) {
    if (quads.empty() || quads.size() == 4) return false;
    neighbours.clear();
    for (const Index q : quads) {
        const std::span<const Index> face = mesh.face(q);
        const std::size_t k = static_cast<std::size_t>(std::ranges::find(face, vertex) - face.begin());
        neighbours.push_back(face[(k + 1) % 4]);
        neighbours.push_back(face[(k + 3) % 4]);
    }
    std::ranges::sort(neighbours);
    for (std::size_t i = 0; i < neighbours.size(); i += 2) {
        const bool pair = neighbours[i] == neighbours[i + 1];
        if (!pair || (i > 0 && neighbours[i] == neighbours[i - 1])) return false;
    }
    return true;
}

std::size_t count_irregular_vertices(const Mesh& mesh, std::span<const Index> quads, const RunContext& context) {
    const IndexLists at = quads_at_vertices(mesh, quads);
    std::vector<std::size_t> of_piece((mesh.vertex_count() + kQuadQualityGrain - 1) / kQuadQualityGrain);
    parallel_for(context, mesh.vertex_count(), kQuadQualityGrain, [&](std::size_t begin, std::size_t end) {
        std::vector<Index> neighbours;
        for (std::size_t v = begin; v < end && !context.is_cancelled(); ++v) {
            of_piece[begin / kQuadQualityGrain] += is_irregular_inside(mesh, at[v], static_cast<Index>(v), neighbours);
        }
    });
    std::size_t count = 0;
    for (const std::size_t piece : of_piece) count += piece;
    return count;
}

} // namespace

double scaled_jacobian(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    const std::array<Vec3d, 4> corners = {a, b, c, d};
    const Vec3d normal = (c - a).cross(d - b);
    const double length_of_normal = normal.norm();
    if (!(length_of_normal > 0)) return -1;
    double smallest = 1;
    for (std::size_t k = 0; k < 4; ++k) {
        const Vec3d next = corners[(k + 1) % 4] - corners[k], previous = corners[(k + 3) % 4] - corners[k];
        const double lengths = next.norm() * previous.norm();
        if (!(lengths > 0)) return -1;
        smallest = std::min(smallest, next.cross(previous).dot(normal) / (lengths * length_of_normal));
    }
    return std::max(smallest, -1.0); // rounding
}

QuadQuality measure_quads(const Mesh& mesh, const RunContext& context) {
    QuadQuality quality;
    const std::vector<Index> quads = quads_of(mesh);
    if (quads.empty()) return quality;
    quality.quads = quads.size();
    quality.irregular_vertices = count_irregular_vertices(mesh, quads, context);

    std::vector<double> jacobians = scaled_jacobians(mesh, quads, context);
    double sum = 0;
    for (std::size_t q = 0; q < quads.size(); ++q) {
        sum += jacobians[q];
        quality.inverted += !(jacobians[q] > 0);
        if (quality.worst_quad != kNoIndex && jacobians[q] >= quality.min_scaled_jacobian) continue;
        quality.min_scaled_jacobian = jacobians[q];
        quality.worst_quad = quads[q];
    }
    quality.mean_scaled_jacobian = sum / double(quads.size());
    const auto low = jacobians.begin() + (std::ptrdiff_t(std::ceil(kLowFraction * double(quads.size()))) - 1);
    std::ranges::nth_element(jacobians, low);
    quality.low_scaled_jacobian = *low;
    return quality;
}

} // namespace filigree
