#include "filigree/fracture.h"
#include "filigree/fracture/crack_warp.h"

#include "filigree/core/random.h"
#include "filigree/fracture/voronoi.h"

#include <Eigen/LU>
#include <gtest/gtest.h>
#include <map>

namespace filigree {
namespace {

Box unit_box() {
    Box box;
    box.extend(Vec3d::Constant(-0.5));
    box.extend(Vec3d::Constant(0.5));
    return box;
}

std::vector<Vec3d> random_points(std::size_t count, std::uint64_t seed) {
    std::vector<Vec3d> points;
    for (std::size_t k = 0; k < count; ++k)
        points.emplace_back(random_unit(seed, 3 * k) - 0.5, random_unit(seed, 3 * k + 1) - 0.5,
                            random_unit(seed, 3 * k + 2) - 0.5);
    return points;
}

std::vector<Vec3d> lattice_points(int side) {
    std::vector<Vec3d> points;
    for (int x = 0; x < side; ++x)
        for (int y = 0; y < side; ++y)
            for (int z = 0; z < side; ++z)
                points.emplace_back((x + 0.5) / side - 0.5, (y + 0.5) / side - 0.5, (z + 0.5) / side - 0.5);
    return points;
}

FractureCells cells_of(std::span<const Vec3d> seeds, const CrackWarpOptions& warp,
                       std::span<const double> weights = {}) {
    return FractureCells::create(seeds, weights, warp, RunContext{}).value();
}

TEST(CrackWarp, ValueNoiseStaysWithinItsBounds) {
    double steepest = 0, largest = 0;
    for (const Vec3d& p : random_points(200'000, 3)) {
        Mat3d gradient;
        const Vec3d value = value_noise(40 * p, 9, &gradient);
        largest = std::max(largest, value.cwiseAbs().maxCoeff());
        steepest = std::max(steepest, gradient.cwiseAbs().rowwise().sum().maxCoeff());
    }
    EXPECT_LE(largest, 1);
    EXPECT_LT(steepest, 5); // what the amplitude rests on
    EXPECT_GT(steepest, 2);
}

TEST(CrackWarp, GradientIsThatOfTheNoise) {
    for (const Vec3d& p : random_points(100, 5)) {
        Mat3d gradient;
        value_noise(10 * p, 9, &gradient);
        constexpr double kStep = 1e-5;
        for (int axis = 0; axis < 3; ++axis) {
            const Vec3d step = kStep * Vec3d::Unit(axis);
            const Vec3d slope =
                (value_noise(10 * p + step, 9, nullptr) - value_noise(10 * p - step, 9, nullptr)) / (2 * kStep);
            EXPECT_LT((slope - gradient.col(axis)).norm(), 1e-6);
        }
    }
}

TEST(CrackWarp, HasAnInverse) {
    for (const double stretch : {1.0, 5.0}) {
        const CrackWarp warp(
            {.box = unit_box(), .roughness = 1, .wavelength = 0.2, .grain = Vec3d(0, 0.6, 0.8), .stretch = stretch});
        double worst = 0;
        for (const Vec3d& p : random_points(5'000, 7)) {
            const Vec3d q = warp.to_grid(p);
            EXPECT_LE(q.cwiseAbs().maxCoeff(), CrackWarp::kGridHalf);
            worst = std::max(worst, (warp.from_grid(q) - p).norm());
        }
        EXPECT_LT(worst, 1e-11);
    }
}

TEST(CrackWarp, DoesNotFold) {
    const CrackWarp warp({.box = unit_box(), .roughness = 1, .wavelength = 0.2});
    constexpr double kStep = 1e-5;
    double least = 1e300;
    for (const Vec3d& p : random_points(20'000, 11)) {
        Mat3d map;
        for (int axis = 0; axis < 3; ++axis)
            map.col(axis) = (warp.to_grid(p + kStep * Vec3d::Unit(axis)) - warp.to_grid(p)) / kStep;
        least = std::min(least, map.determinant());
    }
    EXPECT_GT(least, 0);
}

TEST(CrackWarp, FineBumpsGoOnBelowTheMap) {
    const CrackWarp warp({.box = unit_box(), .roughness = 1, .wavelength = 0.2});
    const double shortest = warp.finest_wavelength() / 8;
    double highest = 0;
    for (const Vec3d& p : random_points(2'000, 13)) {
        highest = std::max(highest, std::abs(warp.fine_height(p, shortest)));
        EXPECT_EQ(warp.fine_height(p, warp.finest_wavelength()), 0); // the map has those
    }
    EXPECT_LE(highest, warp.fine_reach(shortest));
    EXPECT_GT(highest, 0.3 * warp.fine_reach(shortest));
    EXPECT_EQ(warp.fine_reach(warp.finest_wavelength()), 0);
}

/// Each side of a face between two cells, as the four cells at every corner.
void expect_one_diagram(const FractureCells& cells) {
    std::map<std::pair<Index, Index>, std::vector<std::array<Index, 4>>> sides;
    for (Index i = 0; i < cells.count(); ++i) {
        std::size_t corners = 0, faces = 0;
        for (const CellFace& face : cells.cell(i)) {
            ++faces;
            corners += face.corners.size();
            EXPECT_GE(face.corners.size(), 3u);
            std::vector<std::array<Index, 4>> quads;
            for (const CellCorner& corner : face.corners) {
                std::array<Index, 4> quad = {i, corner[0], corner[1], corner[2]};
                std::sort(quad.begin(), quad.end());
                quads.push_back(quad);
            }
            std::sort(quads.begin(), quads.end());
            sides[{i, face.neighbour}] = quads;
        }
        if (faces > 0) {
            EXPECT_EQ(corners / 3 + faces, corners / 2 + 2) << "Euler, cell " << i; // three faces at each corner
        }
    }
    for (const auto& [pair, quads] : sides) {
        if (cells.grid().is_ghost(pair.second)) continue;
        const auto other = sides.find({pair.second, pair.first});
        ASSERT_NE(other, sides.end());
        EXPECT_EQ(other->second, quads);
    }
}

double volume_of(const FractureCells& cells, Index i) {
    double sum = 0;
    for (const CellFace& face : cells.cell(i)) {
        const auto place = [&](std::size_t k) {
            const CellCorner& c = face.corners[k];
            return voronoi_vertex(cells.grid(), i, c[0], c[1], c[2]);
        };
        for (std::size_t k = 2; k < face.corners.size(); ++k) sum += place(0).dot(place(k - 1).cross(place(k))) / 6;
    }
    return sum;
}

TEST(FractureCells, AreOneDiagram) {
    for (const auto& seeds :
         {random_points(1, 1), random_points(2, 1), random_points(60, 1), lattice_points(4), lattice_points(5)}) {
        const FractureCells cells = cells_of(seeds, {.box = unit_box()});
        expect_one_diagram(cells);
    }
}

TEST(FractureCells, InnerCellsOfALatticeAreItsCubes) {
    const FractureCells cells = cells_of(lattice_points(5), {.box = unit_box()});
    const double cube = std::pow(0.98 * 2 * CrackWarp::kGridHalf / 5, 3);
    for (const Index inner : {31u, 62u, 93u}) EXPECT_NEAR(volume_of(cells, inner) / cube, 1, 1e-4);
}

TEST(FractureCells, WalkingFindsTheNearestSeed) {
    for (const auto& seeds : {random_points(300, 2), lattice_points(6)}) {
        const FractureCells cells = cells_of(seeds, {.box = unit_box(), .roughness = 0.7, .wavelength = 0.3});
        Index near = 0;
        for (const Vec3d& p : random_points(3'000, 4)) {
            const GridPoint q = cells.on_grid(p);
            Index nearest = 0;
            for (Index k = 1; k < cells.count(); ++k)
                if (cells.grid().power(k, q) < cells.grid().power(nearest, q)) nearest = k;
            EXPECT_EQ(cells.cell_at(q), nearest);
            EXPECT_EQ(near = cells.cell_at(p, near), nearest);
        }
    }
}

TEST(FractureCells, WeightsMakeCellsLarger) {
    const std::vector<Vec3d> seeds = {{-0.25, 0, 0}, {0.25, 0, 0}};
    const FractureCells even = cells_of(seeds, {.box = unit_box()});
    const FractureCells uneven = cells_of(seeds, {.box = unit_box()}, std::vector<double>{0.05, 0});
    EXPECT_EQ(even.cell_at(Vec3d(0.02, 0, 0)), 1u);
    EXPECT_EQ(uneven.cell_at(Vec3d(0.02, 0, 0)), 0u); // |p - s|^2 - w: equal at x = 0.05
    EXPECT_EQ(uneven.cell_at(Vec3d(0.06, 0, 0)), 1u);
}

TEST(FractureCells, SeedsAtOnePlaceShareNothing) {
    std::vector<Vec3d> seeds = random_points(20, 6);
    seeds.push_back(seeds[3]);
    const FractureCells cells = cells_of(seeds, {.box = unit_box()});
    EXPECT_TRUE(cells.cell(20).empty());
    expect_one_diagram(cells);
    EXPECT_EQ(cells.cell_at(seeds[20], 20), 3u);
}

TEST(FractureCells, RefusesWhatItCannotUse) {
    const RunContext context;
    EXPECT_FALSE(FractureCells::create({}, {}, {.box = unit_box()}, context));
    EXPECT_FALSE(FractureCells::create(std::vector<Vec3d>{{NAN, 0, 0}}, {}, {.box = unit_box()}, context));
    EXPECT_FALSE(FractureCells::create(random_points(2, 1), std::vector<double>{1}, {.box = unit_box()}, context));
    EXPECT_FALSE(FractureCells::create(random_points(2, 1), std::vector<double>{1, 1e9}, {.box = unit_box()}, context));
}

} // namespace
} // namespace filigree
