#include "filigree/deform/warp_pose.h"

#include "filigree/core/parallel_for.h"

namespace filigree {

Pose warp_pose(const SpaceWarp& warp, const Model& model, const RunContext& context) {
    Pose pose;
    pose.positions = driver_positions(model);
    pose.gradients.resize(pose.positions.size());
    const Vec3d& origin = model.mesh.origin;
    parallel_for(context, pose.positions.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Warped warped = warp.warp(origin + pose.positions[i].cast<double>());
            pose.positions[i] = (warped.position - origin).cast<float>();
            pose.gradients[i] = warped.gradient.cast<float>();
        }
    });
    return pose;
}

} // namespace filigree
