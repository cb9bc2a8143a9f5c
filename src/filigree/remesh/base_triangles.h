// A fine triangle surface made coarse and even, through changes that are all recorded.
#pragma once

#include "filigree/context.h"
#include "filigree/remesh/surface_map.h"

namespace filigree {

struct BaseTrianglesOptions {
    std::size_t triangles = 1600; ///< about how many are left
};

/// Flips the edges of needles, collapses edges by quadric error [Garland 1997], splits those that are left long,
/// collapses down to the count, then flips edges and relocates vertices for shape and valence. What keeps thin parts is
/// the area guard: no triangle may stand for much more of the original surface than its own area. More triangles are
/// left where features and topology need them. Errors: cancelled. Cost O(F log F).
Status make_base_triangles(SurfaceMap& map, const BaseTrianglesOptions& options, const RunContext& context);

} // namespace filigree
