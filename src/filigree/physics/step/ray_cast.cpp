#include "filigree/physics/step/ray_cast.h"

#include "filigree/core/math.h"
#include "filigree/physics/contact/obstacle_surface.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr int kSamples = 16;         ///< of a ray in a cell's box
constexpr int kHalvings = 24;        ///< of what lies between two of them
constexpr int kMostMarches = 512;    ///< along a ray through a field
constexpr double kMarch = 0.9;       ///< of a distance: fields are interpolated
constexpr double kReached = 1e-5;    ///< spacings from a surface
constexpr float kBesideCell = 1e-3f; ///< cells: between two of them nothing is lost
constexpr double kBall = 0.71;       ///< of a particle's side: balls on a lattice leave no gaps

/// The parts of a ray in a box; last < first: none.
std::array<double, 2> span_in(const Box& box, const Ray& ray) {
    double first = 0, last = ray.reach;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = box.min[axis] - ray.origin[axis], high = box.max[axis] - ray.origin[axis];
        const double way = ray.direction[axis];
        if (way == 0 && (low > 0 || high < 0)) return {1, 0};
        if (way == 0) continue;
        first = std::max(first, std::min(low / way, high / way));
        last = std::min(last, std::max(low / way, high / way));
    }
    return {first, last};
}

Box widened_by(const Box& box, double by) {
    Box wide;
    wide.min = box.min - Vec3d::Constant(by);
    wide.max = box.max + Vec3d::Constant(by);
    return wide;
}

Ray moved_by(const Ray& ray, const Eigen::Isometry3d& motion) {
    return {motion * ray.origin, motion.linear() * ray.direction, ray.reach};
}

/// Where a ray gets from outside in: inside(distance) says which. Between one that is not and one that is.
template <class Inside>
double entry_between(double outside, double inside, const Inside& is_inside) {
    for (int k = 0; k < kHalvings; ++k) {
        const double middle = 0.5 * (outside + inside);
        (is_inside(middle) ? inside : outside) = middle;
    }
    return inside;
}

/// Where something begins whose distance is known everywhere. reached: m, near enough.
template <class Distance>
std::optional<double> march(double first, double last, double reached, const Distance& distance) {
    double at = first, before = first;
    for (int step = 0; step < kMostMarches && at <= last; ++step) {
        const double left = distance(at);
        if (left < 0 && at > first)
            return entry_between(before, at, [&](double middle) { return distance(middle) < 0; });
        if (left <= reached) return at;
        before = at;
        at += std::max(kMarch * left, reached);
    }
    return std::nullopt;
}

// Obstacles, in their own axes.

struct Met {
    double distance;
    Vec3d normal;
};

std::optional<Met> meet(const HalfSpace& ground, const Ray& ray) {
    const Vec3d normal = ground.normal.normalized();
    const double above = normal.dot(ray.origin - ground.point), down = -normal.dot(ray.direction);
    if (above <= 0) return Met{0, normal};
    if (!(down > 0)) return std::nullopt;
    return Met{above / down, normal};
}

std::optional<Met> meet_ball(const Vec3d& centre, double radius, const Ray& ray) {
    const Vec3d from = ray.origin - centre;
    const double along = from.dot(ray.direction), outside = from.squaredNorm() - radius * radius;
    if (outside <= 0) return Met{0, from.squaredNorm() > 0 ? Vec3d(from.normalized()) : Vec3d(-ray.direction)};
    const double under = along * along - outside;
    if (along >= 0 || under < 0) return std::nullopt;
    const double distance = outside / (std::sqrt(under) - along); // as -along - sqrt, without cancellation
    return Met{distance, (ray.at(distance) - centre).normalized()};
}
std::optional<Met> meet(const Ball& ball, const Ray& ray) { return meet_ball(ball.centre, ball.radius, ray); }

std::optional<Met> meet(const Cuboid& box, const Ray& ray) {
    Box sides;
    sides.min = box.centre - 0.5 * box.size;
    sides.max = box.centre + 0.5 * box.size;
    const auto [first, last] = span_in(sides, ray);
    if (last < first) return std::nullopt;
    const Vec3d beside = (ray.at(first) - box.centre).cwiseQuotient(0.5 * box.size);
    Eigen::Index axis;
    beside.cwiseAbs().maxCoeff(&axis);
    return Met{first, beside[axis] < 0 ? Vec3d(-Vec3d::Unit(axis)) : Vec3d(Vec3d::Unit(axis))};
}

