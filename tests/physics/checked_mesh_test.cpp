// Public calls of the layer look at the meshes they are given.
#include "broken_meshes.h"
#include "filigree/physics/body.h"
#include "filigree/physics/body/make_cells.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(CheckedBody, WhatIsBrokenIsRefused) {
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return make_body(m, Material(), {}, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return make_cells(m, 1, {}, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return DistanceField::create(m, 1, 0, kOneThread); });
}

} // namespace
} // namespace filigree
