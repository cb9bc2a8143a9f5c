// Which cells of a grid keep their pieces of a mesh, and where nodes are inside, so that both fit together.
#pragma once

#include "filigree/melting/grid_cut.h"
#include "filigree/melting/particle_field.h"

#include <optional>

namespace filigree {

/// The triangles of a mesh whose vertices partly live.
struct LivingMesh {
    std::vector<Vec3f> positions; ///< m
    std::vector<Triangle> kept;   ///< all of whose vertices live
    std::vector<Triangle> dying;  ///< some of whose do
    std::vector<Triangle> dead;   ///< none of whose do
};

/// The field's grid, larger where the mesh goes beyond it, with the mesh near what is renewed cut into its cells. Cells
/// keep their pieces of kept triangles; all others are filled from the signs of their nodes. Around an edge of the grid
/// that touches both, the mesh's crossings lead in and out in turn, from the side that one end is on to that of the
/// other: cells where that does not hold give up their pieces. That alone makes the whole closed and manifold; signs
/// only decide how much is kept.
class SeamCells {
public:
    /// renewed: positions of particles of new matter.
    SeamCells(const LivingMesh& mesh, const ParticleField& field, std::span<const Vec3f> renewed);

    /// Errors: cancelled.
    Status settle(const RunContext& context);

    const BlockGrid& grid() const { return grid_; }
    const GridCut& cut() const { return *cut_; }
    bool is_cut(Index kept_triangle) const { return is_cut_[kept_triangle]; }
    bool keeps(Index slot) const { return slot != kNoIndex && (cells_[slot] & kKept) && !(cells_[slot] & kDropped); }
    bool keeps(const GridNode& cell) const { return keeps(grid_.slot(cell)); }
    bool is_inside(Index slot) const { return slot != kNoIndex && inside_[slot]; }
    float value(Index slot) const { return slot == kNoIndex ? ParticleField::kOutside : values_[slot]; }
    struct Crossing {
        Index vertex; ///< of the cut
        bool leaves;  ///< whether what is above is outside
    };
    /// Whether a cell around the edge above a node keeps its pieces.
    bool touches_pieces(Index slot, int axis) const;
    /// The mesh's crossings of such an edge, upward.
    std::span<const Crossing> crossings(Index slot, int axis) const;

private:
    enum CellBits : std::uint8_t {
        kKept = 1,
        kDropped = 2,
        kFar = 4, ///< of triangles that are not cut
        kBand = 8,
    };
    void make_grid(const LivingMesh& mesh, const ParticleField& field);
    void mark_band(int width);
    void cut_band();
    void find_crossings();
    template <class Visit>
    void for_crossings(const Triangle& triangle, const Visit& visit) const;
    void vote(Index slot, int axis, bool leaves);
    void sign_nodes();
    bool give_up_conflicts(const RunContext& context);
    bool is_in_conflict(Index slot, int axis) const;
    template <class Visit>
    void for_box(const Triangle& triangle, const Visit& visit) const;
    std::array<Index, 4> cells_around(Index slot, int axis) const;

    const LivingMesh& mesh_;
    std::span<const Vec3f> renewed_;
    BlockGrid grid_;
    std::vector<float> values_;
    std::vector<GridNode> nodes_below_;  ///< of the mesh's vertices
    std::vector<std::uint8_t> given_up_; ///< cells, in this and earlier rounds
    bool cuts_all_ = false;
    std::optional<GridCut> cut_;
    std::vector<bool> is_cut_;
    std::vector<std::uint8_t> cells_;
    std::vector<std::uint8_t> crossed_; ///< of a slot: axes whose edge the mesh crosses, a bit each
    std::vector<std::int8_t> votes_;    ///< of a node: crossings that say inside, less those that say outside
    std::vector<std::uint8_t> inside_;
    std::unordered_map<std::uint64_t, std::vector<Crossing>> crossings_; ///< of cut triangles, by 4 * slot + axis
};

} // namespace filigree
