// Any mesh as a semi-regular quad mesh: a coarse base of quads, each a grid of (2^levels + 1)^2 vertices.
#pragma once

#include "filigree/mesh/regular_patches.h"
#include "filigree/remesh/manifold_surface.h"
#include "filigree/remesh/quad_quality.h"
#include "filigree/remesh/transfer_attributes.h"

#include <optional>
#include <string>

namespace filigree {

/// What to do with handles and components too small for the patches asked for.
enum class SmallParts {
    remove, ///< handles with a loop below two patch sides are closed, components below half a patch side dropped
    keep,   ///< the surface's topology stays as it is, whatever it costs in shape
};

/// Whether the surface itself is remeshed, or a closed wrap around it.
enum class WrapUse {
    automatic, ///< the wrap when the surface itself cannot pass the gate
    never,
    always,
};

struct QuadRemeshOptions {
    std::size_t quads =
        50'000; ///< about how many, 6 to 100 million; smooth surfaces meet it within 2 %, features add some
    /// How often each patch is halved, 1 to 8. Unset: as many as leave 500 patches or more.
    std::optional<unsigned> levels = {};
    /// Edges whose faces meet at more than this angle stay edges, degrees, 0 to 180; 180 keeps none (open borders
    /// always stay).
    double feature_angle_deg = 40;
    SmallParts small_parts = SmallParts::remove;
    WrapUse wrap = WrapUse::automatic;
    /// The gate's limit on both distances, fraction of the diagonal. Unset: one patch's side, of the layout
    /// asked for; from the input to the quads no more than 6e-3 for 20,000 quads and more, unless levels are set or
    /// the wrap is asked for.
    std::optional<double> max_distance = {};
    bool attributes = true; ///< carry UVs, colours, normals, labels and scalars over
};

/// Distance of one surface from the other, through samples; fractions of the input's diagonal.
struct Deviation {
    double rms = 0, max = 0;
};

struct PhaseSeconds {
    const char* phase;
    double seconds;
};

struct QuadRemeshReport {
    std::size_t patches = 0;
    unsigned levels = 0;
    QuadQuality quality;
    Deviation to_input, from_input;     ///< quads to input, input to quads
    double diagonal = 0;                ///< of the input's box, model units
    double max_distance = 0;            ///< the limit that held
    double max_distance_from_input = 0; ///< and the one from input to quads
    CleanReport clean;
    SurfaceTopology input, output; ///< after clean-up; of the quads
    std::size_t feature_edges = 0; ///< of the cleaned input, kept on patch borders
    bool wrapped = false;
    std::size_t tries = 1; ///< through the gate
    std::string retried;   ///< why the last try but one failed, "" after the first
    std::vector<PhaseSeconds> seconds;
};

struct QuadRemeshed {
    Mesh mesh;              ///< quads only, patch by patch; origin as the input's
    RegularPatches patches; ///< of `mesh`
    /// Where each vertex lies on the input. On filled-in and wrapped places: the closest point there.
    std::vector<CornerPoint> source;
    QuadRemeshReport report;
};

/// Remeshes any mesh that has an area. What comes back has passed the gate: no inverted quad, watertight where the
/// (cleaned) input is, the same Euler number, both distances within the limit. Same bytes for any number of threads.
/// Errors: usage (options out of range; check_mesh refuses the mesh); unsuitable, with the reason (nothing with an
/// area; fewer quads than the parts need; the gate fails every way there is); cancelled. Cost O(F log F + quads).
/// Method: [Lee 1998] (a parametrisation through recorded edge collapses); docs/remesh.md.
Result<QuadRemeshed> quad_remesh(const Mesh& mesh, const QuadRemeshOptions& options, const RunContext& context);

/// The corners of the patches as a mesh: one quad a patch.
Mesh base_mesh(const QuadRemeshed& remeshed);

} // namespace filigree
