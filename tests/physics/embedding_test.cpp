#include "filigree/physics/body.h"

#include "filigree/core/random.h"
#include "filigree/physics/body/embedding.h"
#include "filigree/physics/body/make_cells.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace filigree {
namespace {

/// Random points of the box that the particles fill, and `beyond` further out.
std::vector<Vec3f> random_points(const Vec3f& low, const Vec3f& high, float beyond, std::size_t count) {
    std::vector<Vec3f> points(count);
    for (std::size_t p = 0; p < count; ++p)
        for (int axis = 0; axis < 3; ++axis)
            points[p][axis] =
                low[axis] - beyond + float(random_unit(std::uint64_t(axis), p)) * (high[axis] - low[axis] + 2 * beyond);
    return points;
}

Body block(MaterialModel model, std::size_t cells, const Vec3d& origin = Vec3d::Zero()) {
    Material material;
    material.model = model;
    return make_body(box_cells(cells, cells, cells, 1.0 / double(cells), origin), material);
}

void expect_linear_precision(const Embedding& embedding, const Vectors& rest, double tolerance) {
    for (std::size_t p = 0; p < embedding.size(); ++p) {
        double sum = 0;
        Vec3d at = Vec3d::Zero();
        for (Index n = embedding.offsets[p]; n < embedding.offsets[p + 1]; ++n) {
            sum += embedding.weights[n];
            at += embedding.weights[n] * rest[embedding.particles[n]].cast<double>();
        }
        ASSERT_NEAR(sum, 1, tolerance) << p;
        ASSERT_LT((at - embedding.rest[p].cast<double>()).norm(), tolerance) << p;
    }
}

TEST(Embedding, WeightsReproduceLinearFunctions) {
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::meshfree}) {
        const Body body = block(model, 10);
        const auto points = random_points(Vec3f::Zero(), Vec3f::Ones(), 0, 3000);
        EmbeddingReport report;
        const Embedding embedding = embed(points, body.rest, body.spacing(), kAllThreads, &report);
        EXPECT_EQ(embedding.rest, points);
        EXPECT_EQ(report.far_points, 0u);
        EXPECT_GE(report.least_weight, -0.5f);
        expect_linear_precision(embedding, body.rest, 1e-6);
    }
}

TEST(Embedding, InCellsWeightsAreTrilinearInsideAndLinearBeyond) {
    const Body body = block(MaterialModel::fem, 10);
    const auto inside = random_points(Vec3f::Zero(), Vec3f::Ones(), 0, 2000);
    const Embedding embedding = embed_in_cells(inside, body.cells, kAllThreads);
    for (const float weight : embedding.weights) ASSERT_GE(weight, -1e-5f);
    const std::vector<Vec3f> damaged = {Vec3f::Constant(std::numeric_limits<float>::quiet_NaN()),
                                        Vec3f::Constant(1e30f)};
    for (const float weight : embed_in_cells(damaged, body.cells, kAllThreads).weights)
        EXPECT_TRUE(std::isfinite(weight));
    for (const float beyond : {0.0f, 0.05f, 3.0f})
        expect_linear_precision(
            embed_in_cells(random_points(Vec3f::Zero(), Vec3f::Ones(), beyond, 2000), body.cells, kAllThreads),
            body.rest, 2e-6 * (1 + 10 * beyond));
}

/// The largest distance of embedded points from where an affine motion takes them, over the diagonal of where the
/// particles went.
double affine_error(const Embedding& embedding, const Body& body, const Mat3f& matrix, const Vec3f& move) {
    Vectors positions(body.rest.size());
    Box box;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const Vec3d moved = matrix.cast<double>() * body.rest[i].cast<double>() + move.cast<double>();
        positions.set(i, moved.cast<float>());
        box.extend(moved);
    }
    const std::vector<Mat3f> gradients(positions.size(), matrix);
    std::vector<Vec3f> points(embedding.size());
    std::vector<Mat3f> found(embedding.size());
    move_embedded(embedding, body.rest, positions, gradients, points, found, kAllThreads);
    double worst = 0;
    for (std::size_t p = 0; p < points.size(); ++p) {
        const Vec3d wanted = matrix.cast<double>() * embedding.rest[p].cast<double>() + move.cast<double>();
        worst = std::max(worst, (points[p].cast<double>() - wanted).norm() / box.diagonal());
        EXPECT_LT((found[p] - matrix).norm(), 2e-6f * matrix.norm());
    }
    return worst;
}

