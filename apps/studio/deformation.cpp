#include "deformation.h"

namespace filigree::studio {
std::unique_ptr<SpaceWarp> make_warp(const Warps&, const Box&) { return nullptr; }
Pose deformed_pose(const State&, const RunContext&) { return {}; }
Result<std::vector<Vec3f>> full_deformation(const State&, const RunContext&) { return std::vector<Vec3f>{}; }
PullRegion pull_region(const State&, const Vec3f&, double, double) { return {}; }
Vec3d unwarped(const SpaceWarp&, const Vec3d& place, const Vec3d&) { return place; }
struct HandleDrag::Content {};
HandleDrag::HandleDrag(QObject* parent) : QObject(parent) {}
HandleDrag::~HandleDrag() = default;
void HandleDrag::begin(std::shared_ptr<const Model>, std::shared_ptr<const Pose>, Handle) {}
void HandleDrag::move(const Vec3f&) {}
std::shared_ptr<const Pose> HandleDrag::finish() { return nullptr; }
void HandleDrag::stop() {}
bool HandleDrag::is_active() const { return false; }
void HandleDrag::listen() {}
} // namespace filigree::studio
