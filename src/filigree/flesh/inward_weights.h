// The weights of a surface, carried to the particles inside it.
#pragma once

#include "filigree/flesh.h"

namespace filigree {

/// Neighbours of each particle along the edges of the body's cells, kNoIndex where there is none: x-, x+, y-, y+, z-,
/// z+. Of a body whose particles are the corners of its cells.
std::vector<std::array<Index, 6>> lattice_neighbours(const Body& body);

/// Of each particle the weights of the joints that count most. Particles near the surface or outside have those of the
/// point of the surface that is closest to them; inside, each joint's weight is harmonic. surface: the faces that the
/// body was made of; weights: of its vertices. Cost O(particles) for each joint. Errors: cancelled.
Result<std::vector<FleshWeights>> inward_weights(const Body& body, const Mesh& surface, const SkinWeights& weights,
                                                 std::size_t joints, std::span<const std::array<Index, 6>> neighbours,
                                                 const RunContext& context);

/// The same of one number a vertex, 0 .. 1.
Result<std::vector<float>> inward_values(const Body& body, const Mesh& surface, std::span<const float> values,
                                         std::span<const std::array<Index, 6>> neighbours, const RunContext& context);

} // namespace filigree
