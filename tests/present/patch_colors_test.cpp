#include "filigree/present/patch_colors.h"
#include "filigree/render.h"

#include "filigree/mesh.h"
#include "filigree/present/patch_drawing.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <set>

namespace filigree {
namespace {

TEST(PatchColors, NeighboursDiffer) {
    const Mesh mesh = make_wavy_cube({.resolution = 32});
    const RegularPatches patches = find_regular_patches(mesh, 3, kOneThread).value();
    ASSERT_GT(patches.patch_count(), 6U);
    const std::vector<Index> colors = choose_patch_colors(patches);
    ASSERT_EQ(colors.size(), patches.patch_count());
    for (std::size_t a = 0; a < colors.size(); ++a)
        for (std::size_t b = 0; b < a; ++b) {
            const std::set<Index> corners(patches.base[a].begin(), patches.base[a].end());
            bool touch = false;
            for (const Index corner : patches.base[b]) touch |= corners.contains(corner);
            if (touch) {
                EXPECT_NE(colors[a], colors[b]) << a << ' ' << b;
            }
        }
    EXPECT_EQ(std::set<Index>(colors.begin(), colors.end()).size(), kCategoryCount);
}

TEST(PatchColors, LabelsAndDrawingHaveTheSame) {
    const Mesh mesh = make_wavy_cube({.resolution = 16});
    const RegularPatches patches = find_regular_patches(mesh, 4, kOneThread).value();
    const FaceLabels labels = patch_labels(mesh, 4, kOneThread).value();
    const Mesh drawn = colored_patches(mesh, patches);
    EXPECT_EQ(drawn.face_count(), mesh.face_count());
    std::multiset<Index> in_labels(labels.of_face.begin(), labels.of_face.end()), in_drawing;
    for (std::size_t f = 0; f < drawn.face_count(); ++f) {
        const Vec3f color = drawn.colors[drawn.face(f)[0]].head<3>();
        for (Index k = 0; k < kCategoryCount; ++k)
            if (category_colors()[k] == color) in_drawing.insert(k);
    }
    EXPECT_EQ(in_labels, in_drawing);
}

TEST(PatchColors, RibbonsLieAlongEveryBorder) {
    const Mesh mesh = make_wavy_cube({.resolution = 8});
    const RegularPatches patches = find_regular_patches(mesh, 2, kOneThread).value();
    const Mesh ribbons = border_ribbons(mesh, patches, 0.001);
    EXPECT_EQ(ribbons.face_count(), patches.patch_count() * 4 * patches.side());
}

} // namespace
} // namespace filigree
