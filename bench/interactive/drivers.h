// Drivers of several sizes on many meshes: whether a finer one is always better, and whether an error that is asked for
// is reached.
#pragma once

#include "measurement.h"
#include "named_mesh.h"

#include "filigree/context.h"

namespace filigree::bench {

/// Errors over the curved warps of fidelity_warps (the largest rms, fractions of the diagonal; the largest 95th
/// percentile of the normals, degrees) with drivers of 250, 1,000 and 4,000 vertices, as many as the mesh has more
/// than, from positions and with gradients. A step to the next driver rises where it is more than 5 % worse; below 2e-7
/// and 0.01 degrees errors are rounding.
Measured measure_drivers(const std::vector<NamedMesh>& meshes, const RunContext& context);

/// Strips to a fidelity of 1e-4 and 1e-5 from both sources, and measures the driver with eleven warps that did not
/// choose it: of the same kinds and nowhere more curved. Bends and tapers along every axis (over a shorter side by so
/// much less), twists by other angles, smooth random displacements of other seeds. Meshes below 200 vertices are left
/// out.
Measured measure_goals(const std::vector<NamedMesh>& meshes, const RunContext& context);

} // namespace filigree::bench