TEST(Embedding, AffineMotionIsFollowedToRounding) {
    const Mat3f turn = Eigen::AngleAxisf(2.2f, Vec3f(1, 2, -1).normalized()).toRotationMatrix();
    Mat3f shear = Mat3f::Identity(), stretch = Vec3f(0.3f, 4, 1).asDiagonal();
    shear(0, 1) = 1.5f;
    shear(2, 0) = -0.7f;
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::meshfree}) {
        const Body body = block(model, 12, Vec3d(-0.5, -0.5, -0.5));
        const auto points = random_points(Vec3f::Constant(-0.5f), Vec3f::Constant(0.5f), 0.03f, 2000);
        std::vector<Embedding> embeddings = {embed(points, body.rest, body.spacing(), kAllThreads)};
        embeddings.push_back(embed_to_follow(points, body.rest, body.spacing(), nullptr, kAllThreads));
        if (model == MaterialModel::fem) {
            embeddings.push_back(embed_in_cells(points, body.cells, kAllThreads));
            embeddings.push_back(embed_to_follow(points, body.rest, body.spacing(), &body.cells, kAllThreads));
        }
        for (const Embedding& embedding : embeddings)
            for (const Mat3f& matrix : {turn, Mat3f(3 * turn), Mat3f(turn * shear), Mat3f(turn * stretch * shear)})
                EXPECT_LT(affine_error(embedding, body, matrix, Vec3f(0.2f, -0.4f, 0.1f)), 2e-7);
    }
}

/// Where embedded points go, less where they are, when each particle is moved by its own number from -reach to reach.
std::vector<Vec3f> shaken(const Embedding& embedding, const Vectors& rest, float reach) {
    Vectors positions = rest;
    for (std::size_t i = 0; i < rest.size(); ++i) {
        Vec3f move;
        for (int axis = 0; axis < 3; ++axis) move[axis] = reach * (2 * float(random_unit(std::uint64_t(axis), i)) - 1);
        positions.set(i, rest[i] + move);
    }
    const std::vector<Mat3f> gradients(rest.size(), Mat3f::Identity());
    std::vector<Vec3f> points(embedding.size());
    move_embedded(embedding, rest, positions, gradients, points, {}, kAllThreads);
    for (std::size_t p = 0; p < points.size(); ++p) points[p] -= embedding.rest[p];
    return points;
}

float largest_jump(const std::vector<Vec3f>& values) {
    float most = 0;
    for (std::size_t i = 0; i + 1 < values.size(); ++i) most = std::max(most, (values[i + 1] - values[i]).norm());
    return most;
}

// Half a spacing beyond a meshfree body's outermost particles is its surface. There linear weights overshoot, and
// where they overshoot too far the next point suddenly has other particles.
TEST(Embedding, WhatFollowsDoesNotJumpOrOvershoot) {
    const Body body = block(MaterialModel::meshfree, 10);
    const auto spacing = float(body.spacing());
    std::vector<Vec3f> points; // along a path that leaves the body near one of its edges
    for (int i = 0; i <= 4000; ++i)
        points.push_back(Vec3f(0.48f, 0.9f, 0.93f) + float(i) / 4000 * Vec3f(0.02f, 0.15f, 0.1f));
    const Embedding following = embed_to_follow(points, body.rest, body.spacing(), nullptr, kAllThreads);
    for (const float weight : following.weights) ASSERT_GE(weight, -0.05f - 1e-6f);
    const float reach = 0.1f * spacing;
    const auto ours = shaken(following, body.rest, reach),
               linear = shaken(embed(points, body.rest, body.spacing(), kAllThreads), body.rest, reach);
    EXPECT_LT(largest_jump(ours), 2e-3f * reach);
    EXPECT_GT(largest_jump(linear), 5e-2f * reach);
    for (const Vec3f& move : ours) ASSERT_LT(move.norm(), std::numbers::sqrt3_v<float> * reach);
}

