// From a mesh to a model: strip() takes the detail off and leaves a light driver.
//
//     const Model model = strip(mesh, {.base = 1000}).value().model;
//
// The driver is level 0 of the model: about `base` vertices, which are vertices of the mesh. Move it with anything: a
// warp or handles (pose.h), a simulation (physics/simulation.h), your own solver, another program. A Pose says where
// the vertices of the driver are. Next: restore.h puts the detail back; file.h and pack.h keep the model.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// Poses

/// Where the vertices of a driver are, and optionally how space is deformed around each of them. Restoring with
/// gradients is more exact; without them they are estimated from the positions.
struct Pose {
    std::vector<Vec3f> positions; ///< one a driver vertex, in the order of level 0, relative to the mesh's origin
    std::vector<Mat3f> gradients; ///< empty, or one a driver vertex: d (new position) / d (position at rest)
};

/// Poses of one driver, one a frame. Either all of them have gradients or none.
struct PoseSequence {
    double frames_per_second = 60;
    std::vector<Pose> frames;

    bool empty() const { return frames.empty(); }
};

/// Frames that are fetched one at a time: from memory, from a file, or computed. They need not fit into memory.
template <class Frame>
struct FrameSource {
    std::size_t frames = 0;
    double frames_per_second = 60;
    /// Gives frame 0 .. frames - 1. Unless a function says otherwise, it asks in any order, and more than once.
    std::function<Result<Frame>(std::size_t frame)> frame;
    double metres_per_unit = 0; ///< 0: unknown. Formats that have a place for it say it
};

/// The frames of a sequence, which must outlive the result.
inline FrameSource<Pose> frames_of(const PoseSequence& sequence) {
    return {sequence.frames.size(), sequence.frames_per_second,
            [&sequence](std::size_t frame) -> Result<Pose> { return sequence.frames[frame]; }};
}

// ---------------------------------------------------------------------------------------------------------------------
// Models

/// How the vertices of a mesh are bound to the driver. Each vertex belongs to one cell, a triangle of the driver, and
/// follows the positions and gradients of its three vertices. (Where the driver has no faces, a cell is one vertex,
/// named three times.) Records are ordered by cell. Record r is vertex order[r] of the mesh.
struct BlendDetail {
    /// The three driver vertices of each cell. A record blends them with the weights 1 - u - v, u and v.
    std::vector<Triangle> cells;
    std::vector<Index> cell_offsets = {0}; ///< cell c has the records cell_offsets[c] .. cell_offsets[c + 1] - 1
    std::vector<Index> order;              ///< a permutation of the mesh's vertices
    std::vector<float> u, v;               ///< one a record

    /// Vertices of parts that have no driver vertex (rivets, buttons): bound to the driver beside them. Ascending.
    std::vector<Index> across_gap;
    /// Vertices bound to a cell that faces another way than they do, as no better cell is near. Ascending.
    std::vector<Index> facing_away;
};

/// One resolution of a mesh.
struct Level {
    std::vector<Index> vertices;           ///< vertices of the finest mesh, ascending
    std::vector<Index> face_offsets = {0}; ///< F + 1 offsets into `corners`
    std::vector<Index> corners;            ///< indices into `vertices`

    std::size_t face_count() const { return face_offsets.empty() ? 0 : face_offsets.size() - 1; }
};

/// A stripped mesh: all that is needed to restore it from a pose of its driver.
struct Model {
    Mesh mesh;                 ///< the finest level, as it came in; see driver_is_behind
    std::vector<Level> levels; ///< coarse to fine, without the finest; levels[0] is the driver
    BlendDetail detail;
    /// Vertex i of `mesh` was vertex source_order[i] of the mesh that was stripped. Empty: the order is the same.
    std::vector<Index> source_order = {};
    /// true: the driver was made elsewhere (strip_to_driver). Its vertices are then the last vertices of `mesh`,
    /// without a face, and in no level but the driver. Restored and written meshes do not have them.
    bool driver_is_behind = false;

    /// Number of the finest level. Levels 0 .. finest_level() exist.
    unsigned finest_level() const { return static_cast<unsigned>(levels.size()); }
    const Level& driver() const { return levels.front(); }
    /// Number of vertices of the finest level: the mesh's own, without those of a driver behind them.
    std::size_t vertex_count() const { return mesh.vertex_count() - (driver_is_behind ? driver().vertices.size() : 0); }
    /// Positions of these vertices at rest.
    std::span<const Vec3f> positions() const { return std::span(mesh.positions).first(vertex_count()); }
};

/// The positions of the driver at rest, in its order.
std::vector<Vec3f> driver_positions(const Model& model);
/// The pose at rest: the positions of the driver, without gradients.
Pose rest_pose(const Model& model);

