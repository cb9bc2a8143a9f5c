// From a pose of the driver to the mesh: a Restorer puts the detail back.
//
//     const Restorer restorer = Restorer::create(model).value();   // once
//     const Mesh restored = restorer.mesh(pose).value();           // for each pose
//
// In real time, keep one array and fill it for each pose: restorer.positions(pose, out). PoseError estimates from the
// pose how far the result is from the mesh deformed as a whole. A Skin says the same model as joints and weights, for
// engines and files. Next: file.h writes meshes and animations; render.h draws models without restoring them here.
#pragma once

#include "filigree/strip.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// Restoring

struct RestoreOptions {
    std::optional<unsigned> level = {}; ///< level to restore, 0 .. Model::finest_level(); unset: the finest
    bool operator==(const RestoreOptions&) const = default;
};

/// The level that the options mean. Errors: usage (no such level).
Result<unsigned> restored_level(const Model& model, const RestoreOptions& options);
/// Whether a pose fits a model. Errors: mismatch (another number of vertices than the driver's).
Status check_pose(const Model& model, const Pose& pose);
/// Whether a pose fits a driver with this number of vertices. Errors: mismatch.
Status check_pose(std::size_t driver_vertices, const Pose& pose);

/// Restores one level of one model, pose after pose. What does not depend on the pose is prepared once. Const functions
/// may be called from several threads at a time. Results are the same to the byte for any number of threads.
class Restorer {
public:
    /// The model must outlive the restorer. It is not checked: models of your own have to pass check_model. Cost O(V).
    /// Errors: usage (no such level), cancelled.
    static Result<Restorer> create(const Model& model, const RestoreOptions& options = {},
                                   const RunContext& context = RunContext());
    static Result<Restorer> create(const Model&& model, const RestoreOptions& = {},
                                   const RunContext& = RunContext()) = delete;
    Restorer(Restorer&&) noexcept;
    Restorer& operator=(Restorer&&) noexcept;
    ~Restorer();

    /// Number of vertices of the level. Without a level: the vertices of the mesh, in its order.
    std::size_t vertex_count() const;

    /// The gradients that `pose` is restored with: its own, or estimated from its positions. Cost O(driver). Errors:
    /// mismatch (another number of vertices than the driver's).
    Result<std::vector<Mat3f>> gradients(const Pose& pose, const RunContext& context = RunContext()) const;

    /// Positions of the vertices of the level, relative to the mesh's origin. Cost O(V). Errors: mismatch (another
    /// number of vertices than the driver's), cancelled.
    Result<std::vector<Vec3f>> positions(const Pose& pose, const RunContext& context = RunContext()) const;
    /// Writes the positions to `out`, which has vertex_count() points: no memory is allocated for them. Errors:
    /// mismatch, cancelled.
    Status positions(const Pose& pose, std::span<Vec3f> out, const RunContext& context = RunContext()) const;

