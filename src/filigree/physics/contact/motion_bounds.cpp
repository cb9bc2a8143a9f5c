#include "filigree/physics/contact/motion_bounds.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace filigree {

namespace {

constexpr std::size_t kBodiesGrain = 8;

/// Whether surface points lie outside of the box of the cells: of parts without cells.
bool has_points_outside_cells(const Body& body) {
    Box box;
    for (const auto& at : body.cells.corners)
        box.extend(body.cells.origin + body.cells.spacing * Vec3d(at[0], at[1], at[2]));
    const double slack = 1e-3 * body.spacing();
    return std::ranges::any_of(body.surface.points.rest, [&](const Vec3f& point) {
        const Vec3d p = point.cast<double>();
        return (p.array() < box.min.array() - slack).any() || (p.array() > box.max.array() + slack).any();
    });
}

/// Particles of a lattice that all others lie between, along x, y or z.
std::vector<Index> outermost(const Vectors& rest) {
    std::vector<std::uint8_t> lies_between(rest.size(), 0);
    std::vector<Index> order(rest.size());
    std::iota(order.begin(), order.end(), Index{0});
    for (int axis = 0; axis < 3; ++axis) {
        const auto row = [&](Index i) { return std::pair(rest[i][(axis + 1) % 3], rest[i][(axis + 2) % 3]); };
        const auto is_before = [&](Index i, Index j) { return row(i) == row(j) && rest[i][axis] < rest[j][axis]; };
        std::ranges::sort(order, {}, [&](Index i) { return std::pair(row(i), rest[i][axis]); });
        for (std::size_t k = 1; k + 1 < order.size(); ++k)
            lies_between[order[k]] |= is_before(order[k - 1], order[k]) && is_before(order[k], order[k + 1]);
    }
    std::erase_if(order, [&](Index i) { return lies_between[i] != 0; });
    std::ranges::sort(order);
    return order;
}

} // namespace

MotionBounds::Followed MotionBounds::followed(const BodyState& body) {
    Followed followed;
    if (body.rigid) {
        followed.corners = outermost(body.body->rest);
        return followed;
    }
    followed.has_points_outside = has_points_outside_cells(*body.body);
    const std::size_t count = body.corner_positions().size();
    followed.counts.resize((count + kExtremesPadding - 1) / kExtremesPadding * kExtremesPadding, 0);
    std::fill_n(followed.counts.begin(), count, 1.0f);
    if (body.corners) return followed;
    const std::vector<float>& mass = body.body->mass;
    followed.heaviest = Index(std::ranges::max_element(mass) - mass.begin());
    const std::vector<std::uint8_t> light = light_particles(*body.body);
    for (std::size_t i = 0; i < light.size(); ++i) followed.counts[i] = light[i] ? 0.0f : 1.0f;
    return followed;
}

void MotionBounds::set_body(std::size_t number, const BodyState& body, std::size_t like) {
    if (number >= followed_.size()) {
        followed_.resize(number + 1);
        velocities_.resize(number + 1);
        shifts_.resize(number + 1);
        places_.resize(number + 1);
        last_.resize(number + 1);
    }
    followed_[number] = like == number ? std::make_shared<const Followed>(followed(body)) : followed_[like];
}

void MotionBounds::remove_body(std::size_t number) {
    followed_[number] = nullptr;
    velocities_[number] = shifts_[number] = {};
    places_[number] = {};
    last_[number].clear();
}

/// Of particles that are followed: of their values, less `from` unless that is null.
Extremes MotionBounds::extremes(std::size_t body, const Vectors& values, const Vectors* from) const {
    const Followed& followed = *followed_[body];
    const std::vector<Index>& corners = followed.corners;
    if (corners.empty()) return extremes_of(values, from, followed.counts, followed.heaviest);
    const auto value_of = [&](Index i) -> Vec3f { return from ? Vec3f(values[i] - (*from)[i]) : values[i]; };
    Extremes found{value_of(corners[0]), value_of(corners[0])};
    for (const Index i : corners) found = found.with({value_of(i), value_of(i)});
    return found;
}

void MotionBounds::find_speeds(std::span<const BodyState> bodies, float dt, const RunContext& context) {
    parallel_for(context, bodies.size(), kBodiesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b) {
            if (bodies[b].is_absent) continue;
            velocities_[b] = extremes(b, bodies[b].corner_velocities(), nullptr);
            if (bodies[b].rigid) add_motion(b, bodies[b].positions, dt);
        }
    });
}

void MotionBounds::add_motion(std::size_t body, const Vectors& positions, float dt) {
    const std::vector<Index>& corners = followed_[body]->corners;
    std::vector<Vec3f>& last = last_[body];
    last.resize(corners.size());
    for (std::size_t k = 0; k < corners.size(); ++k) {
        const Vec3f now = positions[corners[k]];
        const Vec3f velocity = (now - std::exchange(last[k], now)) / dt;
        if (dt > 0) velocities_[body] = velocities_[body].with({velocity, velocity});
    }
}

void MotionBounds::find_shifts(std::span<const BodyState> bodies, const RunContext& context) {
    parallel_for(context, bodies.size(), kBodiesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b)
            if (!bodies[b].is_absent && !bodies[b].sleeps())
                shifts_[b] = extremes(b, bodies[b].corner_positions(), &places_[b]);
    });
}

void MotionBounds::count_from_here(std::span<const BodyState> bodies, bool sleepers) {
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (!bodies[b].is_absent && (sleepers || !bodies[b].sleeps())) places_[b] = bodies[b].corner_positions();
    shifts_.assign(shifts_.size(), {});
}

} // namespace filigree
