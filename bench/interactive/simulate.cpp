#include "simulate.h"

#include "../heap.h"
#include "cell_forces.h"
#include "filigree/physics/body/make_cells.h"
#include "timing.h"

#include "filigree/mesh/normals.h"
#include "filigree/physics/simulation.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace filigree::bench {

namespace {

constexpr unsigned kRuns = 5;
constexpr std::size_t kFrames = 60, kFallFrames = 90, kGrowthFrames = 8;
constexpr std::size_t kCheckEvery = 5; // frames between comparisons with direct attachment
constexpr double kDropHeight = 0.3;    // m
constexpr double kYoung = 1e6, kSoftYoung = 1e5;

using Corners = std::array<std::size_t, 3>;

/// Of one frame, s.
struct Phases {
    double elastic = 0, contacts = 0, other = 0, coupling = 0, restore = 0;
    double direct = 0; ///< what would stand for the last two; 0 where it was not measured
    double total() const { return elastic + contacts + other + coupling + restore; }
    /// Phase by phase.
    void keep_least(const Phases& run) {
        for (const auto phase : {&Phases::elastic, &Phases::contacts, &Phases::other, &Phases::coupling,
                                 &Phases::restore, &Phases::direct})
            this->*phase = std::min(this->*phase, run.*phase);
    }
};

struct Scene {
    World world;
    Actor actor;
    StepOptions step;
    std::size_t frames = kFrames;
};

/// What goes along with a scene's body, and is measured with it.
class Follower {
public:
    virtual ~Follower() = default;
    virtual void start(Simulation& simulation, const RunContext& context) = 0;
    virtual void follow(Simulation& simulation, Phases& phases, const RunContext& context) = 0;
};

struct Timing {
    std::vector<Phases> frames;
    std::vector<unsigned> substeps; ///< of each frame
    std::string state;              ///< at the end

    double mean(double (*value)(const Phases&)) const {
        double sum = 0;
        for (const Phases& frame : frames) sum += value(frame);
        return sum / double(frames.size());
    }
    double milliseconds() const {
        return 1e3 * mean([](const Phases& p) { return p.total(); });
    }
    double mean_substeps() const {
        double sum = 0;
        for (const unsigned count : substeps) sum += count;
        return sum / double(substeps.size());
    }
};

void time_run(const Scene& scene, const RunContext& context, Follower* follower, Timing& timing) {
    const bool is_first = timing.frames.empty();
    Simulation simulation = Simulation::create(scene.world, {scene.actor}, scene.step, context).value();
    if (follower) follower->start(simulation, context);
    for (std::size_t frame = 0; frame < scene.frames; ++frame) {
        Phases phases;
        const double begin = now_seconds();
        const FrameReport report = simulation.advance(context).value();
        phases.elastic = report.elastic_seconds;
        phases.contacts = report.contact_seconds;
        phases.other = now_seconds() - begin - phases.elastic - phases.contacts;
        if (follower) follower->follow(simulation, phases, context);
        if (!is_first) {
            timing.frames[frame].keep_least(phases);
            continue;
        }
        timing.frames.push_back(phases);
        timing.substeps.push_back(report.substeps);
    }
    timing.state = simulation.save();
}

std::size_t differing_bytes(const std::string& a, const std::string& b) {
    std::size_t count = std::max(a.size(), b.size()) - std::min(a.size(), b.size());
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) count += a[i] != b[i];
    return count;
}

/// A box of so many particles; fem and springs have one at each corner of a cell, meshfree one in each cell.
std::shared_ptr<const Body> make_box(const Corners& particles, const Material& material) {
    const std::size_t less = material.model == MaterialModel::meshfree ? 0 : 1;
    const double spacing = 1 / double(particles[0] - less);
    return std::make_shared<Body>(
        make_body(box_cells(particles[0] - less, particles[1] - less, particles[2] - less, spacing), material));
}

