#include "filigree/sample/inside_scan.h"
#include "filigree/sample/winding_inside.h"

#include "sample/triangle_surfaces.h"

#include <gtest/gtest.h>

namespace filigree::winding_inside_test {
namespace {

Lattice lattice_over(const TriangleSurface& surface, double spacing, std::optional<Vec3d> origin = {}) {
    return make_lattice(bounds(surface.positions), {.spacing = spacing, .origin = origin}).value();
}

struct Comparison {
    std::size_t inside = 0, different = 0, near_half = 0, points = 0;
};

/// Holds every point of the lattice against the sum over all triangles; within `open` of 1/2 either answer is right.
Comparison compare(const TriangleSurface& surface, const Lattice& lattice, const Occupancy& occupancy, double open) {
    Comparison result;
    const auto [nx, ny, nz] = lattice.counts();
    for (std::size_t k = 0; k < nz; ++k)
        for (std::size_t j = 0; j < ny; ++j)
            for (std::size_t i = 0; i < nx; ++i) {
                const double number = brute_force(surface, lattice.point(i, j, k));
                ++result.points;
                result.near_half += std::abs(number - std::floor(number) - 0.5) < 0.1;
                result.inside += occupancy.contains(i, j, k);
                result.different += std::abs(number - 0.5) > open && occupancy.contains(i, j, k) != (number >= 0.5);
            }
    return result;
}

TEST(WindingInside, IsTheScanForClosedMeshes) {
    const RunContext context(1);
    for (const std::string_view name : {"wavy-cube", "wavy-sphere", "torus", "cylinder"}) {
        const TriangleSurface surface = shape(name, 16);
        const Lattice lattice = lattice_over(surface, 0.061);
        WindingReport report;
        const auto occupancy = winding_inside(surface.view(), lattice, {.accuracy = 0.01}, context, &report);
        ASSERT_TRUE(occupancy);
        EXPECT_EQ(occupancy->bits, scan_inside(surface.view(), lattice, {}, context)->bits);
        EXPECT_EQ(report.open_edges, 0u);
        EXPECT_EQ(report.near_half, 0);
        EXPECT_GT(occupancy->count(), 100u);
    }
}

TEST(WindingInside, AgreesWithTheSumOverAllTrianglesOnDirtyMeshes) {
    const RunContext context(1);
    const TriangleSurface open = without_cap(shape("wavy-sphere", 10)),
                          turned = with_some_turned(shape("torus", 14, 1.5f));
    const struct {
        TriangleSurface surface;
        std::size_t least_open_edges;
    } cases[] = {{open, 20},
                 {turned, 3},
                 {with_some_turned(open), 23},
                 {soup(open), 3 * open.triangles.size()},
                 {only(shape("wavy-sphere", 10), [](const Vec3f& p) { return std::abs(p[2]) < 0.6f; }), 40}};
    for (const auto& [surface, least_open_edges] : cases) {
        const Lattice lattice = lattice_over(surface, 0.1);
        WindingReport report;
        const auto occupancy = winding_inside(surface.view(), lattice, {.accuracy = 0.01}, context, &report);
        ASSERT_TRUE(occupancy) << occupancy.error().message;
        const Comparison comparison = compare(surface, lattice, *occupancy, 0.01);
        EXPECT_EQ(comparison.different, 0u);
        EXPECT_GT(comparison.inside, 500u);
        EXPECT_GE(report.open_edges, least_open_edges);
        const double near_half = double(comparison.near_half) / double(comparison.points);
        EXPECT_NEAR(report.near_half, near_half, 0.1 * near_half + 1e-4);
    }
}

TEST(WindingInside, OfASheetIsWhatItsHollowsHold) {
    const RunContext context(1);
    const TriangleSurface sheet =
        shape("wavy-plane", 8); // all round 1/2 on the one side, above it where the sheet bends round
    const Lattice lattice = lattice_over(sheet, 0.05);
    WindingReport report;
    const auto occupancy = winding_inside(sheet.view(), lattice, {.accuracy = 0.001}, context, &report);
    ASSERT_TRUE(occupancy);
    const Comparison comparison = compare(sheet, lattice, *occupancy, 0.001);
    EXPECT_EQ(comparison.different, 0u);
    EXPECT_GT(comparison.inside, 0u);
    EXPECT_LT(comparison.inside, comparison.points / 2);
    EXPECT_GT(report.near_half, 0.1); // and says that it is not sure
}

TEST(WindingInside, HoldsForPointsOnTheConesThemselves) {
    const RunContext context(1);
    // Three faces about a corner are gone: the cone's tip is the middle of the box, and its triangles, spokes and tip
    // go through lattice points.
    const TriangleSurface corner = only(box({0, 0, 0}, {8, 8, 8}), [](const Vec3f& p) { return p.maxCoeff() == 8; });
    ASSERT_EQ(corner.triangles.size(), 6u);
    const Lattice lattice = make_lattice(bounds(corner.positions), {.spacing = 0.5, .origin = Vec3d(0, 0, 0)}).value();
    WindingReport report;
    const auto occupancy = winding_inside(corner.view(), lattice, {.accuracy = 0.001}, context, &report);
    ASSERT_TRUE(occupancy);
    EXPECT_EQ(report.open_edges, 6u);
    // On the faces that are there the sum is either side's: those at 8 belong to the next box.
    Comparison within;
    for (std::size_t k = 0; k < 16; ++k)
        for (std::size_t j = 0; j < 16; ++j)
            for (std::size_t i = 0; i < 16; ++i) {
                const double number = brute_force(corner, lattice.point(i, j, k));
                within.different += std::abs(number - 0.5) > 0.002 && occupancy->contains(i, j, k) != (number >= 0.5);
                within.inside += occupancy->contains(i, j, k);
            }
    EXPECT_EQ(within.different, 0u);
    EXPECT_GT(within.inside, 1000u);
    EXPECT_LT(within.inside, 3000u);
}

TEST(WindingInside, ClosedPartsStayExactBesideAHole) {
    const RunContext context(1);
    TriangleSurface surface = box({0, 0, 0}, {5, 5, 5});
    const TriangleSurface other = only(box({100, 0, 0}, {105, 5, 5}), [](const Vec3f& p) { return p[0] < 105; });
    for (const Triangle& t : other.triangles) surface.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
    surface.positions.insert(surface.positions.end(), other.positions.begin(), other.positions.end());
    const Lattice lattice = make_lattice(bounds(surface.positions), {.spacing = 1, .origin = Vec3d(0, 0, 0)}).value();
    const auto occupancy = winding_inside(surface.view(), lattice, {.accuracy = 0.01}, context);
    ASSERT_TRUE(occupancy);
    for (std::size_t k = 0; k < 6; ++k)
        for (std::size_t j = 0; j < 6; ++j)
            for (std::size_t i = 0; i < 50; ++i)
                EXPECT_EQ(occupancy->contains(i, j, k), i < 5 && j < 5 && k < 5) << i << " " << j << " " << k;
}

TEST(WindingInside, IsTheSameForAnyNumberOfThreads) {
    const TriangleSurface surface = with_some_turned(without_cap(shape("wavy-sphere", 20)));
    const Lattice lattice = lattice_over(surface, 0.03);
    WindingReport one, four;
    const auto first = winding_inside(surface.view(), lattice, {.accuracy = 0.01}, RunContext(1), &one);
    const auto second = winding_inside(surface.view(), lattice, {.accuracy = 0.01}, RunContext(4), &four);
    ASSERT_TRUE(first);
    ASSERT_TRUE(second);
    EXPECT_EQ(first->bits, second->bits);
    EXPECT_EQ(one.near_half, four.near_half);
}

TEST(WindingInside, CanBeCancelledAndRefusesWhatDoesNotFit) {
    const RunContext context(1);
    const TriangleSurface surface = without_cap(shape("wavy-sphere", 6));
    Lattice huge;
    huge.spacing = 1e-3;
    for (auto& axis : huge.coordinates) {
        axis.resize(40000);
        for (std::size_t i = 0; i < axis.size(); ++i) axis[i] = 1e-4 * static_cast<double>(i);
    }
    const auto refused = winding_inside(surface.view(), huge, {.accuracy = 0.01}, context);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::unsuitable);
    EXPECT_NE(refused.error().message.find("GiB"), std::string::npos);
    context.cancel();
    EXPECT_EQ(winding_inside(surface.view(), lattice_over(surface, 0.1), {.accuracy = 0.01}, context).error().code,
              ErrorCode::cancelled);
}

} // namespace
} // namespace filigree::winding_inside_test
