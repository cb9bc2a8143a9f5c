// Handles described in a JSON file (docs/handles.md), applied to a mesh or to a model's driver.
#pragma once

#include "session.h"

#include "filigree/deform/handles.h"

#include <Eigen/Geometry>

namespace filigree::cli {

/// One handle: which vertices, and where they go: rotated about `centre`, then moved.
struct HandleEntry {
    std::string name;
    std::vector<Index> vertices;                         ///< ids in the mesh, or
    std::optional<Box> box = {};                         ///< all vertices inside, world coordinates, or
    std::optional<std::pair<Vec3d, double>> sphere = {}; ///< centre and radius, world coordinates
    Vec3d move = Vec3d::Zero();                          ///< model units
    Eigen::AngleAxisd rotation = Eigen::AngleAxisd::Identity();
    std::optional<Vec3d> centre = {}; ///< unset: the middle of the handle's vertices
};

struct HandlesFile {
    std::string path;
    std::vector<HandleEntry> handles;
};

/// Errors: not_found, bad_file (with the place), usage (a handle without vertices or with two selections).
Result<HandlesFile> read_handles(const std::string& path);

/// Every vertex of the mesh, by one solve over all of them.
Result<Mesh> move_mesh_by_handles(Mesh mesh, const HandlesFile& handles, const RunContext& context);

/// The driver of a model, by a solve over its vertices alone; a handle's vertices stand for the driver's nearest.
Result<Pose> pose_by_handles(const Model& model, const HandlesFile& handles, const RunContext& context);

} // namespace filigree::cli
