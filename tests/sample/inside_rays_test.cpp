#include "filigree/sample/inside_rays.h"

#include "filigree/mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

using namespace filigree;

namespace {

struct Solid {
    std::string name;
    std::vector<Vec3f> positions;
    std::vector<Triangle> triangles;
};

Solid shape(const std::string& name, unsigned resolution, double size) {
    const Mesh mesh = make_shape(name, {.resolution = resolution, .frequency = 2, .amplitude = 0.1}).value();
    Solid solid{name, mesh.positions, triangulate(mesh).triangles};
    for (Vec3f& p : solid.positions) p *= static_cast<float>(size);
    return solid;
}

/// Every vertex on a whole number: faces in lattice planes, edges along lattice lines, vertices on points, and
/// triangles without area.
Solid snapped(Solid solid) {
    solid.name += " snapped";
    for (Vec3f& p : solid.positions) p = p.array().round();
    return solid;
}

Solid box(const Vec3f& low, const Vec3f& high) {
    Solid solid{"box", {}, {}};
    for (int corner = 0; corner < 8; ++corner)
        solid.positions.emplace_back(corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1],
                                     corner & 4 ? high[2] : low[2]);
    solid.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                       {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return solid;
}

Solid octahedron(float radius) {
    Solid solid{"octahedron", {}, {}};
    for (int axis = 0; axis < 3; ++axis) {
        solid.positions.push_back(radius * Vec3f::Unit(axis));
        solid.positions.push_back(-radius * Vec3f::Unit(axis));
    }
    for (const Index x : {0u, 1u})
        for (const Index y : {2u, 3u})
            for (const Index z : {4u, 5u}) solid.triangles.push_back({x, y, z}); // parity needs no orientation
    return solid;
}

Solid tetrahedra(int count) {
    std::mt19937 random(5);
    std::uniform_int_distribution<int> coordinate(-8, 8);
    Solid solid{"tetrahedra", {}, {}};
    for (int i = 0; i < count; ++i) {
        const auto first = static_cast<Index>(solid.positions.size());
        for (int k = 0; k < 4; ++k)
            solid.positions.push_back(
                Eigen::Vector3i(coordinate(random), coordinate(random), coordinate(random)).cast<float>());
        for (Index k = 0; k < 4; ++k) solid.triangles.push_back({first + k, first + (k + 1) % 4, first + (k + 2) % 4});
    }
    return solid;
}

/// Solids whose vertices are whole numbers up to 8.
std::vector<Solid> solids_on_the_lattice() {
    return {box({-4, -4, -4}, {4, 4, 4}),
            octahedron(8),
            tetrahedra(1),
            tetrahedra(7),
            snapped(shape("wavy-cube", 6, 12)),
            snapped(shape("wavy-sphere", 5, 14)),
            snapped(shape("torus", 8, 10)),
            snapped(shape("cylinder", 4, 4))};
}

/// Parity by a ray along x over all triangles, for a point that is in no plane and on no line of the mesh.
bool brute_force(const Solid& solid, const Vec3d& p) {
    bool inside = false;
    for (const Triangle& t : solid.triangles) {
        const Vec3d a = solid.positions[t[0]].cast<double>(), b = solid.positions[t[1]].cast<double>(),
                    c = solid.positions[t[2]].cast<double>();
        const auto side = [&](const Vec3d& from, const Vec3d& to) {
            return exact::orient2d({from[1], from[2]}, {to[1], to[2]}, {p[1], p[2]});
        };
        const int ab = side(a, b);
        if (ab != 0 && side(b, c) == ab && side(c, a) == ab && exact::orient3d(a, b, c, p) != ab) inside = !inside;
    }
    return inside;
}

/// p + (e, e^2, e^3): small enough for meshes on whole numbers up to 8, whose normals are whole numbers up to 512.
Vec3d moved(const Vec3d& p) { return p + Vec3d(0x1p-16, 0x1p-30, 0x1p-44); }

std::vector<Vec3d> lattice_points(int from, int to, double spacing = 1) {
    std::vector<Vec3d> points;
    for (int k = from; k <= to; ++k)
        for (int j = from; j <= to; ++j)
            for (int i = from; i <= to; ++i) points.push_back(spacing * Vec3d(i, j, k));
    return points;
}

std::vector<bool> brute_force(const Solid& solid, const std::vector<Vec3d>& points) {
    std::vector<bool> inside;
    for (const Vec3d& p : points) inside.push_back(brute_force(solid, p));
    return inside;
}

} // namespace

