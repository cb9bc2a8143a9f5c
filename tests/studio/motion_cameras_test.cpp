// The camera that goes along with what moves.
#include "viewport_stand.h"

#include <gtest/gtest.h>

namespace filigree::studio {
namespace {

/// Goes far along x.
void record_a_way(Workbench& workbench, double length, std::size_t frames) {
    auto recording = std::make_shared<Recording>();
    for (std::size_t k = 0; k < frames; ++k) {
        auto pose = std::make_shared<Pose>(rest_pose(*workbench.state().model));
        for (Vec3f& p : pose->positions) p.x() += float(length * double(k) / double(frames - 1));
        recording->frames.push_back(std::move(pose));
    }
    workbench.document().edit("A way", [&](State& next) { next.recording = recording; });
    workbench.set_mode(Mode::body);
}

TEST(MotionCameras, TheViewGoesAlong) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    constexpr std::size_t kFrames = 240;
    record_a_way(stand.workbench, 20, kFrames);
    const auto seen = [&](std::size_t frame) { // whether all of its box is in the picture
        stand.workbench.go_to_frame(frame);
        const Box box = stand.workbench.motion_box(frame);
        for (int k = 0; k < 8; ++k) {
            const QPointF at =
                stand.viewport->place_of({k & 1 ? box.max.x() : box.min.x(), k & 2 ? box.max.y() : box.min.y(),
                                          k & 4 ? box.max.z() : box.min.z()});
            if (!stand.viewport->rect().contains(at.toPoint())) return false;
        }
        return true;
    };
    const auto camera = [&] { return stand.workbench.view().camera(); };
    EXPECT_FALSE(seen(kFrames - 1)) << "it has left";
    stand.set([](ViewSettings& s) { s.follow = true; });
    for (const std::size_t frame : {std::size_t{0}, kFrames / 3, kFrames - 1}) EXPECT_TRUE(seen(frame)) << frame;
    EXPECT_LT((camera().eye - camera().target).norm(), 15) << "closer than what sees all of the way";

    // What the user does meanwhile stays.
    const double before = (camera().eye - camera().target).norm();
    stand.workbench.view().orbit(40, 5);
    stand.workbench.view().set_zoom(stand.workbench.view().zoom() * 2);
    const Vec3d direction = (camera().eye - camera().target).normalized();
    stand.workbench.go_to_frame(kFrames / 2);
    stand.workbench.go_to_frame(kFrames - 1);
    EXPECT_LT(((camera().eye - camera().target).normalized() - direction).norm(), 1e-6);
    EXPECT_NEAR((camera().eye - camera().target).norm(), before / 2, 0.2 * before);

    stand.set([](ViewSettings& s) { s.follow = false; });
    const Camera still = camera();
    stand.workbench.go_to_frame(0);
    EXPECT_EQ(camera().target, still.target);
}

/// While a body moves its future is not known: the view stays behind a little, and what falls stays in it.
TEST(MotionCameras, TheViewGoesAlongWithABodyThatMoves) {
    Stand stand("wavy-cube", 8);
    ASSERT_TRUE(stand.is_ready());
    BodySettings body = stand.workbench.state().body;
    body.particles = 100;
    body.ground = false;
    stand.workbench.set_body(body);
    stand.set([](ViewSettings& s) { s.follow = true; });
    stand.workbench.animate();
    stand.workbench.wait_until_idle();
    BodySettings falls = stand.workbench.state().body;
    falls.ground = false;
    stand.workbench.set_body(falls);
    stand.workbench.wait_until_idle();
    stand.workbench.play();
    stand.workbench.playback().wait_for_frames(70); // 6.7 m
    const Camera now = stand.workbench.view().camera();
    const Box box = stand.workbench.motion_box(stand.workbench.frame());
    EXPECT_TRUE(stand.viewport->rect().contains(stand.viewport->place_of(box.centre()).toPoint()));
    EXPECT_GT((now.target - stand.workbench.motion_box(0).centre()).norm(), 2);
    stand.workbench.pause();
}

} // namespace
} // namespace filigree::studio
