#include "filigree/scene/scene_run.h"

#include "filigree/core/math.h"
#include "filigree/core/now_seconds.h"
#include "filigree/core/text.h"
#include "filigree/melting/composite_surface.h"
#include "filigree/mesh/normals.h"
#include "filigree/scene/saved_state.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace filigree {

namespace {

/// Frames in each of which the energy is looked at, and then every so many: it costs a twenty-fifth of a frame.
constexpr std::uint64_t kEveryFrameUntil = 8, kEnergyFrames = 4;
/// Elastic energy of a strain of 1e-4, as a part of the stiffness: rounding.
constexpr double kEnergyNoise = 1e-8;

double percentile_95(std::vector<float>& values) {
    if (values.empty()) return 0;
    const auto place = values.begin() + std::ptrdiff_t(0.95 * double(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

/// A frame's distances of the restored mesh from the one that the particles carry, of vertices that are not about to be
/// the particles' surface; diagonal: of the body, m.
void add_frame(CheckTotals& check, const Mesh& mesh, std::span<const Vec3f> restored, std::span<const Vec3f> direct,
               std::span<const float> renewal, double diagonal, const RunContext& context) {
    const auto is_old = [&](std::size_t v) { return renewal[v] <= CompositeMesher::kFadeBegin; };
    double squares = 0, fading_squares = 0, most = 0;
    std::size_t old = 0, fading = 0;
    for (std::size_t v = 0; v < direct.size(); ++v) {
        const double distance = (direct[v] - restored[v]).cast<double>().norm();
        if (is_old(v)) {
            ++old;
            squares += distance * distance;
            most = std::max(most, distance);
        } else if (renewal[v] < CompositeMesher::kFadeEnd) {
            ++fading;
            fading_squares += distance * distance;
        }
    }
    const std::vector<Vec3f> ours = vertex_normals(mesh, restored, context),
                             theirs = vertex_normals(mesh, direct, context);
    std::vector<float> angles;
    for (std::size_t v = 0; v < ours.size(); ++v)
        if (is_old(v) && !ours[v].isZero() && !theirs[v].isZero())
            angles.push_back(math::atan2(ours[v].cross(theirs[v]).norm(), ours[v].dot(theirs[v])) * 180 /
                             std::numbers::pi_v<float>);
    const double p95 = percentile_95(angles),
                 rms = std::sqrt(squares / double(std::max<std::size_t>(old, 1))) / diagonal;
    const double fading_rms = std::sqrt(fading_squares / double(std::max<std::size_t>(fading, 1))) / diagonal;
    check.worst_fading_rms = std::max(check.worst_fading_rms, fading_rms);
    check.rms_sum += rms;
    check.worst_rms = std::max(check.worst_rms, rms);
    check.worst_max = std::max(check.worst_max, most / diagonal);
    check.p95_sum += p95;
    check.worst_p95 = std::max(check.worst_p95, p95);
}

} // namespace

SceneRun::SceneRun(const SceneFile& scene, const ReadyScene& ready, Simulation simulation, unsigned threads)
    : scene_(&scene), ready_(&ready), always_(threads), simulation_(std::move(simulation)) {}

Result<SceneRun> SceneRun::create(const SceneFile& scene, const ReadyScene& ready, bool checks,
                                  const RunContext& context) {
    Result<Simulation> simulation = Simulation::create(ready.world, ready.actors, scene.step, context);
    if (!simulation) return simulation.error();
    SceneRun run(scene, ready, std::move(*simulation), context.threads());
    if (const Status followed = run.follow_characters(); !followed) return followed.error();
    if (const Status followed = run.follow(checks); !followed) return followed.error();
    run.recording_.totals.start = run.energy();
    if (left_alone_from(scene) <= 0) run.recording_.energy.begin(run.recording_.totals.start);
    for (std::size_t b = 0; b < ready.bodies.size(); ++b)
        if (const Status recorded = run.record_body(b); !recorded) return recorded.error();
    run.times_ = {}; // the start is no frame
    for (CheckTotals& check : run.recording_.checks) check = {};
    return run;
}

Status SceneRun::follow_characters() {
    for (std::size_t b = 0; b < ready_->bodies.size(); ++b) {
        const ReadyBody& body = ready_->bodies[b];
        if (!body.follow) continue;
        Following& one = following_.emplace_back(body, ready_->actors[b], b, scene_->step.frames_per_second, always_);
        if (const Status begun = one.begin(simulation_); !begun)
            return scene_error(*scene_, body.follow->line, begun.error().code, begun.error().message);
    }
    return Success{};
}

Status SceneRun::follow(bool checks) {
    for (std::size_t b = 0; b < ready_->bodies.size(); ++b) {
        const ReadyBody& body = ready_->bodies[b];
        const auto attach = [&](std::vector<Vec3f> points, std::span<const Index> pieces) {
            points = body.in_metres(std::move(points));
            return pieces.empty() ? simulation_.attach(b, points, always_)
                                  : simulation_.attach(b, points, pieces, always_);
        };
        const std::size_t driver = attach(driver_positions(body.model), body.pieces.driver);
        Result<Restorer> restorer = Restorer::create(body.model, {}, always_);
        if (!restorer) return restorer.error();
        Follower& follower = followers_.emplace_back(Follower{driver, {}, std::move(*restorer), {}});
        follower.restored.resize(body.model.vertex_count());
        if (checks)
            follower.direct =
                attach({body.model.positions().begin(), body.model.positions().end()}, body.pieces.vertices);
    }
    recording_.poses.assign(ready_->bodies.size(), {scene_->step.frames_per_second, {}});
    recording_.matter.resize(ready_->bodies.size());
    recording_.doubts.resize(ready_->bodies.size());
    if (scene_->picture.particles) recording_.particles.resize(ready_->bodies.size());
    if (checks) recording_.checks.resize(ready_->bodies.size());
    return Success{};
}

Status SceneRun::resume(std::string_view state, const std::string& name) {
    return unpack_state(state, name, ready_->hash, recording_, simulation_);
}

std::string SceneRun::save() const { return pack_state(recording_, simulation_, ready_->hash); }

Status SceneRun::advance_to(std::uint64_t last, const RunContext& context) {
    const std::uint64_t first = frame();
    RunContext silent = context; // the progress is that of the frames
    silent.progress = nullptr;
    while (frame() < last) {
        context.report("simulating", double(frame() - first) / double(last - first));
        for (Following& one : following_)
            if (const Status set = one.next(simulation_); !set) return set;
        const Result<FrameReport> report = simulation_.advance(silent);
        if (!report) return report.error();
        recording_.totals.add(*report);
        times_.add(*report);
        note_doubts(*report);
        note_flow(*report);
        for (std::size_t b = 0; b < followers_.size(); ++b)
            if (const Status recorded = record_body(b); !recorded) return recorded;
    }
    context.report("simulating", 1);
    return Success{};
}

/// The driver's pose in metres, the mesh that follows from it, and how far that is from the truth.
Status SceneRun::record_body(std::size_t b) {
    const double start = now_seconds();
    const ReadyBody& body = ready_->bodies[b];
    Follower& follower = followers_[b];
    Pose& pose = recording_.poses[b].frames.emplace_back();
    pose.positions.resize(body.model.driver().vertices.size());
    pose.gradients.resize(pose.positions.size());
    simulation_.attached(follower.driver, pose.positions, pose.gradients, always_);
    for (Following& one : following_)
        if (one.body() == b)
            one.carry_left_out(simulation_.frame(), body.model.driver().vertices, pose.positions, pose.gradients);
    for (Mat3f& gradient : pose.gradients) gradient *= float(body.scale);
    const double moved = now_seconds();
    hold_lost_of(b);
    if (const Status restored = follower.restorer.positions(pose, follower.restored, always_); !restored)
        return restored;
    times_.coupling += moved - start;
    times_.restore += now_seconds() - moved;
    if (follower.direct) check_body(b);
    if (body.body->material.model == MaterialModel::mpm) {
        MatterParticles& matter = recording_.matter[b].emplace_back(simulation_.matter(b));
        matter.temperatures = {}; // what the surface is not made of
        matter.liquid = {};
    }
    if (recording_.particles.empty()) return Success{};
    const Vectors& particles = simulation_.positions(b);
    std::vector<Vec3f>& drawn = recording_.particles[b].emplace_back();
    for (std::size_t i = 0; i < particles.size(); ++i) drawn.push_back(particles[i]);
    return Success{};
}

void SceneRun::hold_lost_of(std::size_t b) {
    std::vector<Pose>& frames = recording_.poses[b].frames;
    if (frames.size() < 2) return;
    const ReadyBody& body = ready_->bodies[b];
    const auto far = static_cast<float>(kFarInAFrame * body.scale * bounds(body.model.mesh.positions).diagonal());
    const std::size_t held = hold_lost(frames[frames.size() - 2], frames.back(), far, float(kFarInAFrame * body.scale));
    std::optional<std::uint64_t>& first = recording_.doubts[b].first_lost;
    if (held > 0 && !first) first = frame();
}

void SceneRun::note_doubts(const FrameReport& report) {
    if (report.clamped_particles > 0 && !recording_.first_loss)
        recording_.first_loss = {frame(), report.clamped_body, report.clamped_at};
    if (report.unstable_substeps > 0) {
        std::optional<Unstable>& unstable = recording_.doubts[report.unstable_body].unstable;
        if (!unstable) unstable = Unstable{.first = frame()};
        ++unstable->frames;
        unstable->substeps += report.unstable_substeps;
    }
    if (report.least_volume_ratio <= 0)
        for (std::size_t b = 0; b < followers_.size(); ++b) {
            const InvertedCells cells = simulation_.inverted(b);
            if (cells.count == 0) continue;
            if (!recording_.doubts[b].inversion) recording_.doubts[b].inversion.emplace();
            recording_.doubts[b].inversion->add(frame(), cells);
        }
    watch_energy();
}

/// Whether there is more energy than there was when all was last left to itself.
void SceneRun::watch_energy() {
    if (frame() > kEveryFrameUntil && frame() % kEnergyFrames != 0) return;
    EnergyWatch& watch = recording_.energy;
    if (!watch.has_begun) {
        if (simulation_.time() >= left_alone_from(*scene_)) watch.begin(energy());
        return;
    }
    double least = 0; // J, below which energies are rounding
    for (const ReadyBody& body : ready_->bodies)
        least += kEnergyNoise * body.body->material.young_modulus * body.report.cells.volume;
    const double grown = watch.excess(energy(), allowed_growth(*scene_), least);
    if (!(grown > watch.grown)) return;
    if (watch.first == 0) watch.first = frame();
    watch.worst = frame();
    watch.grown = grown;
    watch.share = grown / std::max(watch.moving + watch.potential - watch.least_potential, least);
    watch.body = fastest_body();
    watch.place = middle_of(watch.body);
}

std::size_t SceneRun::fastest_body() const {
    std::size_t fastest = 0;
    double most = -1;
    for (std::size_t b = 0; b < followers_.size(); ++b) {
        const Vectors& velocities = simulation_.velocities(b);
        const std::vector<float>& mass = simulation_.body(b).mass;
        double twice = 0;
        for (std::size_t i = 0; i < velocities.size(); ++i) twice += double(mass[i] * velocities[i].squaredNorm());
        if (twice <= most) continue;
        fastest = b;
        most = twice;
    }
    return fastest;
}

Vec3f SceneRun::middle_of(std::size_t body) const {
    Vec3d middle = Vec3d::Zero();
    const Vectors& positions = simulation_.positions(body);
    for (std::size_t i = 0; i < positions.size(); ++i) middle += positions[i].cast<double>() / double(positions.size());
    return middle.cast<float>();
}

void SceneRun::note_flow(const FrameReport& report) {
    if (report.flowed_out == 0) return;
    std::optional<FlowedOut>& flowed = recording_.doubts[report.most_flowed].flowed_out;
    if (!flowed) flowed = FlowedOut{.first = frame()};
    flowed->most = std::max(flowed->most, std::uint64_t{report.flowed_out});
}

void SceneRun::check_body(std::size_t b) {
    const ReadyBody& body = ready_->bodies[b];
    const Follower& follower = followers_[b];
    std::vector<Vec3f> direct(follower.restored.size());
    const double start = now_seconds();
    simulation_.attached(*follower.direct, direct, {}, always_);
    times_.direct += now_seconds() - start;
    const double diagonal = body.scale * bounds(body.model.mesh.positions).diagonal();
    std::vector<float> renewal(direct.size());
    simulation_.renewal(*follower.direct, renewal);
    add_frame(recording_.checks[b], body.model.mesh, follower.restored, direct, renewal, diagonal, always_);
}

Result<Mesh> SceneRun::mesh(std::size_t body, std::size_t frame, const RunContext& context) const {
    Result<Mesh> mesh = followers_[body].restorer.mesh(recording_.poses[body].frames[frame], context);
    if (mesh) mesh->origin = ready_->origin;
    return mesh;
}

std::vector<std::string> SceneRun::warnings() const {
    std::vector<std::string> sentences;
    for (const StartOverlap& overlap : simulation_.start_overlaps()) {
        const SceneObstacle& obstacle = scene_->obstacles[overlap.obstacle];
        const std::string name = obstacle.mesh.empty() ? obstacle.shape : obstacle.mesh;
        const ReadyBody& body = ready_->bodies[overlap.body];
        std::string sentence = overlap.sentence(fmt::format("body '{}'", body.name),
                                                fmt::format("obstacle '{}' (line {})", name, obstacle.line));
        if (!body.pieces.empty() && !overlap.is_inside)
            sentence += fmt::format("; it breaks while it is pushed, and a frame of up to {} substeps may take minutes",
                                    with_commas(kMostSubsteps));
        sentences.push_back(sentence);
    }
    const auto add = [&](const std::string& sentence) {
        if (!sentence.empty()) sentences.push_back(sentence);
    };
    for (std::size_t b = 0; b < followers_.size(); ++b)
        if (const std::optional<std::uint64_t> first = recording_.doubts[b].first_lost)
            sentences.push_back(fmt::format("body '{}': the motion broke down at some of its surface, first in frame "
                                            "{}; parts of the driver were held where they were",
                                            ready_->bodies[b].name, *first));
    add(loss_warning());
    for (std::size_t b = 0; b < followers_.size(); ++b) {
        const std::string& reason = simulation_.why_rigid(b);
        if (!reason.empty() && ready_->bodies[b].body->cells.cells.size() >= kFewestElasticCells)
            sentences.push_back(fmt::format("body '{}' is moved as a rigid body: {}; automatic_rigid = false keeps it "
                                            "elastic",
                                            ready_->bodies[b].name, reason));
        add(unstable_warning(b));
        add(inversion_warning(b));
        add(flow_warning(b));
    }
    add(energy_warning());
    return sentences;
}

std::vector<std::string> SceneRun::notes() const {
    std::vector<std::string> sentences;
    for (std::size_t b = 0; b < followers_.size(); ++b)
        if (const std::string& reason = simulation_.why_rigid(b);
            !reason.empty() && ready_->bodies[b].body->cells.cells.size() < kFewestElasticCells)
            sentences.push_back(fmt::format("body '{}' is moved as a rigid body: {}", ready_->bodies[b].name, reason));
    return sentences;
}

std::string SceneRun::place_text(const Vec3f& place) const {
    const Vec3d at = place.cast<double>() + ready_->origin;
    return fmt::format("({:.3g}, {:.3g}, {:.3g}) m", at.x(), at.y(), at.z());
}

std::string SceneRun::loss_warning() const {
    const std::optional<FirstLoss>& first = recording_.first_loss;
    if (!first) return "";
    return fmt::format("{} motions of particles were not finite or had to be limited, first in frame {}, body '{}', "
                       "near {}: make the body smaller (scale, size), stiffer (young_modulus) or slower",
                       with_commas(recording_.totals.clamped_particles), first->frame, ready_->bodies[first->body].name,
                       place_text(first->place));
}

std::string SceneRun::inversion_warning(std::size_t b) const {
    const std::optional<Inversion>& inversion = recording_.doubts[b].inversion;
    if (!inversion) return "";
    const ReadyBody& body = ready_->bodies[b];
    const std::string frames = inversion->frames == 1 ? fmt::format("frame {}", inversion->first)
                                                      : fmt::format("{} of the frames {} to {}", inversion->frames,
                                                                    inversion->first, inversion->last);
    return fmt::format("body '{}': cells were inside out at the end of {}; in frame {} {} of {}, the worst near {}: "
                       "make the body stiffer (young_modulus; it has {:.0e}), smaller (scale, size) or slower, or pull "
                       "and press it less",
                       body.name, frames, inversion->worst, with_commas(inversion->cells),
                       with_commas(body.report.cells.cells), place_text(inversion->place),
                       body.body->material.young_modulus);
}

std::string SceneRun::unstable_warning(std::size_t b) const {
    const std::optional<Unstable>& unstable = recording_.doubts[b].unstable;
    if (!unstable) return "";
    const ReadyBody& body = ready_->bodies[b];
    const Material& material = body.body->material;
    const std::string damping = material.internal_damping > 0
                                    ? fmt::format("internal_damping (it has {:.0e}), ", material.internal_damping)
                                    : "";
    return fmt::format("body '{}': {} substeps of {} frames, first in frame {}, were longer than is stable, as a frame "
                       "has {} at most: take a lower young_modulus (it has {:.0e}), {}fewer particles or more "
                       "frames_per_second",
                       body.name, with_commas(unstable->substeps), unstable->frames, unstable->first,
                       with_commas(kMostSubsteps), material.young_modulus, damping);
}

std::string SceneRun::flow_warning(std::size_t b) const {
    const std::optional<FlowedOut>& flowed = recording_.doubts[b].flowed_out;
    if (!flowed) return "";
    return fmt::format("body '{}': {} of its cells or particles flowed to seven times their length, first in frame {}, "
                       "and are elastic from there on; model = \"mpm\" is for matter that flows so far",
                       ready_->bodies[b].name, with_commas(flowed->most), flowed->first);
}

std::string SceneRun::energy_warning() const {
    const EnergyWatch& watch = recording_.energy;
    if (!(watch.grown > 0)) return "";
    const std::string part = watch.share < 10 ? fmt::format(", {:.2g} % of what there was", 100 * watch.share) : "";
    return fmt::format("the energy grew by {:.3g} J{}, first in frame {} and most in frame "
                       "{}, and nothing did that work; body '{}', near {}, moves most: move apart what starts inside "
                       "something, or make it slower or softer (young_modulus)",
                       watch.grown, part, watch.first, watch.worst, ready_->bodies[watch.body].name,
                       place_text(watch.place));
}

/// The skin of a character crushes cells that follow it; they open again with it.
bool SceneRun::is_inside_out() const {
    for (std::size_t b = 0; b < recording_.doubts.size(); ++b)
        if (recording_.doubts[b].inversion && !ready_->bodies[b].follow) return true;
    return false;
}

std::optional<std::string> SceneRun::broke_down() const {
    std::vector<std::string> what;
    const auto any = [&](const auto& has) { return std::ranges::any_of(recording_.doubts, has); };
    if (recording_.totals.clamped_particles > 0 ||
        any([](const BodyDoubts& body) { return body.first_lost.has_value(); }))
        what.emplace_back("the motion broke down");
    if (any([](const BodyDoubts& body) { return body.unstable.has_value(); }))
        what.emplace_back("frames were not stepped stably");
    if (is_inside_out()) what.emplace_back("cells were inside out");
    if (recording_.energy.grown > 0) what.emplace_back("energy came from nowhere");
    if (what.empty()) return std::nullopt;
    return fmt::format("{}: {}, so the result is not to be trusted; the warnings say where, and what to change.",
                       scene_->path, fmt::join(what, ", "));
}

} // namespace filigree
