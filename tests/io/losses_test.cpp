#include "filigree/io/losses.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(Losses, PolygonsAreCutAndTheRestIsLeftOut) {
    EXPECT_EQ(cannot_hold("STL", {"UVs"}), "STL cannot hold UVs; left out.");
    EXPECT_EQ(cannot_hold("STL", {"UVs", "colours", "groups"}), "STL cannot hold UVs, colours and groups; left out.");
    EXPECT_EQ(cannot_hold("GLB", {kPolygonLoss}),
              "GLB cannot hold faces of more than three corners; cut into triangles. PLY and OBJ keep them.");
    EXPECT_EQ(cannot_hold("GLB", {kPolygonLoss, "groups"}),
              "GLB cannot hold groups; left out. Faces of more than three corners are cut into triangles; PLY and OBJ "
              "keep them.");
}

} // namespace
} // namespace filigree