/// Held where its x is least, in gravity, without air.
Scene swing(const Corners& particles, MaterialModel model, double young_modulus) {
    Material material;
    material.model = model;
    material.young_modulus = young_modulus;
    material.damping = 0;
    Scene scene;
    scene.actor.body = make_box(particles, material);
    const std::vector<float>& x = scene.actor.body->rest.x;
    const std::size_t count = scene.actor.body->particle_count();
    const float end =
        *std::min_element(x.begin(), x.begin() + std::ptrdiff_t(count)) + 0.25f * float(scene.actor.body->spacing());
    Pin pin;
    for (Index i = 0; i < count; ++i)
        if (x[i] < end) pin.particles.push_back(i);
    scene.world.pins.push_back(std::move(pin));
    return scene;
}

std::vector<Vectors> positions_of_frames(const Scene& scene, std::size_t steps_a_frame, const RunContext& context) {
    Simulation simulation = Simulation::create(scene.world, {scene.actor}, scene.step, context).value();
    std::vector<Vectors> frames;
    for (std::size_t frame = 0; frame < scene.frames; ++frame) {
        for (std::size_t step = 0; step < steps_a_frame; ++step) simulation.advance(context).value();
        frames.push_back(simulation.positions(0));
    }
    return frames;
}

/// RMS over particles and frames between a scene and the same with (about) four times as many substeps, in diagonals.
double error_of_steps(const Scene& scene, double substeps, const RunContext& context) {
    Scene fine = scene;
    const double steps = std::ceil(2 * substeps); // of two substeps at least
    fine.step.frames_per_second *= steps;
    fine.step.mode = StepMode::explicit_steps;
    const std::vector<Vectors> ours = positions_of_frames(scene, 1, context),
                               theirs = positions_of_frames(fine, std::size_t(steps), context);
    double squares = 0;
    Box box;
    const std::size_t count = scene.actor.body->particle_count();
    for (std::size_t i = 0; i < count; ++i) {
        box.extend(scene.actor.body->rest[i].cast<double>());
        for (std::size_t frame = 0; frame < ours.size(); ++frame)
            squares += double((ours[frame][i] - theirs[frame][i]).squaredNorm());
    }
    return std::sqrt(squares / double(count * ours.size())) / box.diagonal();
}

/// A driver moved by its body with all detail restored, and the detail attached to the body directly.
class DetailFollower : public Follower {
public:
    DetailFollower(const Model& model, double scale, const RunContext& context)
        : model_(model), scale_(scale), restorer_(Restorer::create(model, {}, context).value()) {
        pose_.positions.resize(model.driver().vertices.size());
        pose_.gradients.resize(pose_.positions.size());
        restored_.resize(model.mesh.vertex_count());
        direct_.resize(restored_.size());
    }

    void start(Simulation& simulation, const RunContext& context) override {
        const auto attach = [&](std::vector<Vec3f> points) {
            for (Vec3f& p : points) p *= float(scale_);
            return simulation.attach(0, points, context);
        };
        driver_ = attach(driver_positions(model_));
        all_ = attach(model_.mesh.positions);
        frame_ = 0;
        rms_.clear();
    }

    void follow(Simulation& simulation, Phases& phases, const RunContext& context) override {
        const double begin = now_seconds();
        simulation.attached(driver_, pose_.positions, pose_.gradients, context);
        for (Mat3f& gradient : pose_.gradients) gradient *= float(scale_);
        const double moved = now_seconds();
        restorer_.positions(pose_, restored_, context).value();
        phases.coupling = moved - begin;
        phases.restore = now_seconds() - moved;
        if (frame_++ % kCheckEvery != 0) return;
        const double start = now_seconds();
        simulation.attached(all_, direct_, {}, context);
        phases.direct = now_seconds() - start;
        compare(context);
    }

