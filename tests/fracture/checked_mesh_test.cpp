// Public calls of the layer look at the meshes they are given.
#include "broken_meshes.h"
#include "filigree/fracture.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(CheckedFracture, WhatIsBrokenIsRefused) {
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED(
        [](const Mesh& m) { return make_fracture_cells(m, {.pieces = 3}, kOneThread); });
    const FractureCells cells =
        make_fracture_cells(make_box(Vec3d::Zero(), Vec3d::Ones()), {.pieces = 3}, kOneThread).value();
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([&](const Mesh& m) { return fracture(m, cells, {}, kOneThread); });
}

} // namespace
} // namespace filigree
