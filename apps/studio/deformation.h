// From warps and handles to the pose of the driver, and what the whole mesh would be without Filigree.
#pragma once

#include "document.h"

#include "filigree/deform/unwarp.h"
#include "filigree/pose.h"

#include <QObject>

#include <memory>

namespace filigree::studio {

class Bell;

/// The driver's pose by handles, then warps; no positions at all when the state has neither. Cost O(driver).
Pose deformed_pose(const State& state, const RunContext& context);

/// Every vertex of the finest mesh by the same handles and warps: what restoring is measured against. Handles are
/// solved over all vertices, which takes seconds for several hundred thousand. Positions relative to the mesh's origin.
Result<std::vector<Vec3f>> full_deformation(const State& state, const RunContext& context);

/// As filigree::pull_region, around the pins there are.
PullRegion pull_region(const State& state, const Vec3f& rest_point, double grip, double reach,
                       std::optional<Index> vertex = {});

/// As-rigid-as-possible solving in a thread of its own: always for the latest move, so that a drag never waits.
class HandleDrag : public QObject {
    Q_OBJECT
public:
    explicit HandleDrag(QObject* parent = nullptr);
    ~HandleDrag() override;

    /// From the pose `start` (null: at rest), with the pull's vertices and those it holds. Prepares in the background.
    /// `grabbed` (of the finest mesh; blend code): the vertex that is to go the way of the moves. What carries it turns
    /// a little as it is pulled, so the driver's vertices are moved by so much more that the detail is where it should.
    void begin(std::shared_ptr<const Model> model, std::shared_ptr<const Pose> start, Handle pull,
               std::optional<Index> grabbed = {});
    /// How far the pull's vertices, or what was grabbed, are to be from where they started.
    void move(const Vec3f& way);
    /// Waits for the solution of the last move and returns it. The drag is over. Of a driver so large that this takes
    /// seconds, what there is by then; null before the first solution, and without a drag. Errors: what failed() tells.
    Result<std::shared_ptr<const Pose>> finish();
    /// How far the pull's vertices went in the pose that finish() returned: the move and what was added to it.
    const Vec3f& applied() const { return applied_; }
    void stop(); ///< at once; the drag is over, and leaves nothing
    bool is_active() const;
    bool is_busy() const; ///< on its way to the last move

Q_SIGNALS:
    void solved(std::shared_ptr<const Pose> pose, double milliseconds); ///< in the main thread
    void failed(const Error& error);

private:
    struct Impl;
    void listen();
    std::unique_ptr<Bell> bell_;
    void retire();

    std::shared_ptr<Impl> impl_;                 ///< null: no drag
    std::vector<std::shared_ptr<Impl>> retired_; ///< over, but their threads are still to end
    Vec3f applied_ = Vec3f::Zero();
};

} // namespace filigree::studio
