// Quad meshes with subdivision connectivity: found from the mesh alone, by undoing subdivisions.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh.h"

namespace filigree {

/// A quad mesh as base quads, each carrying a grid of (n + 1)^2 of the mesh's vertices, n = 2^levels. Neighbouring
/// patches share the vertices on their border by index.
struct RegularPatches {
    unsigned levels = 0;                    ///< how often every second row and column can go
    std::vector<std::array<Index, 4>> base; ///< corners of each patch, ids in the mesh, with its faces' orientation
    /// Patch-major, then row by row: vertex id at (column i, row j) of patch p is grid[(p (n + 1) + j) (n + 1) + i].
    /// base[p] = { (0, 0), (n, 0), (n, n), (0, n) }.
    std::vector<Index> grid;

    std::size_t patch_count() const { return base.size(); }
    std::size_t side() const { return std::size_t{1} << levels; } ///< n
    Index at(std::size_t patch, std::size_t i, std::size_t j) const {
        return grid[(patch * (side() + 1) + j) * (side() + 1) + i];
    }
};

/// Undoes subdivision (each quad into four) as often as all components allow, at most max_levels times. Where several
/// colourings are possible (a torus), the one that keeps vertex 0 of each component. Open borders are fine.
/// Errors: usage (check_mesh refuses the mesh), unsuitable, with the reason and the place (a face that is no quad, a
/// non-manifold edge, not even one level); cancelled. Cost O(V + F).
Result<RegularPatches> find_regular_patches(const Mesh& mesh, unsigned max_levels, const RunContext& context);

} // namespace filigree