// Two plates, two cells thick, with an empty layer of cells between them.
TEST(Embedding, WhatFollowsIsNotCarriedAcrossAGap) {
    std::vector<Cells::LatticeIndex> indices;
    for (std::uint16_t k = 0; k < 5; ++k)
        for (std::uint16_t j = 0; j < 8 && k != 2; ++j)
            for (std::uint16_t i = 0; i < 8; ++i) indices.push_back({i, j, k});
    const Body body = make_body(lattice_cells(std::move(indices), 0.1, Vec3d::Zero()), Material());
    const auto points = random_points(Vec3f::Zero(), Vec3f(0.8f, 0.8f, 0.2f), 0, 1000);
    const auto carried_by_upper = [&](const Embedding& embedding) {
        return std::ranges::count_if(embedding.particles, [&](Index i) { return body.rest[i].z() > 0.25f; });
    };
    EXPECT_GT(carried_by_upper(embed(points, body.rest, body.spacing(), kAllThreads)), 1000);
    EXPECT_EQ(carried_by_upper(embed_to_follow(points, body.rest, body.spacing(), &body.cells, kAllThreads)), 0);
}

TEST(Embedding, FarPointsGoAlongWithTheNearestParticles) {
    const Body body = block(MaterialModel::meshfree, 8);
    const std::vector<Vec3f> points = {{3, 0.5f, 0.5f}, {-20, -20, -20}, {0.5f, 1.4f, 0.5f}};
    EmbeddingReport report;
    const Embedding embedding = embed(points, body.rest, body.spacing(), kAllThreads, &report);
    EXPECT_EQ(report.far_points, 3u);
    for (std::size_t p = 0; p < points.size(); ++p) {
        double sum = 0;
        for (Index n = embedding.offsets[p]; n < embedding.offsets[p + 1]; ++n) sum += embedding.weights[n];
        EXPECT_NEAR(sum, 1, 1e-6);
    }
    // The gradients carry them, whatever the weights.
    const Mat3f turn = Eigen::AngleAxisf(0.7f, Vec3f::UnitZ()).toRotationMatrix();
    EXPECT_LT(affine_error(embedding, body, turn, Vec3f(1, 1, 1)), 5e-6);
}

TEST(Embedding, ParticlesInAPlaneOrAloneCarryToo) {
    Vectors plane(25), one(1);
    for (std::size_t n = 0; n < 25; ++n) plane.set(n, Vec3f(float(n % 5), float(n / 5), 0));
    const std::vector<Vec3f> points = {{2.2f, 1.7f, 0.3f}};
    const Embedding in_plane = embed(points, plane, 1, kAllThreads);
    Vec3f at = Vec3f::Zero();
    for (Index n = 0; n < in_plane.offsets[1]; ++n) at += in_plane.weights[n] * plane[in_plane.particles[n]];
    EXPECT_LT((at - Vec3f(2.2f, 1.7f, 0)).norm(), 1e-5f);

    const Embedding by_one = embed(points, one, 1, kAllThreads);
    ASSERT_EQ(by_one.weights, std::vector<float>{1});
    std::vector<Vec3f> moved(1);
    const std::vector<Mat3f> doubled = {2 * Mat3f::Identity()};
    move_embedded(by_one, one, one, doubled, moved, {}, kAllThreads);
    EXPECT_LT((moved[0] - 2 * points[0]).norm(), 1e-6f);

    // A splash on its own: rounding spans no direction.
    for (const Vec3f& p : random_points(Vec3f::Constant(-0.9f), Vec3f::Constant(0.9f), 0, 500)) {
        Vectors splash(2);
        splash.set(0, Vec3f(0.1f, -1.3f, 70.7f) + p);
        splash.set(1, Vec3f(9, 0, 0));
        const Embedding alone = embed(std::vector<Vec3f>{Vec3f(0.1f, -1.3f, 70.7f)}, splash, 1, kAllThreads);
        for (const float weight : alone.weights) EXPECT_LE(std::abs(weight), 1.01f) << p.transpose();
    }

    // What is no number is carried by something, and carries nothing.
    const float nan = std::numeric_limits<float>::quiet_NaN();
    Vectors damaged = plane;
    damaged.set(7, Vec3f(nan, 0, 0));
    const Embedding mended = embed(std::vector<Vec3f>{{nan, 0, 0}, {2, 1, 0}}, damaged, 1, kAllThreads);
    EXPECT_EQ(mended.offsets[1], 1u);
    EXPECT_GT(mended.offsets[2], 3u);
    for (const float weight : mended.weights) EXPECT_TRUE(std::isfinite(weight));

    EXPECT_EQ(embed({}, one, 1, kAllThreads).size(), 0u);
    EXPECT_EQ(embed(points, Vectors(), 1, kAllThreads).offsets, (std::vector<Index>{0, 0}));
}

