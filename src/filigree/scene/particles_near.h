// Particles near points of a body's surface: those that a pin holds or a force pushes.
#pragma once

#include "filigree/physics/body.h"

#include <span>
#include <vector>

namespace filigree {

/// Particles within half a cell's diagonal of any of the points, and the one nearest to each. points: in the body's
/// rest space, m. Returns ascending ids, each once. Cost O(particles
/// log(particles), and points); of a point that is far from all, O(particles).
std::vector<Index> particles_near(const Body& body, std::span<const Vec3f> points);

} // namespace filigree
