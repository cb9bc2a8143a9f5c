#include "filigree/flesh/inward_weights.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh/closest_point.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace filigree {

namespace {

constexpr float kNearSurface = 0.75f; ///< spacings below the surface: particles have the surface's weights
constexpr double kSmallResidual = 1e-5;
constexpr int kMostSteps = 400;
constexpr float kLeastWeight = 0.01f;
constexpr std::size_t kWeightsGrain = 64; // particles

/// One joint's weight over the particles: harmonic where `fixed` is 0, by conjugate gradients.
void make_harmonic(std::span<const std::array<Index, 6>> neighbours, std::span<const std::uint8_t> fixed,
                   std::span<double> x) {
    const std::size_t count = x.size();
    const auto laplacian = [&](std::span<const double> of, std::size_t i) {
        double sum = 0;
        for (const Index n : neighbours[i])
            if (n != kNoIndex) sum += of[i] - of[n];
        return sum;
    };
    std::vector<double> r(count), p(count), q(count);
    double squared = 0;
    for (std::size_t i = 0; i < count; ++i)
        if (!fixed[i]) {
            p[i] = r[i] = -laplacian(x, i);
            squared += r[i] * r[i];
        }
    const double enough = kSmallResidual * kSmallResidual * squared;
    for (int step = 0; step < kMostSteps && squared > enough && squared > 1e-16; ++step) {
        double along = 0;
        for (std::size_t i = 0; i < count; ++i)
            if (!fixed[i]) {
                q[i] = laplacian(p, i);
                along += p[i] * q[i];
            }
        if (!(along > 0)) break;
        const double way = squared / along, before = squared;
        squared = 0;
        for (std::size_t i = 0; i < count; ++i)
            if (!fixed[i]) {
                x[i] += way * p[i];
                r[i] -= way * q[i];
                squared += r[i] * r[i];
            }
        for (std::size_t i = 0; i < count; ++i)
            if (!fixed[i]) p[i] = r[i] + squared / before * p[i];
    }
}

/// Calls visit(particle, point of the surface, corners of its triangle) for particles near the surface or outside.
template <class Visit>
Status each_at_surface(const Body& body, const Mesh& surface, const RunContext& context, const Visit& visit) {
    const Result<Triangulation> cut = triangulate(surface, context);
    if (!cut) return cut.error();
    const ClosestPointTree tree(surface.positions, cut->triangles, context);
    const auto near = float(kNearSurface * body.spacing());
    parallel_for(context, body.particle_count(), kWeightsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (body.field->distance(body.rest[i]) < -near) continue;
            const SurfacePoint point = tree.closest((body.rest[i].cast<double>() / body.scale).cast<float>());
            if (point.triangle != kNoIndex) visit(i, point, cut->triangles[point.triangle]);
        }
    });
    if (context.is_cancelled()) return cancelled_error();
    return Success{};
}

} // namespace

std::vector<std::array<Index, 6>> lattice_neighbours(const Body& body) {
    std::vector<std::array<Index, 6>> neighbours(body.particle_count(),
                                                 {kNoIndex, kNoIndex, kNoIndex, kNoIndex, kNoIndex, kNoIndex});
    for (const std::array<Index, 8>& cell : body.cells.cell_corners)
        for (int corner = 0; corner < 8; ++corner)
            for (int axis = 0; axis < 3; ++axis) {
                const int other = corner ^ (1 << axis);
                neighbours[cell[corner]][2 * axis + (other > corner ? 1 : 0)] = cell[other];
            }
    return neighbours;
}

Result<std::vector<FleshWeights>> inward_weights(const Body& body, const Mesh& surface, const SkinWeights& weights,
                                                 std::size_t joints, std::span<const std::array<Index, 6>> neighbours,
                                                 const RunContext& context) {
    const std::size_t count = body.particle_count();
    std::vector<std::uint8_t> fixed(count);
    std::vector<std::vector<std::pair<Index, double>>> at_surface(count); // by joint
    const Status found_points =
        each_at_surface(body, surface, context, [&](std::size_t i, const SurfacePoint& point, const Triangle& corners) {
            fixed[i] = 1;
            std::map<Index, double> sums;
            for (int k = 0; k < 3; ++k)
                for (Index w = weights.first[corners[k]]; w < weights.first[corners[k] + 1]; ++w)
                    sums[weights.joints[w]] += double(point.barycentric[k]) * double(weights.weights[w]);
            at_surface[i].assign(sums.begin(), sums.end());
        });
    if (!found_points) return found_points.error();
    std::vector<std::uint8_t> counts(joints);
    for (const auto& of : at_surface)
        for (const auto& [joint, weight] : of) counts[joint] |= weight > 0;
    std::vector<std::vector<float>> fields(joints); // empty: no weight anywhere
    parallel_for(context, joints, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j) {
            if (!counts[j] || context.is_cancelled()) continue;
            std::vector<double> x(count);
            for (std::size_t i = 0; i < count; ++i)
                for (const auto& [joint, weight] : at_surface[i])
                    if (joint == j) x[i] = weight;
            make_harmonic(neighbours, fixed, x);
            fields[j].assign(x.begin(), x.end());
        }
    });
    if (context.is_cancelled()) return cancelled_error();
    std::vector<FleshWeights> found(count);
    parallel_for(context, count, kWeightsGrain, [&](std::size_t begin, std::size_t end) {
        std::vector<std::pair<float, Index>> of;
        for (std::size_t i = begin; i < end; ++i) {
            of.clear();
            for (Index j = 0; j < joints; ++j)
                if (!fields[j].empty() && fields[j][i] > kLeastWeight) of.emplace_back(-fields[j][i], j);
            std::ranges::sort(of); // the largest first
            of.resize(std::min(of.size(), FleshWeights::kMost));
            float sum = 0;
            for (const auto& [weight, joint] : of) sum -= weight;
            FleshWeights& to = found[i];
            to.joints.fill(0);
            to.weights.fill(0);
            for (std::size_t k = 0; k < of.size(); ++k) {
                to.joints[k] = of[k].second;
                to.weights[k] = -of[k].first / sum;
            }
            if (of.empty()) to.weights[0] = 1; // of a cell that no surface is near
        }
    });
    return found;
}

Result<std::vector<float>> inward_values(const Body& body, const Mesh& surface, std::span<const float> values,
                                         std::span<const std::array<Index, 6>> neighbours, const RunContext& context) {
    std::vector<std::uint8_t> fixed(body.particle_count());
    std::vector<double> x(body.particle_count());
    const Status found =
        each_at_surface(body, surface, context, [&](std::size_t i, const SurfacePoint& point, const Triangle& corners) {
            fixed[i] = 1;
            for (int k = 0; k < 3; ++k) x[i] += double(point.barycentric[k]) * double(values[corners[k]]);
        });
    if (!found) return found.error();
    make_harmonic(neighbours, fixed, x);
    std::vector<float> inside(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) inside[i] = float(std::clamp(x[i], 0.0, 1.0));
    return inside;
}

} // namespace filigree
