#include "filigree/fracture/planar_fill.h"

#include "filigree/core/random.h"
#include "filigree/fracture/constrained_delaunay.h"

#include <Eigen/LU>
#include <gtest/gtest.h>
#include <map>
#include <numbers>

namespace filigree {
namespace {

std::vector<PlanarSegment> loop(std::size_t first, std::size_t count) {
    std::vector<PlanarSegment> segments;
    for (std::size_t k = 0; k < count; ++k) segments.push_back({Index(first + k), Index(first + (k + 1) % count)});
    return segments;
}

std::vector<Vec2d> circle(std::size_t count, double radius) {
    std::vector<Vec2d> points;
    for (std::size_t k = 0; k < count; ++k) {
        const double angle = 2 * std::numbers::pi * double(k) / double(count);
        points.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
    return points;
}

/// The triangles' edges and the segments cancel.
void expect_closed(const PlanarFill& fill, std::span<const PlanarSegment> segments) {
    std::map<std::pair<Index, Index>, int> sums;
    const auto add = [&](Index a, Index b, int times) { sums[std::minmax(a, b)] += a < b ? times : -times; };
    for (const Triangle& t : fill.triangles)
        for (std::size_t k = 0; k < 3; ++k) add(t[k], t[(k + 1) % 3], 1);
    for (const PlanarSegment& s : segments) add(s.from, s.to, -s.multiplicity);
    for (const auto& [edge, sum] : sums)
        if (edge.first != edge.second) {
            EXPECT_EQ(sum, 0) << edge.first << " " << edge.second;
        }
}

Vec2d place(const PlanarFill& fill, std::span<const Vec2d> points, Index k) {
    return k < points.size() ? points[k] : fill.added[k - points.size()];
}

double area(const PlanarFill& fill, std::span<const Vec2d> points) {
    double sum = 0;
    for (const Triangle& t : fill.triangles) {
        const Vec2d a = place(fill, points, t[0]), b = place(fill, points, t[1]), c = place(fill, points, t[2]);
        sum += 0.5 * ((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]);
    }
    return sum;
}

double outline_area(std::span<const Vec2d> points, std::span<const PlanarSegment> segments) {
    double sum = 0;
    for (const PlanarSegment& s : segments)
        sum += 0.5 * s.multiplicity * (points[s.from][0] * points[s.to][1] - points[s.from][1] * points[s.to][0]);
    return sum;
}

TEST(PlanarFill, FillsARingAndLeavesItsHole) {
    std::vector<Vec2d> points = circle(64, 2);
    const std::vector<Vec2d> hole = circle(40, 1);
    points.insert(points.end(), hole.rbegin(), hole.rend());
    std::vector<PlanarSegment> segments = loop(0, 64);
    for (const PlanarSegment& s : loop(64, 40)) segments.push_back(s);
    for (const double edge : {0.0, 0.1}) {
        const PlanarFill fill = fill_plane(points, segments, {.edge = edge});
        EXPECT_FALSE(fill.is_fan);
        expect_closed(fill, segments);
        EXPECT_NEAR(area(fill, points), outline_area(points, segments), 1e-9);
        EXPECT_EQ(fill.added.empty(), edge == 0);
    }
}

TEST(PlanarFill, TrianglesAreWellShapedAndOfTheLengthAskedFor) {
    const std::vector<Vec2d> points = circle(60, 1);
    const std::vector<PlanarSegment> segments = loop(0, 60);
    const PlanarFill fill = fill_plane(points, segments, {.edge = 0.1});
    double least = 180, longest = 0;
    for (const Triangle& t : fill.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec2d a = place(fill, points, t[k]), b = place(fill, points, t[(k + 1) % 3]),
                        c = place(fill, points, t[(k + 2) % 3]);
            longest = std::max(longest, (b - a).norm());
            least = std::min(least, std::acos((b - a).normalized().dot((c - a).normalized())) * 180 / std::numbers::pi);
        }
    EXPECT_GT(least, 18);
    EXPECT_LT(longest, 0.16);
    EXPECT_GT(longest, 0.08);
}

TEST(PlanarFill, ClosesAnyTangle) {
    for (std::uint64_t seed = 0; seed < 2000; ++seed) {
        const std::size_t count = 3 + random_bits(seed, 1) % 30;
        // Every other tangle has its points on a small lattice, so that they coincide and lie on each other's lines.
        std::vector<Vec2d> points;
        for (std::size_t k = 0; k < count; ++k) {
            Vec2d p(random_unit(seed, 10 + 2 * k), random_unit(seed, 11 + 2 * k));
            if (seed % 2) p = (p * 5).array().floor();
            points.push_back(p);
        }
        const std::vector<PlanarSegment> segments = loop(0, count);
        const PlanarFill fill = fill_plane(points, segments, {.edge = seed % 3 ? 0.2 : 0.0});
        expect_closed(fill, segments);
        EXPECT_FALSE(fill.is_fan) << seed;
        EXPECT_NEAR(area(fill, points), outline_area(points, segments), 1e-5) << seed;
    }
}

TEST(PlanarFill, WindingTwiceGivesTwoCopies) {
    const std::vector<Vec2d> points = {{0, 0}, {1, 0}, {0, 1}};
    std::vector<PlanarSegment> segments = loop(0, 3);
    for (PlanarSegment& s : segments) s.multiplicity = 2;
    EXPECT_EQ(fill_plane(points, segments, {}).triangles.size(), 2u);
    for (PlanarSegment& s : segments) s.multiplicity = -1;
    const PlanarFill back = fill_plane(points, segments, {});
    ASSERT_EQ(back.triangles.size(), 1u);
    EXPECT_LT(area(back, points), 0);
}

TEST(ConstrainedDelaunay, SegmentsCrossAtTheirCrossing) {
    for (std::uint64_t k = 0; k < 200; ++k) {
        ConstrainedDelaunay plane;
        std::array<PlanePoint, 4> p; // a square's corners, moved at random: its diagonals cross
        for (std::size_t c = 0; c < 4; ++c)
            for (std::size_t axis = 0; axis < 2; ++axis) {
                const double side = (axis == 0 ? c == 1 || c == 2 : c >= 2) ? 1 : -1;
                p[c][axis] = std::int64_t(4e6 * (side + 0.4 * random_unit(k, 2 * c + axis) - 0.2));
            }
        std::array<Index, 4> v;
        std::ranges::transform(p, v.begin(), [&](const PlanePoint& point) { return plane.insert(point); });
        ASSERT_TRUE(plane.constrain(v[0], v[2], 1) && plane.constrain(v[1], v[3], 1));
        ASSERT_EQ(plane.vertex_count(), 8u) << "the outer three, four ends, and where they cross";
        const auto real = [](const PlanePoint& point) { return Vec2d(double(point[0]), double(point[1])); };
        const Eigen::Matrix2d along{{double(p[2][0] - p[0][0]), double(p[1][0] - p[3][0])},
                                    {double(p[2][1] - p[0][1]), double(p[1][1] - p[3][1])}};
        const Vec2d t = along.inverse() * (real(p[1]) - real(p[0]));
        const Vec2d crossing = real(p[0]) + t[0] * along.col(0);
        EXPECT_LE((real(plane.point(7)) - crossing).cwiseAbs().maxCoeff(), 0.51) << k;
    }
}

TEST(PlanarFill, NothingInsideNothing) {
    const std::vector<Vec2d> points = {{0, 0}, {1, 0}};
    EXPECT_TRUE(fill_plane(points, std::vector<PlanarSegment>{{0, 1}, {1, 0}}, {.edge = 0.1}).triangles.empty());
    EXPECT_TRUE(fill_plane({}, {}, {}).triangles.empty());
}

} // namespace
} // namespace filigree