TEST(InsideRays, AgreesWithEveryTriangleInTurn) {
    const RunContext context(1);
    std::mt19937 random(3);
    for (const Solid& solid : {box({-1, -1, -1}, {1, 1, 1}), octahedron(1), shape("wavy-cube", 12, 2),
                               shape("wavy-sphere", 12, 2), shape("torus", 12, 1), shape("bar", 4, 1)}) {
        const auto rays = RayParity::create(solid.positions, solid.triangles, {}, context);
        ASSERT_TRUE(rays) << rays.error().message;
        const Box around = bounds(solid.positions);
        std::uniform_real_distribution<double> unit(-0.1, 1.1);
        int inside = 0, different = 0;
        for (int i = 0; i < 2000; ++i) {
            const Vec3d share(unit(random), unit(random), unit(random));
            const Vec3d p = around.min + share.cwiseProduct(around.size());
            const bool expected = brute_force(solid, p);
            different += rays->contains(p) != expected;
            inside += expected;
        }
        EXPECT_EQ(different, 0) << solid.name;
        EXPECT_GT(inside, 100) << solid.name;
    }
}

TEST(InsideRays, IsExactOnMeshesOnTheLatticeFromEveryEye) {
    const RunContext context(1);
    const std::vector<Vec3d> points = lattice_points(-9, 9);
    std::vector<Vec3d> perturbed;
    for (const Vec3d& p : points) perturbed.push_back(moved(p));
    // Far off and generic; in face planes; in line with edges and rows; on a diagonal; near; within the boxes, inside
    // and outside, on no surface, but in planes and on lines of the mesh.
    const std::vector<Vec3d> eyes = {
        {1000.3, -2000.7, 3000.1}, {100, 4, 4}, {4, 4, -50}, {20, 20, 20},    {0, 0, 100},        {-9, 0, 0},
        {0.5, 0.25, 0.125},        {0, 0, 0},   {1, 1, 0.5}, {2, 0, 1.0 / 3}, {1e30, 1e30, 1e30}, {1e9, 0, 0}};
    for (const Solid& solid : solids_on_the_lattice()) {
        const std::vector<bool> expected = brute_force(solid, perturbed);
        exact::Tally tally;
        const auto compare = [&](const std::optional<Vec3d>& eye) {
            const auto rays = RayParity::create(solid.positions, solid.triangles, eye, context);
            if (!rays) {
                EXPECT_NE(rays.error().message.find("on the surface"), std::string::npos) << rays.error().message;
                return false;
            }
            int different = 0;
            RayParity::Count count;
            for (std::size_t i = 0; i < points.size(); ++i)
                different += rays->contains(points[i], &count) != expected[i];
            EXPECT_EQ(different, 0) << solid.name << ", eye " << rays->eye().transpose();
            tally.integers += count.tally.integers;
            tally.expansions += count.tally.expansions;
            return true;
        };
        EXPECT_TRUE(compare({}));
        int compared = 0;
        for (const Vec3d& eye : eyes) compared += compare(eye);
        EXPECT_GE(compared, 8) << solid.name;
        EXPECT_GT(tally.integers, 100u) << solid.name;
        EXPECT_GT(tally.expansions, 0u) << solid.name; // the eye at 1e30
    }
}

TEST(InsideRays, IsExactForEyesOnLatticePointsThemselves) {
    const RunContext context(1);
    const std::vector<Vec3d> points = lattice_points(-9, 9, 0.5);
    for (const Solid& solid : {octahedron(8), snapped(shape("wavy-sphere", 5, 8))}) {
        std::vector<bool> expected;
        for (const Vec3d& p : points) expected.push_back(brute_force(solid, moved(p)));
        int accepted = 0;
        for (std::size_t e = 0; e < points.size(); e += 331) {
            const auto rays = RayParity::create(solid.positions, solid.triangles, points[e], context);
            if (!rays) continue;
            ++accepted;
            int different = 0;
            for (std::size_t i = 0; i < points.size(); ++i) different += rays->contains(points[i]) != expected[i];
            EXPECT_EQ(different, 0) << solid.name << ", eye " << points[e].transpose();
        }
        EXPECT_GT(accepted, 10);
    }
}

TEST(InsideRays, ABoxOnTheLatticeGetsItsVolume) {
    const RunContext context(1);
    const Solid solid = box({0, 0, 0}, {5, 5, 5});
    const auto rays = RayParity::create(solid.positions, solid.triangles, {}, context);
    ASSERT_TRUE(rays);
    for (const Vec3d& p : lattice_points(-1, 6)) {
        const bool expected = (p.array() >= 0).all() && (p.array() < 5).all();
        EXPECT_EQ(rays->contains(p), expected) << p.transpose();
    }
}