    // Of the frames that were compared; positions in diagonals, normals in degrees.
    double worst_rms() const { return *std::max_element(rms_.begin(), rms_.end()); }
    double mean_rms() const {
        double sum = 0;
        for (const double rms : rms_) sum += rms;
        return sum / double(rms_.size());
    }
    double worst_max() const { return worst_max_; }
    double worst_normal_p95() const { return worst_p95_; }

private:
    void compare(const RunContext& context) {
        double squares = 0, most = 0;
        for (std::size_t v = 0; v < direct_.size(); ++v) {
            const double squared = double((direct_[v] - restored_[v]).squaredNorm());
            squares += squared;
            most = std::max(most, squared);
        }
        const double diagonal = scale_ * bounds(model_.mesh.positions).diagonal();
        rms_.push_back(std::sqrt(squares / double(direct_.size())) / diagonal);
        worst_max_ = std::max(worst_max_, std::sqrt(most) / diagonal);
        const std::vector<Vec3f> ours = vertex_normals(model_.mesh, restored_, context),
                                 theirs = vertex_normals(model_.mesh, direct_, context);
        std::vector<float> angles;
        for (std::size_t v = 0; v < ours.size(); ++v)
            if (!ours[v].isZero() && !theirs[v].isZero())
                angles.push_back(std::atan2(ours[v].cross(theirs[v]).norm(), ours[v].dot(theirs[v])));
        if (angles.empty()) return;
        const auto p95 = angles.begin() + std::ptrdiff_t(0.95 * double(angles.size() - 1));
        std::nth_element(angles.begin(), p95, angles.end());
        worst_p95_ = std::max(worst_p95_, double(*p95) * 180 / std::numbers::pi);
    }

    const Model& model_;
    double scale_;
    Restorer restorer_;
    Pose pose_;
    std::vector<Vec3f> restored_, direct_;
    std::size_t driver_ = 0, all_ = 0, frame_ = 0;
    std::vector<double> rms_;
    double worst_max_ = 0, worst_p95_ = 0;
};

class SimulateBench {
public:
    SimulateBench(const SimulateBenchOptions& options, const RunContext& context)
        : options_(options), context_(context) {
        one_thread_.seed = context.seed;
    }

    /// Elastic forces of the fem material, beside the plain loop.
    void elastic() {
        const ShakenBox box(cube(8000));
        const double cells = double(box.cell_count());
        Vectors result(box.positions.size());
        const double plain = least_seconds([&] { plain_forces(box, result); });
        add("forces.plain", cells / plain, "cells/s");
        double seconds = 0;
        for (const int lanes : cell_kernel::lane_counts()) {
            seconds = time_forces(box, lanes, one_thread_);
            add(fmt::format("forces.lanes_{}", lanes), cells / seconds, "cells/s");
        }
        add("forces.of_plain", plain / seconds, "ratio");
        for (const std::size_t size : sizes({8000, 200000})) {
            const ShakenBox some(cube(size));
            const int lanes = cell_kernel::lane_counts().back();
            const double f = time_forces(some, lanes, context_);
            add(fmt::format("forces.of_{}", size), double(some.cell_count()) / f, "cells/s");
            if (!has_more_threads()) continue;
            add(fmt::format("forces.of_{}.gain", size), time_forces(some, lanes, one_thread_) / f, "ratio");
        }
    }

    /// A cube and a slender bar held at one end, against converged runs.
    void swings() {
        const auto measure = [&](const char* name, const Scene& scene) {
            const Timing timing = time_both(name, scene);
            add(fmt::format("{}.substeps", name), timing.mean_substeps(), "substeps");
            if (!context_.is_cancelled())
                add(fmt::format("{}.error", name), error_of_steps(scene, timing.mean_substeps(), context_),
                    "diagonals");
        };
        measure("cube", swing(cube(8000), MaterialModel::fem, kYoung));
        if (options_.particles == 0) measure("bar", swing({41, 14, 14}, MaterialModel::fem, kYoung));
    }

