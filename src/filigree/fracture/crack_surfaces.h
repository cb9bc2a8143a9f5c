// The surfaces inside a body along which it cracks.
#pragma once

#include "filigree/fracture/cut_surface.h"

namespace filigree {

/// Where two cells meet inside the body.
struct CrackSurface {
    Index i, j;         ///< i < j
    Index first, count; ///< its triangles, in CrackSurfaces::triangles
    bool is_fan;        ///< its outline could be filled by a fan alone
};

struct CrackSurfaces {
    std::vector<CrackSurface> facets; ///< in the order of i, then j
    std::vector<Triangle> triangles; ///< over CutSurface::vertices; seen from j counter-clockwise, as they close cell i
};

/// Axes of a facet's plane; unit vectors, z from i to j. Lengths along x and y are model units, for UVs.
struct FacetFrame {
    Vec3d x, y, z;
};
FacetFrame facet_frame(const FractureCells& cells, Index i, Index j);

/// All facets between pieces, with their vertices added to `cut`. Together with the cut surface they close every piece:
/// all edges cancel. edge: the longest edges wanted inside facets, model units; 0: as few triangles as there can be.
/// Where cracks are rough, points inside follow them, and finer bumps rise towards the middle. Cost: about 2 us a
/// triangle, 4 where rough. Errors: cancelled.
Result<CrackSurfaces> crack_surfaces(CutSurface& cut, const FractureCells& cells, double edge,
                                     const RunContext& context);

} // namespace filigree
