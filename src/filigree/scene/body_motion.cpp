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
    dead_.clear();
    surface_frame_ = 0;
    surface_ = nullptr;
    if (Status out = simulation_.set_heat_sources({}); !out) return out;
    return simulation_.set_hands({}, context);
}

Status BodyMotion::set_hands(std::vector<Hand> hands, const RunContext& context) {
    return simulation_.set_hands(std::move(hands), context);
}

Status BodyMotion::set_air_temperature(double kelvins) {
    return simulation_.set_air({{}, {}, kelvins}, dropped_->world.air_heat_transfer);
}

Status BodyMotion::set_heat_sources(std::vector<HeatSource> sources) {
    return simulation_.set_heat_sources(std::move(sources));
}

Result<FrameReport> BodyMotion::advance(const RunContext& context) { return simulation_.advance(context); }

/// The surface of a frame is made once, as what died in it stays dead.
void BodyMotion::look_at_melt(const MomentWishes& wishes, Moment& moment) {
    const RunContext always;
    const MatterParticles matter = scaled(simulation_.matter(0), 1 / dropped_->scale);
    if (moment.frame != surface_frame_) {
        surface_frame_ = moment.frame;
        Result<std::optional<Mesh>> made = dropped_->melting->surface(moment.pose, matter, dead_, always);
        surface_ = made && *made ? std::make_shared<const Mesh>(std::move(**made)) : nullptr;
    }
    moment.surface = surface_;
    if (!wishes.temperatures) return;
    if (!surface_) {
        moment.temperatures = dropped_->melting->temperatures(matter);
        return;
    }
    const MatterAtPoints near(surface_->positions, matter.positions, double(matter.spacing), always);
    for (std::size_t v = 0; v < near.size(); ++v)
        moment.temperatures.push_back(near.at<float>(v, matter.temperatures, matter.temperatures.front()));
}

Moment BodyMotion::look(const MomentWishes& wishes) {
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
    if (dropped_->melting) look_at_melt(wishes, moment);
    if (!wishes.full) return moment;
    const Model& model = *dropped_->model;
    if (!all_vertices_)
        all_vertices_ = attach({model.positions().begin(), model.positions().end()},
                               pieces_of(*dropped_, &CarriedByPieces::vertices));
    moment.full.resize(model.vertex_count());
    simulation_.attached(*all_vertices_, moment.full, {}, always);
    for (Vec3f& p : moment.full) p *= to_units;
    return moment;
}

} // namespace filigree
