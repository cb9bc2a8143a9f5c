#include "filigree/scene/body_motion.h"

#include "filigree/scene/recording.h"

namespace filigree {

namespace {

std::span<const Index> pieces_of(const DroppedBody& dropped, std::vector<Index> CarriedByPieces::*which) {
    if (!dropped.breaking) return {};
    return dropped.breaking->carried.*which;
}

} // namespace

Moment start_of(const DroppedBody& dropped) {
    Moment moment;
    moment.pose.positions = driver_positions(*dropped.model);
    moment.pose.gradients.assign(moment.pose.positions.size(), Mat3f::Identity());
    const Vectors& rest = dropped.body->rest;
    for (std::size_t i = 0; i < rest.size(); ++i) moment.particles.push_back(rest[i] / float(dropped.scale));
    return moment;
}

BodyMotion::BodyMotion(std::shared_ptr<const DroppedBody> dropped, Simulation simulation)
    : dropped_(std::move(dropped)), simulation_(std::move(simulation)), last_(start_of(*dropped_).pose) {
    driver_ = attach(last_.positions, pieces_of(*dropped_, &CarriedByPieces::driver));
    start_ = simulation_.save();
}

Result<BodyMotion> BodyMotion::create(std::shared_ptr<const DroppedBody> dropped, const RunContext& context) {
    Actor actor;
    actor.body = dropped->body;
    actor.fracture = dropped->fracture;
    Result<Simulation> simulation = Simulation::create(dropped->world, {actor}, {}, context);
    if (!simulation) return simulation.error();
    return BodyMotion(std::move(dropped), std::move(*simulation));
}

/// Points in model units that go along with the body.
std::size_t BodyMotion::attach(std::vector<Vec3f> points, std::span<const Index> pieces) {
    for (Vec3f& p : points) p *= float(dropped_->scale);
    return pieces.empty() ? simulation_.attach(0, points, RunContext())
                          : simulation_.attach(0, points, pieces, RunContext());
}

Status BodyMotion::rewind(const RunContext& context) {
    if (Status restored = simulation_.restore(start_); !restored) return restored;
    last_ = start_of(*dropped_).pose;
    return simulation_.set_hands({}, context);
}

Status BodyMotion::set_hands(std::vector<Hand> hands, const RunContext& context) {
    return simulation_.set_hands(std::move(hands), context);
}

Result<FrameReport> BodyMotion::advance(const RunContext& context) { return simulation_.advance(context); }

Moment BodyMotion::look(bool with_full) {
    const RunContext always; // a frame that was simulated is delivered
    const float to_units = float(1 / dropped_->scale);
    const auto far = static_cast<float>(kFarInAFrame * bounds(dropped_->model->mesh.positions).diagonal());
    Moment moment;
    moment.frame = simulation_.frame();
    moment.fracture = simulation_.fracture(0);
    moment.pose.positions.resize(last_.positions.size());
    moment.pose.gradients.resize(last_.positions.size());
    simulation_.attached(driver_, moment.pose.positions, moment.pose.gradients, always);
    for (Vec3f& p : moment.pose.positions) p *= to_units;
    hold_lost(last_, moment.pose, far, float(kFarInAFrame));
    last_ = moment.pose;
    const Vectors& particles = simulation_.positions(0);
    moment.particles.reserve(particles.size());
    for (std::size_t i = 0; i < particles.size(); ++i) moment.particles.push_back(to_units * particles[i]);
    if (!with_full) return moment;
    if (!all_vertices_)
        all_vertices_ = attach(dropped_->model->mesh.positions, pieces_of(*dropped_, &CarriedByPieces::vertices));
    moment.full.resize(dropped_->model->mesh.vertex_count());
    simulation_.attached(*all_vertices_, moment.full, {}, always);
    for (Vec3f& p : moment.full) p *= to_units;
    return moment;
}

} // namespace filigree
