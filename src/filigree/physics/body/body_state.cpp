#include "filigree/physics/body/body_state.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/parallel_for.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace filigree {

namespace {

constexpr std::size_t kBodyStateGrain = 2048;
constexpr float kMostFlow = 4; ///< stretch, and 1 over it: what flows is sheared without end, its detail is not
constexpr double kLight = 0.3, kLightBeside = 0.2; ///< of what a full cell gives its corner, and of the mean
constexpr double kSurfaceStiffness = 4;            ///< times the stiffness of a spacing of material under the point
constexpr float kTogether = 1; ///< spacings between two ways of placing a point; further, its particles came apart

void bound_stretches(std::span<Mat3f> gradients, const RunContext& context) {
    parallel_for(context, gradients.size(), kBodyStateGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) gradients[i] = bounded_stretch(gradients[i]);
    });
}

Index nearest_particle(const Embedding& points, std::size_t point, const Vectors& rest) {
    Index nearest = points.particles[points.offsets[point]];
    for (Index k = points.offsets[point]; k < points.offsets[point + 1]; ++k) {
        const Index j = points.particles[k];
        if ((rest[j] - points.rest[point]).squaredNorm() < (rest[nearest] - points.rest[point]).squaredNorm())
            nearest = j;
    }
    return nearest;
}

std::vector<Vec3f> places_of(const Embedding& points, const Vectors& positions) {
    std::vector<Vec3f> places(points.size());
    for (std::size_t i = 0; i < places.size(); ++i) places[i] = embedded_point(points, i, positions);
    return places;
}

/// The cells whose corners are the particles; null for meshfree bodies.
const Cells* corners_of(const Body& body) {
    return body.material.model == MaterialModel::meshfree ? nullptr : &body.cells;
}

} // namespace

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
    const std::vector<float>& mass = body.mass;
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

PlacedPoints place_in_reference(const BodyState& state, std::span<const Vec3f> rest_points, const RunContext& context) {
    PlacedPoints placed{{rest_points.begin(), rest_points.end()}, {}};
    if (!state.has_flowed()) return placed;
    const Vectors &rest = state.body->rest, &reference = state.elasticity->reference();
    const Embedding at_rest = embed(rest_points, rest, state.body->spacing(), context);
    placed.gradients.resize(rest_points.size());
    move_embedded(at_rest, rest, reference, state.flow, placed.places, placed.gradients, context);
    const float together = kTogether * float(state.body->spacing());
    parallel_for(context, rest_points.size(), kBodyStateGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) {
            const Index nearest = nearest_particle(at_rest, p, rest);
            const Vec3f alone = reference[nearest] + state.flow[nearest] * (rest_points[p] - rest[nearest]);
            if ((alone - placed.places[p]).norm() <= together) continue;
            placed.places[p] = alone;
            placed.gradients[p] = state.flow[nearest];
        }
    });
    bound_stretches(placed.gradients, context);
    return placed;
}

Mat3f surface_flow(const BodyState& state, std::size_t point) {
    if (!state.has_flowed()) return Mat3f::Identity();
    const Embedding& at_rest = state.body->surface.points;
    Mat3f sum = Mat3f::Zero();
    for (Index k = at_rest.offsets[point]; k < at_rest.offsets[point + 1]; ++k)
        sum += at_rest.weights[k] * state.flow[at_rest.particles[k]];
    return bounded_stretch(sum);
}

Attachment attach(const BodyState& state, std::size_t body, std::span<const Vec3f> rest_points,
                  const RunContext& context) {
    PlacedPoints placed = place_in_reference(state, rest_points, context);
    return {body,
            {rest_points.begin(), rest_points.end()},
            embed_to_follow(placed.places, state.elasticity->reference(), state.body->spacing(),
                            corners_of(*state.body), context),
            std::move(placed.gradients)};
}

void move_attached(const BodyState& state, const Attachment& attachment, std::span<Vec3f> points,
                   std::span<Mat3f> gradients, const RunContext& context) {
    std::vector<Mat3f> particle_gradients(state.positions.size());
    state.elasticity->gradients(state.positions, particle_gradients, context);
    move_embedded(attachment.embedding, state.elasticity->reference(), state.positions, particle_gradients, points,
                  gradients, context);
    if (attachment.gradients.empty()) return;
    for (std::size_t i = 0; i < gradients.size(); ++i) gradients[i] = gradients[i] * attachment.gradients[i];
}

void renew_neighbourhoods(BodyState& state, std::span<Attachment* const> attachments, const RunContext& context) {
    for (std::size_t i = 0; i < state.positions.size(); ++i)
        if (!state.positions[i].allFinite()) return; // the frame is done again or held where it was
    const std::vector<Vec3f> surface = places_of(state.surface, state.positions),
                             balls = places_of(state.balls, state.positions);
    std::vector<std::vector<Vec3f>> carried(attachments.size());
    for (std::size_t a = 0; a < attachments.size(); ++a) {
        Attachment& attachment = *attachments[a];
        carried[a].resize(attachment.embedding.size());
        std::vector<Mat3f> gradients(attachment.embedding.size());
        move_attached(state, attachment, carried[a], gradients, context);
        bound_stretches(gradients, context);
        attachment.gradients = std::move(gradients);
    }
    std::vector<Mat3f> flow(state.positions.size());
    state.elasticity->gradients(state.positions, flow, context);
    if (state.has_flowed())
        for (std::size_t i = 0; i < flow.size(); ++i) flow[i] = flow[i] * state.flow[i];
    bound_stretches(flow, context);
    state.flow = std::move(flow);

    state.elasticity->renew(state.positions, context);
    const double spacing = state.body->spacing();
    state.surface = embed(surface, state.positions, spacing, context);
    if (!balls.empty()) state.balls = embed(balls, state.positions, spacing, context);
    for (std::size_t a = 0; a < attachments.size(); ++a)
        attachments[a]->embedding = embed_to_follow(carried[a], state.positions, spacing, nullptr, context);
    set_surface_stiffness(state);
}

void set_surface_stiffness(BodyState& state) {
    const Body& body = *state.body;
    const double modulus = body.material.density * std::pow(pressure_wave_speed(body.material), 2);
    std::vector<float>& stiffness = state.surface_stiffness;
    stiffness.resize(state.surface.size());
    for (std::size_t s = 0; s < stiffness.size(); ++s)
        stiffness[s] = float(kSurfaceStiffness * modulus * double(body.surface.areas[s]) / body.spacing());
    const auto bound = [&](const Embedding& points) {
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
    };
    bound(state.surface);
    if (state.has_flowed()) bound(state.balls); // at rest they are the surface's neighbours, with the same particles
}

void embed_surface_at_rest(BodyState& state, bool with_balls, const RunContext& context) {
    const Body& body = *state.body;
    state.surface = body.surface.points;
    if (!with_balls) return;
    std::vector<Vec3f> points = body.surface.points.rest;
    for (std::size_t s = 0; s < points.size(); ++s) points[s] -= state.ball_radius * body.surface.normals[s];
    state.balls = body.material.model == MaterialModel::meshfree ? embed(points, body.rest, body.spacing(), context)
                                                                 : embed_in_cells(points, body.cells, context);
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
