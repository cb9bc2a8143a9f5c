// The report's detail code (2.4, 2.5): each removed vertex as signed barycentric coordinates and a height over three
// reference points of the next coarser level. Also with four and six references, the report's future work.
//
// Three references: an edge point lies between C1 and C2 with the coarse quad C1 C2 C3 C4 on its left;
// Cm = (C3 + C4) / 2, and P = u C1 + v C2 + w Cm + s h n, n the unit normal of (C1, C2, Cm), u = 1 - v - w. A centre
// point takes its quad's lower edge as C1, C2 and the middle of the upper one as Cm.
// Four: origin, `across` and `up` are means over all four corners of the quad (for an edge point with the edge's middle
// as origin). Six: an edge point also takes the far corners of the quad on its right, where there is one; a centre
// point has only four corners. P = origin + v across + w up + s h n. Measured by the prototype: 4 and 6 change the
// error under deformation by about 15 % either way.
//
// References that span no plane: when restored, the height has no direction and is left out; the point stays among its
// references. When removed, the point is `loose` (see ReferenceDetail). So every answer is finite and bounded.
#pragma once

#include "filigree/mesh/regular_patches.h"
#include "filigree/reference/height_law.h"

#include <memory>
#include <optional>
#include <string>

namespace filigree {

struct ReferenceOptions {
    unsigned references = 3;              ///< 3 (the report), 4 or 6
    unsigned max_levels = 16;             ///< undo at most this many subdivisions, 1 to 16
    std::optional<std::size_t> base = {}; ///< or as many as bring the driver closest to so many vertices, 3 or more
    bool operator==(const ReferenceOptions&) const = default;
};

/// The detail of a regular mesh, coarse to fine: everything restore needs besides the driver's positions.
struct ReferenceDetail {
    RegularPatches patches;
    unsigned references = 3;
    float extent = 0;               ///< largest absolute coordinate of the mesh at rest, model units
    std::vector<Vec3f> rest_driver; ///< level 0 at rest, ascending by vertex id
    /// (v, w, h) of each vertex that is not in level 0, h in model units. Level by level, and in each: first the edges
    /// of the base mesh, by the lower of their half-edges 4 patch + side (sides in the order of the base quad's
    /// corners), in that half-edge's direction and as seen from its patch; then patch by patch, row by row, cell by
    /// cell: the edge point on the cell's lower edge (not in row 0), the one on its left edge (not in column 0), and
    /// its centre.
    std::vector<Vec3f> records;
    /// Records, ascending, of points whose references at rest span no plane, or that lie too far from them: their
    /// numbers are an offset from the first reference in the basis of the base quad, and no law applies.
    std::vector<Index> loose;
};

/// Removes detail level by level against *decoded* coarser points (closed loop), in the precision of the decode, so
/// that errors do not add up. Level 0's vertices are the corners of the base quads. Cost O(V).
/// Errors: as find_regular_patches, which checks the mesh; usage (an option that is out of its range).
Result<ReferenceDetail> encode_reference(const Mesh& mesh, const ReferenceOptions& options, const RunContext& context);

/// Restores a regular mesh from driver positions, again and again; from several threads at once if need be.
class ReferenceRestorer {
public:
    /// Folds the law into the records. Keeps a reference to `detail`. Cost O(V).
    ReferenceRestorer(const ReferenceDetail& detail, HeightLaw law, const RunContext& context);
    ReferenceRestorer(const ReferenceDetail&&, HeightLaw, const RunContext&) = delete;
    ~ReferenceRestorer();
    ReferenceRestorer(ReferenceRestorer&&) noexcept;
    ReferenceRestorer& operator=(ReferenceRestorer&&) noexcept;

    /// Ids in the finest mesh of the vertices of level k, ascending; level 0 is the driver. Cost O(V).
    std::vector<Index> level_vertices(unsigned level) const;
    /// The quads of level k over the finest mesh's vertex ids, patch by patch, row by row.
    std::vector<std::array<Index, 4>> level_quads(unsigned level) const;

    /// driver: positions of level_vertices(0), in that order. Gives every vertex of `level` its place in `positions`,
    /// which is indexed by the finest mesh's vertex ids; the others are left alone. Same bytes for any thread count.
    void restore(std::span<const Vec3f> driver, unsigned level, std::span<Vec3f> positions,
                 const RunContext& context) const;

    /// The fast form: patch by patch, (m + 1)^2 positions each, m = 2^level, row by row; border points stand in every
    /// patch that has them, with the same bytes. positions.size() = patch_count (m + 1)^2.
    void restore_grids(std::span<const Vec3f> driver, unsigned level, std::span<Vec3f> positions,
                       const RunContext& context) const;

    /// Bytes of folded records that one restore_grids of the finest level reads.
    std::size_t code_bytes() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// The first thing wrong with a detail that came from outside, as a sentence, or "" when it can be restored: sizes that
/// fit each other, ids below vertex_count. Cost O(V).
std::string check_reference(const ReferenceDetail& detail, std::size_t vertex_count);

} // namespace filigree
