#include "filigree/sample.h"
#include "filigree/sample/lattice_memory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace filigree {
namespace {

Box box_of(const Vec3d& min, const Vec3d& max) {
    Box result;
    result.extend(min);
    result.extend(max);
    return result;
}

/// Errors have the code and one sentence that names `word`.
void expect_error(const Result<Lattice>& result, ErrorCode code, const std::string& word) {
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, code);
    EXPECT_NE(result.error().message.find(word), std::string::npos) << result.error().message;
    EXPECT_EQ(result.error().message.back(), '.');
}

TEST(Lattice, LiesInTheMiddleOfTheBoxsCells) {
    const auto lattice = make_lattice(box_of({0, -1, 2}, {4, 1, 5}), {.spacing = 0.5});
    ASSERT_TRUE(lattice.ok());
    EXPECT_EQ(lattice->counts(), (std::array<std::size_t, 3>{8, 4, 6}));
    EXPECT_EQ(lattice->point(0, 0, 0), Vec3d(0.25, -0.75, 2.25));
    EXPECT_EQ(lattice->point(7, 3, 5), Vec3d(3.75, 0.75, 4.75));
    EXPECT_EQ(lattice->point_count(), 8 * 4 * 6);
    EXPECT_EQ(lattice->spacing, 0.5);
}

TEST(Lattice, WithAnOriginHasAllItsPointsInTheClosedBox) {
    const auto lattice = make_lattice(box_of({0, 0, 0}, {1, 1, 1}), {.spacing = 0.25, .origin = Vec3d(0, 10.125, -3)});
    ASSERT_TRUE(lattice.ok());
    EXPECT_EQ(lattice->coordinates[0], (std::vector<double>{0, 0.25, 0.5, 0.75, 1}));
    EXPECT_EQ(lattice->coordinates[1], (std::vector<double>{0.125, 0.375, 0.625, 0.875}));
    EXPECT_EQ(lattice->coordinates[2], (std::vector<double>{0, 0.25, 0.5, 0.75, 1}));
}

TEST(Lattice, IsOnADyadicGridCloseToWhatWasAsked) {
    for (const double spacing : {0.1, 1.0 / 3, 0.7310585, 1e-3}) {
        const Vec3d origin(0.123456789, -17.3, 4e-5);
        const auto lattice = make_lattice(box_of({-1, -1.5, -1.25}, {1, 1, 1}), {.spacing = spacing, .origin = origin});
        ASSERT_TRUE(lattice.ok());
        EXPECT_NE(lattice->spacing, spacing);
        EXPECT_NEAR(lattice->spacing, spacing, 0x1p-24 * spacing);
        const double step = std::ldexp(1, std::ilogb(spacing) - 24);
        for (const auto& coordinates : lattice->coordinates)
            for (std::size_t i = 0; i < coordinates.size(); ++i) {
                ASSERT_EQ(std::remainder(coordinates[i], step), 0);
                ASSERT_EQ(coordinates[i], coordinates[0] + double(i) * lattice->spacing); // no rounding at all
            }
        for (int axis = 0; axis < 3; ++axis) { // the origin is one of the points
            const double away = std::remainder(lattice->coordinates[axis][0] - origin[axis], lattice->spacing);
            EXPECT_LT(std::abs(away), 0x1p-24 * spacing);
        }
    }
}

TEST(Lattice, MissesNoPointAtTheBoxsEnds) {
    for (int n = 1; n < 300; ++n) {
        const double spacing = 1.0 / n; // most of them have no finite binary expansion
        const auto lattice = make_lattice(box_of({-1, 0, 0}, {1, 1, 1}), {.spacing = spacing, .origin = Vec3d::Zero()});
        ASSERT_TRUE(lattice.ok());
        for (int axis = 0; axis < 3; ++axis) {
            const auto& x = lattice->coordinates[axis];
            const double low = axis == 0 ? -1 : 0;
            ASSERT_GE(x.front(), low);
            ASSERT_LT(x.front() - lattice->spacing, low);
            ASSERT_LE(x.back(), 1);
            ASSERT_GT(x.back() + lattice->spacing, 1);
        }
    }
}

TEST(Lattice, OfAThinBoxHasOneLayerInTheMiddle) {
    const auto lattice = make_lattice(box_of({0, 0, 3}, {4, 4, 3.5}), {.spacing = 1});
    ASSERT_TRUE(lattice.ok());
    EXPECT_EQ(lattice->coordinates[2], std::vector<double>{3.25});
    const auto flat = make_lattice(box_of({0, 0, 3}, {4, 4, 3}), {.spacing = 1});
    ASSERT_TRUE(flat.ok());
    EXPECT_EQ(flat->coordinates[2], std::vector<double>{3});
}

