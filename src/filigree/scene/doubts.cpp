#include "filigree/scene/doubts.h"

#include "filigree/scene.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kForEver = std::numeric_limits<double>::infinity();
constexpr double kGrowth = 0.01, kGrowthOfWhatBreaks = 0.05, kGrowthAfterWork = 0.05;

double last_time(const std::vector<double>& times) { return times.empty() ? 0 : times.back(); }

double end_of(const RigidMotion& motion) {
    return std::max(last_time(motion.move.times), last_time(motion.angle.times));
}

/// When something that pushes has come to nothing.
double end_of(const Keyed<Vec3d>& push) {
    const Vec3d& last = push.times.empty() ? push.constant : push.values.back();
    return last.isZero() ? last_time(push.times) : kForEver;
}

/// Whether heat comes to a body or goes: what melts and sets is stiff in another shape.
bool is_heated(const SceneFile& scene, const SceneBody& body) {
    if (!body.material.melts()) return false;
    const auto warms = [](const SceneObstacle& obstacle) { return obstacle.obstacle.heat_transfer > 0; };
    return scene.world.air_heat_transfer > 0 || !scene.world.heat_sources.empty() || body.material.heating != 0 ||
           body.material.conductivity > 0 || std::ranges::any_of(scene.obstacles, warms);
}

} // namespace

void Inversion::add(std::uint64_t frame, const InvertedCells& found) {
    if (frames == 0) first = frame;
    last = frame;
    ++frames;
    if (!(found.least < least)) return;
    worst = frame;
    cells = found.count;
    least = found.least;
    place = found.place;
}

void EnergyWatch::begin(const Energy& energy) {
    has_begun = true;
    total = energy.total();
    moving = energy.kinetic + energy.elastic;
    potential = least_potential = energy.potential;
}

double EnergyWatch::excess(const Energy& energy, double allowed, double least) {
    least_potential = std::min(least_potential, energy.potential);
    const double had = moving + potential - least_potential, more = energy.total() - total;
    return more > allowed * had + least ? more : 0;
}

double left_alone_from(const SceneFile& scene) {
    if (!scene.follows.empty()) return kForEver;
    double from = end_of(scene.world.wind);
    for (const ScenePin& pin : scene.pins) from = std::max(from, end_of(pin.motion));
    for (const SceneObstacle& obstacle : scene.obstacles) from = std::max(from, end_of(obstacle.obstacle.motion));
    for (const SceneForce& force : scene.forces) from = std::max(from, end_of(force.newtons));
    for (const SceneHand& hand : scene.hands) from = std::max(from, hand.hand.until);
    for (const SceneBody& body : scene.bodies)
        if (is_heated(scene, body)) from = kForEver;
    return from;
}

double allowed_growth(const SceneFile& scene) {
    double allowed = scene.fractures.empty() ? kGrowth : kGrowthOfWhatBreaks;
    if (left_alone_from(scene) > 0) allowed = std::max(allowed, kGrowthAfterWork);
    return allowed;
}

} // namespace filigree
