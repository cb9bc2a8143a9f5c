// From a pose of the driver to the mesh: put the detail back.
#pragma once

#include "filigree/hierarchy/gradient_fit.h"
#include "filigree/hierarchy/model.h"
#include "filigree/hierarchy/pose.h"

#include <optional>

namespace filigree {

struct RestoreOptions {
    std::optional<unsigned> level = {}; ///< restore up to this level; unset: the finest
    bool operator==(const RestoreOptions&) const = default;
};

/// The level that the options mean. Errors: usage (no such level).
Result<unsigned> restored_level(const Model& model, const RestoreOptions& options);
/// Whether a pose belongs to a model. Errors: mismatch (the pose has another number of vertices than the driver).
Status check_pose(const Model& model, const Pose& pose);
/// The same for a driver of so many vertices.
Status check_pose(std::size_t driver_vertices, const Pose& pose);

/// Restores one model at one level, pose after pose. Everything that does not depend on the pose is prepared once.
class Restorer {
public:
    /// The model must outlive the restorer; it is not checked (check_model). Cost O(V). Errors: usage (no such level),
    /// cancelled.
    static Result<Restorer> create(const Model& model, const RestoreOptions& options, const RunContext& context);
    static Result<Restorer> create(const Model&& model, const RestoreOptions&, const RunContext&) = delete;
    Restorer(Restorer&&) noexcept;
    Restorer& operator=(Restorer&&) noexcept;
    ~Restorer();

    /// Vertices of the restored level; the finest mesh's own, in its order, when no level was asked for.
    std::size_t vertex_count() const;

    /// The gradients that `pose` is restored with: its own, or estimated from its positions. Errors: mismatch (the pose
    /// has another number of vertices than the driver).
    Result<std::vector<Mat3f>> gradients(const Pose& pose, const RunContext& context) const;

    /// Positions of the level's vertices. Errors: mismatch (the pose has another number of vertices than the driver),
    /// cancelled. Same bytes for any thread count.
    Result<std::vector<Vec3f>> positions(const Pose& pose, const RunContext& context) const;
    /// The same into `out` (vertex_count() points), for pose after pose without a new array.
    Status positions(const Pose& pose, std::span<Vec3f> out, const RunContext& context) const;

    /// The level as a mesh: positions, and the normals where the mesh came with normals (by the cofactor of the blended
    /// gradient); every other attribute as it came.
    Result<Mesh> mesh(const Pose& pose, const RunContext& context) const;
    /// The same bytes with what gradients(pose) gave, for who asks for both: the work is done once. Errors: also
    /// mismatch (another number of gradients than driver vertices).
    Result<Mesh> mesh(const Pose& pose, std::span<const Mat3f> gradients, const RunContext& context) const;

private:
    struct Content;
    explicit Restorer(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
