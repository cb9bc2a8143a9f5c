// Public calls of the layer look at the meshes they are given.
#include "broken_meshes.h"
#include "filigree/sample.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(CheckedSample, WhatIsBrokenIsRefused) {
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return InsideSampler::create(m, {}, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return InsideTest::create(m, {}, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return spacing_for_count(m, 100, {}, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED(
        [](const Mesh& m) { return points_inside(m, std::vector<Vec3d>(1, Vec3d::Zero()), {}, kOneThread); });
}

} // namespace
} // namespace filigree
