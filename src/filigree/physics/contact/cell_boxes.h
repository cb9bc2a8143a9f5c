// Finding which cells of a body points might lie in. Private to the layer.
#pragma once

#include "filigree/physics/contact/matter.h"

#include <algorithm>

namespace filigree {

/// Of a cell's corners, where they are now.
struct CellBox {
    Vec3f low, high, centre; ///< centre: their mean

    CellBox() = default;
    CellBox(const std::array<Index, 8>& corners, const Vectors& positions) {
        low = high = centre = positions[corners[0]];
        for (int k = 1; k < 8; ++k) {
            const Vec3f p = positions[corners[k]];
            low = low.cwiseMin(p);
            high = high.cwiseMax(p);
            centre += p;
        }
        centre /= 8;
    }
    /// Whether some of it is no further than `around` from a box, along each axis ...
    bool meets(const Vec3f& from, const Vec3f& to, float around) const {
        return (to.array() >= low.array() - around).all() && (from.array() <= high.array() + around).all();
    }
    bool holds(const Vec3f& point, float around) const { return meets(point, point, around); } ///< ... or from a point
};

/// A box about any axes.
struct TurnedBox {
    Vec3f centre;
    Mat3f half_axes; ///< columns: from the centre to the middles of three sides
};
inline TurnedBox turned_box(const Box& box) {
    return {box.centre().cast<float>(), (0.5 * box.size()).cast<float>().asDiagonal()};
}

/// The cells of a body where they are now, sorted into the boxes of a grid: a cell into the box of its centre (a large
/// one into several), so that few boxes around a point have all that may hold it.
class CellBoxes {
public:
    /// reach: m, that points may still move before they are looked for again.
    CellBoxes(const Matter& matter, const Vectors& positions, float reach);

    struct Near {
        Index cell = kNoIndex; ///< that holds the point, or the nearest within reach; kNoIndex: there is none
        float gap = 0;         ///< m that the point is outside of a rigid body; of others unknown, 0
    };
    Near find(const Vec3f& point) const;

    TurnedBox rigid_box() const; ///< all of a rigid body that may touch
    /// m: the box is no nearer to a rigid body.
    float gap_of_rigid(const TurnedBox& box) const;

private:
    Near find_rigid(const Vec3f& point) const;
    struct Range {
        std::array<int, 3> from, to; ///< both included
    };
    Range range(const Vec3f& low, const Vec3f& high) const { ///< of boxes
        Range range;
        for (int axis = 0; axis < 3; ++axis) {
            const float last = float(counts_[axis] - 1);
            range.from[axis] = int(std::clamp((low[axis] - low_[axis]) * boxes_a_metre_, 0.0f, last));
            range.to[axis] = int(std::clamp((high[axis] - low_[axis]) * boxes_a_metre_, 0.0f, last));
        }
        return range;
    }

    const Matter& matter_;
    Mat3f inverse_ = Mat3f::Zero(); ///< of a rigid body: from the world to its cell 0
    Vec3f corner_ = Vec3f::Zero();
    Vec3f low_ = Vec3f::Zero();  ///< of all boxes, m; of a rigid body: of all that may touch, in those coordinates
    Vec3f high_ = Vec3f::Zero(); ///< the same, of a rigid body
    float reach_ = 0;
    float boxes_a_metre_ = 1; ///< along an axis
    float around_ = 0;        ///< m: how far from a point the boxes lie that have all of its cells
    std::array<int, 3> counts_{0, 0, 0};
    struct Extent : CellBox { ///< low and high `reach` further out
        Index cell;
    };
    std::vector<Index> offsets_;
    std::vector<Extent> extents_; ///< of one box after the other
};

} // namespace filigree
