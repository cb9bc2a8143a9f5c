// Public calls of the layer look at the meshes they are given.
#include "broken_meshes.h"
#include "filigree/coding/mesh_code.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(CheckedCoding, WhatIsBrokenIsRefused) {
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return pack_mesh(m, {}, nullptr, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED(
        [](const Mesh& m) { return pack_mesh(m, {.levels = true}, nullptr, kOneThread); });
}

} // namespace
} // namespace filigree
