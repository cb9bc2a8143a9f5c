// How fast a meshfree body can swing. Private to the layer.
#pragma once

#include "filigree/context.h"
#include "filigree/physics/body.h"
#include "filigree/physics/meshfree/meshfree_gather.h"

namespace filigree::meshfree {

struct LinearModuli {
    float shear, bulk; ///< Pa
};

/// Largest eigenvalue of M^-1 K at rest, hourglass term included, over
/// lambda + 2 mu. By power iteration: Rayleigh quotients approach it from below. hourglass: z over the shear modulus.
float squared_frequency_over_stiffness(const Body& body, const MlsNeighbours& neighbours,
                                       std::span<const float> hourglass, LinearModuli moduli, int iterations,
                                       const RunContext& context);

} // namespace filigree::meshfree
