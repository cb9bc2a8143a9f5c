// Any mesh as quads: a coarse base of quads, each of them a regular grid.
//
//     const Mesh quads = quad_remesh(mesh, {.quads = 50'000}).value().mesh;
//
// What comes back has passed a gate: no inverted quad, closed where the input is closed, close to the input. If nothing
// passes, the error says why and what to ask for. Next: strip.h, file.h; find_regular_patches (mesh.h) finds such grids
// in other quad meshes.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// Reports

/// A point on the surface of a mesh: barycentric coordinates over three corners (indices into Mesh::corners) of one
/// face.
struct CornerPoint {
    Triangle corners = {kNoIndex, kNoIndex, kNoIndex};
    Vec3f barycentric = Vec3f::Zero();
};

/// The quality of a quad mesh. The scaled Jacobian of a quad is the smallest of its corners' (e x f) . n / (|e| |f|): e
/// and f are the edges that leave the corner, n is the normal of the quad. 1: a rectangle; 0 or less: a corner is
/// straight or inverted.
struct QuadQuality {
    std::size_t quads = 0;
    /// Vertices without four quads; vertices on open borders do not count.
    std::size_t irregular_vertices = 0;
    double min_scaled_jacobian = 1, low_scaled_jacobian = 1, mean_scaled_jacobian = 1; ///< low: 1st percentile
    std::size_t inverted = 0;    ///< quads with a scaled Jacobian of 0 or less
    Index worst_quad = kNoIndex; ///< the quad with the smallest
};

/// Measures the quads of a mesh; other faces are ignored. The mesh is not checked. Cost O(F).
QuadQuality measure_quads(const Mesh& mesh, const RunContext& context = RunContext());

/// What was changed to make the input a manifold.
struct CleanReport {
    std::size_t welded_vertices = 0;    ///< vertices at the place of an earlier one
    std::size_t unused_vertices = 0;    ///< vertices in no triangle
    std::size_t degenerate_faces = 0;   ///< triangles that repeat a vertex after welding: dropped
    std::size_t duplicate_faces = 0;    ///< triangles over the same vertices as an earlier one, and walls: dropped
    std::size_t flipped_faces = 0;      ///< turned so that neighbours agree; the larger part of each component stays
    std::size_t cut_edges = 0;          ///< edges with three or more triangles, or two that cannot agree: opened
    std::size_t separated_edges = 0;    ///< edges with four or more triangles: separated into closed sheets
    std::size_t split_vertices = 0;     ///< copies of vertices whose triangles form more than one fan
    std::size_t removed_components = 0; ///< components that were too small
    double removed_area = 0;            ///< their area, fraction of the whole
    std::size_t closed_handles = 0;     ///< handles that were too small
    std::size_t filled_triangles = 0;   ///< triangles that closed them
};

/// Counts of a manifold surface.
struct SurfaceTopology {
    std::size_t components = 0;
    std::size_t border_edges = 0, border_loops = 0;
    std::int64_t euler = 0; ///< vertices - edges + triangles
    /// Handles of all components together: (2 components - border loops - euler) / 2.
    std::int64_t genus() const { return (2 * std::int64_t(components) - std::int64_t(border_loops) - euler) / 2; }
};

// ---------------------------------------------------------------------------------------------------------------------
// Quad remeshing

/// What happens to handles and components that are too small for the patches.
enum class SmallParts {
    remove, ///< handles shorter than two patch sides are closed, components smaller than half a side dropped
    keep,   ///< the topology stays, also where the shape suffers
};

/// Whether the surface itself is remeshed or a closed wrap around it. automatic: the wrap where the surface does not
/// pass the gate.
enum class WrapUse {
    automatic,
    never,
    always,
};

struct QuadRemeshOptions {
    /// Number of quads, 6 to 100 million. Smooth surfaces meet it within 2 %; sharp features add some.
    std::size_t quads = 50'000;
    /// Each patch is halved so many times, 1 to 8. Unset: as often as leaves 500 patches or more.
    std::optional<unsigned> levels = {};
    /// Edges whose faces meet at more than this angle stay sharp, degrees, 0 to 180; 180: none. Open borders always
    /// stay.
    double feature_angle_deg = 40;
    SmallParts small_parts = SmallParts::remove;
    WrapUse wrap = WrapUse::automatic;
    /// The gate's limit on the distances between input and quads, fraction of the diagonal. Unset: one side of a patch;
    /// and from the input to the quads at most 6e-3 for 20,000 quads and more, unless levels are set or wrap is
    /// `always`.
    std::optional<double> max_distance = {};
    bool attributes = true; ///< transfer UVs, colours, normals, labels and scalars
};

/// Distance of one surface from the other at samples, fractions of the input's diagonal.
struct Deviation {
    double rms = 0, max = 0;
};

struct PhaseSeconds {
    const char* phase;
    double seconds;
};

/// What quad_remesh did.
struct QuadRemeshReport {
    std::size_t patches = 0;
    unsigned levels = 0;
    QuadQuality quality;
    Deviation to_input, from_input;     ///< from the quads to the input, and from the input to the quads
    double diagonal = 0;                ///< of the input, model units
    double max_distance = 0;            ///< the limit that counted
    double max_distance_from_input = 0; ///< the limit from the input to the quads
    CleanReport clean;
    SurfaceTopology input, output; ///< of the cleaned input; of the quads
    std::size_t feature_edges = 0; ///< sharp edges of the cleaned input, kept on patch borders
    bool wrapped = false;
    std::size_t tries = 1; ///< number of tries at the gate
    std::string retried;   ///< why the try before the last one failed; "" after one try
    std::vector<PhaseSeconds> seconds;
};

struct QuadRemeshed {
    Mesh mesh;              ///< quads only, patch by patch; origin as the input's
    RegularPatches patches; ///< the patches of `mesh`
    /// For each vertex: its place on the input; the closest point where the surface was filled or wrapped.
    std::vector<CornerPoint> source;
    QuadRemeshReport report;
};

/// Remeshes any mesh that has an area. What comes back has passed the gate: no inverted quad, closed where the
/// (cleaned) input is closed, the same Euler number, both distances within the limit. The same bytes for any number of
/// threads. Method: a parametrisation through recorded edge collapses [Lee 1998], docs/remesh.md. Cost O(F log F +
/// quads). Errors: usage (an option out of range; check_mesh refuses the mesh), unsuitable (nothing with an area; fewer
/// quads than the parts need; every way fails at the gate; the sentence gives the reason), cancelled.
Result<QuadRemeshed> quad_remesh(const Mesh& mesh, const QuadRemeshOptions& options = {},
                                 const RunContext& context = RunContext());

/// The patches as a mesh: one quad a patch.
Mesh base_mesh(const QuadRemeshed& remeshed);

} // namespace filigree