std::optional<Met> meet(const MeshObstacle& mesh, const Ray& ray) {
    const Ray own{ray.origin - mesh.offset, ray.direction, ray.reach};
    if (!mesh.surface) {
        const DistanceField& field = *mesh.field;
        const auto [first, last] = span_in(field.box(), own);
        const auto distance = [&](double at) { return double(field.at(own.at(at).cast<float>()).distance); };
        const auto found = march(first, last, kReached * field.box().diagonal(), distance);
        if (!found) return std::nullopt;
        return Met{*found, field.at(own.at(*found).cast<float>()).normal.cast<double>()};
    }
    const Box box = widened_by(mesh.surface->box(), 4 * mesh.surface->margin());
    const auto [first, last] = span_in(box, own);
    if (last < first) return std::nullopt;
    const auto crossing = mesh.surface->first_crossing(own.at(first), own.at(last));
    if (!crossing) return std::nullopt;
    return Met{first + crossing->at * (last - first), crossing->normal};
}

std::optional<WorldHit> meet_obstacle(const SimulationState& state, std::size_t number, const Ray& ray) {
    const Obstacle& obstacle = state.world.obstacles[number];
    const Eigen::Isometry3d pose = obstacle.motion.at(state.time());
    const Ray own = moved_by(ray, pose.inverse());
    const auto met = std::visit([&](const auto& shape) { return meet(shape, own); }, obstacle.shape);
    if (!met || met->distance > ray.reach) return std::nullopt;
    WorldHit hit;
    hit.distance = met->distance;
    hit.normal = pose.linear() * met->normal;
    hit.obstacle = number;
    return hit;
}

// Bodies.

WorldHit hit_of(double distance, const Vec3d& normal, const Vec3f& rest) {
    WorldHit hit;
    hit.distance = distance;
    hit.normal = normal;
    hit.rest = rest;
    return hit;
}

std::optional<WorldHit> meet_rigid(const BodyState& body, const Ray& ray) {
    const RigidPose& pose = *body.rigid;
    Eigen::Isometry3d to_rest = Eigen::Isometry3d::Identity();
    to_rest.linear() = pose.turn.toRotationMatrix().transpose();
    to_rest.translation() = pose.rest_centre - to_rest.linear() * pose.centre;
    const Ray own = moved_by(ray, to_rest);
    const DistanceField& field = *body.body->field;
    const auto [first, last] = span_in(field.box(), own);
    const auto distance = [&](double at) {
        return double(field.at(own.at(at).cast<float>()).distance - body.body->field_radius);
    };
    const auto found = march(first, last, kReached * body.body->spacing(), distance);
    if (!found) return std::nullopt;
    const Vec3f rest = own.at(*found).cast<float>();
    return hit_of(*found, to_rest.linear().transpose() * field.at(rest).normal.cast<double>(), rest);
}

/// A cell that a ray may go through.
struct CellOnRay {
    double first, last; ///< m along the ray
    Index cell;
};

class SoftMatter {
public:
    SoftMatter(const BodyState& body, const Matter& matter) : body_(*body.body), matter_(matter) {
        positions_ = &body.positions;
        if (!body.corners) return;
        const Embedding& carried = body.body->corners; // as the particles are now, and not as the last frame left them
        corners_ = Vectors(carried.size());
        for (std::size_t c = 0; c < carried.size(); ++c) corners_.set(c, embedded_point(carried, c, body.positions));
        positions_ = &corners_;
    }

