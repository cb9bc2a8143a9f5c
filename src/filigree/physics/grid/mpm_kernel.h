// The two loops between particles and nodes that a step of the material point method spends its time in, over the
// particles of one block, in two vector widths. Private to the layer.
#pragma once

#include "filigree/physics/grid/mpm_grid.h"

#include <span>

namespace filigree::mpm {

// width: what the processor has, or less, for tests. Every width gives the same bytes.

/// Nodes that walls hide from particles.
struct BehindWalls {
    std::span<const std::uint32_t> hidden; ///< by particle: a bit a node of the stencil, x fastest; empty: none
    Node* tile = nullptr;                  ///< takes what such nodes are given
};

/// Adds momentum, mass, what stress does in a step dt, and heat that flows, to the nodes of the block's tile.
void scatter_particles(std::span<const std::uint32_t> numbers, const Particle* particles, const Matter& matter,
                       float spacing, float dt, Node* tile, VectorWidth width = widest_vectors(),
                       const BehindWalls& behind = {});

/// What nodes say at a particle, and its sums with the ways to the nodes (m).
struct alignas(32) AtParticle {
    float value[8]; ///< as of a node that is updated: motion, matter
    float slope[3][8];
};
/// out: one for each number. Nothing is behind walls.
void gather_at_particles(std::span<const std::uint32_t> numbers, const Particle* particles, float spacing,
                         const Node* tile, AtParticle* out, VectorWidth width = widest_vectors());

} // namespace filigree::mpm
