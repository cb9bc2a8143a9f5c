#include "filigree/scene.h"
#include "filigree/scene/scene_run.h"

namespace filigree {

Result<SceneMotion> simulate_scene(const SceneFile& scene, const RunContext& context) {
    Result<ReadyScene> ready = set_up(scene, context);
    if (!ready) return ready.error();
    Result<SceneRun> run = SceneRun::create(scene, *ready, false, context);
    if (!run) return run.error();
    if (Status simulated = run->advance_to(scene.frames, context); !simulated) return simulated.error();

    SceneMotion motion{
        .origin = ready->origin, .bodies = {}, .warnings = ready->warnings, .broke_down = run->broke_down()};
    for (std::string& warning : run->warnings()) motion.warnings.push_back(std::move(warning));
    const std::vector<PoseSequence>& poses = run->recording().poses;
    for (std::size_t b = 0; b < poses.size(); ++b) {
        ReadyBody& body = ready->bodies[b];
        leave_out_closed_cracks(body, poses[b].frames);
        motion.bodies.push_back({body.name, body.model, poses[b], body.scale});
    }
    return motion;
}

} // namespace filigree
