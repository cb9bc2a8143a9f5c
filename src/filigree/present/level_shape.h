// A level of a model as a shape that can be picked, and what its levels cost and lose in a picture.
#pragma once

#include "filigree/mesh.h"
#include "filigree/render.h"
#include "filigree/render/level_choice.h"
#include "filigree/restore.h"

#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace filigree {

/// A point of a surface, as seen along a ray.
struct Picked {
    Vec3d at;     ///< in the world
    Index vertex; ///< of the finest mesh, the nearest one
};

/// A level in the processor's memory. Never changes once made.
class LevelShape {
public:
    /// Errors: as of Restorer::create.
    static Result<std::shared_ptr<const LevelShape>> make(std::shared_ptr<const Model> model, RestoreOptions restore,
                                                          unsigned level, const RunContext& context);

    const std::vector<Triangle>& triangles() const { return triangles_; }
    std::size_t vertex_count() const { return vertex_count_; }
    Index finest_vertex(Index vertex) const { return vertices_.empty() ? vertex : vertices_[vertex]; }
    /// The other way; unset: the level does not have it. Cost O(log V).
    std::optional<Index> vertex_of(Index finest) const;
    /// As posed, relative to the mesh's origin. Empty: the pose does not belong to the model.
    std::vector<Vec3f> positions(const Pose& pose, const RunContext& context) const;
    /// What a ray in the world meets first of the shape at these positions, of which the clip plane takes away a part;
    /// up to eight layers of that lie in front of it. Cost: first_hit's, once a layer.
    std::optional<Picked> pick(std::span<const Vec3f> positions, Camera::Ray ray,
                               const std::optional<ClipPlane>& clip) const;

private:
    std::shared_ptr<const Model> model_;
    std::optional<Restorer> restorer_;
    std::vector<Index> vertices_; ///< in the finest mesh; empty: it is the finest
    std::vector<Triangle> triangles_;
    std::size_t vertex_count_ = 0;
};

/// Triangles and vertices of a level; the finest one's deviation is 0, the others' are not measured.
LevelFacts level_facts(const Model& model, unsigned level);
/// How far nearly all (97 %) of the finest mesh's vertices are from each level that is coarser; unset where that is not
/// to be known (a level without faces). Looks at up to 20,000 of them. Errors: cancelled.
Result<std::vector<std::optional<double>>> level_deviations(const Model& model, const RunContext& context);

} // namespace filigree
