// What is drawn while the document is another already.
#include "drawn_objects.h"
#include "studio/first_state_once.h"
#include "studio/materials.h"
#include "studio/patience.h"
#include "viewport.h"

#include "filigree/mesh.h"

#include <QOffscreenSurface>
#include <QOpenGLContext>
#include <QTest>
#include <QWidget>

#include <algorithm>

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

TEST(DrawnObjects, AModelWithMoreLevelsThanTheOneDrawn) {
    Workbench workbench{first_state_once()};
    workbench.make_shape({.name = "wavy-cube", .options = {.resolution = 16}});
    workbench.wait_until_idle();
    workbench.set_strip({.levels = 1});
    workbench.wait_until_idle();
    Viewport viewport(workbench);
    viewport.resize(360, 240);
    viewport.set_animated(false);
    viewport.set_passes(kPasses);
    viewport.show();
    const auto is_ready = [&] { return viewport.is_ready(); };
    ASSERT_TRUE(QTest::qWaitFor(is_ready, kPatience));

    workbench.set_strip({.levels = 4});
    workbench.wait_until_idle();
    ASSERT_EQ(workbench.state().level(), 4u);
    viewport.show_all(); // of the old model
    ViewSettings settings = workbench.view().settings();
    settings.split = settings.clip = true;
    workbench.view().set(settings);
    ASSERT_TRUE(QTest::qWaitFor([&] { return is_ready() && viewport.timings().level == 4; }, kPatience));

    ShownModel nothing_ready(workbench.state(), RestoreOn::cpu);
    EXPECT_FALSE(nothing_ready.nearest_ready(1'000));
    EXPECT_EQ(nothing_ready.level(1'000), nullptr);
}

/// Without a window.
struct DrawnObjectsTest : testing::Test {
    Workbench workbench{first_state_once()};
    QOffscreenSurface surface;
    QOpenGLContext opengl;
    std::unique_ptr<DrawnObjects> drawn;

    void SetUp() override {
        QSurfaceFormat format;
        format.setVersion(4, 3);
        format.setProfile(QSurfaceFormat::CoreProfile);
        surface.setFormat(format);
        surface.create();
        opengl.setFormat(format);
        if (!opengl.create() || opengl.format().version() < std::pair(4, 3) || !opengl.makeCurrent(&surface))
            GTEST_SKIP() << "no OpenGL";
        workbench.make_shape({.name = "wavy-cube", .options = {.resolution = 12}});
        workbench.wait_until_idle();
        drawn = std::make_unique<DrawnObjects>(workbench, [](const std::function<void()>& work) { work(); });
        drawn->start(RestoreOn::cpu);
        settle();
    }
    void TearDown() override {
        if (drawn) drawn->stop();
        drawn.reset();
    }

    void settle() {
        workbench.wait_until_idle();
        drawn->background().finish_all();
    }
    void set(const std::function<void(ViewSettings&)>& change) {
        ViewSettings settings = workbench.view().settings();
        change(settings);
        workbench.view().set(settings);
    }
    void bend(double degrees) {
        Warps warps = workbench.state().warps;
        warps.bend = degrees;
        workbench.set_warps(warps);
    }
    Scene full() { return drawn->scene(TileShows::full, workbench.state().level(), {}, 1, QPalette()); }
    /// Three frames, of which the last is shown.
    void simulate() {
        BodySettings body = workbench.state().body;
        body.particles = 300;
        workbench.set_body(body);
        for (int k = 0; k < 2; ++k) {
            workbench.step();
            workbench.wait_until_idle();
            workbench.playback().wait_for_frames(0);
        }
        settle();
    }
    /// Wax in warm air, until some of it flows.
    void melt_some() {
        BodySettings body = workbench.state().body;
        body.material = material_named("wax");
        body.particles = 300;
        body.drop = 0;
        body.melting_time = 1;
        workbench.set_body(body);
        workbench.melt();
        EXPECT_TRUE(QTest::qWaitFor([&] { return drawn->melt() != nullptr; }, kPatience));
        workbench.pause();
        settle();
    }
};

TEST_F(DrawnObjectsTest, TheFullDeformationIsOfThePoseShown) {
    set([](ViewSettings& s) { s.split = true; });
    settle();
    EXPECT_EQ(drawn->full_problem(), "") << "at rest there is nothing to compute";
    bend(30);
    EXPECT_EQ(drawn->full_problem(), "being computed");
    settle();
    EXPECT_EQ(drawn->full_problem(), "");
    ASSERT_EQ(full().objects.size(), 1u);
    const Box of_30 = full().objects[0].drawable->box();

    bend(90);
    EXPECT_EQ(drawn->full_problem(), "being computed");
    EXPECT_TRUE(full().objects.empty()) << "what is drawn is of the pose before";
    settle();
    ASSERT_EQ(full().objects.size(), 1u);
    const Box of_90 = full().objects[0].drawable->box();
    EXPECT_GT((of_90.size() - of_30.size()).norm(), 0.01);

    // What is on its way when the pose changes again does not arrive.
    bend(30);
    workbench.wait_until_idle();
    bend(90);
    drawn->background().finish_all();
    EXPECT_TRUE(full().objects.empty());
    settle();
    ASSERT_EQ(full().objects.size(), 1u);
    EXPECT_LT((full().objects[0].drawable->box().size() - of_90.size()).norm(), 1e-6);
}

TEST_F(DrawnObjectsTest, ARecordedMomentHasNoFullDeformationOfAnother) {
    set([](ViewSettings& s) {
        s.split = true;
        s.ground = false;
    });
    simulate();
    ASSERT_EQ(workbench.frame_count(), 3u);
    ASSERT_EQ(workbench.full().size(), workbench.state().model->mesh.vertex_count());
    EXPECT_EQ(drawn->full_problem(), "");
    const auto count = [&] { return full().objects.size(); };
    const std::size_t at_the_end = count();
    ASSERT_GE(at_the_end, 1u);
    workbench.go_to_frame(1);
    settle();
    EXPECT_EQ(count(), at_the_end - 1) << "the last frame's full deformation is still drawn";
    EXPECT_NE(drawn->full_problem().find("recording"), std::string::npos) << drawn->full_problem();
    workbench.go_to_frame(2);
    settle();
    EXPECT_EQ(count(), at_the_end);
}

TEST_F(DrawnObjectsTest, ColorsAreOfWhatTheLegendSays) {
    set([](ViewSettings& s) { s.coloring = &kLevelColors; });
    settle();
    const std::size_t count = workbench.state().model->mesh.vertex_count();
    EXPECT_EQ(drawn->colors().values, vertex_levels(*workbench.state().model, workbench.state().model->finest_level()));
    bend(40);
    EXPECT_EQ(drawn->colors().values.size(), count);
    set([](ViewSettings& s) { s.coloring = &kErrorColors; });
    EXPECT_TRUE(drawn->colors().values.empty()) << "levels under the legend of an error";
    const unsigned level = workbench.state().level();
    const Scene grey = drawn->scene(TileShows::restored, level, {}, 1, QPalette());
    ASSERT_FALSE(grey.objects.empty());
    EXPECT_FALSE(grey.objects[0].appearance.own_colors);
    settle();
    ASSERT_EQ(drawn->colors().values.size(), count);
    const float most = *std::max_element(drawn->colors().values.begin(), drawn->colors().values.end());
    EXPECT_GT(most, 0);
    EXPECT_LT(most, 0.2f) << "fractions of the diagonal";
    bend(50);
    EXPECT_TRUE(drawn->colors().values.empty()) << "the error of the pose before";
    settle();
    EXPECT_EQ(drawn->colors().values.size(), count);

    simulate();
    EXPECT_EQ(drawn->colors().values.size(), count);
    workbench.go_to_frame(1);
    settle();
    EXPECT_TRUE(drawn->colors().values.empty()) << "nobody knows the error of a recorded moment";
    set([](ViewSettings& s) { s.coloring = &kOwnColors; });
    EXPECT_TRUE(drawn->colors().values.empty());
}

/// Without knowing the full deformation: that would take every vertex through the same pulls.
TEST_F(DrawnObjectsTest, TheExpectedErrorIsColouredForEveryPose) {
    set([](ViewSettings& s) { s.coloring = &kExpectedErrorColors; });
    const std::size_t count = workbench.state().model->mesh.vertex_count();
    const auto most = [&] { return *std::ranges::max_element(drawn->colors().values); };
    settle();
    ASSERT_EQ(drawn->colors().values.size(), count);
    EXPECT_EQ(most(), 0) << "at rest";
    bend(140);
    EXPECT_EQ(drawn->colors().values.size(), count) << "grey for a moment, while it moves";
    settle();
    const float bent = most();
    EXPECT_GT(bent, 1e-5f);
    EXPECT_LT(bent, 0.2f) << "fractions of the diagonal";
    EXPECT_TRUE(workbench.full().empty());
    EXPECT_GE(drawn->colors().range.most, 1e-4f);
    const unsigned level = workbench.state().level();
    const Scene scene = drawn->scene(TileShows::restored, level, {}, 1, QPalette());
    ASSERT_FALSE(scene.objects.empty());
    EXPECT_TRUE(scene.objects[0].appearance.own_colors);

    simulate();
    workbench.go_to_frame(1);
    settle();
    ASSERT_EQ(drawn->colors().values.size(), count) << "a recorded moment has one as well";
    EXPECT_LT(most(), bent) << "it has only begun to fall";

    set([](ViewSettings& s) { s.coloring = &kOwnColors; });
    EXPECT_TRUE(drawn->colors().values.empty());
}

TEST_F(DrawnObjectsTest, TheMeltIsCutIntoTrianglesOnceForAllPicks) {
    EXPECT_TRUE(drawn->melt_triangles().empty());
    melt_some();
    ASSERT_TRUE(drawn->melt());
    const Box box = world_bounds(*drawn->melt());
    const Vec3d middle = 0.5 * (box.min + box.max), above = middle + Vec3d(0, 10, 0);
    const std::optional<Picked> first = drawn->pick_melt({above, -Vec3d::UnitY()});
    ASSERT_TRUE(first);
    const Triangle* const triangles = drawn->melt_triangles().data();
    EXPECT_EQ(drawn->melt_triangles().size(), triangulate(*drawn->melt()).triangles.size());
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(drawn->pick_melt({above, -Vec3d::UnitY()}));
    EXPECT_EQ(drawn->melt_triangles().data(), triangles) << "cut anew for a pick";
    const std::shared_ptr<const Mesh> before = drawn->melt();
    workbench.step();
    workbench.wait_until_idle();
    workbench.playback().wait_for_frames(0);
    settle();
    ASSERT_TRUE(drawn->melt());
    EXPECT_NE(drawn->melt(), before);
    EXPECT_EQ(drawn->melt_triangles().size(), triangulate(*drawn->melt()).triangles.size()) << "of the surface before";
}

/// OpenGL goes away while the melt's heat is shown, and comes back when there is neither.
TEST_F(DrawnObjectsTest, NoHeatIsLeftOfAMeltThatIsGone) {
    set([](ViewSettings& s) { s.coloring = &kHeatColors; });
    melt_some();
    ASSERT_TRUE(drawn->melt());
    EXPECT_FALSE(drawn->colors().values.empty());
    drawn->stop();
    workbench.set_mode(Mode::deform);
    set([](ViewSettings& s) { s.coloring = &kOwnColors; });
    drawn->start(RestoreOn::cpu);
    settle();
    EXPECT_FALSE(drawn->melt());
    EXPECT_TRUE(drawn->colors().values.empty());
    EXPECT_FALSE(full().objects.empty() && drawn->scene(TileShows::restored, 0, {}, 1, QPalette()).objects.empty());
}

} // namespace
