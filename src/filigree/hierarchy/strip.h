// From a mesh to a model: build the levels, take the detail off.
#pragma once

#include "filigree/hierarchy/model.h"

#include <optional>

namespace filigree {

struct StripOptions {
    // How coarse the driver is; at most one of the three. With none: 1,000 vertices, fewer for meshes below 20,000
    // (a twentieth, at least 50) and all of them below 50. Vertices at one place count once.
    std::optional<std::size_t> base = {}; ///< driver vertices, about; 3 or more
    std::optional<unsigned> levels = {};  ///< levels below the finest, each with a quarter of the vertices of the next
    std::optional<double> error = {};     ///< how far the driver may leave the mesh, fraction of the diagonal (rms)
    /// Longest edge that simplification may leave, fraction of the diagonal; edges of the mesh itself may be longer.
    /// Flat parts then keep vertices, and there may be more than asked for above.
    std::optional<double> max_edge = {};
    Precision precision = Precision::float32;
    /// Levels of more vertices are simplified in parallel clusters, in time that grows as the mesh does; smaller ones
    /// in one piece. With max_edge all are made in one piece.
    std::size_t one_piece = 600'000;
    /// The mesh's vertices are put in order_by_place() first, and Model::source_order says where they were: for meshes
    /// whose order is hopeless, which restore slowly.
    bool reorder = false;
    bool operator==(const StripOptions&) const = default;
};

struct StripReport {
    std::size_t welded_vertices = 0; ///< vertices at the place of an earlier one
    std::size_t across_gap = 0;      ///< see Binding
    std::size_t facing_away = 0;
    std::size_t forced_collapses = 0; ///< see Simplified
    double simplify_error = 0;        ///< see Simplified::error; summed over the levels
    double simplify_seconds = 0, bind_seconds = 0, encode_seconds = 0;
    std::vector<std::string> warnings; ///< sentences: why a driver that was given is a bad one
    bool operator==(const StripReport&) const = default;
};

struct Stripped {
    Model model;
    StripReport report;
};

/// Strips any mesh that has a vertex: the report counts what could not be bound well.
/// Errors: usage (options that make no sense; check_mesh refuses the mesh), unsuitable (no vertices; more triangles
/// than kMostListedTriangles, see mesh/edges.h), cancelled. Cost O(F) while the mesh
/// has more than StripOptions::one_piece vertices, and O(F log F) for what is simplified in one piece: about 3
/// processor seconds a million vertices. Same bytes for any number of threads.
Result<Stripped> strip(Mesh mesh, const StripOptions& options, const RunContext& context);

/// The errors of strip that are known before any work: usage, unsuitable (no vertices). Cost O(size) for check_mesh.
std::optional<Error> check_strip(const Mesh& mesh, const StripOptions& options);

/// Takes the detail off a mesh down to a driver that somebody else made: any mesh near it, of vertices of its own. Its
/// vertices are the driver's, all of them and in their order, so poses are arrays of that mesh's positions.
/// Restored meshes have the mesh's own vertices alone (Model::driver_is_behind). Each vertex is bound to the driver's
/// side that it belongs to along the mesh's surface; nothing is refused, see StripReport and its warnings: a driver
/// that is inside out, or so far away that positions lose their digits. Errors: usage (check_mesh refuses one of the
/// two), unsuitable (no vertices in either, more triangles or vertices than indices), cancelled. Cost O(V log V).
Result<Stripped> strip_to_driver(Mesh mesh, const Mesh& driver, Precision precision, const RunContext& context);

/// Takes the detail off a mesh down to a driver of its own vertices that is known already: two levels, the driver and
/// the mesh. driver: triangles. Errors: usage (check_mesh refuses the mesh; the driver's vertices do not ascend or are
/// not the mesh's, or its faces are no triangles over them), unsuitable (no vertices), cancelled. Cost O(V log V).
Result<Model> bind_to_own_driver(Mesh mesh, Level driver, Precision precision, const RunContext& context);

} // namespace filigree
