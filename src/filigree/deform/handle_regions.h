// Handles over regions of a mesh: which vertices are taken, and where they go. The rest follows as rigidly as it can.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/hierarchy/model.h"
#include "filigree/hierarchy/pose.h"

#include <Eigen/Geometry>

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filigree {

/// Vertices that go together: rotated about `centre`, then moved. They are named, or lie in a box or a ball.
struct HandleRegion {
    std::string name = {};                               ///< for messages; empty: its number is said
    std::vector<Index> vertices = {};                    ///< of the mesh, and
    std::optional<Box> box = {};                         ///< all vertices inside, world coordinates, and
    std::optional<std::pair<Vec3d, double>> sphere = {}; ///< centre and radius, world coordinates
    Vec3d move = Vec3d::Zero();                          ///< model units
    Eigen::AngleAxisd rotation = Eigen::AngleAxisd::Identity();
    std::optional<Vec3d> centre = {}; ///< world coordinates; unset: the middle of the region's vertices

    /// On the way from rest (0) to where it goes (1).
    HandleRegion part(double fraction) const;
};

/// Every vertex of the mesh, by one solve over all of them; normals turn along. Vertices at one place move together.
/// Errors: usage (check_mesh refuses the mesh; a handle that holds no vertex, a vertex that is not there or in two
/// handles; the sentence begins with the handle), and as of HandleSolver.
Result<Mesh> move_by_handles(Mesh mesh, std::span<const HandleRegion> handles, const RunContext& context);

/// The driver of a model, by a solve over its vertices alone; for a named vertex of the mesh stands the driver's
/// nearest. Errors: the same.
Result<Pose> pose_by_handles(const Model& model, std::span<const HandleRegion> handles, const RunContext& context);

} // namespace filigree