TEST(Lattice, RefusesWhatMakesNoSense) {
    const Box unit = box_of({0, 0, 0}, {1, 1, 1});
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    for (const double spacing : {0.0, -1.0, nan, infinity, -infinity})
        expect_error(make_lattice(unit, {.spacing = spacing}), ErrorCode::usage, "spacing");
    expect_error(make_lattice(unit, {.spacing = 0.1, .origin = Vec3d(0, nan, 0)}), ErrorCode::usage, "origin");
    expect_error(make_lattice(Box(), {.spacing = 0.1}), ErrorCode::usage, "extent");
    expect_error(make_lattice(box_of({1, 1, 1}, {1, 1, 1}), {.spacing = 0.1}), ErrorCode::usage, "extent");
    expect_error(make_lattice(unit, {.spacing = 1.5}), ErrorCode::usage, "larger than the box");
    expect_error(make_lattice(box_of({0, 0, 0.1}, {4, 4, 0.2}), {.spacing = 1, .origin = Vec3d::Zero()}),
                 ErrorCode::unsuitable, "along z");
}

TEST(Lattice, SaysWhichSpacingWouldDo) {
    const Box unit = box_of({0, 0, 0}, {1, 2, 1});
    expect_error(make_lattice(unit, {.spacing = 1.0 / 65000}), ErrorCode::unsuitable, "65534");
    expect_error(make_lattice(unit, {.spacing = 1e-6}), ErrorCode::unsuitable, "at least 3.052");
    EXPECT_TRUE(make_lattice(unit, {.spacing = 3.053e-05}).ok());
    expect_error(make_lattice(unit, {.spacing = 1e-12}), ErrorCode::unsuitable, "resolution");
    const Box far = box_of({1e6, 0, 0}, {1e6 + 1, 1, 1});
    expect_error(make_lattice(far, {.spacing = 0.1}), ErrorCode::unsuitable, "nearer to the origin");
    EXPECT_TRUE(make_lattice(far, {.spacing = 0.25}).ok());
    expect_error(make_lattice(unit, {.spacing = 0.1, .origin = Vec3d(1e9, 0, 0)}), ErrorCode::unsuitable, "resolution");
}

TEST(Occupancy, CountsAndListsItsPoints) {
    const auto lattice = make_lattice(box_of({0, 0, 0}, {70, 2, 2}), {.spacing = 1});
    ASSERT_TRUE(lattice.ok());
    Occupancy occupancy{lattice->counts(), 2, std::vector<std::uint64_t>(8)};
    const std::vector<std::array<std::uint16_t, 3>> points = {{0, 0, 0}, {63, 0, 0}, {64, 0, 0}, {69, 1, 0}, {5, 0, 1}};
    for (const auto& [i, j, k] : points) {
        EXPECT_FALSE(occupancy.contains(i, j, k));
        occupancy.bits[(k * 2u + j) * 2u + i / 64u] |= std::uint64_t{1} << i % 64;
        EXPECT_TRUE(occupancy.contains(i, j, k));
    }
    EXPECT_EQ(occupancy.count(), 5u);
    const LatticePoints inside = points_inside(*lattice, occupancy);
    EXPECT_EQ(inside.indices, points);
    ASSERT_EQ(inside.positions.size(), 5u);
    EXPECT_EQ(inside.positions[3], Vec3f(69.5f, 1.5f, 0.5f));
    EXPECT_EQ(inside.positions[4], Vec3f(5.5f, 0.5f, 1.5f));
}

TEST(Occupancy, IsEmptyAtFirstAndKeepsToTheMemoryAllowed) {
    const Lattice lattice = make_lattice(box_of({0, 0, 0}, {70, 3, 2}), {.spacing = 1}).value();
    const Occupancy empty = make_occupancy(lattice).value();
    EXPECT_EQ(empty.counts, lattice.counts());
    EXPECT_EQ(empty.words_per_row, 2u);
    EXPECT_EQ(empty.count(), 0u);
    EXPECT_TRUE(make_occupancy(lattice, 1000, 1096)); // 2 words x 3 x 2 rows are 96 bytes
    const auto refused = make_occupancy(lattice, 1001, 1096);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::unsuitable);
    EXPECT_NE(refused.error().message.find("70 x 3 x 2 points"), std::string::npos) << refused.error().message;
}

TEST(Occupancy, VisitsPointsInsideInOrder) {
    Occupancy occupancy = make_occupancy(make_lattice(box_of({0, 0, 0}, {70, 3, 2}), {.spacing = 1}).value()).value();
    occupancy.bits[1] = 1 | 32;      // i = 64 and 69 of row (0, 0)
    occupancy.bits[10] = 1ull << 63; // i = 63 of row (2, 1)
    std::vector<std::array<std::size_t, 3>> visited;
    for_each_inside(occupancy, [&](std::size_t i, std::size_t j, std::size_t k) { visited.push_back({i, j, k}); });
    EXPECT_EQ(visited, (std::vector<std::array<std::size_t, 3>>{{64, 0, 0}, {69, 0, 0}, {63, 2, 1}}));
}

} // namespace
} // namespace filigree
