#include "filigree/physics/contact/start_sides.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/physics/body/point_grid.h"
#include "filigree/physics/contact/obstacle_motion.h"

#include <algorithm>
#include <cstdio>

namespace filigree {

namespace {

constexpr double kNeighbours = 1.75; // spacings between particles that hang together, without cells
constexpr double kSomeOutside = 0.1; // of a body's mass

/// Calls visit(a, b) for particles that hang together.
template <class Visit>
void each_neighbours(const BodyState& state, const Visit& visit) {
    const Body& body = *state.body;
    if (body.material.model != MaterialModel::meshfree && body.cells.corners.size() == body.particle_count()) {
        for (const std::array<Index, 8>& corners : body.cells.cell_corners)
            for (unsigned k = 0; k < 8; ++k)
                for (const unsigned axis : {1u, 2u, 4u})
                    if (!(k & axis)) visit(corners[k], corners[k | axis]);
        return;
    }
    const float radius = float(kNeighbours * body.spacing());
    const PointGrid grid(state.positions, radius);
    for (Index a = 0; a < state.positions.size(); ++a)
        grid.near(state.positions[a], radius, [&](Index b) {
            if (a < b && (state.positions[a] - state.positions[b]).norm() < radius) visit(a, b);
        });
}

} // namespace

StartSides::StartSides(const BodyState& body, const ObstacleShape& shape, const Eigen::Isometry3d& motion)
    : body_(body), shape_(shape), to_own_(motion.inverse()) {
    if (!is_finite(body.positions)) return; // the frame is done again
    const Box box = box_of(body.positions);
    const Vec3d centre = to_own_ * box.centre();
    const double radius = 0.5 * box.diagonal(), spacing = body.body->spacing();
    const bool is_clear = shape.clearance(centre, radius + spacing) >= radius + spacing;
    if (is_clear) is_inside_ = shape.is_closed() && shape.is_inside(centre);
    if (is_clear && !is_inside_) return;
    std::vector<double> clearances;
    const double edge = 2 * kNeighbours * spacing;
    for (std::size_t i = 0; i < body.positions.size(); ++i) {
        places_.push_back(to_own_ * body.positions[i].cast<double>());
        clearances.push_back(shape.clearance(places_.back(), edge));
    }
    if (!is_inside_) find_groups(clearances);
}

void StartSides::find_groups(std::span<const double> clearances) {
    DisjointSets sets(places_.size());
    each_neighbours(body_, [&](Index a, Index b) {
        const double length = (places_[a] - places_[b]).norm();
        if (clearances[a] > length || clearances[b] > length || !shape_.is_between(places_[a], places_[b]))
            sets.join(a, b);
    });
    struct Group {
        double mass = 0, clearance = -1;
        Index clearest = 0;
        bool is_inside = false;
    };
    std::vector<Group> groups(places_.size());
    double whole = 0;
    for (Index i = 0; i < places_.size(); ++i) {
        Group& group = groups[sets.root(i)];
        group.mass += double(body_.body->mass[i]);
        whole += double(body_.body->mass[i]);
        if (clearances[i] > group.clearance) {
            group.clearance = clearances[i];
            group.clearest = i;
        }
    }
    Index largest = kNoIndex, outer = kNoIndex;
    for (Index g = 0; g < groups.size(); ++g) {
        Group& group = groups[g];
        if (group.clearance < 0) continue;
        if (largest == kNoIndex || group.mass > groups[largest].mass) largest = g;
        group.is_inside = shape_.is_closed() && shape_.is_inside(places_[group.clearest]);
        if (!group.is_inside && (outer == kNoIndex || group.mass > groups[outer].mass)) outer = g;
    }
    const bool comes_out = shape_.is_solid() || (shape_.is_closed() && !shape_.looked_inwards());
    const double least = shape_.is_solid() ? 0 : kSomeOutside * whole;
    if (comes_out && outer != kNoIndex && groups[outer].mass > least) largest = outer;
    is_inside_ = groups[largest].is_inside && (outer == kNoIndex || groups[outer].mass < kSomeOutside * whole);
    if (groups[largest].mass == whole) return;
    right_.resize(places_.size());
    for (Index i = 0; i < places_.size(); ++i) right_[i] = sets.root(i) == largest;
}

Vec3d StartSides::start_of(std::size_t point) const {
    const Embedding& surface = body_.surface;
    const Vec3d place = to_own_ * embedded_point(surface, point, body_.positions).cast<double>();
    if (is_inside_ && shape_.is_solid()) return shape_.is_inside(place) ? shape_.exit(place) : place;
    Vec3d mean = Vec3d::Zero();
    double count = 0;
    for (Index k = surface.offsets[point]; k < surface.offsets[point + 1]; ++k) {
        const Index particle = surface.particles[k];
        if (!right_.empty() && !right_[particle]) continue;
        mean += to_own_ * body_.positions[particle].cast<double>();
        ++count;
    }
    if (count > 0) return mean / count;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < places_.size(); ++i)
        if (const double distance = (places_[i] - place).squaredNorm(); right_[i] && distance < least) {
            least = distance;
            mean = places_[i];
        }
    return mean;
}

std::vector<StartOverlap> find_start_overlaps(const World& world, std::span<const ObstacleShape> shapes,
                                              std::span<const BodyState> bodies, double time) {
    constexpr double kDeep = 0.75; // spacings: what is less deep is pushed out softly
    std::vector<StartOverlap> found;
    const ObstaclePoses poses(world, time);
    for (std::size_t o = 0; o < world.obstacles.size(); ++o) {
        const ObstacleShape& shape = shapes[o];
        const Eigen::Isometry3d to_own = poses.at(o).inverse();
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            const BodyState& body = bodies[b];
            if (body.is_absent || !is_finite(body.positions)) continue;
            StartOverlap overlap{b, o, 0, false};
            std::optional<StartSides> sides;
            if (shape.is_traced()) sides.emplace(body, shape, poses.at(o));
            if (sides) overlap.is_inside = sides->is_inside() && !shape.is_solid();
            for (std::size_t s = 0; s < body.surface.size() && !(sides && sides->all_right()); ++s) {
                const Vec3f place = embedded_point(body.surface, s, body.positions);
                Vec3d start = sides ? sides->start_of(s) : Vec3d(Vec3d::Zero());
                const double depth = sides ? shape.follow(start, to_own * place.cast<double>()).depth
                                           : -double(poses.distance_to(o, place).distance);
                overlap.depth = std::max(overlap.depth, depth);
            }
            if (overlap.is_inside || overlap.depth > kDeep * body.body->spacing()) found.push_back(overlap);
        }
    }
    return found;
}

std::string StartOverlap::sentence(const std::string& body_name, const std::string& obstacle_name) const {
    if (is_inside)
        return body_name + " starts inside " + obstacle_name +
               ", which is a room for it: it stays in there; move one of them if it should be outside";
    char text[32];
    std::snprintf(text, sizeof text, "%.2g", depth);
    return body_name + " starts up to " + text + " m deep in " + obstacle_name +
           " and is pushed out at once, to the side where most of it lies; move one of them";
}

} // namespace filigree
