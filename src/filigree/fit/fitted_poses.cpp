#include "filigree/fit/fitted_poses.h"

#include "filigree/core/parallel_for.h"
#include "filigree/restore.h"

#include <cmath>

namespace filigree {

namespace {

constexpr std::size_t kErrorGrain = 16384;

/// Adds up squared distances, and keeps the farthest vertex: the first of equal ones.
class ErrorSum {
public:
    void add(std::span<const Vec3f> restored, std::span<const Vec3f> truth, std::size_t frame,
             const RunContext& context) {
        struct Piece {
            double squared = 0, most = -1;
            std::size_t vertex = 0;
        };
        std::vector<Piece> pieces((truth.size() + kErrorGrain - 1) / kErrorGrain);
        parallel_for(context, truth.size(), kErrorGrain, [&](std::size_t begin, std::size_t end) {
            Piece& piece = pieces[begin / kErrorGrain];
            for (std::size_t v = begin; v < end; ++v) {
                const double squared = (restored[v].cast<double>() - truth[v].cast<double>()).squaredNorm();
                piece.squared += squared;
                if (squared <= piece.most) continue;
                piece.most = squared;
                piece.vertex = v;
            }
        });
        for (const Piece& piece : pieces) {
            squared_ += piece.squared;
            if (piece.most <= most_) continue;
            most_ = piece.most;
            error_.max_frame = frame;
            error_.max_vertex = static_cast<Index>(piece.vertex);
        }
        count_ += truth.size();
    }

    AnimationError error() const {
        AnimationError error = error_;
        if (count_ > 0) error.rms = std::sqrt(squared_ / double(count_));
        error.max = std::sqrt(std::max(most_, 0.0));
        return error;
    }

private:
    double squared_ = 0, most_ = -1;
    std::size_t count_ = 0;
    AnimationError error_;
};

} // namespace

Result<FittedPoses> fit_poses(const Model& model, std::size_t frames,
                              const std::function<Status(std::size_t frame, std::span<Vec3f> positions)>& frame,
                              const PoseFitOptions& options, const RunContext& context) {
    RunContext silent = context;
    silent.progress = {};
    const Result<PoseFit> fit = PoseFit::create(model, options, silent);
    if (!fit) return fit.error();
    const Result<Restorer> restorer = Restorer::create(model, {}, silent);
    if (!restorer) return restorer.error();
    FittedPoses fitted;
    ErrorSum sum;
    std::vector<Vec3f> truth(model.vertex_count()), restored(model.vertex_count());
    for (std::size_t k = 0; k < frames; ++k) {
        context.report("fitting", double(k) / double(frames));
        if (Status read = frame(k, truth); !read) return read.error();
        Result<Pose> pose = fit->fit(truth, silent);
        if (!pose) return pose.error();
        if (Status done = restorer->positions(*pose, restored, silent); !done) return done.error();
        sum.add(restored, truth, k, context);
        fitted.poses.push_back(*std::move(pose));
    }
    context.report("fitting", 1);
    fitted.error = sum.error();
    return fitted;
}

Result<AnimationError> animation_error(const Model& model, const PoseSequence& poses, const MeshAnimation& animation,
                                       std::span<const Index> order, const RunContext& context) {
    const std::size_t count = model.vertex_count();
    if (animation.rest->vertex_count() != count || (!order.empty() && order.size() != count))
        return Error{ErrorCode::mismatch, "The animation has " + std::to_string(animation.rest->vertex_count()) +
                                              " vertices and the model " + std::to_string(count) +
                                              "; they are of different meshes."};
    if (animation.frames != poses.frames.size())
        return Error{ErrorCode::mismatch, "The animation has " + std::to_string(animation.frames) +
                                              " frames and the model " + std::to_string(poses.frames.size()) +
                                              " poses; they are not of one animation."};
    RunContext silent = context;
    silent.progress = {};
    const Result<Restorer> restorer = Restorer::create(model, {}, silent);
    if (!restorer) return restorer.error();
    ErrorSum sum;
    std::vector<Vec3f> truth(count), restored(count), ordered(order.size());
    for (std::size_t k = 0; k < animation.frames; ++k) {
        context.report("measuring the error", double(k) / double(animation.frames));
        if (Status read = animation.positions(k, truth); !read) return read.error();
        for (std::size_t v = 0; v < ordered.size(); ++v) ordered[v] = truth[order[v]];
        if (Status done = restorer->positions(poses.frames[k], restored, silent); !done) return done.error();
        sum.add(restored, order.empty() ? truth : ordered, k, context);
        if (context.is_cancelled()) return cancelled_error();
    }
    context.report("measuring the error", 1);
    return sum.error();
}

} // namespace filigree
