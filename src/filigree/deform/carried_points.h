// Points inside a mesh that go along with its driver.
#pragma once

#include "filigree/context.h"
#include "filigree/strip.h"

#include <span>
#include <vector>

namespace filigree {

/// Where a pose takes points: each goes with the driver's vertices by the inverse fourth power of their distances at
/// rest, so above all with the nearest. For pictures: of a large driver, vertices are left out evenly. rest: the
/// points; driver: its vertices at rest, one or more; pose: one position a driver vertex, gradients or none. Cost: at
/// most 1.5 million pairs, or 64 vertices a point.
std::vector<Vec3f> carried_points(std::span<const Vec3f> rest, std::span<const Vec3f> driver, const Pose& pose,
                                  const RunContext& context);

} // namespace filigree
