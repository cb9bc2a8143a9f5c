#include "filigree/restore.h"

#include "filigree/core/random.h"
#include "filigree/deform/restored_error.h"
#include "filigree/mesh.h"
#include "filigree/pose.h"
#include "filigree/strip.h"
#include "threads.h"

#include <algorithm>
#include <gtest/gtest.h>

namespace filigree {
namespace {

Model stripped(Mesh mesh, std::size_t base) {
    StripOptions options;
    options.base = base;
    return strip(std::move(mesh), options, kOneThread).value().model;
}

/// Estimates of one model's poses.
class Judge {
public:
    explicit Judge(const Model& model)
        : restorer_(Restorer::create(model, {}, kOneThread).value()), error_(model, kOneThread) {}
    double rms(const Pose& pose) const {
        return error_.estimate(pose, restorer_.gradients(pose, kOneThread).value()).value().rms;
    }

private:
    Restorer restorer_;
    PoseError error_;
};

std::unique_ptr<SpaceWarp> random_warp(const Box& box, std::uint64_t seed) {
    const auto between = [&](double low, double high) { return low + (high - low) * random_unit(seed, 0); };
    const Axis axis = static_cast<Axis>(random_bits(seed, 1) % 3);
    switch (random_bits(seed, 2) % 4) {
    case 0:
        return make_bend(box, axis, between(20, 180));
    case 1:
        return make_twist(box, axis, between(20, 270));
    case 2:
        return make_taper(box, axis, between(0.3, 0.9)).value();
    default:
        return make_smooth_random(box, between(0.03, 0.3), seed);
    }
}

/// Share of random poses of several models whose estimate is within a factor of 2 of the error.
double share_within_two(bool with_gradients, std::uint64_t poses_a_model) {
    const Model models[] = {stripped(make_wavy_cube({.resolution = 48}), 1000),
                            stripped(make_wavy_sphere({.resolution = 64}), 600),
                            stripped(make_torus({.resolution = 64}), 500), stripped(make_bar({.resolution = 24}), 300),
                            stripped(make_wavy_plane({.resolution = 100}), 500)};
    double within = 0, count = 0;
    std::uint64_t seed = 100;
    for (const Model& model : models) {
        const Box box = world_bounds(model.mesh);
        const Judge judge(model);
        for (std::uint64_t k = 0; k < poses_a_model; ++k) {
            const std::unique_ptr<SpaceWarp> warp = random_warp(box, ++seed);
            Pose pose = warp_pose(*warp, model, kOneThread);
            if (!with_gradients) pose.gradients.clear();
            const std::vector<Vec3f> truth = warp_positions(*warp, model.mesh.positions, model.mesh.origin, kOneThread);
            const double error = restored_error(model, {}, pose, truth, kOneThread).value().rms;
            const double rounding = 2e-7 * box.diagonal(); // below it both are nothing
            const double ratio = std::max(judge.rms(pose), rounding) / std::max(error, rounding);
            within += ratio >= 0.5 && ratio <= 2;
            ++count;
        }
    }
    return within / count;
}

TEST(PoseError, IsWithinAFactorOfTwo) {
    EXPECT_GE(share_within_two(false, 40), 0.9);
    EXPECT_GE(share_within_two(true, 40), 0.9);
}

TEST(PoseError, SameBytesForAnyThreadsAndAfterAMove) {
    const Model model = stripped(make_wavy_sphere({.resolution = 48}), 400);
    const Box box = world_bounds(model.mesh);
    Pose pose = warp_pose(*make_bend(box, Axis::x, 100), model, kOneThread);
    for (const bool with_gradients : {true, false}) {
        const std::vector<Mat3f> gradients = pose.gradients;
        if (!with_gradients) pose.gradients.clear();
        PoseError one(model, RunContext(1)), two(model, RunContext(2));
        const PoseError::Estimate first = one.estimate(pose, gradients).value(),
                                  second = two.estimate(pose, gradients).value();
        const PoseError moved = std::move(one);
        const PoseError::Estimate third = moved.estimate(pose, gradients).value();
        EXPECT_EQ(first.rms, second.rms);
        EXPECT_EQ(first.rms, third.rms);
        EXPECT_EQ(first.local, second.local);
    }
}

TEST(PoseError, IsNothingAtRestAndForAffineMaps) {
    const Model model = stripped(make_wavy_sphere({.resolution = 48}), 400);
    const double diagonal = world_bounds(model.mesh).diagonal();
    EXPECT_LT(Judge(model).rms(rest_pose(model)), 1e-7 * diagonal);
    Pose turned = rest_pose(model);
    for (Vec3f& p : turned.positions) p = Vec3f(2 * p.y() + p.z(), -p.x(), 0.5f * p.z());
    EXPECT_LT(Judge(model).rms(turned), 1e-6 * diagonal);
}

TEST(PoseError, IsLargestWhereThePoseIsCurved) {
    const Model model = stripped(make_bar({.resolution = 24}), 400);
    Pose pose = rest_pose(model);
    const Box box = bounds(pose.positions);
    for (Vec3f& p : pose.positions) { // half of it stays
        const double x = std::max(0.0, double(p.x()) - box.centre().x()) / box.size().x();
        p.z() += float(0.5 * box.size().x() * (1 - std::cos(6 * x)));
    }
    const Restorer restorer = Restorer::create(model, {}, kOneThread).value();
    const PoseError::Estimate estimate =
        PoseError(model).estimate(pose, restorer.gradients(pose, kOneThread).value()).value();
    double still = 0, moved = 0;
    const std::vector<Vec3f> rest = driver_positions(model);
    for (std::size_t v = 0; v < rest.size(); ++v) {
        const double x = (double(rest[v].x()) - box.min.x()) / box.size().x();
        double& side = x < 0.3 ? still : moved;
        side = std::max(side, double(estimate.local[v]));
    }
    EXPECT_LT(10 * still, moved);

    // The mesh's vertices, for colours, likewise; a driver's vertex has its own.
    const std::vector<float> errors = vertex_errors(model, estimate.local);
    ASSERT_EQ(errors.size(), model.mesh.vertex_count());
    for (std::size_t v = 0; v < rest.size(); ++v)
        EXPECT_NEAR(errors[model.driver().vertices[v]], estimate.local[v], 1e-6 * moved) << v;
    for (std::size_t v = 0; v < errors.size(); ++v) {
        const double x = (double(model.mesh.positions[v].x()) - box.min.x()) / box.size().x();
        EXPECT_LE(errors[v], (x < 0.25 ? still : moved) * (1 + 1e-6)) << v;
        EXPECT_GE(errors[v], -1e-6 * moved) << v; // weights are rounded
    }
}

TEST(PoseError, WarnsFromOneThousandthOfTheDiagonal) {
    PoseError::Estimate estimate{.rms = 0.019, .diagonal = 20, .local = {}};
    EXPECT_FALSE(estimate.is_too_curved());
    estimate.rms = 0.021;
    EXPECT_TRUE(estimate.is_too_curved());
    EXPECT_DOUBLE_EQ(estimate.share(), 0.00105);
    estimate.diagonal = 0; // a single point
    EXPECT_FALSE(estimate.is_too_curved());
}

TEST(PoseError, CountsThatDoNotFitAreErrors) {
    const Model model = strip(make_wavy_sphere({.resolution = 8}), {.base = 60}, kOneThread).value().model;
    const PoseError error(model, kOneThread);
    const Pose pose = rest_pose(model);
    const std::vector<Mat3f> gradients(pose.positions.size(), Mat3f::Identity());
    EXPECT_TRUE(error.estimate(pose, gradients).ok());
    const auto few = error.estimate(pose, std::span(gradients).first(3));
    ASSERT_FALSE(few.ok());
    EXPECT_EQ(few.error().code, ErrorCode::mismatch);
    const auto other = error.estimate(Pose{{Vec3f::Zero()}, {}}, gradients);
    ASSERT_FALSE(other.ok());
    EXPECT_EQ(other.error().code, ErrorCode::mismatch);
}

} // namespace
} // namespace filigree
