#include "filigree/pose.h"

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
constexpr std::size_t kFirstDriver = 1000, kSmallestDriver = 12;
constexpr double kOrder = 1.3;        // the error falls about as fast as this power of the driver's vertices grows
constexpr double kMargin = 1.4;       // warps that are no more curved than the family's err by up to so much more
constexpr double kCloseEnough = 1.15; // ratio of the smallest driver that passed to the largest that did not

/// The next size to try: where a power law through both drivers, or of the usual order through one, meets the goal.
class DriverSearch {
public:
    DriverSearch(std::size_t most, double goal) : most_(double(most)), goal_(goal) {}

    std::size_t first() const { return static_cast<std::size_t>(std::min(double(kFirstDriver), most_)); }
    void add(std::size_t size, double error) {
        Tried& side = error <= goal_ ? passed_ : failed_;
        side = {double(size), std::max(error, 1e-12)};
    }
    bool is_done() const {
        return passed_.size > 0 &&
               (passed_.size <= double(kSmallestDriver) || passed_.size / failed_.size < kCloseEnough);
    }
    std::size_t next() const {
        double size;
        if (passed_.size > 0 && passed_.size < most_ && failed_.size > 0) {
            const double slope = math::log(passed_.error / failed_.error) / math::log(passed_.size / failed_.size);
            size = failed_.size * math::pow(0.9 * goal_ / failed_.error, 1 / std::min(slope, -0.1));
            size = std::clamp(size, failed_.size * 1.07, passed_.size / 1.07);
        } else { // the whole mesh has no error that a power law could go through
            const Tried& one = failed_.size > 0 ? failed_ : passed_;
            size = one.size * std::clamp(math::pow(one.error / (0.8 * goal_), 1 / kOrder), 0.1, 10.0);
            if (failed_.size > 0) size = std::max(size, failed_.size * 1.3);
            if (passed_.size > 0) size = std::min(size, passed_.size / (failed_.size > 0 ? 1.07 : 1.3));
        }
        return static_cast<std::size_t>(std::clamp(std::round(size), double(kSmallestDriver), most_));
    }

private:
    struct Tried {
        double size = 0, error = 0;
    };
    Tried passed_, failed_;
    double most_, goal_;
};

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
