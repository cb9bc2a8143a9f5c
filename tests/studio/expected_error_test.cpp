// What the pose shown is expected to be off by, followed while it moves.
#include "expected_error.h"
#include "studio/first_state_once.h"
#include "studio/patience.h"

#include "workbench.h"

#include <QElapsedTimer>
#include <QSignalSpy>
#include <QTest>

#include <algorithm>

#include <gtest/gtest.h>

namespace filigree::studio {
namespace {

struct ExpectedErrorTest : testing::Test {
    Workbench bench{first_state_once()};
    ExpectedError& expected = bench.expected_error();

    void SetUp() override {
        bench.make_shape({.name = "wavy-cube", .options = {.resolution = 16}});
        bench.wait_until_idle();
        bench.set_strip({.base = 60});
        bench.wait_until_idle();
    }
    void bend(double degrees) {
        Warps warps;
        warps.bend = degrees;
        bench.set_warps(warps);
    }
    /// As the library sees the pose shown.
    PoseError::Estimate estimate() const {
        const Model& model = *bench.state().model;
        RestoreOptions options = bench.state().restore;
        options.level.reset();
        const Restorer restorer = Restorer::create(model, options, RunContext()).value();
        return PoseError(model)
            .estimate(*bench.pose(), restorer.gradients(*bench.pose(), RunContext()).value())
            .value();
    }
};

TEST_F(ExpectedErrorTest, IsThatOfThePoseShown) {
    ASSERT_TRUE(expected.estimate());
    EXPECT_EQ(expected.estimate()->share(), 0) << "at rest";
    EXPECT_EQ(expected.warning(), "");
    bend(5);
    EXPECT_TRUE(expected.is_pending());
    bench.wait_until_idle();
    ASSERT_TRUE(expected.estimate());
    EXPECT_EQ(expected.estimate()->rms, estimate().rms);
    EXPECT_GT(expected.estimate()->rms, 0);
    EXPECT_EQ(expected.warning(), "") << "so little is not to be seen";

    bend(170);
    bench.wait_until_idle();
    EXPECT_EQ(expected.estimate()->local, estimate().local);
    ASSERT_GT(expected.estimate()->share(), 1e-3);
    const QString warning = expected.warning();
    EXPECT_TRUE(warning.contains(QString::number(100 * expected.estimate()->share(), 'g', 2) + " % of the diagonal"))
        << warning.toStdString();
    EXPECT_TRUE(warning.contains("larger driver")) << warning.toStdString();

    bench.set_strip({.base = 1500}); // as it advises
    bench.wait_until_idle();
    EXPECT_LT(expected.estimate()->share(), 1e-3);
    EXPECT_EQ(expected.warning(), "");
    bend(0);
    EXPECT_EQ(expected.estimate()->share(), 0) << "rest need not be waited for";
}

TEST_F(ExpectedErrorTest, IsLiveWhileThePoseMovesAndRightWhenItStops) {
    QSignalSpy changed(&expected, &ExpectedError::changed);
    QElapsedTimer clock;
    clock.start();
    double degrees = 20;
    while (clock.elapsed() < 900) { // as a slider that is dragged: never still
        bend(degrees += 0.5);
        QTest::qWait(8);
    }
    const auto seconds = 1e-3 * double(clock.elapsed());
    EXPECT_GE(changed.count(), 2) << "nobody is told before it is over";
    EXPECT_LE(changed.count(), seconds / 0.15 + 2) << "more often than anybody reads";
    bench.wait_until_idle();
    EXPECT_FALSE(expected.is_pending());
    EXPECT_EQ(expected.estimate()->rms, estimate().rms);
}

TEST_F(ExpectedErrorTest, IsLiveWhileTheShapeIsPulled) {
    const std::vector<Vec3f>& p = bench.state().model->mesh.positions;
    const Index top =
        Index(std::max_element(p.begin(), p.end(), [](auto& a, auto& b) { return a.y() < b.y(); }) - p.begin());
    const Vec3d at = bench.state().model->mesh.world_position(top);
    bench.begin_pull(top, at);
    bench.pull_to(at + Vec3d(0, 1.5, 0));
    EXPECT_TRUE(QTest::qWaitFor([&] { return expected.estimate() && expected.estimate()->rms > 0; }, kPatience));
    EXPECT_TRUE(bench.is_pulling());
    bench.cancel_pull();
    EXPECT_EQ(expected.estimate()->rms, 0);
}

TEST_F(ExpectedErrorTest, FollowsABodyAndItsRecording) {
    BodySettings body = bench.state().body;
    body.particles = 300;
    bench.set_body(body);
    bench.make_body();
    bench.wait_until_idle();
    bench.play();
    EXPECT_TRUE(QTest::qWaitFor([&] { return expected.estimate() && expected.estimate()->rms > 0; }, kPatience));
    bench.playback().wait_for_frames(3);
    bench.pause();
    bench.wait_until_idle();
    EXPECT_EQ(expected.estimate()->rms, estimate().rms);
    bench.go_to_frame(1); // where nobody knows every vertex
    bench.wait_until_idle();
    EXPECT_EQ(expected.estimate()->rms, estimate().rms);
}

TEST_F(ExpectedErrorTest, IsOfTheModelShown) {
    bend(120);
    bench.wait_until_idle();
    const double coarse = expected.estimate()->rms;
    bench.set_strip({.base = 400});
    bench.wait_until_idle();
    EXPECT_EQ(expected.estimate()->rms, estimate().rms);
    EXPECT_LT(expected.estimate()->rms, coarse);
}

TEST_F(ExpectedErrorTest, ColorsAreMadeWhereTheyAreWanted) {
    bend(120);
    bench.wait_until_idle();
    EXPECT_TRUE(expected.colors().values.empty());
    expected.want_colors(true);
    bench.wait_until_idle();
    const PoseError::Estimate of_pose = estimate();
    const std::vector<float> errors = vertex_errors(*bench.state().model, of_pose.local);
    ASSERT_EQ(expected.colors().values.size(), errors.size());
    for (std::size_t v = 0; v < errors.size(); ++v)
        ASSERT_FLOAT_EQ(expected.colors().values[v], float(errors[v] / of_pose.diagonal)) << v;
    EXPECT_EQ(expected.colors().range.least, 0);
    EXPECT_GT(expected.colors().range.most, float(of_pose.share()));

    bend(0);
    ASSERT_EQ(expected.colors().values.size(), errors.size());
    EXPECT_EQ(*std::ranges::max_element(expected.colors().values), 0);
    EXPECT_EQ(expected.colors().range.most, 1e-4f) << "the legend would go to 100 %";
    bend(0.01); // of which rounding is a part
    bench.wait_until_idle();
    EXPECT_EQ(expected.colors().range.most, 1e-4f);
}

} // namespace
} // namespace filigree::studio
