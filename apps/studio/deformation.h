// From warps and handles to the pose of the driver, and what the whole mesh would be without Filigree.
#pragma once

#include "document.h"

#include "filigree/deform/handles.h"

#include <condition_variable>
#include <thread>

namespace filigree::studio {

/// Null where there is nothing to do.
std::unique_ptr<SpaceWarp> make_warp(const Warps& warps, const Box& rest_box);

/// The driver's pose by handles, then warps; no positions at all when the state has neither. Cost O(driver).
Pose deformed_pose(const State& state, const RunContext& context);

/// Every vertex of the finest mesh by the same handles and warps: what restoring is measured against. Handles are
/// solved over all vertices, which takes seconds for several hundred thousand. Positions relative to the mesh's origin.
Result<std::vector<Vec3f>> full_deformation(const State& state, const RunContext& context);

/// Which driver vertices a pull at a point takes and which stay: those within `grip` of it, and those beyond `reach`
/// (unless they are in a handle already, which stays as it is). Distances along straight lines, model units.
struct PullRegion {
    std::vector<Index> grip, anchors; ///< of the driver, ascending, disjoint; grip holds at least the nearest vertex
};
PullRegion pull_region(const State& state, const Vec3f& rest_point, double grip, double reach);

/// As-rigid-as-possible solving in a thread of its own: always for the latest targets, so that a drag never waits.
class HandleDrag : public QObject {
    Q_OBJECT
public:
    explicit HandleDrag(QObject* parent = nullptr);
    ~HandleDrag() override;

    /// Starts with these handles of the state; the last of them is the one that is pulled. Prepares in the background.
    void begin(std::shared_ptr<const Model> model, std::vector<Handle> handles);
    /// Where the last handle's vertices are to be.
    void move(std::vector<Vec3f> targets);
    /// Waits for the solution of the last targets and returns it; null when it failed. The drag is over.
    std::shared_ptr<const Pose> finish(std::vector<Handle>* handles);
    bool is_active() const;

Q_SIGNALS:
    void solved(std::shared_ptr<const Pose> pose, double milliseconds); ///< in the main thread
    void failed(const Error& error);

private:
    struct Content;
    std::unique_ptr<Content> content_;
};

} // namespace filigree::studio
