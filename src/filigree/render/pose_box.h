// The box of a posed model, without restoring it.
#pragma once

#include "filigree/strip.h"

namespace filigree {

/// Every restored vertex is a mean, with the weights of its driver cell, of the places its three corners alone would
/// carry it to: c_i' + A_i (q - c_i / 2). So the box of those places, taken over the box of all q of the cell, holds
/// it.
class PoseBox {
public:
    /// Blend models only. vertices: of the finest mesh, those that are restored. Cost O(records).
    PoseBox(const Model& model, std::span<const Index> vertices);
    /// Not smaller than the box of the restored vertices, relative to the mesh's origin; larger by about the curvature
    /// within a cell. Cost O(cells).
    Box at(std::span<const Vec3f> positions, std::span<const Mat3f> gradients) const;

private:
    struct Cell {
        Triangle corners;
        Box q;
    };
    std::vector<Cell> cells_;
    std::vector<Vec3d> rest_; ///< of the driver
};

} // namespace filigree