    void materials() {
        for (const auto& [name, model] : {std::pair{"fem", MaterialModel::fem},
                                          {"springs", MaterialModel::springs},
                                          {"meshfree", MaterialModel::meshfree}}) {
            const Timing timing = time_both(name, swing(cube(8000), model, kSoftYoung));
            add(fmt::format("{}.substeps", name), timing.mean_substeps(), "substeps");
            add(fmt::format("{}.substep", name), timing.milliseconds() / timing.mean_substeps(), "ms");
        }
        const Timing stiff = time_both("springs_stiff", swing(cube(8000), MaterialModel::springs, kYoung));
        add("springs_stiff.substeps", stiff.mean_substeps(), "substeps");
    }

    /// Spinning boxes that nothing touches.
    void growth() {
        for (const std::size_t size : sizes({1000, 8000, 27000, 64000, 200000})) {
            Scene scene;
            Material material;
            material.young_modulus = kSoftYoung;
            scene.actor.body = make_box(cube(size), material);
            scene.actor.spin = Vec3d(0, 1, 0);
            scene.frames = kGrowthFrames;
            const std::string name = fmt::format("growth.{}", size);
            const Timing timing = time_both(name, scene);
            const double substep = timing.milliseconds() / timing.mean_substeps();
            add(name + ".substep", substep, "ms");
            add(name + ".a_particle", 1e6 * substep / double(scene.actor.body->particle_count()), "ns");
        }
    }

    /// Rigid pieces: as long as they fall, and once they lie. On one thread, as Bullet's.
    void heap() {
        const bench::Heap heap = bench::make_heap();
        std::vector<double> falling, resting;
        const unsigned runs = options_.particles == 0 ? kRuns : 1; // a size of the caller's own is a trial
        for (unsigned run = 0; run < runs && !context_.is_cancelled(); ++run) {
            Simulation simulation = Simulation::create(heap.world, heap.actors, {}, one_thread_).value();
            const auto seconds_of = [&](std::size_t frames) {
                const double begin = now_seconds();
                for (std::size_t frame = 0; frame < frames; ++frame) simulation.advance(one_thread_).value();
                return (now_seconds() - begin) / double(frames);
            };
            falling.push_back(seconds_of(kFrames));
            seconds_of(kHeapRests - kFrames);
            resting.push_back(seconds_of(kFrames));
        }
        add("heap.falling", 1e3 * std::ranges::min(falling), "ms");
        add("heap.resting", 1e3 * std::ranges::min(resting), "ms");
    }

    /// The mesh, a metre long, dropped on the ground with all its detail.
    void fall(const Mesh& mesh) {
        Mesh copy = mesh;
        const Model model = strip(std::move(copy), {.base = options_.base.value_or(1000)}, context_).value().model;
        for (const double young_modulus : {kYoung, kSoftYoung}) {
            const std::string name = young_modulus == kYoung ? "fall" : "fall_soft";
            const Box box = world_bounds(mesh);
            BodyOptions body;
            body.scale = 1 / box.size().maxCoeff();
            body.cells.count = options_.particles ? options_.particles : 10000;
            Material material;
            material.young_modulus = young_modulus;
            Scene scene;
            scene.actor.body = std::make_shared<Body>(make_body(mesh, material, body, context_).value());
            scene.actor.placement.translation() = Vec3d(0, kDropHeight - (box.min - mesh.origin).y() * body.scale, 0);
            scene.world.obstacles.emplace_back().shape = HalfSpace{};
            scene.frames = kFallFrames;
            DetailFollower detail(model, body.scale, context_);
            const Timing timing = time_both(name, scene, &detail);
            report_fall(name, scene, timing, detail);
        }
    }

    std::vector<Measurement> take() { return std::move(figures_); }

private:
    void add(const std::string& name, double value, std::string unit) {
        figures_.push_back({"simulate." + name, value, std::move(unit)});
    }

    bool has_more_threads() const { return context_.threads() > 1; }