/// Level k as a mesh, 0 <= k <= finest_level(). The finest has vertex_count() vertices. Levels below it have the
/// attributes of vertices; the finest has those of corners and faces too. Cost O(size of the mesh).
Mesh level_mesh(const Model& model, unsigned level);
/// A level below the finest as a mesh. mesh: the finest.
Mesh level_mesh(const Mesh& mesh, const Level& level);

/// The size of a level.
struct LevelCounts {
    std::size_t vertices = 0, faces = 0, corners = 0;
    std::size_t triangles() const { return corners - 2 * faces; } ///< once its faces are cut into triangles
};
/// The size of level k, 0 <= k <= finest_level().
LevelCounts level_counts(const Model& model, unsigned level);

/// For each vertex of level k: the coarsest level that it is in, as a number for colours. Cost O(size of the levels).
std::vector<float> vertex_levels(const Model& model, unsigned level);

/// The first thing wrong with a model, as a sentence, or "" when it is sound: indices are in range, offsets ascend,
/// there is one record a vertex, numbers are finite. A model that passes can be restored. Cost O(size).
std::string check_model(const Model& model);
/// The first thing wrong with a level of a mesh of so many vertices, as a sentence, or "". Cost O(size).
std::string check_level(const Level& level, std::size_t vertex_count);

// ---------------------------------------------------------------------------------------------------------------------
// Stripping

struct StripOptions {
    // How coarse the driver is. Set one of these three at most. Unset: 1,000 vertices; a twentieth of the mesh for
    // meshes below 20,000 vertices, but at least 50. Vertices at the same place count once.
    std::optional<std::size_t> base = {}; ///< number of driver vertices, about; 3 or more
    std::optional<unsigned> levels = {};  ///< levels below the finest, each with a quarter of the vertices of the next
    std::optional<double> error = {};     ///< largest distance from the mesh (rms), fraction of the diagonal
    /// Longest edge that simplification makes, fraction of the diagonal. Edges of the mesh itself may be longer. The
    /// driver then keeps vertices in flat parts and may have more of them than asked for.
    std::optional<double> max_edge = {};
    /// Levels with more vertices than this are simplified in parallel clusters, in linear time; smaller levels in one
    /// piece. With max_edge all levels are simplified in one piece.
    std::size_t one_piece = 600'000;
    /// Sorts the vertices of the mesh by place first (Model::source_order says how), so that restoring is fast. For
    /// meshes whose vertices are in a random order.
    bool reorder = false;
    bool operator==(const StripOptions&) const = default;
};

struct StripReport {
    std::size_t welded_vertices = 0;  ///< vertices at the place of an earlier one
    std::size_t across_gap = 0;       ///< size of BlendDetail::across_gap
    std::size_t facing_away = 0;      ///< size of BlendDetail::facing_away
    std::size_t forced_collapses = 0; ///< edges that were collapsed although faces then fold
    double simplify_error = 0;        ///< distance of the driver from the mesh, model units (rms, summed over levels)
    double simplify_seconds = 0, bind_seconds = 0, encode_seconds = 0;
    std::vector<std::string> warnings; ///< sentences: why a given driver is a bad one
    bool operator==(const StripReport&) const = default;
};

struct Stripped {
    Model model;
    StripReport report;
};

/// Takes the detail off a mesh. Any mesh with a vertex can be stripped; the report counts vertices that are bound
/// badly. Results are the same to the byte for any number of threads. Cost O(F) above StripOptions::one_piece vertices,
/// O(F log F) below: about 3 processor seconds a million vertices. Errors: usage (options that make no sense;
/// check_mesh refuses the mesh), unsuitable (no vertices; more than 2^32 / 3 triangles), cancelled.
Result<Stripped> strip(Mesh mesh, const StripOptions& options = {}, const RunContext& context = RunContext());

/// Takes the detail off a mesh, for a driver that was made elsewhere: any mesh near it, with its own vertices. A pose
/// has the positions of that driver's vertices, in their order. Each vertex is bound to the side of the driver that it
/// belongs to along the surface. No driver is refused: the report's warnings say when it is inside out or too far away.
/// Cost O(V log V). Errors: usage (check_mesh refuses one of the two), unsuitable (no vertices in one of them; more
/// triangles or vertices than indices), cancelled.
Result<Stripped> strip_to_driver(Mesh mesh, const Mesh& driver, const RunContext& context = RunContext());

/// Takes the detail off a mesh, for a driver that consists of vertices of the mesh. The model has two levels: the
/// driver and the mesh. driver: its faces are triangles. Cost O(V log V). Errors: usage (check_mesh refuses the mesh;
/// the vertices of the driver do not ascend or are not the mesh's; a face is no triangle), unsuitable (no vertices),
/// cancelled.
Result<Model> bind_to_own_driver(Mesh mesh, Level driver, const RunContext& context = RunContext());

} // namespace filigree
