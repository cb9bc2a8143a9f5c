// The lattice spacing at which a wanted number of points is inside.
#pragma once

#include "filigree/sample/sample_inside.h"

namespace filigree {

/// The spacing at which about `count` lattice points are inside: to a few percent, but for boxes that are a few
/// spacings thin, where a layer more or less decides.
/// Asks up to four lattices. By rays and winding, where each point takes about a microsecond, it gives up on a mesh
/// that holds hardly a point of 1.6 million. Errors: as InsideSampler; unsuitable (nothing is inside; more than 60,000
/// points along an axis).
Result<double> spacing_for_count(const Mesh& mesh, std::size_t count, const InsideOptions& options,
                                 const RunContext& context);

} // namespace filigree
