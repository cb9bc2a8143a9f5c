#include "filigree/scene/following.h"

#include <algorithm>
#include <cmath>

namespace filigree {

Following::Following(const ReadyBody& body, const Actor& actor, std::size_t number, double frames_per_second,
                     const RunContext& context)
    : body_(body), flesh_(*body.flesh), placement_(actor.placement), number_(number), rate_(frames_per_second),
      context_(context), transforms_(flesh_.skin().joints.size()) {}

double Following::clip_seconds(double frame) const {
    const double length = flesh_.skin().clips[body_.clip].seconds;
    const double at = body_.follow->start + body_.follow->speed * frame / rate_;
    if (body_.follow->repeat && length > 0) return at - length * std::floor(at / length);
    return std::clamp(at, 0.0, length);
}

void Following::set_transforms(double frame) { flesh_.skin().transforms(body_.clip, clip_seconds(frame), transforms_); }

/// In the scene, m.
Vectors Following::targets(double frame, Vectors* felt) {
    set_transforms(frame);
    Vectors at;
    flesh_.targets(transforms_, Vec3d::Zero(), at, felt, context_);
    const Mat3f turn = placement_.linear().cast<float>();
    for (std::size_t i = 0; i < at.size(); ++i) at.set(i, (placement_ * at[i].cast<double>()).cast<float>());
    for (std::size_t i = 0; felt && i < felt->size(); ++i) felt->set(i, turn * (*felt)[i]);
    return at;
}

Vectors Following::velocities(double frame, const Vectors& now) {
    return target_velocities(targets(frame - 1, nullptr), now, targets(frame + 1, nullptr), rate_);
}

/// The rest shape, which does not turn with the placement.
std::vector<Mat3f> Following::stretches(double frame) {
    if (flesh_.body()->material.is_plastic()) return {};
    set_transforms(frame);
    return flesh_.stretches(transforms_, context_);
}

Status Following::begin(Simulation& simulation) {
    const Vectors start = targets(0, nullptr), speeds = velocities(0, start);
    if (Status set = simulation.set_positions(number_, flesh_.settled(start)); !set) return set;
    if (Status set = simulation.set_velocities(number_, speeds); !set) return set;
    return simulation.set_follow(number_, flesh_.follow(), start, speeds, stretches(0));
}

Status Following::next(Simulation& simulation) {
    const auto frame = double(simulation.frame() + 1);
    Vectors felt;
    const Vectors at = targets(frame, body_.follow->is_sculpted ? &felt : nullptr);
    return simulation.set_targets(number_, at, velocities(frame, at), felt, stretches(frame));
}

void Following::carry_left_out(std::size_t frame, std::span<const Index> vertices, std::span<Vec3f> positions,
                               std::span<Mat3f> gradients) {
    if (flesh_.report().left_out_vertices == 0) return;
    set_transforms(double(frame));
    const SkinnedMesh& skin = flesh_.skin();
    for (std::size_t k = 0; k < vertices.size(); ++k) {
        const Index v = vertices[k];
        if (!flesh_.left_out()[v]) continue;
        const Eigen::Affine3d blend = blended_transform(skin, transforms_, v);
        positions[k] = (placement_ * (flesh_.scale() * (blend * skin.mesh.positions[v].cast<double>()))).cast<float>();
        if (!gradients.empty()) gradients[k] = (placement_.linear() * blend.linear()).cast<float>();
    }
}

} // namespace filigree
