#include "filigree/pose.h"

#include "filigree/blend/driver_search.h"
#include "filigree/blend/gradient_fit.h"
#include "filigree/blend/sampled_restorer.h"
#include "filigree/core/math.h"
#include "filigree/mesh.h"
#include "filigree/restore.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr std::size_t kMostMeasured = 65536; // vertices, where a few per cent do
constexpr double kMargin = 1.4; // warps that are no more curved than the family's err by up to so much more

Status check(const StripOptions& options, const FidelityGoal& goal) {
    if (!(goal.error > 0) || !std::isfinite(goal.error))
        return Error{ErrorCode::usage, "A fidelity has to be above 0, a fraction of the diagonal."};
    if (options.base || options.levels || options.error)
        return Error{ErrorCode::usage, "Fidelity says how fine the driver is; say no base, levels or error beside it."};
    return Success{};
}

} // namespace

std::vector<NamedWarp> fidelity_warps(const Box& box) {
    const Axis axis = longest_axis(box);
    std::vector<NamedWarp> warps;
    warps.push_back({"stretch 2", true, make_stretch(box, axis, 2).value()});
    warps.push_back({"stretch 0.5", true, make_stretch(box, axis, 0.5).value()});
    warps.push_back({"squeeze 2", true, make_squeeze(box, axis, 2).value()});
    warps.push_back({"bend 90", false, make_bend(box, axis, 90)});
    warps.push_back({"bend 180", false, make_bend(box, axis, 180)});
    warps.push_back({"twist 180", false, make_twist(box, axis, 180)});
    warps.push_back({"taper 0.5", false, make_taper(box, axis, 0.5).value()});
    warps.push_back({"random 10 %", false, make_smooth_random(box, 0.10, 1)});
    warps.push_back({"random 25 %", false, make_smooth_random(box, 0.25, 1)});
    return warps;
}

Result<double> fidelity(const Model& model, PoseSource source, const RunContext& context) {
    const Result<Restorer> restorer = Restorer::create(model, {}, context);
    if (!restorer) return restorer.error();
    const Mesh mesh = level_mesh(model, model.finest_level());
    double largest = 0;
    for (const NamedWarp& named : fidelity_warps(world_bounds(mesh))) {
        if (named.affine) continue;
        Pose pose = warp_pose(*named.warp, model, context);
        if (source == PoseSource::positions) pose.gradients.clear();
        const Result<std::vector<Vec3f>> restored = restorer->positions(pose, context);
        if (!restored) return restored.error();
        const std::vector<Vec3f> truth = warp_positions(*named.warp, mesh.positions, mesh.origin, context);
        if (context.is_cancelled()) return cancelled_error();
        const double diagonal = bounds(truth).diagonal();
        if (diagonal > 0) largest = std::max(largest, vertex_distance(mesh, *restored, truth, context).rms / diagonal);
    }
    return largest;
}

Result<DriverFidelity> driver_fidelity(const Model& model, const RunContext& context) {
    const SampledRestorer restorer(model, kMostMeasured, context);
    const GradientFit fit(level_mesh(model, 0), context);
    DriverFidelity largest;
    for (const NamedWarp& named : fidelity_warps(world_bounds(model.mesh))) {
        if (named.affine) continue;
        const Pose pose = warp_pose(*named.warp, model, context);
        const std::vector<Vec3f> truth = warp_positions(*named.warp, restorer.rest(), model.mesh.origin, context);
        const std::vector<Mat3f> fitted = fit.fit(pose.positions, context);
        if (context.is_cancelled()) return cancelled_error();
        const double diagonal = bounds(truth).diagonal();
        if (!(diagonal > 0)) continue;
        const auto error = [&](std::span<const Mat3f> gradients) {
            return restorer.rms_distance(pose.positions, gradients, truth, context) / diagonal;
        };
        largest.positions = std::max(largest.positions, error(fitted));
        largest.gradients = std::max(largest.gradients, error(pose.gradients));
    }
    return largest;
}

Result<StrippedToFidelity> strip_to_fidelity(const Mesh& mesh, const StripOptions& options, const FidelityGoal& goal,
                                             const RunContext& context) {
    if (Status status = check(options, goal); !status) return status.error();
    const double aim = goal.error / kMargin;
    DriverSearch search(std::max<std::size_t>(mesh.vertex_count(), 3), aim);
    StrippedToFidelity best;
    unsigned tried = 0;
    for (std::size_t size = search.first();; size = search.next()) {
        StripOptions trial = options;
        trial.base = std::max<std::size_t>(size, 3);
        Result<Stripped> stripped = strip(mesh, trial, context);
        if (!stripped) return stripped.error();
        const Result<double> error = fidelity(stripped->model, goal.source, context);
        if (!error) return error.error();
        ++tried;
        search.add(size, *error);
        const bool passed = *error <= aim, is_whole = size >= mesh.vertex_count();
        if (passed || is_whole) best = {*std::move(stripped), *error, tried};
        if (search.is_done() || (is_whole && !passed)) break;
    }
    best.tried = tried;
    return best;
}

} // namespace filigree
