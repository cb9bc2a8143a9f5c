// How well the error that is judged from a pose alone (PoseError) agrees with the true one.
#pragma once

#include "measurement.h"
#include "named_mesh.h"

#include "filigree/context.h"

namespace filigree::bench {

/// Poses by random_warp with the seeds 1 to `poses`, in turn over the drivers of the meshes: of 250, 1,000 and 4,000
/// vertices where the mesh has four times as many, else of a quarter of its vertices; meshes below 200 vertices are
/// left out. Each pose once from positions and once with gradients. Tables: shares by kind of warp and by driver, and
/// the worst poses. Cost: a few milliseconds a pose for small meshes.
Measured measure_estimate(const std::vector<NamedMesh>& meshes, std::size_t poses, const RunContext& context);

} // namespace filigree::bench
