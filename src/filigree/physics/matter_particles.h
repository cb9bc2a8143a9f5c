// The particles of a body that flows, parts and joins, as its surface is made of them.
#pragma once

#include "filigree/core/types.h"

namespace filigree {

/// One of each a particle, in an order that stays. World.
struct MatterParticles {
    std::vector<Vec3f> positions;    ///< m
    std::vector<float> volumes;      ///< m^3, as compressed as they are; never above that at rest
    std::vector<float> temperatures; ///< K
    std::vector<float> liquid;       ///< 0 solid .. 1 fluid
    std::vector<float> renewal;      ///< 0: matter as it was at the start .. 1: new
    float spacing = 0;               ///< m, between particles at rest
};

} // namespace filigree
