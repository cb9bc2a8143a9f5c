// Triangles paired to quads: the patches, and where each of their points lies on the triangles.
#pragma once

#include "filigree/context.h"
#include "filigree/remesh/surface_map.h"

namespace filigree {

/// A patch over one or two triangles, laid out in a plane of its own.
struct BaseQuad {
    std::array<Index, 4> vertices = {};                ///< of the base, counter-clockwise
    std::array<Vec2d, 4> places;                       ///< of those, in the plane
    std::array<Index, 2> slots = {kNoIndex, kNoIndex}; ///< the triangles; the second kNoIndex when there is one
    std::array<std::array<Vec2d, 3>, 2> corners;       ///< the triangles' corners in the plane
    std::array<bool, 4> features = {};                 ///< whether the side from vertex i to i + 1 must stay

    /// The point (s, t) of the patch, 0 to 1: vertices 0 to 3 are at (0, 0), (1, 0), (1, 1), (0, 1).
    TrianglePoint at(double s, double t) const;
};

struct BaseQuads {
    std::vector<BaseQuad> quads;
    std::vector<VertexKind> kinds; ///< of the base's vertices
    bool halved = false;           ///< every patch was cut into four, a triangle without a partner into three
};

/// Pairs the triangles (maximum weighted matching; shape and valence decide), after edge splits that give every region
/// between features an even number of them. If some triangle finds no partner, or if asked to, halves all sides. May
/// change the map. Errors: cancelled. Cost: see match_triangles.
Result<BaseQuads> make_base_quads(SurfaceMap& map, bool halve, const RunContext& context);

} // namespace filigree
