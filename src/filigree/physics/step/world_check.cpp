// What a world and its actors must be before anything moves: checked once, each complaint with the name of its place.
#include "filigree/physics/simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filigree {

namespace {

constexpr double kLeastTemperature = std::numeric_limits<double>::min(); ///< K

/// Keeps the first thing that is wrong.
class Checker {
public:
    explicit Checker(std::span<const Actor> actors) : actors_(actors) {}

    void require(bool right, const std::string& place, const char* what) {
        if (!right && wrong_.empty()) wrong_ = place + " " + what + ".";
    }
    void finite(const Vec3d& value, const std::string& place) { require(value.allFinite(), place, "must be finite"); }
    void at_least(double value, double least, const std::string& place, const char* what) {
        require(std::isfinite(value) && value >= least, place, what);
    }

    /// least: of each value.
    void keys(const Keyed<double>& keyed, double least, const std::string& place) {
        times(keyed, place);
        const auto is_right = [&](double value) { return std::isfinite(value) && value >= least; };
        require((!keyed.times.empty() || is_right(keyed.constant)) && std::ranges::all_of(keyed.values, is_right),
                place, least > 0 ? "must be above 0 K" : "must be finite");
    }
    void keys(const Keyed<Vec3d>& keyed, const std::string& place) {
        finite(keyed.constant, place + ".constant");
        times(keyed, place);
        for (const Vec3d& value : keyed.values) finite(value, place + ".values");
    }
    template <class T>
    void times(const Keyed<T>& keyed, const std::string& place) {
        require(keyed.values.size() == keyed.times.size(), place + ".values", "must be as many as its times");
        for (std::size_t k = 0; k < keyed.times.size(); ++k)
            require(std::isfinite(keyed.times[k]) && (k == 0 || keyed.times[k - 1] <= keyed.times[k]), place + ".times",
                    "must be finite and ascend");
    }
    void motion(const RigidMotion& motion, const std::string& place) {
        finite(motion.centre, place + ".centre");
        keys(motion.move, place + ".move");
        keys(motion.angle, place + ".angle");
        pose(motion.start, place + ".start");
    }
    void pose(const Eigen::Isometry3d& pose, const std::string& place) {
        const Mat3d turn = pose.linear();
        require(pose.translation().allFinite() && (turn.transpose() * turn - Mat3d::Identity()).norm() < 1e-6 &&
                    turn.determinant() > 0,
                place, "must be a turn and a shift");
    }
    void body(std::size_t body, const std::string& place) {
        require(body < actors_.size(), place + ".body", "is not there: bodies are counted from 0");
    }
    void particles(std::size_t body, std::span<const Index> particles, const std::string& place) {
        if (!wrong_.empty() || body >= actors_.size()) return;
        for (const Index particle : particles)
            require(particle < actors_[body].body->particle_count(), place + ".particles",
                    "names a particle that is not there");
    }

    void actor(const Actor& actor, const std::string& place) {
        require(actor.body != nullptr, place + ".body", "is missing");
        if (!actor.body) return;
        require(actor.body->particle_count() > 0, place + ".body", "has no particles");
        pose(actor.placement, place + ".placement");
        finite(actor.velocity, place + ".velocity");
        finite(actor.spin, place + ".spin");
        if (actor.fracture) fracture(*actor.fracture, actor, place + ".fracture");
    }
    void fracture(const Fracture& fracture, const Actor& actor, const std::string& place) {
        require(fracture.body && fracture.body->whole == actor.body, place + ".body", "must be of the actor's body");
        const std::string wrong_material = check_fracture(fracture.material);
        require(wrong_material.empty(), place + ".material", ("is wrong: " + wrong_material).c_str());
        if (!wrong_.empty()) return;
        for (const FractureEvent& event : fracture.events) {
            require(std::isfinite(event.time), place + ".events", "must have finite times");
            for (const Index piece : event.pieces)
                require(piece < fracture.body->partition.count, place + ".events", "name a piece that is not there");
            for (const Index particle : event.particles)
                require(particle < actor.body->particle_count(), place + ".events",
                        "name a particle that is not there");
        }
    }

    void shape(const HalfSpace& ground, const std::string& place) {
        finite(ground.point, place + ".point");
        require(ground.normal.allFinite() && ground.normal.norm() > 0, place + ".normal",
                "must be finite and not zero");
    }
    void shape(const Ball& ball, const std::string& place) {
        finite(ball.centre, place + ".centre");
        require(std::isfinite(ball.radius) && ball.radius > 0, place + ".radius", "must be above 0 m");
    }
    void shape(const Cuboid& box, const std::string& place) {
        finite(box.centre, place + ".centre");
        require(box.size.allFinite() && box.size.minCoeff() > 0, place + ".size", "must be above 0 m");
    }
    void shape(const MeshObstacle& mesh, const std::string& place) {
        require(mesh.field != nullptr, place + ".field", "is missing");
        finite(mesh.offset, place + ".offset");
    }
    void obstacle(const Obstacle& obstacle, const std::string& place) {
        std::visit([&](const auto& of_kind) { shape(of_kind, place + ".shape"); }, obstacle.shape);
        motion(obstacle.motion, place + ".motion");
        at_least(obstacle.friction, 0, place + ".friction", "must be 0 or more");
        require(obstacle.restitution >= 0 && obstacle.restitution <= 1, place + ".restitution", "must be from 0 to 1");
        require(obstacle.stiffness > 0 && obstacle.stiffness <= 1, place + ".stiffness", "must be above 0, to 1");
        keys(obstacle.temperature, kLeastTemperature, place + ".temperature");
        at_least(obstacle.heat_transfer, 0, place + ".heat_transfer", "must be 0 W/(m^2 K) or more");
    }
    /// place: of what holds both.
    void pair(const PairContact& contact, const std::string& place) {
        at_least(contact.friction, 0, place + ".contact.friction", "must be 0 or more");
        require(contact.restitution >= 0 && contact.restitution <= 1, place + ".contact.restitution",
                "must be from 0 to 1");
    }
    void air(const Keyed<double>& temperature, double heat_transfer, const std::string& place) {
        keys(temperature, kLeastTemperature, place + "air_temperature");
        at_least(heat_transfer, 0, place + "air_heat_transfer", "must be 0 W/(m^2 K) or more");
    }
    void heat_source(const HeatSource& source, const std::string& place) {
        shape(source.ball, place + ".ball");
        keys(source.move, place + ".move");
        keys(source.power, std::numeric_limits<double>::lowest(), place + ".power");
    }
    void hand(const Hand& hand, const std::string& place) {
        body(hand.body, place);
        require(hand.point.allFinite(), place + ".point", "must be finite");
        at_least(hand.stiffness, 0, place + ".stiffness", "must be 0 N/m or more");
        keys(hand.target, place + ".target");
        require(!std::isnan(hand.from) && !std::isnan(hand.until), place, "must come and go at times that are numbers");
    }

