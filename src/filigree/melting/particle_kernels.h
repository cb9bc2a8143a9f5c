// The kernels that a particle field is a sum of.
#pragma once

#include "filigree/context.h"
#include "filigree/physics/simulation.h"

#include <array>

namespace filigree {

/// weight * (1 - |G (x - centre)|^2)^3 where that is above 0.
struct ParticleKernel {
    Vec3f centre;
    std::array<float, 6> shape; ///< G: xx, xy, xz, yy, yz, zz; 1 / m
    float weight;
    Vec3f reach; ///< half sizes of the box it is in; m
};

/// Kernels in an order in which neighbours are close; it depends on the particles alone. Errors: cancelled.
Result<std::vector<ParticleKernel>> make_particle_kernels(const MatterParticles& particles, const RunContext& context);

} // namespace filigree
