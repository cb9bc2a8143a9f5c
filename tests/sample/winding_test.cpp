#include "filigree/sample/winding.h"

#include "filigree/mesh/shapes.h"
#include "filigree/mesh/triangulate.h"
#include "filigree/sample/inside_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

using namespace filigree;

namespace {

struct Surface {
    std::vector<Vec3f> positions;
    std::vector<Triangle> triangles;
};

Surface shape(std::string_view name, unsigned resolution, float size = 2) {
    const Mesh mesh = make_shape(name, {.resolution = resolution, .frequency = 2, .amplitude = 0.1}).value();
    Surface surface{mesh.positions, triangulate(mesh).triangles};
    for (Vec3f& p : surface.positions) p *= size;
    return surface;
}

Surface box(const Vec3f& low, const Vec3f& high) {
    Surface surface;
    for (int corner = 0; corner < 8; ++corner)
        surface.positions.emplace_back(corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1],
                                       corner & 4 ? high[2] : low[2]);
    surface.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                         {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return surface;
}

template <class Keep>
Surface only(Surface surface, const Keep& keep) {
    std::erase_if(surface.triangles, [&](const Triangle& t) {
        return !keep(Vec3f((surface.positions[t[0]] + surface.positions[t[1]] + surface.positions[t[2]]) / 3));
    });
    return surface;
}

Surface without_cap(Surface surface) {
    return only(std::move(surface), [](const Vec3f& p) { return p[2] < 0.6f; });
}

Surface with_some_turned(Surface surface) {
    std::mt19937 random(2);
    for (Triangle& t : surface.triangles)
        if (random() % 50 == 0) std::swap(t[0], t[1]);
    return surface;
}

/// Every triangle for itself.
Surface soup(const Surface& surface) {
    Surface result;
    for (const Triangle& t : surface.triangles) {
        const auto first = static_cast<Index>(result.positions.size());
        for (const Index v : t) result.positions.push_back(surface.positions[v]);
        result.triangles.push_back({first, first + 1, first + 2});
    }
    return result;
}

double brute_force(const Surface& surface, const Vec3d& point) {
    double sum = 0;
    for (const Triangle& t : surface.triangles) {
        const Vec3d a = surface.positions[t[0]].cast<double>() - point,
                    b = surface.positions[t[1]].cast<double>() - point,
                    c = surface.positions[t[2]].cast<double>() - point;
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        sum += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return sum / (2 * std::numbers::pi);
}

std::vector<Vec3d> random_points(const Surface& surface, int count, double beyond = 0.3) {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> unit(-beyond, 1 + beyond);
    const Box around = bounds(surface.positions);
    std::vector<Vec3d> points;
    for (int i = 0; i < count; ++i) {
        const Vec3d share(unit(random), unit(random), unit(random));
        points.push_back(around.min + share.cwiseProduct(around.size()));
    }
    return points;
}

Lattice lattice_over(const Surface& surface, double spacing, std::optional<Vec3d> origin = {}) {
    return make_lattice(bounds(surface.positions), {.spacing = spacing, .origin = origin}).value();
}

struct Comparison {
    std::size_t inside = 0, different = 0, near_half = 0, points = 0;
};

/// Holds every point of the lattice against the sum over all triangles; within `open` of 1/2 either answer is right.
Comparison compare(const Surface& surface, const Lattice& lattice, const Occupancy& occupancy, double open) {
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

} // namespace

TEST(WindingTree, KnowsTheSolidAngleOfAnOctant) {
    const RunContext context(1);
    const Surface octant{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2}}};
    const WindingTree tree(octant.positions, octant.triangles, 1e-4, context);
    EXPECT_NEAR(tree.winding({0, 0, 0}), 1.0 / 8, 1e-9);
    for (const Vec3d& p : random_points(octant, 200)) EXPECT_NEAR(tree.winding(p), brute_force(octant, p), 1e-9);
}

