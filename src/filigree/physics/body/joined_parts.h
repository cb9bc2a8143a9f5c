// Parts of a mesh that cells join although there is a gap between them. Private to the layer.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/sample/closure.h"

#include <optional>

namespace filigree {

/// Looks at 4^3 samples a cell around every corner: where those inside the mesh are in two parts that do not hang
/// together within four cells, the corner joins them. Gaps below a quarter of a cell are not seen, nor parts that are
/// thinner. Of meshes that are open, and of boxes of more than 2^24 cells, nothing is said. Errors: unsuitable,
/// cancelled. Cost: that of sampling the cells, and O(corners).
Result<JoinedParts> find_joined_parts(std::span<const Vec3f> positions, const WeldedTriangles& welded, double scale,
                                      const Cells& cells, const RunContext& context);

/// The samples that it looks at, of the lattice from the cells' origin on; none where it says nothing.
Result<std::optional<Occupancy>> gap_samples(std::span<const Vec3f> positions, const WeldedTriangles& welded,
                                             double scale, const Cells& cells, const RunContext& context);
/// What gaps at corners come to: steps of samples between two parts, 0 where a corner joins none.
JoinedParts joined_parts_of(std::span<const std::uint8_t> gaps, const Cells& cells);

/// The sentence for it, or "". particles: that the body has.
std::string joined_sentence(const JoinedParts& joined, double spacing, std::size_t particles);

} // namespace filigree