    /// The level as a mesh. Normals are restored where the mesh had normals; other attributes are unchanged. Errors:
    /// mismatch, cancelled.
    Result<Mesh> mesh(const Pose& pose, const RunContext& context = RunContext()) const;
    /// The level as a mesh, with gradients that gradients(pose) gave: for callers that need both, so that they are
    /// estimated once. Errors: mismatch (also another number of gradients than driver vertices), cancelled.
    Result<Mesh> mesh(const Pose& pose, std::span<const Mat3f> gradients,
                      const RunContext& context = RunContext()) const;

private:
    struct Content;
    explicit Restorer(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

// ---------------------------------------------------------------------------------------------------------------------
// The error of a pose

/// Estimates how far a restored pose is from the same deformation applied to the whole mesh. The estimate looks at the
/// edges of the driver: where positions and gradients of the two ends do not agree, or gradients differ, the
/// deformation is more curved than the driver can follow. Predicted error = a (mismatch at the edge) + b (change of
/// gradient) (height of the detail); a and b are fitted once per model, with a few smooth displacements. For more than
/// nine poses in ten the estimate is within a factor of 2 of the error (`filigree bench estimate`). It does not know
/// that a solver might have moved the whole mesh differently.
class PoseError {
public:
    /// Does not refer to the model later. context: its threads are used later as well; it cannot be cancelled. Cost
    /// O(V).
    explicit PoseError(const Model& model, const RunContext& context = RunContext());
    PoseError(PoseError&&) noexcept;
    PoseError& operator=(PoseError&&) noexcept;
    ~PoseError();

    struct Estimate {
        double rms = 0;           ///< over the vertices of the mesh, model units
        double diagonal = 0;      ///< of the posed driver, model units
        std::vector<float> local; ///< for each driver vertex: rms over the vertices bound around it, model units

        double share() const { return diagonal > 0 ? rms / diagonal : 0; } ///< rms as a fraction of the diagonal
        /// Whether the error is visible: more than a pixel of a picture that the shape fills.
        bool is_too_curved() const { return share() > 1e-3; }
    };
    /// gradients: those of Restorer::gradients, one a driver vertex. Safe from many threads. Cost O(driver); the first
    /// pose with gradients also costs a few restores of 16,384 vertices, and the first pose without gradients an
    /// estimate of gradients as well. Errors: mismatch (another number of vertices or gradients than the driver's).
    Result<Estimate> estimate(const Pose& pose, std::span<const Mat3f> gradients) const;

private:
    /// The vertices bound to a cell, summed for its edges 0-1, 1-2 and 2-0: squares of 4 b_k b_l (1 in the middle of
    /// the edge, 0 at the opposite corner), and these times the squared height.
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

/// The local estimates, blended to the vertices of the mesh, for colours. local: PoseError::Estimate::local. Cost O(V).
std::vector<float> vertex_errors(const Model& model, std::span<const float> local);

// ---------------------------------------------------------------------------------------------------------------------
// Skins
//
// A model is linear-blend skinning of ordinary joints. Driver vertex i rests at c_i and moves to c_i' with gradient
// A_i; vertex p is bound at m = sum b_i c_i. With every joint bound by a translation alone,
//     three influences:  p' = sum b_i [ (A_i / 2) (x - c_i) + c_i' ],  x = 2 p - m
//     six influences:    p' = sum_ij b_i b_j [ (A_i + A_j) / 2 (p - (c_i + c_j) / 2) + (c_i' + c_j') / 2 ]
// Three influences skin a rest shape whose detail is twice as high, with half matrices. Six influences skin the rest
// shape itself and need one more joint for each edge of the driver.

/// Joints and weights for one level of a model.
struct Skin {
    /// The two driver vertices in whose middle a joint lies; for a joint at a driver vertex, that vertex twice.
    using Joint = std::array<Index, 2>;

    unsigned influences = 3;           ///< 3 or 6
    unsigned slots = 4;                ///< joints and weights a vertex: 4 or 8
    std::vector<Joint> joints;         ///< indices into the driver's vertices
    std::vector<Vec3d> rest;           ///< position of each joint at rest
    std::vector<Vec3f> positions;      ///< x of each vertex: the positions to skin
    std::vector<Index> vertex_joints;  ///< `slots` a vertex, largest weight first; 0 where the weight is 0
    std::vector<float> vertex_weights; ///< `slots` a vertex, not negative, sum 1; multiples of 1 / 65535 unless exact

    /// Factor for the gradient of every joint: 1/2 or 1.
    double gradient_scale() const { return influences == 3 ? 0.5 : 1; }
};

/// The skin of level k. Weights are rounded to multiples of 1 / 65535 before positions are computed from them, so that
/// rounding does not move the rest shape; exact: weights stay floats. influences: 3 or 6. Cost O(V). Errors: usage (no
/// such level; another number of influences).
Result<Skin> make_skin(const Model& model, unsigned level, unsigned influences, bool exact);

/// The transform of a joint in a pose: world = [matrix | translation].
struct JointTransform {
    Mat3d matrix;
    Vec3d translation;
};
/// positions, gradients: of the pose, one a driver vertex.
JointTransform joint_transform(const Skin& skin, std::size_t joint, std::span<const Vec3f> positions,
                               std::span<const Mat3f> gradients);

/// A matrix as two nested nodes that have a rotation and a scale each, as files of joints can hold them:
/// matrix = outer_rotation * diag(outer_scale) * inner_rotation * diag(kInnerScale).
struct NestedRotations {
    Eigen::Quaterniond outer_rotation, inner_rotation;
    Vec3d outer_scale; ///< one is negative where the matrix mirrors
};

/// Constant scale of the inner node. The singular values of a rotation are equal, so its axes are not defined; this
/// scale makes them different.
inline const Vec3d kInnerScale = {0.8, 1, 1.25};

/// Decomposes the matrices of one joint, one a frame. Rotations turn as little as possible from frame to frame, so that
/// interpolating them is as good as interpolating the matrices.
std::vector<NestedRotations> align_rotations(std::span<const Mat3d> matrices);

/// Decomposes `scale` times the identity, without a rotation.
NestedRotations resting_rotations(double scale);

} // namespace filigree
