#include "filigree/scene/finer_check.h"

#include "filigree/restore.h"
#include "filigree/scene/following.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

void require(const Status& status) {
    if (!status) throw BadResultAccess(status.error());
}

void add(TruthError& error, std::span<const Vec3f> found, std::span<const Vec3f> truth, double diagonal) {
    double squares = 0;
    for (std::size_t v = 0; v < found.size(); ++v) {
        const double distance = double((found[v] - truth[v]).norm()) / diagonal;
        squares += distance * distance;
        error.worst = std::max(error.worst, distance);
    }
    error.rms += std::sqrt(squares / double(std::max<std::size_t>(found.size(), 1)));
}

/// The scene with half the spacing. Its models are not asked for, so they are all driver: nothing to simplify.
SceneFile finer_scene(const SceneFile& scene, const ReadyScene& ready) {
    SceneFile finer = scene;
    for (std::size_t b = 0; b < finer.bodies.size(); ++b) {
        finer.bodies[b].body.cells.spacing = 0.5 * ready.bodies[b].body->spacing();
        finer.bodies[b].driver = ready.bodies[b].model.vertex_count();
    }
    return finer;
}

/// A body of the scene and what goes along with it: in the finer simulation, and in one whose particles are put where
/// the finer ones are.
class Compared {
public:
    Compared(std::size_t number, const ReadyBody& body, Simulation& finer, Simulation& carried,
             const RunContext& context)
        : number_(number), body_(body), restorer_(Restorer::create(body.model, {}, context).value()) {
        const std::vector<Vec3f> mesh = body.in_metres({body.model.positions().begin(), body.model.positions().end()});
        const Vectors& rest = body.body->rest;
        std::vector<Vec3f> particles(rest.size());
        for (std::size_t i = 0; i < particles.size(); ++i) particles[i] = rest[i];
        truth_ = finer.attach(number, mesh, context);
        particles_ = finer.attach(number, particles, context);
        attached_ = carried.attach(number, mesh, context);
        driver_ = carried.attach(number, body.in_metres(driver_positions(body.model)), context);
        diagonal_ = body.scale * bounds(body.model.mesh).diagonal();
    }

    void compare(const Simulation& finer, Simulation& carried, FinerCheck& check, const RunContext& context) const {
        std::vector<Vec3f> places(body_.body->particle_count());
        finer.attached(particles_, places, {}, context);
        Vectors positions(places.size());
        for (std::size_t i = 0; i < places.size(); ++i) positions.set(i, places[i]);
        require(carried.set_positions(number_, positions));

        std::vector<Vec3f> truth(body_.model.vertex_count()), found(truth.size());
        finer.attached(truth_, truth, {}, context);
        carried.attached(attached_, found, {}, context);
        add(check.attached, found, truth, diagonal_);
        Pose pose;
        pose.positions.resize(body_.model.driver().vertices.size());
        pose.gradients.resize(pose.positions.size());
        carried.attached(driver_, pose.positions, pose.gradients, context);
        for (Mat3f& gradient : pose.gradients) gradient *= float(body_.scale);
        require(restorer_.positions(pose, found, context));
        add(check.restored, found, truth, diagonal_);
    }

private:
    std::size_t number_;
    const ReadyBody& body_;
    Restorer restorer_;
    std::size_t truth_ = 0, particles_ = 0; ///< attachments of the finer simulation
    std::size_t attached_ = 0, driver_ = 0; ///< of the one that is carried
    double diagonal_ = 0;
};

std::vector<FinerCheck> compare(const SceneFile& scene, const ReadyScene& ready, std::size_t frames,
                                std::size_t moments, const RunContext& context) {
    RunContext silent = context;
    silent.progress = nullptr;
    const SceneFile finer_file = finer_scene(scene, ready);
    const ReadyScene finer_ready = set_up(finer_file, silent).value();
    Simulation finer = Simulation::create(finer_ready.world, finer_ready.actors, scene.step, silent).value();
    Simulation carried = Simulation::create(ready.world, ready.actors, scene.step, silent).value();
    std::vector<Following> following;
    for (std::size_t b = 0; b < finer_ready.bodies.size(); ++b)
        if (finer_ready.bodies[b].follow) {
            following.emplace_back(finer_ready.bodies[b], finer_ready.actors[b], b, scene.step.frames_per_second,
                                   silent);
            require(following.back().begin(finer));
        }
    std::vector<Compared> bodies;
    std::vector<FinerCheck> checks(ready.bodies.size());
    for (std::size_t b = 0; b < checks.size(); ++b) {
        bodies.emplace_back(b, ready.bodies[b], finer, carried, silent);
        checks[b].particles = finer_ready.bodies[b].body->particle_count();
    }
    const std::size_t count = std::clamp<std::size_t>(moments, 1, std::max<std::size_t>(frames, 1));
    std::size_t compared = 0;
    for (std::size_t frame = 1; frame <= frames; ++frame) {
        context.report("simulating with eight times the particles", double(frame - 1) / double(frames));
        for (Following& one : following) require(one.next(finer));
        finer.advance(silent).value();
        if (frame * count / frames == compared) continue;
        compared = frame * count / frames;
        for (std::size_t b = 0; b < checks.size(); ++b) bodies[b].compare(finer, carried, checks[b], silent);
    }
    for (FinerCheck& check : checks)
        for (TruthError* error : {&check.attached, &check.restored})
            error->rms /= double(std::max<std::size_t>(compared, 1));
    return checks;
}

} // namespace

Result<std::vector<FinerCheck>> check_against_finer(const SceneFile& scene, const ReadyScene& ready, std::size_t frames,
                                                    std::size_t moments, const RunContext& context) {
    try {
        return compare(scene, ready, frames, moments, context);
    } catch (const BadResultAccess& failure) {
        return failure.error();
    }
}

} // namespace filigree
