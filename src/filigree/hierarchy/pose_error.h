// How far a restored pose is from deforming the whole mesh, judged from the pose alone.
#pragma once

#include "filigree/hierarchy/model.h"

namespace filigree {

/// Leaves each driver vertex out and asks how well two neighbours on opposite sides of it, blended as restoring blends
/// (blend_code.h), say where it is. The restored mesh is off by a fixed share of that: measured over bends, twists,
/// tapers and smooth random displacements of meshes and drivers of many kinds, within a factor of 2 for nine poses in
/// ten (test PoseError.IsWithinAFactorOfTwo). It sees what the driver is too coarse for. It does not see that a solver
/// would have moved the whole mesh differently.
class PoseError {
public:
    /// Of a blend model; for others every estimate is 0. The model must outlive this. Cost O(size of the driver).
    explicit PoseError(const Model& model);

    struct Estimate {
        double rms = 0;           ///< over the mesh's vertices, model units
        std::vector<float> local; ///< rms around each driver vertex, model units; 0 where it has no opposite neighbours
    };
    /// gradients: those that the pose is restored with (Restorer::gradients), one a driver vertex. Cost O(driver).
    Estimate estimate(const Pose& pose, std::span<const Mat3f> gradients) const;

private:
    /// A vertex and two neighbours with it nearly between them; share: of the way from first to second.
    struct Triple {
        Index vertex, first, second;
        float share;
    };
    std::vector<Vec3f> rest_;
    std::vector<Triple> triples_;  ///< ascending in vertex
    std::vector<double> vertices_; ///< of the mesh that hang on each driver vertex, by weight
};

} // namespace filigree
