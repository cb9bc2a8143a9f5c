#include "view.h"

#include <QSignalSpy>

#include <gtest/gtest.h>

namespace filigree::studio {
namespace {

Box unit_box() {
    Box box;
    box.extend(Vec3d(0, 0, 0));
    box.extend(Vec3d(1, 1, 1));
    return box;
}

TEST(ViewState, FittingShowsAllAtZoomOne) {
    ViewState view;
    view.fit(unit_box(), Vec3d(1, 1, 1).normalized(), 1.5);
    EXPECT_NEAR(view.zoom(), 1, 1e-12);
    for (int k = 0; k < 8; ++k) {
        const Vec3d pixel = view.camera().project(Vec3d(k & 1, k >> 1 & 1, k >> 2), 150, 100);
        EXPECT_GT(pixel.x(), 0);
        EXPECT_LT(pixel.x(), 150);
        EXPECT_GT(pixel.y(), 0);
        EXPECT_LT(pixel.y(), 100);
        EXPECT_GT(pixel.z(), 0);
    }
}

TEST(ViewState, ZoomIsHowMuchLarger) {
    ViewState view;
    view.fit(unit_box(), Vec3d(0, 0, 1), 1);
    const Camera before = view.camera();
    view.set_zoom(2);
    EXPECT_NEAR(view.zoom(), 2, 1e-12);
    EXPECT_NEAR((view.camera().eye - before.target).norm(), 0.5 * (before.eye - before.target).norm(), 1e-12);
    view.set_zoom(1e9);
    EXPECT_NEAR(view.zoom(), ViewState::kMostZoom, 1e-9);
    view.set_zoom(0);
    EXPECT_NEAR(view.zoom(), ViewState::kLeastZoom, 1e-9);
    view.set_zoom(std::nan(""));
    EXPECT_NEAR(view.zoom(), ViewState::kLeastZoom, 1e-9);
}

TEST(ViewState, OrbitTurnsAboutTheTargetAndStopsBelowThePole) {
    ViewState view;
    view.fit(unit_box(), Vec3d(0, 0, 1), 1);
    const Camera before = view.camera();
    const double distance = (before.eye - before.target).norm();
    view.orbit(90, 0);
    EXPECT_NEAR((view.camera().eye - (before.target + distance * Vec3d::UnitX())).norm(), 0, 1e-9);
    view.orbit(0, 500);
    const Vec3d direction = (view.camera().eye - view.camera().target).normalized();
    EXPECT_NEAR(std::asin(direction.y()) * 180 / 3.14159265358979, 89, 1e-6);
    view.orbit(0, -1000);
    EXPECT_LT((view.camera().eye - view.camera().target).y(), 0);
    EXPECT_NEAR((view.camera().eye - view.camera().target).norm(), distance, 1e-9);
    EXPECT_NEAR(view.zoom(), 1, 1e-9);
}

TEST(ViewState, PanMovesThePictureByFractionsOfItsHeight) {
    ViewState view;
    view.fit(unit_box(), Vec3d(0, 0, 1), 1);
    const Vec3d target = view.camera().target;
    view.pan(0.25, 0.5);
    const Vec3d pixel = view.camera().project(target, 100, 100);
    EXPECT_NEAR(pixel.x(), 50 - 25, 1e-6);
    EXPECT_NEAR(pixel.y(), 50 + 50, 1e-6);
}

TEST(ViewState, TellsOnlyOfWhatIsAnother) {
    ViewState view;
    QSignalSpy changed(&view, &ViewState::changed), moved(&view, &ViewState::camera_changed);
    ViewSettings settings = view.settings();
    view.set(settings);
    EXPECT_EQ(changed.count(), 0);
    settings.split = true;
    view.set(settings);
    EXPECT_EQ(changed.count(), 1);
    EXPECT_EQ(moved.count(), 0);
    settings.up = UpAxis::z;
    view.set(settings);
    EXPECT_EQ(changed.count(), 2);
    EXPECT_EQ(moved.count(), 1);
    EXPECT_EQ(view.camera().up, Vec3d::UnitZ());
}

} // namespace
} // namespace filigree::studio
