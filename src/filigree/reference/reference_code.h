// The report's detail code (2.4, 2.5): each removed vertex as signed barycentric coordinates and a height over three
// reference points of the next coarser level. Also with four and six references, the report's future work.
//
// Three references: an edge point lies between C1 and C2 with the coarse quad C1 C2 C3 C4 on its left;
// Cm = (C3 + C4) / 2, and P = u C1 + v C2 + w Cm + s h n, n the unit normal of (C1, C2, Cm), u = 1 - v - w. A centre
// point takes its quad's lower edge as C1, C2 and the middle of the upper one as Cm.
// Four: origin, `across` and `up` are means over all four corners of the quad (for an edge point with the edge's middle
// as origin). Six: an edge point also takes the far corners of the quad on its right, where there is one; a centre
// point has only four corners. P = origin + v across + w up + s h n. Measured by the prototype: 4 and 6 change the
// error under deformation by about 15 % either way.
//
// References that span no plane: when restored, the height has no direction and is left out; the point stays among its
// references. When removed, the point is `loose` (see ReferenceDetail). So every answer is finite and bounded.
#pragma once

#include "filigree/reference.h"

#include "filigree/mesh.h"
#include "filigree/reference/height_law.h"

#include <memory>
#include <optional>
#include <string>

namespace filigree {

/// Removes detail level by level against *decoded* coarser points (closed loop), in the precision of the decode, so
/// that errors do not add up. Level 0's vertices are the corners of the base quads. Cost O(V).
/// Errors: as find_regular_patches, which checks the mesh; usage (an option that is out of its range).
Result<ReferenceDetail> encode_reference(const Mesh& mesh, const ReferenceOptions& options, const RunContext& context);

/// The first thing wrong with a detail that came from outside, as a sentence, or "" when it can be restored: sizes that
/// fit each other, ids below vertex_count. Cost O(V).
std::string check_reference(const ReferenceDetail& detail, std::size_t vertex_count);

} // namespace filigree