/// RMS distance, over the diagonal, of points on the lattice's outer layer from where a smooth motion takes them.
double smooth_error(const std::function<Vec3d(const Vec3d&)>& motion) {
    const Body body = block(MaterialModel::fem, 19);
    Vectors positions(body.rest.size());
    std::vector<Mat3f> gradients(body.rest.size());
    for (std::size_t i = 0; i < body.rest.size(); ++i)
        positions.set(i, motion(body.rest[i].cast<double>()).cast<float>());
    corner_gradients(body.cells, positions, gradients, kAllThreads);
    std::vector<Vec3f> points = random_points(Vec3f::Zero(), Vec3f::Ones(), 0, 2000);
    for (std::size_t p = 0; p < points.size(); ++p) points[p][int(p % 3)] = p / 3 % 2 ? 1.0f : 0.0f;
    std::vector<Vec3f> moved(points.size());
    const Embedding embedding = embed(points, body.rest, body.spacing(), kAllThreads);
    move_embedded(embedding, body.rest, positions, gradients, moved, {}, kAllThreads);
    double sum = 0;
    for (std::size_t p = 0; p < points.size(); ++p)
        sum += (moved[p].cast<double>() - motion(points[p].cast<double>())).squaredNorm();
    return std::sqrt(sum / double(points.size()) / 3);
}

TEST(Embedding, SmoothMotionsAreFollowedClosely) {
    const auto bend = [](const Vec3d& p) { // a quarter of a turn
        const double angle = std::numbers::pi / 2 * (p.x() - 0.5), radius = 2 / std::numbers::pi - (p.y() - 0.5);
        return Vec3d(radius * std::sin(angle), -radius * std::cos(angle), p.z());
    };
    const auto wavy = [](const Vec3d& p) {
        const double turn = 2 * std::numbers::pi;
        return Vec3d(p.x() + 0.03 * std::sin(turn * p.y()), p.y() + 0.03 * std::sin(turn * p.z()),
                     p.z() + 0.03 * std::sin(turn * p.x()));
    };
    EXPECT_LT(smooth_error(bend), 6e-5);
    EXPECT_LT(smooth_error(wavy), 2e-5);
}

TEST(Embedding, ThreadsDoNotMatter) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Body body = block(MaterialModel::meshfree, 9);
    const auto points = random_points(Vec3f::Zero(), Vec3f::Ones(), 0.1f, 10000);
    const Embedding one = embed(points, body.rest, body.spacing(), RunContext(1));
    const Embedding two = embed(points, body.rest, body.spacing(), RunContext(2));
    EXPECT_EQ(one.offsets, two.offsets);
    EXPECT_EQ(one.particles, two.particles);
    EXPECT_EQ(one.weights, two.weights);
}

} // namespace
} // namespace filigree
