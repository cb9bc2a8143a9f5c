#include "filigree/sample.h"

#include "filigree/mesh.h"
#include "sample/bodies.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace filigree {
namespace {

TEST(SpacingForCount, IsRightToAFewPercent) {
    const Mesh torus = make_torus({.resolution = 32});
    for (std::size_t wanted : {500u, 20'000u, 300'000u}) {
        const double spacing = spacing_for_count(torus, wanted, {}, kAllThreads).value();
        const double found = double(sample_inside(torus, lattice_over(torus, spacing), {}, kAllThreads)->count());
        EXPECT_NEAR(found / double(wanted), 1, 0.05) << wanted;
    }
    EXPECT_FALSE(spacing_for_count(make_wavy_plane({.resolution = 8, .amplitude = 0}), 100, by(InsideMethod::winding),
                                   kAllThreads));
}

Mesh box_of(const Vec3f& size) {
    Mesh box = make_wavy_cube({.resolution = 1, .amplitude = 0});
    const Box old = bounds(box.positions);
    for (Vec3f& p : box.positions)
        p = (p - old.min.cast<float>()).cwiseQuotient(old.size().cast<float>()).cwiseProduct(size);
    return box;
}

TEST(SpacingForCount, AStrayVertexSaysNothing) {
    Mesh torus = make_torus({.resolution = 32});
    const double spacing = spacing_for_count(torus, 2000, {}, kAllThreads).value();
    torus.positions.emplace_back(1e5f, 0, 0);
    EXPECT_EQ(spacing_for_count(torus, 2000, {}, kAllThreads).value(), spacing);
}

TEST(SpacingForCount, FlatBoxesAndNeedlesGetTheirCount) {
    for (const Vec3f& size :
         {Vec3f(1, 1, 1e-5f), Vec3f(1, 0.2f, 1e-5f), Vec3f(1e30f, 1e27f, 1e29f), Vec3f(1e-20f, 2e-20f, 3e-20f)})
        for (const std::size_t wanted : {1u, 700u, 20'000u}) {
            const Mesh box = box_of(size);
            const auto spacing = spacing_for_count(box, wanted, {}, kAllThreads);
            ASSERT_TRUE(spacing) << spacing.error().message;
            const double found = double(sample_inside(box, lattice_over(box, *spacing), {}, kAllThreads)->count());
            EXPECT_NEAR(found / double(wanted), 1, wanted == 1 ? 7 : 0.1) << size.transpose() << ", " << wanted;
        }
    EXPECT_EQ(spacing_for_count(box_of({1, 1e-6f, 1e-6f}), 1'000'000, {}, kAllThreads).error().code,
              ErrorCode::unsuitable);
}

/// A band with one half turn: neither side is inside.
Mesh moebius_strip(int steps) {
    Mesh strip;
    for (int s = 0; s < steps; ++s) {
        const double around = 2 * std::numbers::pi * s / steps, turn = around / 2;
        for (const double w : {-0.3, 0.3})
            strip.positions.push_back(Vec3d((1 + w * std::cos(turn)) * std::cos(around),
                                            (1 + w * std::cos(turn)) * std::sin(around), w * std::sin(turn))
                                          .cast<float>());
    }
    for (Index s = 0; s < Index(steps); ++s) {
        const bool last = s + 1 == Index(steps);
        const Index a = 2 * s, b = a + 1, c = last ? 0 : a + 2, d = last ? 1 : a + 3;
        strip.add_face(last ? std::array<Index, 4>{a, b, c, d} : std::array<Index, 4>{a, b, d, c});
    }
    return strip;
}

/// Two triangles whose hollow is on their outer side.
Mesh inward_fold() {
    Mesh fold;
    fold.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    fold.add_face(std::array<Index, 3>{0, 1, 2});
    fold.add_face(std::array<Index, 3>{0, 3, 1});
    return fold;
}

TEST(SpacingForCount, GivesUpOnSheetsBeforeTheLatticeGetsHuge) {
    for (const Mesh& sheet : {moebius_strip(60), inward_fold()}) {
        std::size_t layers = 0;
        RunContext context;
        context.progress = [&](std::string_view, double fraction) { layers += fraction == 0; };
        const auto spacing = spacing_for_count(sheet, 200, {}, context);
        ASSERT_FALSE(spacing);
        EXPECT_EQ(spacing.error().code, ErrorCode::unsuitable);
        EXPECT_NE(spacing.error().message.find("lattice points, "), std::string::npos) << spacing.error().message;
        EXPECT_LE(layers, 4u); // two lattices, of 1.6 million points at most
    }
}

} // namespace
} // namespace filigree
