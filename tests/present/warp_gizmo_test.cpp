#include "filigree/present/warp_gizmo.h"

#include "filigree/render.h"

#include <array>
#include <gtest/gtest.h>

namespace filigree {
namespace {

/// Its knob stays under the pointer while a handle is dragged: what is shown is what is done.
TEST(WarpGizmo, KnobsFollowThePointer) {
    Box box;
    box.min = {-0.5, -1, -0.4};
    box.max = {0.5, 1, 0.4};
    const std::array<Vec3f, 2> corners = {box.min.cast<float>(), box.max.cast<float>()};
    const CameraPoints points{corners};
    const Camera camera = fit_camera(std::span(&points, 1), Vec3d(0.4, 0.3, 1), Vec3d::UnitY(), 1);
    const PictureSize size = {400, 400};
    for (const WarpKind part :
         {WarpKind::stretch, WarpKind::squeeze, WarpKind::bend, WarpKind::twist, WarpKind::taper}) {
        const auto knob = [&](const Warps& warps) {
            for (const GizmoShape& shape : gizmo_shapes(warps, box))
                if (shape.part == part) return camera.project(shape.knob, size.width, size.height);
            return Vec3d(Vec3d::Zero());
        };
        Warps wanted;
        if (part == WarpKind::stretch) wanted.stretch = 1.3;
        if (part == WarpKind::squeeze) wanted.squeeze = 0.8;
        if (part == WarpKind::bend) wanted.bend = 30;
        if (part == WarpKind::twist) wanted.twist = 40;
        if (part == WarpKind::taper) wanted.taper = 1.4;
        const Vec3d from = knob({}), to = knob(wanted);
        ASSERT_GT((to - from).head<2>().norm(), 3) << static_cast<int>(part);
        GizmoDrag drag(part, {}, box, camera, from.x(), from.y(), size);
        const Warps reached = drag.moved_to(to.x(), to.y());
        EXPECT_LT((knob(reached) - to).head<2>().norm(), 0.35 * (to - from).head<2>().norm()) << static_cast<int>(part);
    }
}

TEST(WarpGizmo, IsFoundByItsKnobAndKeepsToTheRanges) {
    const Box box{Vec3d(-0.5, -1, -0.4), Vec3d(0.5, 1, 0.4)};
    EXPECT_TRUE(gizmo_shapes({}, Box()).empty());
    const std::vector<GizmoShape> shapes = gizmo_shapes({}, box);
    ASSERT_EQ(shapes.size(), 5u);
    const std::array<Vec3f, 2> corners = {box.min.cast<float>(), box.max.cast<float>()};
    const CameraPoints points{corners};
    const Camera camera = fit_camera(std::span(&points, 1), Vec3d(0.4, 0.3, 1), Vec3d::UnitY(), 1);
    const PictureSize size = {400, 400};
    for (const GizmoShape& shape : shapes) {
        const Vec3d at = camera.project(shape.knob, size.width, size.height);
        EXPECT_EQ(gizmo_at(shapes, camera, at.x(), at.y(), size, 5), shape.part);
        EXPECT_FALSE(gizmo_at(shapes, camera, at.x() + 300, at.y() + 300, size, 5));
    }
    const Vec3d top = camera.project(shapes[0].knob, size.width, size.height);
    GizmoDrag stretch(WarpKind::stretch, {}, box, camera, top.x(), top.y(), size);
    EXPECT_EQ(stretch.moved_to(top.x(), top.y()), Warps());
    EXPECT_EQ(stretch.moved_to(top.x(), top.y() - 1e5).stretch, Warps::kMostFactor);
    EXPECT_EQ(stretch.moved_to(top.x(), 399).stretch, Warps::kLeastFactor);
}

} // namespace
} // namespace filigree