    std::optional<WorldHit> meet(const Ray& ray) const {
        std::optional<double> best;
        Index whose = 0;
        for (const CellOnRay& on : cells_on(ray)) {
            if (best && on.first > *best) break;
            const std::optional<double> found = meet_cell(on, ray);
            if (!found || (best && *found >= *best)) continue;
            best = found;
            whose = on.cell;
        }
        if (!best) return std::nullopt;
        Matter::Place place{whose};
        matter_.locate_in_cell(*positions_, ray.at(*best).cast<float>(), place, kBesideCell);
        const auto depth = matter_.depth(place, matter_.inverse_derivative(*positions_, place), Vec3f::Zero());
        const Vec3d normal = depth ? Vec3d(depth->normal.cast<double>()) : Vec3d(-ray.direction);
        return hit_of(*best, normal, matter_.rest_position(place));
    }

private:
    /// Ascending.
    std::vector<CellOnRay> cells_on(const Ray& ray) const {
        std::vector<CellOnRay> found;
        const double beside = double(kBesideCell) * body_.spacing();
        for (Index cell = 0; cell < body_.cells.cells.size(); ++cell) {
            Box box;
            for (const Index corner : matter_.corners(cell)) box.extend((*positions_)[corner].cast<double>());
            const auto [first, last] = span_in(widened_by(box, beside), ray);
            if (first <= last) found.push_back({first, last, cell});
        }
        std::ranges::sort(found, {}, [](const CellOnRay& on) { return std::pair(on.first, on.cell); });
        return found;
    }

    bool is_inside(Index cell, const Vec3d& point) const {
        Matter::Place place{cell};
        if (!matter_.locate_in_cell(*positions_, point.cast<float>(), place, kBesideCell)) return false;
        return body_.field->at(matter_.rest_position(place)).distance <= body_.field_radius;
    }

    std::optional<double> meet_cell(const CellOnRay& on, const Ray& ray) const {
        const auto inside = [&](double at) { return is_inside(on.cell, ray.at(at)); };
        double before = on.first;
        for (int k = 0; k <= kSamples; ++k) {
            const double at = on.first + (on.last - on.first) * k / kSamples;
            if (inside(at)) return k == 0 ? at : entry_between(before, at, inside);
            before = at;
        }
        return std::nullopt;
    }

    const Body& body_;
    const Matter& matter_;
    const Vectors* positions_;
    Vectors corners_;
};

std::optional<WorldHit> meet_particles(const BodyState& body, const Ray& ray) {
    std::optional<WorldHit> best;
    for (std::size_t i = 0; i < body.positions.size(); ++i) {
        const double radius = kBall * math::cbrt(double(body.body->volume[i]));
        const auto met = meet_ball(body.positions[i].cast<double>(), radius, ray);
        if (met && met->distance <= ray.reach && (!best || met->distance < best->distance))
            best = hit_of(met->distance, met->normal, body.body->rest[i]);
    }
    return best;
}

std::optional<WorldHit> meet_body(const SimulationState& state, std::size_t slot, const Ray& ray) {
    const BodyState& body = state.bodies[slot];
    if (body.is_free() || (body.is_absent && !body.is_on_grid) || !is_finite(body.positions)) return std::nullopt;
    const double around = 2 * body.body->spacing() + double(body.body->field_radius);
    if (const auto [first, last] = span_in(widened_by(box_of(body.positions), around), ray); last < first)
        return std::nullopt;
    const Matter* matter = state.contacts.matter(slot);
    std::optional<WorldHit> hit = !matter      ? meet_particles(body, ray)
                                  : body.rigid ? meet_rigid(body, ray)
                                               : SoftMatter(body, *matter).meet(ray);
    if (hit) hit->body = body.actor;
    return hit;
}

} // namespace

std::optional<WorldHit> cast_ray(const Ray& ray, const SimulationState& state, std::optional<std::size_t> ignore) {
    std::optional<WorldHit> first;
    Ray left = ray;
    const auto take = [&](const std::optional<WorldHit>& hit) {
        if (!hit || (first && hit->distance >= first->distance)) return;
        first = hit;
        left.reach = hit->distance;
    };
    for (std::size_t o = 0; o < state.world.obstacles.size(); ++o) take(meet_obstacle(state, o, left));
    for (std::size_t slot = 0; slot < state.bodies.size(); ++slot)
        if (!ignore || state.bodies[slot].actor != *ignore) take(meet_body(state, slot, left));
    if (first) first->place = ray.at(first->distance);
    return first;
}

} // namespace filigree
