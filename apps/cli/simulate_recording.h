// What a simulation leaves: the poses frame by frame, and figures about them; and the file that a stopped run goes on
// from.
#pragma once

#include "scene_setup.h"

namespace filigree::cli {

/// How far the mesh restored from the driver is from the mesh that the particles carry directly, over all frames.
struct CheckTotals {
    double rms_sum = 0, worst_rms = 0, worst_max = 0; ///< fractions of the diagonal at rest
    double p95_sum = 0, worst_p95 = 0;                ///< degrees between normals
    double direct_seconds = 0;
};

/// Sums over all frames so far.
struct Totals {
    std::uint64_t frames = 0, explicit_frames = 0, descent_frames = 0;
    std::uint64_t substeps = 0, least_substeps = ~std::uint64_t{0}, most_substeps = 0, clamped_particles = 0,
                  most_contacts = 0;
    double elastic_seconds = 0, contact_seconds = 0, other_seconds = 0, coupling_seconds = 0, restore_seconds = 0;
    double deepest_contact = 0;
    float least_volume_ratio = 1, most_stretch = 1;
    Energy start; ///< before the first frame

    void add(const FrameReport& report);
};

struct Recording {
    std::vector<PoseSequence> poses;                        ///< one a body; the first is the start
    std::vector<std::vector<std::vector<Vec3f>>> particles; ///< of each body and frame, where they are drawn
    std::vector<CheckTotals> checks;                        ///< one a body with --check, else none
    Totals totals;
};

/// Everything that a run needs to go on. hash: of the scene.
std::string pack_state(const Recording& recording, const Simulation& simulation, std::uint64_t hash);

/// Puts a run where it was. Errors: bad_file (damaged, not a state), mismatch (of another scene).
Status unpack_state(std::string_view bytes, const std::string& name, std::uint64_t hash, Recording& recording,
                    Simulation& simulation);

} // namespace filigree::cli
