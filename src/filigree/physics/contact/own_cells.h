// Finding where a body might meet itself. Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"
#include "filigree/physics/contact/cell_boxes.h"
#include "filigree/physics/contact/folded_cells.h"
#include "filigree/physics/contact/matter.h"

namespace filigree {

/// Surface points of a body that might lie in far cells of the same; but for those of parts without cells. Clusters of
/// 2^3 cells are compared first, by boxes and balls around them, then cells by their boxes, so that matter which lies
/// where it belongs is not looked at point by point. Cells that are not far touch where the surface folds: FoldedCells
/// finds those.
///
/// A cell is far from another if it is not reached in two steps through matter; nor in three, of neighbouring clusters.
class OwnCells {
public:
    explicit OwnCells(const Matter& matter); ///< matter: not rigid; outlives this

    /// A surface point whose cell has folded, and the cell that is not far from it and holds the point; once a point.
    using Folds = std::vector<std::pair<Index, Index>>;
    /// Between which of a body's limbs there is no contact.
    class Passing {
    public:
        /// group: of each particle; pairs: of groups. body: with cells.
        Passing(const Body& body, std::span<const std::uint16_t> group,
                std::span<const std::array<std::uint16_t, 2>> pairs);
        bool holds(Index point, Index cell) const { return passes_[of_point_[point] * groups_ + of_cell_[cell]]; }

    private:
        std::size_t groups_ = 0;
        std::vector<std::uint16_t> of_point_, of_cell_;
        std::vector<std::uint8_t> passes_; ///< of each pair of groups
    };

    /// Those of points that may move by `reach` (m). Cost as FoldedCells::find, and O(cells around those that have
    /// folded).
    Folds folds(const Vectors& positions, float reach, const RunContext& context) const;

    /// For each surface point the far or folded cell that holds it, or the nearest of these within reach (m); kNoIndex
    /// where there is none. Cost O(clusters and folds, and cells and points that are near far cells). positions: of the
    /// cells' corners. passing: null where everything touches.
    std::vector<Index> find(const Vectors& positions, const Folds& folds, float reach, const Passing* passing,
                            const RunContext& context) const;

    bool are_far(Index cell, Index other) const;

    /// How many pairs of clusters `find` looks into, which is what it costs.
    std::size_t candidates(const Vectors& positions, float reach) const;

private:
    using Key = std::array<int, 3>;
    struct Cluster {
        Key at;                 ///< lattice index of its cells, halved
        std::uint32_t far_near; ///< bits of the 3^3 clusters around: some of their cells are far from some of this one
        Index first_cell, first_corner;
        Index first_far; ///< of far_cells_, one for each of those bits
    };
    struct NearBoxes {            ///< of some clusters' cells
        std::vector<Index> first; ///< of each cluster, in `boxes`; kNoIndex of the others
        std::vector<CellBox> boxes;
    };
    struct Extent {
        Vec3f low, high, centre;
        float radius; ///< below 0: of nothing
    };
    static Extent extent_of(std::span<const Index> members, const Vectors& places);
    std::span<const Index> points_of(Index cluster) const {
        return points_of_cells(clusters_[cluster].first_cell, clusters_[cluster + 1].first_cell);
    }
    std::span<const Index> points_of_cells(Index begin, Index end) const { ///< numbers in cells_
        return std::span(surface_points_).subspan(point_offsets_[begin], point_offsets_[end] - point_offsets_[begin]);
    }
    static int direction(const Key& from, const Key& to);
    std::uint64_t far_cells(Index cluster, Index other) const;
    std::vector<Extent> extents(const Vectors& positions) const;
    std::vector<std::pair<Index, Index>> near_of_find(std::span<const Extent> extents, float reach) const;
    std::vector<std::pair<Index, Index>> near_clusters(std::span<const Extent> extents, float around) const;
    NearBoxes cell_boxes(std::span<const std::pair<Index, Index>> near, const Vectors& positions,
                         const RunContext& context) const;
    void look_into(std::span<const std::pair<Index, Index>> near, std::span<const Extent> extents,
                   const NearBoxes& boxes, const Vectors& positions, float reach, const Passing* passing,
                   std::vector<Index>& found) const;

    void add_folds(Index own, std::span<const CellBox> boxes, const Vectors& positions, float reach,
                   Folds& folds) const;

    const Matter& matter_;
    const Embedding in_cells_;      ///< of a meshfree body: its surface points in corners of cells
    const Embedding& points_;       ///< in corners of cells
    std::vector<Cluster> clusters_; ///< and one behind the last
    std::vector<Index> cells_, corners_, surface_points_;
    std::vector<Index> point_offsets_;     ///< of each of cells_, and the end
    std::vector<std::uint64_t> far_cells_; ///< bit i + 8 j: a cluster's i-th cell is far from its neighbour's j-th
    float overhang_ = 0;         ///< m that points may lie outside of their cells; without those of loose parts
    std::vector<Index> numbers_; ///< of each cell, in cells_
    std::vector<std::array<Index, 8>> cell_corners_; ///< of each of cells_, read one after the other
    FoldedCells folded_cells_;
};

} // namespace filigree
