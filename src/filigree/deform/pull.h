// Pulling a driver by hand: which of its vertices go along and which stay, the solution while it is dragged, and the
// same pulls once more over every vertex of the mesh.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/hierarchy/model.h"
#include "filigree/hierarchy/pose.h"

#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace filigree {

/// Vertices of a driver, ascending and disjoint: those that a pull takes, and those that stay where they are.
struct PullRegion {
    std::vector<Index> grip, held;
};

/// The driver's vertices within `grip` of a point, and those beyond `reach` of it; the nearest one where none is within
/// the grip. Pinned ones are among those that stay, so `grip` is empty where all are pinned. Distances along straight
/// lines at rest, model units; the point is relative to the mesh's origin. pinned: of the driver, ascending. vertex: of
/// the finest mesh; those that carry it are taken too, so that it comes along (blend code). Cost O(driver).
PullRegion pull_region(const Model& model, std::span<const Index> pinned, const Vec3f& rest_point, double grip,
                       double reach, std::optional<Index> vertex = {});

/// A pull that was made, with all that is needed to do it again on another resolution.
struct Pull {
    PullRegion region;
    Vec3f centre = Vec3f::Zero(); ///< what was taken hold of, at rest, relative to the mesh's origin
    double grip = 0, reach = 0;   ///< model units about it, at rest
    Vec3f move = Vec3f::Zero();   ///< of what is within the grip
};

/// Every vertex of the finest mesh after the pulls, one after the other; vertices at one place move as one. Relative to
/// the mesh's origin. Cost: a HandleSolver over all vertices for each pull, seconds for several hundred thousand.
/// Errors: as of HandleSolver, cancelled.
Result<std::vector<Vec3f>> pull_every_vertex(const Model& model, std::span<const Pull> pulls,
                                             const RunContext& context);

/// The pose's gradients become those of a motion that began at `start`; null, or one without gradients: at rest.
void follow_start(Pose& pose, const Pose* start);

/// One pull of a driver while it is dragged: some rounds of as-rigid-as-possible solving a step, each from the last
/// solution. What was taken hold of turns a little as it is pulled. So the driver's vertices are moved by so much more
/// that the grabbed vertex goes the way that is asked for, up to half of that way.
class PullSolver {
public:
    /// start: the pose to begin from; null: at rest. It and the model must outlive this. grabbed: of the finest mesh,
    /// what is to go the way (blend code, from rest or a pose with gradients; ignored otherwise). Errors: as of
    /// HandleSolver::create.
    static Result<PullSolver> create(const Model& model, const Pose* start, const PullRegion& region,
                                     std::optional<Index> grabbed, const RunContext& context);
    PullSolver(PullSolver&&) noexcept;
    PullSolver& operator=(PullSolver&&) noexcept;
    ~PullSolver();

    /// Another few rounds towards `way` from the start. Errors: as of HandleSolver::solve.
    Result<Pose> step(const Vec3f& way, double tolerance, const RunContext& context);
    /// How far the grip was moved by the last step.
    const Vec3f& applied() const;
    /// Whether the last step changed no more than `tolerance` (of the diagonal) and brought the grabbed vertex where it
    /// should be, or 400 rounds on the way did not.
    bool has_arrived(double tolerance) const;

private:
    struct Solver;
    explicit PullSolver(std::unique_ptr<Solver> solver);
    std::unique_ptr<Solver> solver_;
};

} // namespace filigree
