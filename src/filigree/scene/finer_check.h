// Error of a scene's meshes against the same scene with eight times the particles.
#pragma once

#include "filigree/scene/world_setup.h"

namespace filigree {

/// Distances from the finer simulation, in diagonals of the body at rest.
struct TruthError {
    double rms = 0;   ///< mean over the frames
    double worst = 0; ///< of any vertex in any frame
};

struct FinerCheck {
    std::size_t particles = 0; ///< of the finer body
    TruthError attached;       ///< every vertex carried by the scene's own particles
    TruthError restored;       ///< restored from the driver that they carry
};

/// Simulates the scene with half the spacing and carries the scene's own particles along with that, so that both move
/// alike and only what is between particles differs. What the particles carry is then compared, `moments` times spread
/// over `frames`. Poses of bodies that flow say little: their own particles would have new neighbours.
/// One a body. Errors: as of set_up and Simulation::create. Cost: a run of eight times the particles with up to twice
/// the substeps.
Result<std::vector<FinerCheck>> check_against_finer(const SceneFile& scene, const ReadyScene& ready, std::size_t frames,
                                                    std::size_t moments, const RunContext& context);

} // namespace filigree
