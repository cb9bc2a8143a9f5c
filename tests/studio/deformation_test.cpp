#include "deformation.h"

#include "filigree/mesh.h"

#include <QSignalSpy>
#include <QTest>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace filigree::studio {
namespace {

State cube_state(unsigned resolution = 24, std::size_t base = 200) {
    State state;
    ShapeOptions options;
    options.resolution = resolution;
    auto source = std::make_shared<Source>();
    source->mesh = make_wavy_cube(options);
    Stripped stripped = strip(source->mesh, {.base = base}, RunContext()).value();
    state.source = source;
    state.model = std::make_shared<const Model>(std::move(stripped.model));
    state.restore.level = state.model->finest_level();
    return state;
}

double rms(std::span<const Vec3f> a, std::span<const Vec3f> b) {
    double sum = 0;
    for (std::size_t v = 0; v < a.size(); ++v) sum += (a[v] - b[v]).cast<double>().squaredNorm();
    return std::sqrt(sum / double(a.size()));
}

std::vector<Vec3f> restored(const State& state, const Pose& pose) {
    return Restorer::create(*state.model, state.restore, RunContext())->positions(pose, RunContext()).value();
}

/// A pull from `start` in the direction of the surface's highest corner, finished.
State pulled(State state, const Vec3f& centre, const Vec3f& way, double grip = 0.2, double reach = 0.7) {
    PullRegion region = pull_region(state, centre, grip, reach);
    Handle pull;
    pull.vertices = region.grip;
    pull.held = region.held;
    pull.centre = centre;
    pull.grip = grip;
    pull.reach = reach;
    pull.move = way;
    HandleDrag drag;
    drag.begin(state.model, state.handle_pose, pull);
    drag.move(way);
    state.handle_pose = drag.finish().value();
    EXPECT_FALSE(drag.is_active());
    state.handles.push_back(pull);
    return state;
}

TEST(Warps, NothingToDoIsNoPose) {
    const State state = cube_state();
    EXPECT_EQ(make_warp(state.warps, world_bounds(state.model->mesh)), nullptr);
    EXPECT_TRUE(deformed_pose(state, RunContext()).positions.empty());
    EXPECT_TRUE(full_deformation(state, RunContext()).value() == state.model->mesh.positions);
}

TEST(Warps, DriverAndAllVerticesGoTheSameWay) {
    State state = cube_state();
    state.warps = {.axis = Axis::x, .stretch = 1.3, .squeeze = 1.1, .bend = 60, .twist = 30, .taper = 0.7};
    const Pose pose = deformed_pose(state, RunContext());
    const std::vector<Vec3f> full = full_deformation(state, RunContext()).value();
    const std::vector<Index>& vertices = state.model->driver().vertices;
    ASSERT_EQ(pose.positions.size(), vertices.size());
    for (std::size_t v = 0; v < vertices.size(); ++v) EXPECT_LT((pose.positions[v] - full[vertices[v]]).norm(), 1e-6f);
    EXPECT_LT(rms(restored(state, pose), full), 0.01); // of a cube with sides of 1
}

TEST(PullRegion, GripAndHeldAreApartAndPinsAreHeld) {
    State state = cube_state();
    const std::vector<Vec3f> rest = driver_positions(*state.model);
    const PullRegion free = pull_region(state, rest[5], 0.2, 0.6);
    for (Index v = 0; v < rest.size(); ++v) {
        const float distance = (rest[v] - rest[5]).norm();
        EXPECT_EQ(std::binary_search(free.grip.begin(), free.grip.end(), v), distance <= 0.2f);
        EXPECT_EQ(std::binary_search(free.held.begin(), free.held.end(), v), distance > 0.6f);
    }
    state.handles.push_back({.vertices = {free.grip[0]}, .targets = {rest[free.grip[0]]}, .pinned = true});
    const PullRegion region = pull_region(state, rest[5], 0.2, 0.6);
    EXPECT_EQ(region.grip.size(), free.grip.size() - 1);
    EXPECT_TRUE(std::binary_search(region.held.begin(), region.held.end(), free.grip[0]));
    EXPECT_EQ(pull_region(state, rest[9], 0, 0).grip, std::vector<Index>{9}); // the nearest at least
}

TEST(HandleDrag, BringsTheGripThereAndHoldsTheRest) {
    const State before = cube_state();
    const Vec3f way(0, 0.3f, 0);
    const std::vector<Vec3f> rest = driver_positions(*before.model);
    const State state = pulled(before, rest[0], way);
    ASSERT_NE(state.handle_pose, nullptr);
    const Pose& pose = *state.handle_pose;
    for (const Index v : state.handles[0].vertices) EXPECT_LT((pose.positions[v] - rest[v] - way).norm(), 1e-6f);
    for (const Index v : state.handles[0].held) EXPECT_LT((pose.positions[v] - rest[v]).norm(), 1e-6f);
    for (const Mat3f& gradient : pose.gradients) EXPECT_NEAR(gradient.determinant(), 1, 1e-4);
}

TEST(HandleDrag, TheNextPullStartsFromTheShapeThatTheLastLeft) {
    const State before = cube_state();
    const std::vector<Vec3f> rest = driver_positions(*before.model);
    const State once = pulled(before, rest[0], Vec3f(0.1f, 0.3f, 0));
    const State twice = pulled(once, rest[40], Vec3f::Zero());
    for (std::size_t v = 0; v < rest.size(); ++v) {
        EXPECT_LT((twice.handle_pose->positions[v] - once.handle_pose->positions[v]).norm(), 1e-4f);
        EXPECT_LT((twice.handle_pose->gradients[v] - once.handle_pose->gradients[v]).norm(), 1e-2f);
    }
}

TEST(HandleDrag, TellsSolutionsWhileItIsDragged) {
    const State state = cube_state();
    const PullRegion region = pull_region(state, driver_positions(*state.model)[0], 0.2, 0.7);
    HandleDrag drag;
    std::shared_ptr<const Pose> latest;
    QObject::connect(&drag, &HandleDrag::solved, &drag, [&](const std::shared_ptr<const Pose>& pose, double took) {
        EXPECT_GE(took, 0);
        latest = pose;
    });
    Handle pull;
    pull.vertices = region.grip;
    pull.held = region.held;
    drag.begin(state.model, nullptr, pull);
    EXPECT_TRUE(drag.is_active());
    EXPECT_TRUE(QTest::qWaitFor([&] { return latest != nullptr; }));
    const Index grabbed = region.grip[0];
    const float start = latest->positions[grabbed].y();
    for (int k = 1; k <= 50; ++k) drag.move(Vec3f(0, 0.01f * float(k), 0));
    EXPECT_TRUE(QTest::qWaitFor([&] { return latest->positions[grabbed].y() > start + 0.49f; }));
    drag.stop();
    EXPECT_FALSE(drag.is_active());
    EXPECT_EQ(drag.finish().value(), nullptr);
}

TEST(HandleDrag, GoingAwayInTheMiddleIsSafe) {
    const State state = cube_state(48, 2000);
    const PullRegion region = pull_region(state, driver_positions(*state.model)[0], 0.2, 0.7);
    Handle pull;
    pull.vertices = region.grip;
    pull.held = region.held;
    HandleDrag drag;
    for (int k = 0; k < 5; ++k) {
        drag.begin(state.model, nullptr, pull);
        drag.move(Vec3f(0, 1, 0));
    }
}

TEST(FullDeformation, RepeatsThePullsOnEveryVertex) {
    State state = cube_state(24, 600);
    const std::vector<Vec3f> rest = driver_positions(*state.model);
    state = pulled(state, rest[0], Vec3f(-0.1f, 0.25f, 0.1f));
    state = pulled(state, rest[100], Vec3f(0, 0.1f, 0.2f));
    state.warps.twist = 30;
    const std::vector<Vec3f> full = full_deformation(state, RunContext()).value();
    const Pose pose = deformed_pose(state, RunContext());
    const double moved = rms(full, state.model->mesh.positions);
    EXPECT_GT(moved, 0.05);
    EXPECT_LT(rms(restored(state, pose), full), 0.03);
}

TEST(HandleDrag, TellsWhatWasAppliedSoThatItCanBeRepeated) {
    const State state = cube_state(24, 600);
    const Index grabbed = Index(state.model->mesh.vertex_count() / 3);
    const PullRegion region = pull_region(state, state.model->mesh.positions[grabbed], 0.1, 0.6, grabbed);
    Handle pull;
    pull.vertices = region.grip;
    pull.held = region.held;
    HandleDrag drag;
    drag.begin(state.model, nullptr, pull, grabbed);
    drag.move(Vec3f(0, 0.3f, 0.1f));
    EXPECT_TRUE(drag.is_busy());
    EXPECT_TRUE(QTest::qWaitFor([&] { return !drag.is_busy(); }));
    const auto pose = drag.finish().value();
    ASSERT_NE(pose, nullptr);
    const std::vector<Vec3f> rest = driver_positions(*state.model);
    for (const Index v : pull.vertices) EXPECT_LT((pose->positions[v] - rest[v] - drag.applied()).norm(), 1e-5f);
}

TEST(FullDeformation, CanBeCancelled) {
    State state = cube_state();
    state = pulled(state, driver_positions(*state.model)[0], Vec3f(0, 0.3f, 0));
    const RunContext context;
    context.cancel();
    const auto result = full_deformation(state, context);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree::studio