    std::vector<std::size_t> sizes(const std::vector<std::size_t>& usual) const {
        return options_.particles ? std::vector{options_.particles} : usual;
    }
    /// Particles along the sides of a box of about so many.
    Corners cube(std::size_t size) const {
        if (options_.particles) size = options_.particles;
        const std::size_t side = std::max<std::size_t>(2, std::size_t(std::lround(std::cbrt(double(size)))));
        return {side, side, side};
    }

    static double time_forces(const ShakenBox& box, int lanes, const RunContext& context) {
        const cell_kernel::Plan plan = cell_kernel::make_plan(box.body);
        Vectors result(box.positions.size());
        cell_kernel::Sums sums;
        return least_seconds([&] { cell_kernel::forces(plan, box.positions, result, sums, lanes, context); });
    }

    /// The frame's time; with more threads than one, what they gain and whether they compute the same.
    Timing time_both(const std::string& name, const Scene& scene, Follower* follower = nullptr) {
        Timing timing, one;
        for (unsigned run = 0; run < kRuns; ++run) { // in turn, as the machine's speed drifts
            time_run(scene, context_, follower, timing);
            if (has_more_threads()) time_run(scene, one_thread_, follower, one);
        }
        add(name + ".frame", timing.milliseconds(), "ms");
        if (has_more_threads()) {
            add(name + ".gain", one.milliseconds() / timing.milliseconds(), "ratio");
            add(name + ".differing_bytes", double(differing_bytes(one.state, timing.state)), "bytes");
        }
        return timing;
    }

    void report_fall(const std::string& name, const Scene& scene, const Timing& timing, const DetailFollower& detail) {
        const double frame = 1e-3 * timing.milliseconds();
        double direct = 0, measured = 0;
        for (const Phases& phases : timing.frames) {
            direct += phases.direct;
            measured += phases.direct > 0;
        }
        direct /= measured;
        const double coupled = timing.mean([](const Phases& p) { return p.coupling + p.restore; });
        add(name + ".elastic", 1e3 * timing.mean([](const Phases& p) { return p.elastic; }), "ms");
        add(name + ".contacts", 1e3 * timing.mean([](const Phases& p) { return p.contacts; }), "ms");
        add(name + ".other", 1e3 * timing.mean([](const Phases& p) { return p.other; }), "ms");
        add(name + ".coupling", 1e3 * timing.mean([](const Phases& p) { return p.coupling; }), "ms");
        add(name + ".restore", 1e3 * timing.mean([](const Phases& p) { return p.restore; }), "ms");
        double worst = 0;
        for (const Phases& phases : timing.frames) worst = std::max(worst, phases.total());
        add(name + ".worst_frame", 1e3 * worst, "ms");
        add(name + ".rate", 1 / frame, "frames/s");
        add(name + ".particles", double(scene.actor.body->particle_count()), "particles");
        add(name + ".substeps", timing.mean_substeps(), "substeps");
        add(name + ".direct", 1e3 * direct, "ms");
        add(name + ".direct_of_restored", direct / coupled, "ratio");
        add(name + ".frame_with_direct_of_restored", (frame - coupled + direct) / frame, "ratio");
        add(name + ".rms", detail.mean_rms(), "diagonals");
        add(name + ".worst_rms", detail.worst_rms(), "diagonals");
        add(name + ".worst_max", detail.worst_max(), "diagonals");
        add(name + ".worst_normal_p95", detail.worst_normal_p95(), "degrees");
    }

    SimulateBenchOptions options_;
    const RunContext& context_;
    RunContext one_thread_{1};
    std::vector<Measurement> figures_;
};

} // namespace

std::vector<Measurement> measure_simulation(const Mesh& mesh, const SimulateBenchOptions& options,
                                            const RunContext& context) {
    SimulateBench bench(options, context);
    bench.elastic();
    bench.swings();
    bench.materials();
    bench.growth();
    bench.heap();
    bench.fall(mesh);
    return bench.take();
}

} // namespace filigree::bench
