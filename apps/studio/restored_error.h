// How far what is restored is from what deforming every vertex gives.
#pragma once

#include "document.h"

#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh_distance.h"

namespace filigree::studio {

/// The level shown, restored from `pose` (no positions: at rest), against its vertices in `full`: one place a vertex of
/// the finest mesh.
Result<VertexDistance> restored_error(const State& state, const Pose& pose, std::span<const Vec3f> full,
                                      const RunContext& context);

} // namespace filigree::studio
