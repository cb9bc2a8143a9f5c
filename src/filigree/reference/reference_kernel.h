// The arithmetic of the reference code: bases of reference points, placing a point in one, and the two loops that
// refine a row and an edge of a patch. Internal to reference_code.cpp.
//
// One template serves a single float (the encoder) and four, eight or sixteen lanes (the restorer). Both do the same
// operations in the same order and neither contracts nor reorders, so they give the same bytes on every processor.
#pragma once

#include "filigree/core/lanes.h"
#include "filigree/reference/height_law.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace filigree::reference {

inline constexpr std::size_t kLanes = 16;

template <class F>
using Point = LaneVector<F>;

/// Squares below this are taken for it: degenerate references then give a zero normal, not a division by zero.
/// Positions are scaled to about one before they come here.
inline constexpr float kTinySquare = 1e-36f;
/// Ratios of areas beyond this are held there, so that nothing overflows.
inline constexpr float kHugeRatio = 1e30f;

template <class F>
FILIGREE_INLINE F at_least(F a, float low) {
    const F bound = F{} + low;
    return bound > a ? bound : a;
}
template <class F>
FILIGREE_INLINE F at_most(F a, float high) {
    const F bound = F{} + high;
    return bound < a ? bound : a;
}

/// 1 / sqrt(max(a, kTinySquare)) to float's precision: a guess from the bits, 3.5 % off at most, then a cubic and a
/// quadratic step: one step less than inverse_sqrt of lanes.h, for the same precision.
template <class F>
FILIGREE_INLINE F bounded_inverse_sqrt(F a) {
    using Int = typename IntOf<F>::type;
    a = at_least(a, kTinySquare);
    // No std::bit_cast: where it is not inlined (-Og), it is a call with other registers than its caller's widths have.
    F y = __builtin_bit_cast(F, 0x5f375a86 - (__builtin_bit_cast(Int, a) >> 1));
    F t = a * y * y;
    y = y * (1.875f - t * (1.25f - 0.375f * t));
    t = a * y * y;
    return y * (1.5f - 0.5f * t);
}

/// The reference points of an edge point: the ends of its coarse edge, beyond them the far corners of the quad on its
/// left, and for six references those of the quad on its right. beyond[i] and behind[i] lie next to ends[i].
template <class F>
struct References {
    Point<F> ends[2], beyond[2], behind[2];
};

/// A plane with coordinates: origin + v across + w up, and the height over it.
template <class F>
struct Basis {
    Point<F> origin, across, up;
};

/// The basis of an edge point. Three references (the report): C1, C2 and Cm = (C3 + C4) / 2 span it. Four: the origin
/// is the edge's middle, `across` the mean of the quad's two edges along it. Six (`both_sides`): `across` is the mean
/// over the quads on both sides, in which the edge itself counts twice, and `up` half the way between their far edges.
template <int kReferences, class F>
FILIGREE_INLINE Basis<F> edge_basis(const References<F>& r, bool both_sides) {
    const Point<F> far_middle = 0.5f * (r.beyond[0] + r.beyond[1]);
    const Point<F> along = r.ends[1] - r.ends[0];
    if constexpr (kReferences == 3) return {r.ends[0], along, far_middle - r.ends[0]};
    const Point<F> middle = 0.5f * (r.ends[0] + r.ends[1]);
    const Point<F> far_along = r.beyond[1] - r.beyond[0];
    if (kReferences == 4 || !both_sides) return {middle, 0.5f * (along + far_along), far_middle - middle};
    const Point<F> behind_middle = 0.5f * (r.behind[0] + r.behind[1]);
    const Point<F> mean_along = 0.25f * (far_along + (r.behind[1] - r.behind[0]));
    return {middle, 0.5f * along + mean_along, 0.5f * (far_middle - behind_middle)};
}

/// The basis of a quad's centre point, from the references of its lower edge. Three: that edge's basis. Four and six:
/// the quad's mean, and the means of its opposite edges.
template <int kReferences, class F>
FILIGREE_INLINE Basis<F> centre_basis(const References<F>& r) {
    Basis<F> basis = edge_basis < kReferences == 3 ? 3 : 4 > (r, false);
    if constexpr (kReferences != 3) basis.origin = basis.origin + 0.5f * basis.up;
    return basis;
}