TEST(InsideRays, BodiesThatTouchShareNoPointAndMissNone) {
    const RunContext context(1);
    const std::vector<Vec3d> points = lattice_points(-4, 3);
    std::vector<int> owners(points.size());
    for (const float x : {-4.f, 0.f})
        for (const float y : {-4.f, 0.f})
            for (const float z : {-4.f, 0.f}) {
                const Solid solid = box({x, y, z}, {x + 4, y + 4, z + 4});
                const auto rays = RayParity::create(solid.positions, solid.triangles, {}, context);
                ASSERT_TRUE(rays);
                for (std::size_t i = 0; i < points.size(); ++i) owners[i] += rays->contains(points[i]);
            }
    EXPECT_EQ(owners, std::vector<int>(points.size(), 1));
}

TEST(InsideRays, HoldsForLargeSmallAndFarMeshes) {
    const RunContext context(1);
    const Solid unit = snapped(shape("wavy-sphere", 6, 12));
    const std::vector<Vec3d> points = lattice_points(-8, 8);
    const auto reference = RayParity::create(unit.positions, unit.triangles, {}, context);
    ASSERT_TRUE(reference);
    for (const float scale : {0x1p-100f, 0x1p-20f, 0x1p100f})
        for (const float offset : {0.f, 0x1p16f}) {
            Solid solid = unit;
            for (Vec3f& p : solid.positions) p = scale * (p + Vec3f(offset, -offset, offset)).eval();
            const auto rays = RayParity::create(solid.positions, solid.triangles, {}, context);
            ASSERT_TRUE(rays);
            int different = 0;
            for (const Vec3d& p : points)
                different +=
                    rays->contains(double(scale) * (p + Vec3d(offset, -offset, offset))) != reference->contains(p);
            EXPECT_EQ(different, 0) << scale << ", " << offset;
        }
}

TEST(InsideRays, RefusesAnEyeOnTheSurfaceAndMeshesWithoutTriangles) {
    const RunContext context(1);
    const Solid solid = box({0, 0, 0}, {4, 4, 4});
    for (const Vec3d& eye : {Vec3d(0, 0, 0), Vec3d(2, 0, 0), Vec3d(1, 2, 4), Vec3d(2, 2, 0), Vec3d(4, 4, 1.7)}) {
        const auto rays = RayParity::create(solid.positions, solid.triangles, eye, context);
        ASSERT_FALSE(rays) << eye.transpose();
        EXPECT_EQ(rays.error().code, ErrorCode::unsuitable);
    }
    const Vec3d beside(2, 2, std::nextafter(4.0, 5.0)), within(2, 2, std::nextafter(4.0, 3.0));
    for (const Vec3d& eye : {beside, within}) {
        const auto rays = RayParity::create(solid.positions, solid.triangles, eye, context);
        ASSERT_TRUE(rays);
        EXPECT_TRUE(rays->contains({1, 1, 1}));
        EXPECT_FALSE(rays->contains({5, 1, 1}));
    }
    const Vec3d nowhere(NAN, 0, 0);
    EXPECT_EQ(RayParity::create(solid.positions, solid.triangles, nowhere, context).error().code,
              ErrorCode::unsuitable);
    EXPECT_EQ(RayParity::create(solid.positions, {}, {}, context).error().code, ErrorCode::unsuitable);
}

TEST(InsideRays, ManyPointsAreOnePointManyTimes) {
    const Solid solid = shape("wavy-sphere", 10, 2);
    std::vector<Vec3d> points = lattice_points(-14, 14, 0.083);
    points.push_back(Vec3d(NAN, 0, 0));
    points.push_back(Vec3d(0, INFINITY, 0));
    for (const unsigned threads : {1u, 4u}) {
        const RunContext context(threads);
        const auto rays = RayParity::create(solid.positions, solid.triangles, {}, context);
        ASSERT_TRUE(rays);
        RayParity::Count together, one_by_one;
        const auto inside = rays->contains(points, context, &together);
        ASSERT_TRUE(inside);
        for (std::size_t i = 0; i < points.size(); ++i)
            ASSERT_EQ((*inside)[i] != 0, rays->contains(points[i], &one_by_one)) << i;
        EXPECT_GT(together.crossings, 0u);
        EXPECT_EQ(together.crossings, one_by_one.crossings);
        EXPECT_EQ(together.triangles_tested, one_by_one.triangles_tested);
        EXPECT_FALSE(rays->contains(points.back()));
    }
}

TEST(InsideRays, CanBeCancelled) {
    const RunContext context(1);
    const Solid solid = shape("wavy-sphere", 10, 2);
    const auto rays = RayParity::create(solid.positions, solid.triangles, {}, context);
    ASSERT_TRUE(rays);
    context.cancel();
    EXPECT_EQ(rays->contains(lattice_points(-9, 9), context).error().code, ErrorCode::cancelled);
    EXPECT_EQ(RayParity::create(solid.positions, solid.triangles, {}, context).error().code, ErrorCode::cancelled);
}
