// As-rigid-as-possible handles: some vertices are put somewhere, the rest follows with as little strain as it can.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/hierarchy/pose.h"
#include "filigree/mesh/mesh.h"

#include <memory>

namespace filigree {

struct HandleOptions {
    unsigned iterations = 200; ///< at most this many local-global rounds
    double tolerance = 1e-5;   ///< stop when no vertex moves further in a round; fraction of the diagonal
    /// Resistance to bending: the length over which a sharp bend is spread, as a fraction of the diagonal. It makes
    /// results independent of the mesh's fineness; with 0, the plain method, fine surfaces fold sharply.
    double smoothness = 0.03;
};

struct HandleResult {
    Pose pose;               ///< positions, and the vertices' rotations as gradients
    unsigned iterations = 0; ///< rounds done
    double last_move = 0;    ///< largest move of the last round, fraction of the diagonal
};

/// The local-global solver for one rest shape and one set of handles [Sorkine 2007]: the global step's matrix, with
/// cotangent weights (clamped to be non-negative), is factored once; in the local step each vertex's rotation starts
/// from that of the round before [Mueller 2016] and is drawn to its neighbours' [Levi 2015]. Rounds have momentum, but
/// the energy never rises. Rotations are proper (determinant 1) whatever the targets are.
class HandleSolver {
public:
    /// positions: V rest points; triangles: over them, any quality (degenerate ones only just hold their vertices
    /// together; a vertex that is connected to no handle stays where it is). handles: distinct vertices whose positions
    /// are given. Errors: usage (a handle out of range, repeated, or none at all), unsuitable (more than
    /// 20 million vertices), out_of_memory, cancelled (asked before and after the
    /// factorisation, which takes most of the time).
    static Result<HandleSolver> create(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                       std::span<const Index> handles, const RunContext& context);
    HandleSolver(HandleSolver&&) noexcept;
    HandleSolver& operator=(HandleSolver&&) noexcept;
    ~HandleSolver();

    /// targets: one position a handle, in the order of `handles`. Starts from the last solution, moved along with the
    /// handles as a rigid body: dragging is cheap, and a rigid motion exact. Same bytes for any thread count.
    /// Cost O(iterations (V + fill)). Errors: mismatch, usage (a target that is not finite), cancelled (the last
    /// solution stays).
    Result<HandleResult> solve(std::span<const Vec3f> targets, const HandleOptions& options, const RunContext& context);
    /// Forgets the last solution: the next solve starts from the rest shape.
    void reset();

private:
    struct Solver;
    explicit HandleSolver(std::unique_ptr<Solver> solver);
    std::unique_ptr<Solver> solver_;
};

} // namespace filigree
