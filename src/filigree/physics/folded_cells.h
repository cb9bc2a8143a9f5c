// Finding where a body's surface has folded onto itself. Private to the layer.
#pragma once

#include "filigree/physics/matter.h"

namespace filigree {

/// Cells of the surface whose normals have turned towards those of cells with which they share a side.
class FoldedCells {
public:
    explicit FoldedCells(const Matter& matter); ///< matter: not rigid; outlives this

    /// Cells of which the surface has turned so much towards that of another that it may touch itself; ascending. Cost
    /// O(cells).
    std::vector<Index> find(const Vectors& positions, const RunContext& context) const;

private:
    struct Beside {
        Index other;       ///< number in surface_cells_, larger than the first's
        float fold_cosine; ///< between their normals: below it the surface may touch itself
    };
    bool may_touch(const Vectors& positions, Index one, Index other, const Vec3f& turned) const;

    const Matter& matter_;
    Vectors rest_normals_;              ///< of each cell: the mean of its points' normals, unit; zero without points
    std::vector<Index> surface_cells_;  ///< those that have a normal, ascending
    std::vector<Index> beside_offsets_; ///< of each of surface_cells_, and the end
    std::vector<Beside> beside_;        ///< those that it may be folded onto
};

} // namespace filigree
