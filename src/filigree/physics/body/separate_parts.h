// Parts of a mesh that are nearer to each other than a cell, taken apart. Private to the layer.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/sample/closure.h"

namespace filigree {

/// Gives parts that joined_parts.h finds corners of their own: cells beside each other share corners only where samples
/// inside the mesh (4^3 a cell) lead from one to the other. From such gaps on, down to where the parts hang together,
/// it follows them. A cell that two parts share goes to the one with more of it; what it holds of the other counts in a
/// cell of that one beside it (Cells::homes), and so do cells that only the surface passes through. Returns at how many
/// corners parts are joined still, as JoinedParts: a part lies in one cell alone there. Errors: unsuitable, cancelled.
/// Cost: as find_joined_parts, and O(cells at gaps).
Result<JoinedParts> separate_parts(std::span<const Vec3f> positions, const WeldedTriangles& welded, double scale,
                                   Cells& cells, const RunContext& context);

} // namespace filigree
