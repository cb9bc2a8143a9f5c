// Finding where a body's surface has folded onto itself. Private to the layer.
#pragma once

#include "filigree/physics/contact/matter.h"

namespace filigree {

/// Cells of the surface whose normals have turned towards those of cells with which they share a side.
class FoldedCells {
public:
    explicit FoldedCells(const Matter& matter); ///< matter: not rigid; outlives this

    /// Cells of which the surface has turned so much towards that of another that it may touch itself; ascending. Cost
    /// O(cells).
    std::vector<Index> find(const Vectors& positions, const RunContext& context) const;

private:
    struct Neighbours { ///< two surface cells that share a side
        Index one, other;
        float fold_cosine; ///< between their normals: below it the surface may touch itself
    };

    void turn_by_cells(const Vectors& positions, Vectors& normals) const;

    const Matter& matter_;
    Vectors rest_normals_; ///< of each cell: the mean of its points' normals, unit; zero where it has none
    std::vector<Neighbours> neighbours_;
};

} // namespace filigree
