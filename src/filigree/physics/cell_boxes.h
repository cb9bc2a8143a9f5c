// Finding which cells of a body points might lie in. Private to the layer.
#pragma once

#include "filigree/physics/matter.h"

namespace filigree {

/// The cells of a body where they are now, sorted into the boxes of a grid.
class CellBoxes {
public:
    /// reach: m, that points may still move before they are looked for again.
    CellBoxes(const Matter& matter, const Vectors& positions, float reach);

    /// The cell that holds the point, or the nearest within reach; kNoIndex where there is none.
    Index find(const Vec3f& point) const;

private:
    Index find_rigid(const Vec3f& point) const;

    const Matter& matter_;
    Mat3f inverse_ = Mat3f::Zero(); ///< of a rigid body: from the world to its cell 0
    Vec3f corner_ = Vec3f::Zero();
    Vec3f high_ = Vec3f::Zero(); ///< with low_ the box of its cells in those coordinates
    float reach_ = 0;
    Vec3f low_ = Vec3f::Zero();
    float step_ = 1;
    std::array<int, 3> counts_{0, 0, 0};
    struct Extent {
        Vec3f low, high, centre;
    };
    std::vector<Index> offsets_;
    std::vector<Index> entries_;  ///< of each box: cells that reach into it
    std::vector<Extent> extents_; ///< of each cell, `reach` wider than it is
};

} // namespace filigree