/// What the law needs besides the records. Factors take the records' unit to the pose's.
struct Scaling {
    HeightLaw law = HeightLaw::keep;
    float height = 1; ///< factor on heights
    float size = 1;   ///< factor on rest sizes
};

/// A basis's size, as the law stores it at rest: width, 1 / area, area.
template <class F>
FILIGREE_INLINE F rest_size(const Basis<F>& basis, HeightLaw law) {
    const Point<F> normal = cross(basis.across, basis.up);
    const F width2 = dot(basis.across, basis.across), area2 = dot(normal, normal);
    if (law == HeightLaw::inverse) return width2 * bounded_inverse_sqrt(width2);
    if (law == HeightLaw::proportional) return bounded_inverse_sqrt(area2);
    return area2 * bounded_inverse_sqrt(area2);
}

/// Eq. 2.7 and 2.14: origin + v across + w up + s h n, with s from the law.
template <class F>
FILIGREE_INLINE Point<F> place(const Basis<F>& basis, const Point<F>& record, F size, const Scaling& scaling) {
    const Point<F> normal = cross(basis.across, basis.up);
    const F area2 = dot(normal, normal);
    const F inverse_area = bounded_inverse_sqrt(area2);
    F height = scaling.height * record.z;
    if (scaling.law != HeightLaw::keep) {
        F s = scaling.size * size;
        if (scaling.law == HeightLaw::inverse) {
            s = s * bounded_inverse_sqrt(dot(basis.across, basis.across));
        } else if (scaling.law == HeightLaw::proportional) {
            s = at_most(s * (area2 * inverse_area), kHugeRatio);
            s = s * bounded_inverse_sqrt(s); // grows with its surroundings alone: no bound needed
        } else {
            s = s * inverse_area;
        }
        if (scaling.law != HeightLaw::proportional) s = at_most(at_least(s, 1 / kMaxHeightScale), kMaxHeightScale);
        height = height * s;
    }
    return basis.origin + (record.x * basis.across + record.y * basis.up + (height * inverse_area) * normal);
}

/// Cells of a patch's row at one level. Rows hold x, y and z one after the other, `pitch` apart; up to kLanes floats
/// around them are read and not used.
struct CellRow {
    const float* behind; ///< coarse row j - 1 (of use from j = 1)
    const float* lower;  ///< coarse row j
    const float* upper;  ///< coarse row j + 1
    std::size_t pitch;   ///< of the coarse rows
    std::size_t cells;   ///< a power of two
    const float* code;   ///< blocks, see block_floats
    float* even;         ///< fine row 2 j: coarse points and edge points
    float* odd;          ///< fine row 2 j + 1: edge points and centre points
    std::size_t fine_pitch;
};

/// Consecutive points of an edge: each its references, gathered. Row 6 c + k is coordinate c of ends, beyond and
/// behind.
struct EdgeRun {
    alignas(64) float references[18][kLanes];
    bool both_sides;
    const float* code;
    std::size_t count; ///< 1 to kLanes
};

inline std::size_t block_width(std::size_t cells) { return std::min(cells, kLanes); }
/// Kinds of basis with a size of their own in a cell: with six references the centre's is none of the edges'.
inline std::size_t cell_sizes(int references, HeightLaw law) {
    return law == HeightLaw::keep ? 0 : references == 6 ? 3 : 2;
}
/// A block of cells in blocks of up to kLanes: v, w, h of the edge points along the row, of those across it and of the
/// centres, then the sizes.
inline std::size_t cell_floats(int references, HeightLaw law) { return 9 + cell_sizes(references, law); }
inline std::size_t edge_floats(HeightLaw law) { return law == HeightLaw::keep ? 3 : 4; }

/// Refines one row of cells. The points on the patch's sides come out as anything; they are set from the edges.
void refine_row(const CellRow& row, int references, const Scaling& scaling);
/// Refines points of an edge.
void refine_edge(const EdgeRun& run, int references, const Scaling& scaling, float (&out)[3][kLanes]);
/// Interleaves `count` points of a row, each coordinate times `unit`; writes up to 3 kLanes floats past the end.
void interleave(const float* row, std::size_t pitch, std::size_t count, float unit, float* out);
/// Copies lines of 64 bytes past the caches; `to` is aligned to them.
void stream_lines(const float* from, std::size_t lines, float* to);
/// Makes what this thread streamed visible to those it tells.
void finish_streaming();

} // namespace filigree::reference