    Status status() const {
        if (wrong_.empty()) return Success{};
        return Error{ErrorCode::usage, wrong_};
    }

private:
    std::span<const Actor> actors_;
    std::string wrong_;
};

std::string numbered(const char* list, std::size_t number) { return list + ("[" + std::to_string(number) + "]"); }

} // namespace

Status check_world(const World& world, std::span<const Actor> actors) {
    Checker check(actors);
    check.require(!actors.empty(), "actors", "is empty: a simulation needs at least one body");
    for (std::size_t a = 0; a < actors.size(); ++a) check.actor(actors[a], numbered("actors", a));
    if (const Status found = check.status(); !found) return found; // particles are looked up in them

    check.finite(world.gravity, "world.gravity");
    check.keys(world.wind, "world.wind");
    check.at_least(world.air_density, 0, "world.air_density", "must be 0 kg/m^3 or more");
    check.at_least(world.body_friction, 0, "world.body_friction", "must be 0 or more");
    check.require(world.body_restitution >= 0 && world.body_restitution <= 1, "world.body_restitution",
                  "must be from 0 to 1");
    for (std::size_t p = 0; p < world.body_pairs.size(); ++p) {
        const BodyPair& pair = world.body_pairs[p];
        const std::string place = numbered("world.body_pairs", p);
        check.require(pair.first < actors.size() && pair.second < actors.size(), place,
                      "must name bodies that are there");
        check.pair(pair.contact, place);
    }
    for (std::size_t p = 0; p < world.group_pairs.size(); ++p) {
        const GroupPair& pair = world.group_pairs[p];
        const std::string place = numbered("world.group_pairs", p);
        const auto is_there = [&](std::size_t body) { return body < actors.size(); };
        check.require(std::ranges::all_of(pair.first, is_there) && std::ranges::all_of(pair.second, is_there), place,
                      "must name bodies that are there");
        check.pair(pair.contact, place);
    }
    check.air(world.air_temperature, world.air_heat_transfer, "world.");
    check.require(std::isfinite(world.heat_pace) && world.heat_pace > 0, "world.heat_pace", "must be above 0");
    for (std::size_t s = 0; s < world.heat_sources.size(); ++s)
        check.heat_source(world.heat_sources[s], numbered("world.heat_sources", s));
    for (std::size_t o = 0; o < world.obstacles.size(); ++o)
        check.obstacle(world.obstacles[o], numbered("world.obstacles", o));
    for (std::size_t p = 0; p < world.pins.size(); ++p) {
        const Pin& pin = world.pins[p];
        const std::string place = numbered("world.pins", p);
        check.body(pin.body, place);
        check.particles(pin.body, pin.particles, place);
        check.require(pin.body >= actors.size() || actors[pin.body].body->material.model != MaterialModel::rigid, place,
                      "holds a rigid body, which has no part that could be held; make it an obstacle");
        check.motion(pin.motion, place + ".motion");
    }
    for (std::size_t f = 0; f < world.forces.size(); ++f) {
        const RegionForce& force = world.forces[f];
        const std::string place = numbered("world.forces", f);
        check.body(force.body, place);
        check.particles(force.body, force.particles, place);
        check.keys(force.force, place + ".force");
    }
    for (std::size_t h = 0; h < world.hands.size(); ++h) check.hand(world.hands[h], numbered("world.hands", h));
    return check.status();
}

Status check_actor(const Actor& actor) {
    Checker check({});
    check.actor(actor, "actor");
    return check.status();
}

Status check_obstacle_motion(const Eigen::Isometry3d& pose, const Vec3d& velocity, const Vec3d& spin) {
    Checker check({});
    check.pose(pose, "pose");
    check.finite(velocity, "velocity");
    check.finite(spin, "spin");
    return check.status();
}

Status check_hands(std::span<const Hand> hands, std::size_t body_count) {
    const std::vector<Actor> bodies(body_count);
    Checker check(bodies);
    for (std::size_t h = 0; h < hands.size(); ++h) check.hand(hands[h], numbered("hands", h));
    return check.status();
}

Status check_air(const Keyed<double>& temperature, double heat_transfer) {
    Checker check({});
    check.air(temperature, heat_transfer, "");
    return check.status();
}

Status check_heat_sources(std::span<const HeatSource> sources) {
    Checker check({});
    for (std::size_t s = 0; s < sources.size(); ++s) check.heat_source(sources[s], numbered("heat_sources", s));
    return check.status();
}

} // namespace filigree
