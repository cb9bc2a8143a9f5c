#include "filigree/scene/scene_run.h"

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

constexpr float kCrushed = 0.1f; ///< of a cell's volume, below which the user is told

double percentile_95(std::vector<float>& values) {
    if (values.empty()) return 0;
    const auto place = values.begin() + std::ptrdiff_t(0.95 * double(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

/// A part of a volume in words; below 0: inside out.
std::string volume_text(float ratio) { return ratio > 0 ? fmt::format("{:.2g} %", 100 * ratio) : "less than none"; }

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
            angles.push_back(std::atan2(ours[v].cross(theirs[v]).norm(), ours[v].dot(theirs[v])) * 180 /
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
    if (const Status followed = run.follow(checks); !followed) return followed.error();
    run.recording_.totals.start = run.energy();
    for (std::size_t b = 0; b < ready.bodies.size(); ++b)
        if (const Status recorded = run.record_body(b); !recorded) return recorded.error();
    run.times_ = {}; // the start is no frame
    for (CheckTotals& check : run.recording_.checks) check = {};
    return run;
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
        const Result<FrameReport> report = simulation_.advance(silent);
        if (!report) return report.error();
        recording_.totals.add(*report);
        times_.add(*report);
        recording_.descent_causes.add(*report);
        recording_.last_volume_ratio = report->least_volume_ratio;
        note_crush(*report);
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

void SceneRun::note_crush(const FrameReport& report) {
    if (!(report.least_volume_ratio < kCrushed)) return;
    std::optional<Crush>& crush = recording_.doubts[report.most_crushed].crush;
    if (!crush) crush = Crush{.first = frame()};
    if (!(report.least_volume_ratio < crush->least)) return;
    crush->least = report.least_volume_ratio;
    crush->worst = frame();
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
    for (std::size_t b = 0; b < followers_.size(); ++b)
        if (const std::optional<std::uint64_t> first = recording_.doubts[b].first_lost)
            sentences.push_back(fmt::format("body '{}': the motion broke down at some of its surface, first in frame "
                                            "{}; parts of the driver were held where they were",
                                            ready_->bodies[b].name, *first));
    if (const std::uint64_t clamped = recording_.totals.clamped_particles)
        sentences.push_back(fmt::format("{} motions of particles were not finite or had to be limited: the motion is "
                                        "not to be trusted",
                                        with_commas(clamped)));
    for (std::size_t b = 0; b < followers_.size(); ++b) {
        const std::string& name = ready_->bodies[b].name;
        if (const std::string& reason = simulation_.why_rigid(b); !reason.empty())
            sentences.push_back(fmt::format("body '{}' is moved as a rigid body: {}; automatic_rigid = false keeps it "
                                            "elastic",
                                            name, reason));
        if (const std::optional<Crush>& crush = recording_.doubts[b].crush)
            sentences.push_back(fmt::format("body '{}': cells were crushed to {} of their volume in frame {}, first "
                                            "below a tenth in frame {}: what follows may be wrong",
                                            name, volume_text(crush->least), crush->worst, crush->first));
        if (const std::optional<FlowedOut>& flowed = recording_.doubts[b].flowed_out)
            sentences.push_back(
                fmt::format("body '{}': {} of its cells or particles flowed to seven times their length, "
                            "first in frame {}, and are elastic from there on; model = \"mpm\" is for "
                            "matter that flows so far",
                            name, with_commas(flowed->most), flowed->first));
    }
    if (recording_.last_volume_ratio <= 0)
        sentences.push_back("some cells are inside out at the end: the bodies were pressed or pulled too hard");
    if (const std::optional<std::string> energy = energy_warning()) sentences.push_back(*energy);
    if (const std::optional<std::string> descent = descent_warning()) sentences.push_back(*descent);
    return sentences;
}

std::optional<std::string> SceneRun::broke_down() const {
    const bool lost =
        std::ranges::any_of(recording_.doubts, [](const BodyDoubts& body) { return body.first_lost.has_value(); });
    if (recording_.totals.clamped_particles == 0 && !lost) return std::nullopt;
    return scene_->path + ": the motion broke down and is not to be trusted: bodies are too soft for their size or "
                          "speed. Make them smaller (scale, size), stiffer (young_modulus), slower, or give them "
                          "damping.";
}

/// Whether nothing in the scene does work on the bodies but gravity.
bool SceneRun::is_left_alone() const {
    return scene_->pins.empty() && scene_->hands.empty() && scene_->forces.empty() && scene_->wind.times.empty() &&
           scene_->wind.constant.isZero() &&
           std::none_of(scene_->obstacles.begin(), scene_->obstacles.end(),
                        [](const SceneObstacle& obstacle) { return obstacle.motion.moves(); });
}

std::optional<std::string> SceneRun::energy_warning() const {
    constexpr double kGrowth = 0.05, kNoise = 1e-8; // the latter: elastic energy of a strain of 1e-4
    if (frame() == 0 || !is_left_alone()) return std::nullopt;
    const Energy &start = recording_.totals.start, end = energy();
    double least = 0; // J, below which energies are rounding
    for (const ReadyBody& body : ready_->bodies)
        least += kNoise * body.body->material.young_modulus * body.report.cells.volume;
    // The potential has no zero of its own: what counts is how much of it came or went.
    const double had = start.kinetic + start.elastic + std::abs(end.potential - start.potential);
    const double grown = end.total() - start.total();
    if (grown <= kGrowth * had + least) return std::nullopt;
    return fmt::format("the energy grew by {:.3g} J although nothing did work: bodies start inside something, or the "
                       "motion is not to be trusted",
                       grown);
}

/// Descent has a damping of its own, which takes the place of what the scene asks for.
std::optional<std::string> SceneRun::descent_warning() const {
    const bool is_deadened = std::any_of(scene_->bodies.begin(), scene_->bodies.end(),
                                         [](const SceneBody& body) { return body.material.internal_damping > 0; });
    const bool is_springy = std::any_of(scene_->obstacles.begin(), scene_->obstacles.end(),
                                        [](const SceneObstacle& obstacle) { return obstacle.sets_restitution; });
    const std::uint64_t frames = recording_.totals.descent_frames;
    if (frames == 0 || !(is_deadened || is_springy)) return std::nullopt;
    const char* replaced = !is_springy    ? "internal_damping"
                           : !is_deadened ? "restitution"
                                          : "internal_damping and restitution";
    return fmt::format("{} frames were computed by descent, whose own damping takes the place of {}; mode = "
                       "\"explicit\" heeds {}",
                       with_commas(frames), replaced, is_deadened && is_springy ? "them" : "it");
}

} // namespace filigree
