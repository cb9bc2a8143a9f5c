// Parts of a mesh that cells join although there is a gap between them. Private to the layer.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/sample/closure.h"

namespace filigree {

/// Looks at 4^3 samples a cell around every corner: where those inside the mesh are in two parts that do not hang
/// together within four cells, the corner joins them. Gaps below a quarter of a cell are not seen, nor parts that are
/// thinner. Of meshes that are open, and of boxes of more than 2^24 cells, nothing is said. Errors: unsuitable,
/// cancelled. Cost: that of sampling the cells, and O(corners).
Result<JoinedParts> find_joined_parts(std::span<const Vec3f> positions, const WeldedTriangles& welded, double scale,
                                      const Cells& cells, const RunContext& context);

/// The sentence for it, or "". particles: that the body has.
std::string joined_sentence(const JoinedParts& joined, double spacing, std::size_t particles);

} // namespace filigree
