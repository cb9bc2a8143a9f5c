#include "filigree/physics/body/body_state.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/math.h"
#include "filigree/physics/body/embedding.h"
#include "filigree/physics/body/fields.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace filigree {

namespace {

constexpr double kLight = 0.3, kLightBeside = 0.2; ///< of what a full cell gives its corner, and of the mean
constexpr double kSurfaceStiffness = 4;            ///< times the stiffness of a spacing of material under the point
constexpr float kMostFlow = 4; ///< stretch, and 1 over it: what flows is sheared without end, its detail is not

/// The cells whose corners are the particles; null for meshfree bodies.
const Cells* corners_of(const Body& body) {
    return body.material.model == MaterialModel::meshfree ? nullptr : &body.cells;
}

} // namespace

BodyState free_slot() {
    static const std::shared_ptr<const Body> nothing = [] {
        auto body = std::make_shared<Body>();
        body->cells.spacing = std::numeric_limits<double>::infinity();
        return body;
    }();
    BodyState state;
    state.body = nothing;
    state.actor = BodyState::kNobody;
    state.is_absent = true;
    return state;
}

Mat3f bounded_stretch(const Mat3f& gradient) {
    if (!gradient.allFinite()) return Mat3f::Identity();
    // Of stretches a >= b >= c: a <= |F|, and c = det F / (a b) >= 2 det F / |F|^2.
    const float squared = gradient.squaredNorm();
    if (squared < kMostFlow * kMostFlow && 2 * std::abs(gradient.determinant()) * kMostFlow > 1.0001f * squared)
        return gradient;
    const SingularValues<float> svd = singular_values(gradient);
    if (svd.s.maxCoeff() <= kMostFlow && svd.s.minCoeff() >= 1 / kMostFlow) return gradient;
    return svd.u * svd.s.cwiseMax(1 / kMostFlow).cwiseMin(kMostFlow).asDiagonal() * svd.v.transpose();
}

std::vector<std::uint8_t> light_particles(const Body& body) {
    std::vector<float> mass = body.mass;
    if (!body.fields.density.empty()) // what counts is how full the cells are
        for (std::size_t i = 0; i < mass.size(); ++i) mass[i] = float(body.material.density) * body.volume[i];
    const double h = body.spacing(), full = body.material.density * h * h * h / 8;
    const double mean = std::accumulate(mass.begin(), mass.end(), 0.0) / double(mass.size()); // of a thin sheet: less
    const auto least = float(std::min(kLight * full, kLightBeside * mean));
    std::vector<std::uint8_t> light;
    for (const float m : mass) light.push_back(m < least);
    return light;
}

void find_light_corners(BodyState& state) {
    const Body& body = *state.body;
    const std::vector<std::uint8_t> light = light_particles(body);
    std::vector<Index> heaviest(light.size(), kNoIndex);
    for (const auto& corners : body.cells.cell_corners) {
        const Index heavy = *std::ranges::max_element(corners, {}, [&](Index corner) { return body.mass[corner]; });
        for (const Index corner : corners)
            if (heaviest[corner] == kNoIndex || body.mass[heavy] > body.mass[heaviest[corner]])
                heaviest[corner] = heavy;
    }
    for (Index i = 0; i < light.size(); ++i)
        if (light[i] && heaviest[i] != i) state.light_corners.push_back({i, heaviest[i]});
}

Attachment attach(const BodyState& state, std::size_t body, std::span<const Vec3f> rest_points,
                  const RunContext& context) {
    const Body& matter = *state.body;
    return {body,
            {rest_points.begin(), rest_points.end()},
            embed_to_follow(rest_points, matter.rest, matter.spacing(), corners_of(matter), context)};
}

void move_attached(const BodyState& state, const Attachment& attachment, std::span<Vec3f> points,
                   std::span<Mat3f> gradients, const RunContext& context) {
    std::vector<Mat3f> particle_gradients(state.positions.size());
    state.elasticity->gradients(state.positions, particle_gradients, context);
    move_embedded(attachment.embedding, state.body->rest, state.positions, particle_gradients, points, gradients,
                  context);
}

void set_surface_stiffness(BodyState& state) {
    const Body& body = *state.body;
    const double modulus = body.material.density * math::pow(pressure_wave_speed(body.material), 2);
    std::vector<float>& stiffness = state.surface_stiffness;
    stiffness.resize(state.surface.size());
    for (std::size_t s = 0; s < stiffness.size(); ++s)
        stiffness[s] = float(kSurfaceStiffness * modulus * double(body.surface.areas[s]) / body.spacing());
    const Embedding& points = state.surface;
    if (!body.fields.stiffness.empty()) {
        const std::vector<float> around = at_corners(body.cells, body.fields.stiffness);
        for (std::size_t s = 0; s < points.size(); ++s) {
            float sum = 0;
            for (Index k = points.offsets[s]; k < points.offsets[s + 1]; ++k)
                sum += points.weights[k] * around[points.particles[k]];
            stiffness[s] *= std::max(sum, BodyFields::kLeast);
        }
    }
    const auto each_weight = [&](std::size_t point, const auto& visit) {
        for (Index k = points.offsets[point]; k < points.offsets[point + 1]; ++k)
            visit(points.particles[k], std::abs(points.weights[k]));
    };
    std::vector<double> sums(body.particle_count(), 0);
    for (std::size_t s = 0; s < points.size(); ++s)
        each_weight(s, [&](Index particle, float weight) { sums[particle] += double(weight * stiffness[s]); });
    for (std::size_t s = 0; s < points.size(); ++s) {
        double part = 1;
        each_weight(s, [&](Index particle, float weight) {
            if (weight > 0)
                part = std::min(part, double(kContactShare) * double(body.mass[particle]) *
                                          double(state.rest_squared_frequency) / sums[particle]);
        });
        stiffness[s] *= float(part);
    }
}

void place_corners(std::span<BodyState> bodies, const RunContext& context) {
    for (BodyState& body : bodies)
        if (body.corners) body.corners->place(body.positions, body.velocities, context);
}

Box box_of(const Vectors& positions) {
    Vec3f low = positions[0], high = low;
    for (std::size_t i = 1; i < positions.size(); ++i) {
        low = low.cwiseMin(positions[i]);
        high = high.cwiseMax(positions[i]);
    }
    Box box;
    box.extend(low.cast<double>());
    box.extend(high.cast<double>());
    return box;
}

} // namespace filigree