TEST(WindingTree, IsAWholeNumberForClosedMeshes) {
    const RunContext context(1);
    const Surface cube = box({-1, -1, -1}, {1, 1, 1}); // so few triangles that all are summed exactly
    const WindingTree tree(cube.positions, cube.triangles, 1e-4, context);
    int inside = 0;
    for (const Vec3d& p : random_points(cube, 2000)) {
        const bool expected = (p.array().abs() < 1).all();
        ASSERT_NEAR(tree.winding(p), expected ? 1 : 0, 1e-6) << p.transpose();
        inside += expected;
    }
    EXPECT_GT(inside, 300);
    for (const std::string_view name : {"wavy-cube", "wavy-sphere", "torus"}) {
        const Surface surface = shape(name, 12);
        const WindingTree larger(surface.positions, surface.triangles, 1e-3, context);
        for (const Vec3d& p : random_points(surface, 1000)) {
            const double number = larger.winding(p);
            ASSERT_NEAR(number, std::round(brute_force(surface, p)), 1e-3) << name;
        }
    }
}

TEST(WindingTree, KeepsTheAccuracyAskedFor) {
    const RunContext context(1);
    for (const Surface& surface : {without_cap(shape("wavy-sphere", 20)), with_some_turned(shape("torus", 24)),
                                   shape("wavy-plane", 30), soup(without_cap(shape("wavy-cube", 16)))}) {
        const std::vector<Vec3d> points = random_points(surface, 400);
        double error_before = 1;
        for (const double accuracy : {0.1, 0.01, 0.001, 0.0001}) {
            const WindingTree tree(surface.positions, surface.triangles, accuracy, context);
            double error = 0;
            for (const Vec3d& p : points) error = std::max(error, std::abs(tree.winding(p) - brute_force(surface, p)));
            EXPECT_LT(error, accuracy);
            EXPECT_LT(error, error_before);
            error_before = error;
        }
    }
}

TEST(WindingTree, ManyPointsAreOnePointManyTimes) {
    const Surface surface = without_cap(shape("wavy-sphere", 16));
    std::vector<Vec3d> points = random_points(surface, 3000);
    for (const double far : {1e3, 1e7, 1e30, 1e300}) points.push_back({far, -far, 0});
    points.push_back({NAN, 0, 0});
    for (const unsigned threads : {1u, 4u}) {
        const RunContext context(threads);
        const WindingTree tree(surface.positions, surface.triangles, 0.01, context);
        const auto numbers = tree.winding(points, context);
        ASSERT_TRUE(numbers);
        for (std::size_t i = 0; i < points.size(); ++i)
            ASSERT_EQ((*numbers)[i], static_cast<float>(tree.winding(points[i])));
        for (std::size_t i = 3000; i < points.size(); ++i) EXPECT_NEAR((*numbers)[i], 0, 1e-5);
        context.cancel();
        EXPECT_EQ(tree.winding(points, context).error().code, ErrorCode::cancelled);
    }
    const RunContext context(1);
    EXPECT_EQ(WindingTree({}, {}, 0.01, context).winding({0, 0, 0}), 0);
}

TEST(WindingTree, OnTheSurfaceItFollowsTheRuleOfThePerturbedPoint) {
    const RunContext context(1);
    const Surface cube = box({0, 0, 0}, {4, 4, 4});
    const WindingTree tree(cube.positions, cube.triangles, 1e-4, context);
    for (int k = -1; k <= 5; ++k)
        for (int j = -1; j <= 5; ++j)
            for (int i = -1; i <= 5; ++i) {
                const Vec3d p(i, j, k);
                const bool expected = (p.array() >= 0).all() && (p.array() < 4).all();
                EXPECT_NEAR(tree.winding(p), expected ? 1 : 0, 1e-4) << p.transpose(); // corners and edges too
            }
}

TEST(WindingInside, IsTheScanForClosedMeshes) {
    const RunContext context(1);
    for (const std::string_view name : {"wavy-cube", "wavy-sphere", "torus", "cylinder"}) {
        const Surface surface = shape(name, 16);
        const Lattice lattice = lattice_over(surface, 0.061);
        WindingReport report;
        const auto occupancy = winding_inside(surface.positions, surface.triangles, lattice, 0.01, context, &report);
        ASSERT_TRUE(occupancy);
        EXPECT_EQ(occupancy->bits,
                  scan_inside({surface.positions, surface.triangles}, lattice, Overlap::parity, context)->bits);
        EXPECT_EQ(report.open_edges, 0u);
        EXPECT_EQ(report.near_half, 0);
        EXPECT_GT(occupancy->count(), 100u);
    }
}

