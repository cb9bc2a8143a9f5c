// How far a restored pose is from deforming the whole mesh, judged from the pose alone.
#pragma once

#include "filigree/hierarchy/model.h"

#include <array>
#include <memory>

namespace filigree {

/// Looks at every edge of the driver's cells. Where positions and gradients of its ends do not agree (the trapezoid
/// rule misses the other end), or the gradients differ, the deformation is more curved than the driver can follow;
/// between the ends the mesh is off by a share of the one, and of the other times the detail's height. How large the
/// shares are is measured on the model itself, once, with a few smooth displacements. The estimate is then within a
/// factor of 2 of the error for more than nine poses in ten (`filigree bench estimate`). It does not see that a solver
/// would have moved the whole mesh differently.
class PoseError {
public:
    /// Does not refer to the model later on. context: what is
    /// measured later takes its threads, and cannot be cancelled; same bytes for any number. Cost O(V).
    explicit PoseError(const Model& model, const RunContext& context = RunContext());
    PoseError(PoseError&&) noexcept;
    PoseError& operator=(PoseError&&) noexcept;
    ~PoseError();

    struct Estimate {
        double rms = 0;           ///< over the mesh's vertices, model units
        double diagonal = 0;      ///< of the posed driver, model units
        std::vector<float> local; ///< rms over what hangs around each driver vertex, model units

        /// As a share of the diagonal; 0 for a driver without size.
        double share() const { return diagonal > 0 ? rms / diagonal : 0; }
        /// Whether one sees it: a pixel of a picture that the shape fills.
        bool is_too_curved() const { return share() > 1e-3; }
    };
    /// gradients: those that the pose is restored with (Restorer::gradients), one a driver vertex. Cost O(driver); the
    /// first pose that comes with gradients costs a few restores of 16,384 vertices too, and the first one without also
    /// a GradientFit. From many threads at a time. Errors: as of check_pose; mismatch (another number of
    /// gradients).
    Result<Estimate> estimate(const Pose& pose, std::span<const Mat3f> gradients) const;

private:
    /// What hangs on a cell: sums over its vertices, for the edges 0-1, 1-2 and 2-0, of the square of 4 b_k b_l (one in
    /// the middle of the edge, nothing at the other corner), and of that times the squared height.
    struct Load {
        std::array<double, 3> vertices, heights;
        double count;
    };
    struct Calibration;
    Estimate estimate_unscaled(std::span<const Vec3f> positions, std::span<const Mat3f> gradients) const;

    std::vector<Vec3f> rest_;
    std::vector<Triangle> cells_;
    std::vector<Load> loads_;
    std::unique_ptr<Calibration> calibration_;
};

/// The local estimates at the vertices of the finest mesh, for colours: blended over each cell as positions are. Cost
/// O(V).
std::vector<float> vertex_errors(const Model& model, std::span<const float> local);

} // namespace filigree
