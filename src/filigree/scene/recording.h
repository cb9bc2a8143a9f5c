// Result of a simulated scene: the poses of each frame, and figures about the run.
#pragma once

#include "filigree/physics/simulation.h"
#include "filigree/scene/doubts.h"
#include "filigree/strip.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace filigree {

/// How far the mesh restored from the driver is from the mesh that the particles carry directly, over all frames.
struct CheckTotals {
    double rms_sum = 0, worst_rms = 0, worst_max = 0; ///< fractions of the diagonal at rest
    double p95_sum = 0, worst_p95 = 0;                ///< degrees between normals
    /// The same as worst_rms for vertices whose matter is between kFadeBegin and kFadeEnd, where they fade; 0: none
    /// did.
    double worst_fading_rms = 0;
};

/// Sums over all frames so far. No times: equal runs have equal totals.
struct RunTotals {
    std::uint64_t frames = 0;
    std::uint64_t substeps = 0, least_substeps = ~std::uint64_t{0}, most_substeps = 0, clamped_particles = 0,
                  most_contacts = 0;
    double deepest_contact = 0, deepest_in_matter = 0; ///< m
    float least_volume_ratio = 1, most_stretch = 1;
    Energy start; ///< before the first frame

    void add(const FrameReport& report);
};

/// Seconds that the frames of this run took; those before it was resumed are not in it.
struct RunTimes {
    std::uint64_t frames = 0;
    double elastic = 0, contact = 0, other = 0; ///< as FrameReport has them
    double coupling = 0;                        ///< particles to driver
    double restore = 0;                         ///< driver to mesh
    double direct = 0;                          ///< particles to every vertex; only where that was checked

    void add(const FrameReport& report);
};

struct Recording {
    std::vector<PoseSequence> poses;                        ///< one a body; the first is the start
    std::vector<std::vector<std::vector<Vec3f>>> particles; ///< of each body and frame, where they are drawn
    std::vector<std::vector<MatterParticles>> matter;       ///< of each body and frame; none of bodies not of mpm
    std::vector<CheckTotals> checks;                        ///< one a body where that was asked for, else none
    RunTotals totals;
    std::vector<BodyDoubts> doubts; ///< one a body
    std::optional<FirstLoss> first_loss;
    EnergyWatch energy;
};

/// Holds driver vertices whose motion in a frame makes no sense (not finite, or too far) where they were: one such
/// vertex would spoil the whole mesh.
/// before, now: poses one after the other, with gradients. far: the longest way that is sensible in a frame, in the
/// poses' units. most_gradient: the largest norm of a gradient that is. Returns how many were held.
std::size_t hold_lost(const Pose& before, Pose& now, float far, float most_gradient);

/// The longest sensible way of a vertex in a frame, in diagonals of the body at rest.
inline constexpr double kFarInAFrame = 1e4;

} // namespace filigree
