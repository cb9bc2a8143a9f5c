#include "filigree/sample.h"

#include "filigree/core/random.h"
#include "filigree/mesh.h"
#include "sample/bodies.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace filigree {
namespace {

TEST(SpreadInside, JitteredPointsStayInTheirCellsAndInside) {
    const Mesh mesh = make_wavy_cube({.resolution = 24});
    const Lattice lattice = lattice_over(mesh, 0.06);
    const auto regular = spread_inside(mesh, lattice, Pattern::lattice, {}, kAllThreads).value();
    const auto jittered = spread_inside(mesh, lattice, Pattern::jitter, {}, kAllThreads).value();
    ASSERT_EQ(regular.size(), jittered.size());
    const InsideTest test = InsideTest::create(mesh, {}, kAllThreads).value();
    std::size_t moved = 0;
    for (std::size_t p = 0; p < regular.size(); ++p) {
        EXPECT_LE((jittered[p] - regular[p]).cwiseAbs().maxCoeff(), lattice.spacing / 2);
        EXPECT_TRUE(test.contains(jittered[p]));
        moved += jittered[p] != regular[p];
    }
    EXPECT_GT(moved, regular.size() * 9 / 10);
    RunContext other;
    other.seed = 2;
    EXPECT_NE(spread_inside(mesh, lattice, Pattern::jitter, {}, other).value(), jittered);
    EXPECT_EQ(spread_inside(mesh, lattice, Pattern::jitter, {}, RunContext(1)).value(), jittered);
}

TEST(SpreadInside, PoissonPointsKeepTheirDistanceAndFillTheBody) {
    const Mesh mesh = make_wavy_sphere({.resolution = 16});
    const Lattice lattice = lattice_over(mesh, 0.1);
    const auto points = spread_inside(mesh, lattice, Pattern::poisson, {}, kAllThreads).value();
    const InsideTest test = InsideTest::create(mesh, {}, kAllThreads).value();
    for (std::size_t p = 0; p < points.size(); ++p) {
        EXPECT_TRUE(test.contains(points[p]));
        for (std::size_t q = 0; q < p; ++q) ASSERT_GE((points[p] - points[q]).norm(), 0.8 * lattice.spacing);
    }
    const auto regular = spread_inside(mesh, lattice, Pattern::lattice, {}, kAllThreads).value();
    EXPECT_GT(points.size(), regular.size() * 7 / 10);
    for (const Vec3d& p : regular) { // no hole is left that a point would fit into
        double nearest = 1e9;
        for (const Vec3d& q : points) nearest = std::min(nearest, (p - q).norm());
        EXPECT_LT(nearest, 1.5 * lattice.spacing);
    }
}

/// What poisson means, plainly: all darts at once, in their order.
std::vector<Vec3d> plain_poisson(const Mesh& mesh, const Lattice& lattice) {
    const Occupancy occupancy = sample_inside(mesh, lattice, {}, kAllThreads).value();
    const InsideTest test = InsideTest::create(mesh, {}, kAllThreads).value();
    std::vector<std::pair<double, Vec3d>> darts;
    std::uint64_t number = 0;
    for_each_inside(occupancy, [&](std::size_t i, std::size_t j, std::size_t k) {
        for (int d = 0; d < 8; ++d, ++number) {
            Vec3d place = lattice.point(i, j, k);
            for (int axis = 0; axis < 3; ++axis)
                place[axis] += lattice.spacing * (random_unit(kAllThreads.seed, 4 * number + axis) - 0.5) * 1.5;
            if (test.contains(place)) darts.emplace_back(random_unit(kAllThreads.seed + 1, number), place);
        }
    });
    std::ranges::sort(darts, {}, [](const auto& dart) { return dart.first; });
    const double least = 0.8 * lattice.spacing;
    const Vec3d corner = bounds(mesh.positions).min.cast<double>().array() - 2 * least;
    const auto side = static_cast<int>(bounds(mesh.positions).size().maxCoeff() / least) + 5;
    std::vector<std::vector<Vec3d>> cells(std::size_t(side) * side * side);
    std::vector<Vec3d> kept;
    for (const auto& [order, place] : darts) {
        const Eigen::Array3i at = ((place - corner) / least).array().cast<int>();
        const auto near = [&](int n) -> std::vector<Vec3d>& {
            return cells[((at[2] + n / 9 - 1) * side + at[1] + n / 3 % 3 - 1) * side + at[0] + n % 3 - 1];
        };
        bool is_free = true;
        for (int n = 0; n < 27 && is_free; ++n)
            for (const Vec3d& p : near(n)) is_free = is_free && (p - place).squaredNorm() >= least * least;
        if (!is_free) continue;
        near(13).push_back(place);
        kept.push_back(place);
    }
    return kept;
}

TEST(SpreadInside, PoissonInPassesIsPoissonAtOnce) {
    const Mesh box = make_wavy_cube({.resolution = 1, .amplitude = 0});
    const double side = bounds(box.positions).size().x();
    for (const double along : {20.0, 65.0}) { // the second takes two passes
        const Lattice lattice = lattice_over(box, side / along);
        EXPECT_EQ(spread_inside(box, lattice, Pattern::poisson, {}, kAllThreads).value(), plain_poisson(box, lattice));
    }
}

TEST(SpreadInside, PoissonCanBeCancelledBetweenDarts) {
    const Mesh mesh = make_wavy_sphere({.resolution = 10});
    RunContext context;
    bool has_begun = false;
    context.progress = [&](std::string_view phase, double) {
        if (phase != "throwing darts") return;
        has_begun = true;
        context.cancel();
    };
    const auto stopped = spread_inside(mesh, lattice_over(mesh, 0.1), Pattern::poisson, {}, context);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
    EXPECT_TRUE(has_begun);
}

} // namespace
} // namespace filigree
