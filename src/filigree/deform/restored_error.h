// How far what is restored is from what deforming every vertex gives.
#pragma once

#include "filigree/mesh.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

namespace filigree {

/// A level of the model, restored from `pose` (no positions: at rest), against its vertices in `full`: one place a
/// vertex of the finest mesh, relative to the mesh's origin. Errors: as of Restorer, mismatch, cancelled; unsuitable (a
/// driver made elsewhere, which is no part of the mesh).
Result<VertexDistance> restored_error(const Model& model, const RestoreOptions& restore, const Pose& pose,
                                      std::span<const Vec3f> full, const RunContext& context);

} // namespace filigree
