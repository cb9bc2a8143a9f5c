// Public calls of the layer look at the meshes they are given.
#include "broken_meshes.h"
#include "filigree/render.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(CheckedDrawing, WhatIsBrokenIsRefused) {
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return DrawData::surface(m, {}, kOneThread); });
}

} // namespace
} // namespace filigree
