// A stripped mesh: its levels and how the detail between them is stored.
#pragma once

#include "filigree/hierarchy/blend_code.h"
#include "filigree/hierarchy/pose.h"
#include "filigree/mesh/mesh.h"

#include <span>
#include <string>

namespace filigree {

/// One resolution of a mesh.
struct Level {
    std::vector<Index> vertices;           ///< ids in the finest mesh, ascending
    std::vector<Index> face_offsets = {0}; ///< as in Mesh
    std::vector<Index> corners;            ///< positions in `vertices`

    std::size_t face_count() const { return face_offsets.empty() ? 0 : face_offsets.size() - 1; }
};

/// Everything needed to restore a mesh from a pose of its driver.
struct Model {
    Mesh mesh;                 ///< the finest level, as it came in; see driver_is_behind
    std::vector<Level> levels; ///< coarse to fine, without the finest; levels[0] is the driver
    BlendDetail detail;
    /// Vertex i of the mesh was vertex source_order[i] of the mesh that was stripped; empty: the order is the same.
    std::vector<Index> source_order = {};
    /// The driver was made elsewhere (strip_to_driver): its vertices are the last ones of `mesh`, where no face has
    /// them. No level has them but the driver, so what is restored and written has the mesh's own vertices alone.
    bool driver_is_behind = false;

    /// The number of the finest level; levels 0 .. finest_level() exist.
    unsigned finest_level() const { return static_cast<unsigned>(levels.size()); }
    const Level& driver() const { return levels.front(); }
    /// Of the finest level: the mesh's own, without those of a driver behind them.
    std::size_t vertex_count() const { return mesh.vertex_count() - (driver_is_behind ? driver().vertices.size() : 0); }
    /// Where these are at rest.
    std::span<const Vec3f> positions() const { return std::span(mesh.positions).first(vertex_count()); }
};

/// Level k as a mesh of its own, 0 <= k <= finest_level(): the finest has vertex_count() vertices. Attributes of
/// vertices come along, attributes of corners and faces only at the finest level (the caller can see which are empty).
/// Cost O(size of the mesh).
Mesh level_mesh(const Model& model, unsigned level);

/// A level below the finest as a mesh; mesh: the finest.
Mesh level_mesh(const Mesh& mesh, const Level& level);

/// What a level has, as its level_mesh() would.
struct LevelCounts {
    std::size_t vertices = 0, faces = 0, corners = 0;
    /// Once its faces are cut into triangles.
    std::size_t triangles() const { return corners - 2 * faces; }
};
/// Of level k, 0 <= k <= finest_level().
LevelCounts level_counts(const Model& model, unsigned level);

/// The coarsest level that each vertex of level k is in, as numbers for colours. Cost O(size of the levels).
std::vector<float> vertex_levels(const Model& model, unsigned level);

/// The driver's rest positions, in the driver's order.
std::vector<Vec3f> driver_positions(const Model& model);
/// The pose in which nothing has moved: the driver's rest positions, without gradients.
Pose rest_pose(const Model& model);

/// The first thing wrong with a level of a mesh of so many vertices, as a sentence, or "". Cost O(size).
std::string check_level(const Level& level, std::size_t vertex_count);

/// The first thing wrong with a model, as a sentence, or "" when everything refers to what is there: indices in range,
/// offsets ascending, records one a vertex, numbers finite. A model that passes can be restored. Cost O(size).
std::string check_model(const Model& model);

} // namespace filigree
