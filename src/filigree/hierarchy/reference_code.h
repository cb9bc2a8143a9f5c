// The report's detail code (2.4, 2.5): each removed vertex as signed barycentric coordinates and a height over three
// reference points of the next coarser level. Also with four and six references, the report's future work.
#pragma once

#include "filigree/hierarchy/law.h"
#include "filigree/hierarchy/regular_patches.h"

namespace filigree {

struct ReferenceOptions {
    unsigned references = 3;            ///< 3 (the report), 4 or 6
    unsigned max_levels = 16;           ///< undo at most this many subdivisions
};

/// The detail of a regular mesh, coarse to fine: everything restore needs besides the driver's positions.
struct ReferenceDetail {
    RegularPatches patches;
    unsigned references = 3;
    /// Three numbers a coded vertex, in the order reference_code.cpp documents: tangential coordinates v and w in the
    /// frame of the references, and the signed height h (model units).
    std::vector<Vec3f> records;
    /// The size that each record's height is scaled by, at rest: width |C2 - C1| and area of (C1, C2, Cm). Same order.
    std::vector<Vec2f> rest_sizes;
};

/// Removes detail level by level against *decoded* coarser points (closed loop), in the precision of the decode, so
/// that errors do not add up. Level 0's vertices are the corners of the base quads. Cost O(V).
/// Errors: as find_regular_patches; usage (references not 3, 4 or 6).
Result<ReferenceDetail> encode_reference(const Mesh& mesh, const ReferenceOptions& options, const RunContext& context);

/// Restores a regular mesh from driver positions, again and again. Building it folds the law into the records.
class ReferenceRestorer {
public:
    ReferenceRestorer(const ReferenceDetail& detail, Law law);

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

private:
    const ReferenceDetail* detail_;
    Law law_;
    // The folded records and work arrays are the implementer's.
};

} // namespace filigree