TEST(WindingInside, AgreesWithTheSumOverAllTrianglesOnDirtyMeshes) {
    const RunContext context(1);
    const Surface open = without_cap(shape("wavy-sphere", 10)), turned = with_some_turned(shape("torus", 14, 1.5f));
    const struct {
        Surface surface;
        std::size_t least_open_edges;
    } cases[] = {{open, 20},
                 {turned, 3},
                 {with_some_turned(open), 23},
                 {soup(open), 3 * open.triangles.size()},
                 {only(shape("wavy-sphere", 10), [](const Vec3f& p) { return std::abs(p[2]) < 0.6f; }), 40}};
    for (const auto& [surface, least_open_edges] : cases) {
        const Lattice lattice = lattice_over(surface, 0.1);
        WindingReport report;
        const auto occupancy = winding_inside(surface.positions, surface.triangles, lattice, 0.01, context, &report);
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
    const Surface sheet = shape("wavy-plane", 8); // all round 1/2 on the one side, above it where the sheet bends round
    const Lattice lattice = lattice_over(sheet, 0.05);
    WindingReport report;
    const auto occupancy = winding_inside(sheet.positions, sheet.triangles, lattice, 0.001, context, &report);
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
    const Surface corner = only(box({0, 0, 0}, {8, 8, 8}), [](const Vec3f& p) { return p.maxCoeff() == 8; });
    ASSERT_EQ(corner.triangles.size(), 6u);
    const Lattice lattice = make_lattice(bounds(corner.positions), {.spacing = 0.5, .origin = Vec3d(0, 0, 0)}).value();
    WindingReport report;
    const auto occupancy = winding_inside(corner.positions, corner.triangles, lattice, 0.001, context, &report);
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
    Surface surface = box({0, 0, 0}, {5, 5, 5});
    const Surface other = only(box({100, 0, 0}, {105, 5, 5}), [](const Vec3f& p) { return p[0] < 105; });
    for (const Triangle& t : other.triangles) surface.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
    surface.positions.insert(surface.positions.end(), other.positions.begin(), other.positions.end());
    const Lattice lattice = make_lattice(bounds(surface.positions), {.spacing = 1, .origin = Vec3d(0, 0, 0)}).value();
    const auto occupancy = winding_inside(surface.positions, surface.triangles, lattice, 0.01, context);
    ASSERT_TRUE(occupancy);
    for (std::size_t k = 0; k < 6; ++k)
        for (std::size_t j = 0; j < 6; ++j)
            for (std::size_t i = 0; i < 50; ++i)
                EXPECT_EQ(occupancy->contains(i, j, k), i < 5 && j < 5 && k < 5) << i << " " << j << " " << k;
}

TEST(WindingInside, IsTheSameForAnyNumberOfThreads) {
    const Surface surface = with_some_turned(without_cap(shape("wavy-sphere", 20)));
    const Lattice lattice = lattice_over(surface, 0.03);
    WindingReport one, four;
    const auto first = winding_inside(surface.positions, surface.triangles, lattice, 0.01, RunContext(1), &one);
    const auto second = winding_inside(surface.positions, surface.triangles, lattice, 0.01, RunContext(4), &four);
    ASSERT_TRUE(first);
    ASSERT_TRUE(second);
    EXPECT_EQ(first->bits, second->bits);
    EXPECT_EQ(one.near_half, four.near_half);
}

TEST(WindingInside, CanBeCancelledAndRefusesWhatDoesNotFit) {
    const RunContext context(1);
    const Surface surface = without_cap(shape("wavy-sphere", 6));
    Lattice huge;
    huge.spacing = 1e-3;
    for (auto& axis : huge.coordinates) {
        axis.resize(40000);
        for (std::size_t i = 0; i < axis.size(); ++i) axis[i] = 1e-4 * static_cast<double>(i);
    }
    const auto refused = winding_inside(surface.positions, surface.triangles, huge, 0.01, context);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::unsuitable);
    EXPECT_NE(refused.error().message.find("GiB"), std::string::npos);
    context.cancel();
    EXPECT_EQ(
        winding_inside(surface.positions, surface.triangles, lattice_over(surface, 0.1), 0.01, context).error().code,
        ErrorCode::cancelled);
}
