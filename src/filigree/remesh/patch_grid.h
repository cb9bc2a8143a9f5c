// The quads themselves: a regular grid of vertices in every patch, on the surface, shared along patch borders.
#pragma once

#include "filigree/mesh.h"
#include "filigree/remesh/base_quads.h"
#include "filigree/remesh/surface_walk.h"

namespace filigree {

/// Vertices are numbered corners first, then side by side, then patch by patch.
struct PatchGrid {
    RegularPatches patches;
    std::vector<std::array<bool, 4>>
        features; ///< of each patch: whether the side from base vertex k to k + 1 is a curve
    std::vector<Vec3d> positions;
    std::vector<TrianglePoint> source; ///< on the original surface; kept in step with positions while points stay on it
    std::vector<VertexKind> kinds;
    /// Above 0 for vertices that stay at a tip: how far untangling may take them from there, model units; see
    /// hold_tips.
    std::vector<float> held;
    /// The two neighbours along the curve of each curve vertex, else kNoIndex.
    std::vector<std::array<Index, 2>> along;

    std::vector<std::array<Index, 4>> quads() const; ///< patch by patch, row by row
};

/// Samples every point through the map. Cost O(points x 30 records), in parallel.
PatchGrid sample_patches(const SurfaceMap& map, const BaseQuads& base, const SurfaceWalk& walk, unsigned levels,
                         const RunContext& context);

/// One level more: what is new begins between its neighbours, walked onto the surface.
PatchGrid halve_grid(const PatchGrid& coarse, const SurfaceWalk& walk, const RunContext& context);

/// The surface as a mesh of quads.
Mesh grid_mesh(const PatchGrid& grid, const Vec3d& origin);

} // namespace filigree
