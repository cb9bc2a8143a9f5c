// Sharp edges that are worth keeping: where they run, and where they turn.
#pragma once

#include "filigree/remesh/manifold_surface.h"

#include <cstdint>

namespace filigree {

struct FeatureOptions {
    double angle_deg = 40; ///< between the normals of an edge's two triangles
    double patch_side = 0; ///< model units: curves are judged at this scale
};

struct FeatureCurves {
    std::vector<std::uint8_t> half_edges; ///< 3 F: 1 where the edge is sharp, alike on twins; borders are not marked
    std::vector<std::uint8_t> corners;    ///< V: 1 where a curve or a border turns by more than 45 degrees
    std::size_t edge_count = 0;
};

/// Edges sharper than the angle, without those that noise makes: short loose chains, small loops,
/// networks that are small all together.
/// twins: of the surface's half-edges. Cost O(F).
FeatureCurves find_feature_curves(const ManifoldSurface& surface, std::span<const Index> twins,
                                  const FeatureOptions& options);

} // namespace filigree
