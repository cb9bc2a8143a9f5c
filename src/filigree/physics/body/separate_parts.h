// Parts of a mesh that are nearer to each other than a cell, taken apart. Private to the layer.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/sample/closure.h"

#include <optional>

namespace filigree {

/// Gives parts corners of their own that lie in the 2^3 cells around a corner and do not hang together in these: cells
/// beside each other share corners only where samples inside the mesh (4^3 a cell) lead from one to the other. From
/// such gaps and creases on, down to where the parts hang together, it follows them. A cell that two parts share goes
/// to the one with more of it; what it holds of the other counts in a cell of that one beside it (Cells::homes), and so
/// do cells that only the surface passes through. Returns at how many corners parts are joined still, as JoinedParts: a
/// part lies in one cell alone there; none where the mesh says nothing of gaps, as gap_samples. Errors: unsuitable,
/// cancelled. Cost: as find_joined_parts, and O(cells at gaps).
Result<std::optional<JoinedParts>> separate_parts(std::span<const Vec3f> positions, const WeldedTriangles& welded,
                                                  double scale, Cells& cells, const RunContext& context);

} // namespace filigree
