#include "filigree/pose.h"

#include "filigree/mesh.h"
#include "filigree/restore.h"
#include "filigree/strip.h"
#include "threads.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

namespace filigree {
namespace {

constexpr double kTolerance = 1e-5;

Model cube_model(std::size_t base = 200) {
    return strip(make_wavy_cube({.resolution = 24}), {.base = base}, kAllThreads).value().model;
}

bool has(const std::vector<Index>& ascending, Index v) {
    return std::binary_search(ascending.begin(), ascending.end(), v);
}

/// Steps until the pull has arrived.
Pose pulled(PullSolver& solver, const Vec3f& way) {
    Pose pose;
    do pose = solver.step(way, kTolerance, kAllThreads).value();
    while (!solver.has_arrived(kTolerance));
    return pose;
}

double rms(std::span<const Vec3f> a, std::span<const Vec3f> b) {
    double sum = 0;
    for (std::size_t v = 0; v < a.size(); ++v) sum += (a[v] - b[v]).cast<double>().squaredNorm();
    return std::sqrt(sum / double(a.size()));
}

TEST(PullRegion, TakesWhatIsNearAndHoldsWhatIsFarOrPinned) {
    const Model model = cube_model();
    const std::vector<Vec3f> rest = driver_positions(model);
    const PullRegion free = pull_region(model, {}, rest[5], 0.2, 0.6);
    for (Index v = 0; v < rest.size(); ++v) {
        EXPECT_EQ(has(free.grip, v), (rest[v] - rest[5]).norm() <= 0.2f);
        EXPECT_EQ(has(free.held, v), (rest[v] - rest[5]).norm() > 0.6f);
    }
    const std::vector<Index> pinned = {free.grip[0]};
    const PullRegion region = pull_region(model, pinned, rest[5], 0.2, 0.6);
    EXPECT_EQ(region.grip.size(), free.grip.size() - 1);
    EXPECT_TRUE(has(region.held, pinned[0]));
    EXPECT_EQ(pull_region(model, {}, rest[9], 0, 0).grip, std::vector<Index>{9}); // the nearest at least
}

TEST(PullRegion, TakesWhatCarriesAVertex) {
    const Model model = cube_model();
    const Vec3f far(9, 9, 9);
    for (Index vertex = 0; vertex < model.mesh.vertex_count(); vertex += 97) {
        const PullRegion region = pull_region(model, {}, far, 0, 100, vertex);
        EXPECT_GE(region.grip.size(), 1u);
        EXPECT_LE(region.grip.size(), 3u); // a cell's corners
        EXPECT_LT((driver_positions(model)[region.grip[0]] - model.mesh.positions[vertex]).norm(), 0.6f);
    }
}

TEST(PullRegion, IsEmptyWhereAllIsPinned) {
    const Model model = cube_model();
    std::vector<Index> all(model.driver().vertices.size());
    for (Index v = 0; v < all.size(); ++v) all[v] = v;
    const PullRegion region = pull_region(model, all, Vec3f::Zero(), 1, 2);
    EXPECT_TRUE(region.grip.empty());
    EXPECT_EQ(region.held, all);
}

TEST(PullSolver, BringsTheGripThereAndHoldsTheRest) {
    const Model model = cube_model();
    const std::vector<Vec3f> rest = driver_positions(model);
    const PullRegion region = pull_region(model, {}, rest[0], 0.2, 0.7);
    PullSolver solver = PullSolver::create(model, nullptr, region, {}, kAllThreads).value();
    EXPECT_FALSE(solver.has_arrived(kTolerance));
    const Vec3f way(0, 0.3f, 0);
    const Pose pose = pulled(solver, way);
    EXPECT_EQ(solver.applied(), way);
    for (const Index v : region.grip) EXPECT_LT((pose.positions[v] - rest[v] - way).norm(), 1e-6f);
    for (const Index v : region.held) EXPECT_LT((pose.positions[v] - rest[v]).norm(), 1e-6f);
}

TEST(PullSolver, BringsTheGrabbedVertexThereByMovingTheGripFurther) {
    const Model model = cube_model(600);
    const auto grabbed = static_cast<Index>(model.mesh.vertex_count() / 3);
    const Vec3f from = model.mesh.positions[grabbed], way(0, 0.3f, 0.1f);
    const PullRegion region = pull_region(model, {}, from, 0.1, 0.6, grabbed);
    PullSolver solver = PullSolver::create(model, nullptr, region, grabbed, kAllThreads).value();
    const Pose pose = pulled(solver, way);
    const std::vector<Vec3f> restored = Restorer::create(model, {}, kAllThreads)->positions(pose, kAllThreads).value();
    EXPECT_LT((restored[grabbed] - from - way).norm(), 1e-3f);
    const std::vector<Vec3f> rest = driver_positions(model);
    for (const Index v : region.grip) EXPECT_LT((pose.positions[v] - rest[v] - solver.applied()).norm(), 1e-5f);
}

TEST(PullSolver, TheNextPullStartsFromTheShapeThatTheLastLeft) {
    const Model model = cube_model();
    const std::vector<Vec3f> rest = driver_positions(model);
    PullSolver first =
        PullSolver::create(model, nullptr, pull_region(model, {}, rest[0], 0.2, 0.7), {}, kAllThreads).value();
    const Pose once = pulled(first, Vec3f(0.1f, 0.3f, 0));
    PullSolver second =
        PullSolver::create(model, &once, pull_region(model, {}, rest[40], 0.2, 0.7), {}, kAllThreads).value();
    const Pose twice = pulled(second, Vec3f::Zero());
    EXPECT_LT(rms(twice.positions, once.positions), 1e-4);
    for (std::size_t v = 0; v < rest.size(); ++v) EXPECT_LT((twice.gradients[v] - once.gradients[v]).norm(), 1e-2f);
}

TEST(PullEveryVertex, DoesWhatTheDriverDid) {
    const Model model = cube_model(600);
    EXPECT_EQ(pull_every_vertex(model, {}, kAllThreads).value(), model.mesh.positions);
    const Vec3f centre = driver_positions(model)[0];
    Pull pull{pull_region(model, {}, centre, 0.2, 0.7), centre, 0.2, 0.7, Vec3f(-0.1f, 0.25f, 0.1f)};
    PullSolver solver = PullSolver::create(model, nullptr, pull.region, {}, kAllThreads).value();
    const Pose pose = pulled(solver, pull.move);
    const std::vector<Vec3f> restored = Restorer::create(model, {}, kAllThreads)->positions(pose, kAllThreads).value();
    const std::vector<Vec3f> all = pull_every_vertex(model, std::span(&pull, 1), kAllThreads).value();
    EXPECT_GT(rms(all, model.mesh.positions), 0.05);
    EXPECT_LT(rms(all, restored), 0.03);
    const RunContext cancelled;
    cancelled.cancel();
    EXPECT_EQ(pull_every_vertex(model, std::span(&pull, 1), cancelled).error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
