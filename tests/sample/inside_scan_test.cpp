#include "cases.h"
#include "filigree/sample/inside_scan.h"

#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/mesh/weld.h"
#include "io/corpus.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <thread>

namespace filigree {
namespace {

struct Solid {
    std::vector<Vec3f> positions;
    std::vector<Triangle> triangles;

    ScanMesh view() const { return {positions, triangles}; }
    void add(const Solid& other) {
        const Index first = Index(positions.size());
        positions.insert(positions.end(), other.positions.begin(), other.positions.end());
        for (const Triangle& t : other.triangles) triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
};

Solid solid(const Mesh& mesh) { return {mesh.positions, triangulate(mesh).triangles}; }

Solid solid(const char* shape, unsigned resolution) {
    return solid(make_shape(shape, {.resolution = resolution, .frequency = 2, .amplitude = 0.1}).value());
}

Solid make_box(const Vec3f& low, const Vec3f& high) {
    Solid box;
    for (int v = 0; v < 8; ++v)
        box.positions.push_back({(v & 1 ? high : low)[0], (v & 2 ? high : low)[1], (v & 4 ? high : low)[2]});
    box.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                     {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return box;
}

Solid make_octahedron(float radius) {
    Solid octahedron;
    for (int axis = 0; axis < 3; ++axis)
        for (const float side : {radius, -radius}) octahedron.positions.push_back(side * Vec3f::Unit(axis));
    for (Index x : {0u, 1u})
        for (Index y : {2u, 3u})
            for (Index z : {4u, 5u})
                octahedron.triangles.push_back((x + y + z) % 2 == 0 ? Triangle{x, y, z} : Triangle{x, z, y});
    return octahedron;
}

Lattice make_points(const Vec3d& origin, double spacing, const std::array<std::size_t, 3>& counts) {
    Lattice lattice;
    lattice.spacing = spacing;
    for (int axis = 0; axis < 3; ++axis)
        for (std::size_t i = 0; i < counts[axis]; ++i)
            lattice.coordinates[axis].push_back(std::fma(double(i), spacing, origin[axis]));
    return lattice;
}

/// A lattice over the mesh and a little beyond, n steps along its longest side.
Lattice lattice_over(const Solid& mesh, int n, const Vec3d& shift = Vec3d::Zero()) {
    const Box box = bounds(mesh.positions);
    const double spacing = box.size().maxCoeff() / n;
    std::array<std::size_t, 3> counts;
    for (int axis = 0; axis < 3; ++axis) counts[axis] = std::size_t(box.size()[axis] / spacing) + 4;
    return make_points(box.min + spacing * (shift - Vec3d(1.3, 1.4, 1.2)), spacing, counts);
}

/// One lattice point on each coordinate of a vertex, n steps along the longest side.
Lattice lattice_on_vertex(const Solid& mesh, int n, std::size_t vertex) {
    const Box box = bounds(mesh.positions);
    const double spacing = box.size().maxCoeff() / n;
    const Vec3d anchor = mesh.positions[vertex].cast<double>();
    const Vec3d steps = ((anchor - box.min) / spacing).array().ceil() + 1;
    Lattice lattice =
        make_points(anchor - spacing * steps, spacing, {std::size_t(n) + 4, std::size_t(n) + 4, std::size_t(n) + 4});
    for (int axis = 0; axis < 3; ++axis) // fma rounds: put the point on it exactly
        lattice.coordinates[axis][std::size_t(steps[axis])] = anchor[axis];
    return lattice;
}

/// Signed crossings of the ray from p + (e, e^2, e^3) along +x, straight from exact signs: no bounds, no tie-breaking.
struct RayCount {
    int crossings = 0, net = 0;
};

/// Sign of (b - a) x (p - a) in (y, z), for p moved by (e^2, e^3).
int side_of_edge(const Vec3d& a, const Vec3d& b, double y, double z) {
    const int side = exact::orient2d({a[1], a[2]}, {b[1], b[2]}, {y, z});
    if (side != 0) return side;
    if (a[2] != b[2]) return a[2] < b[2] ? -1 : 1;
    return a[1] == b[1] ? 0 : a[1] < b[1] ? 1 : -1;
}

/// One row of the lattice; every triangle is looked at.
std::vector<RayCount> count_row(const Solid& mesh, const Lattice& lattice, std::size_t j, std::size_t k) {
    const double y = lattice.coordinates[1][j], z = lattice.coordinates[2][k];
    std::vector<RayCount> row(lattice.coordinates[0].size());
    for (const Triangle& t : mesh.triangles) {
        const Vec3d p[3] = {mesh.positions[t[0]].cast<double>(), mesh.positions[t[1]].cast<double>(),
                            mesh.positions[t[2]].cast<double>()};
        if (std::max({p[0][1], p[1][1], p[2][1]}) < y || std::min({p[0][1], p[1][1], p[2][1]}) > y) continue;
        if (std::max({p[0][2], p[1][2], p[2][2]}) < z || std::min({p[0][2], p[1][2], p[2][2]}) > z) continue;
        const int side = side_of_edge(p[0], p[1], y, z);
        if (side == 0 || side_of_edge(p[1], p[2], y, z) != side || side_of_edge(p[2], p[0], y, z) != side) continue;
        const int normal = exact::normal_signs(p[0], p[1], p[2])[0];
        for (std::size_t i = 0; i < row.size(); ++i)
            if (exact::orient3d_perturbed(p[0], p[1], p[2], lattice.point(i, j, k)) == -normal) {
                ++row[i].crossings;
                row[i].net += normal;
            }
    }
    return row;
}

std::size_t differences(const Occupancy& a, const Occupancy& b) {
    EXPECT_EQ(a.counts, b.counts);
    EXPECT_EQ(a.bits.size(), b.bits.size());
    std::size_t result = 0;
    for (std::size_t w = 0; w < a.bits.size(); ++w) result += std::size_t(std::popcount(a.bits[w] ^ b.bits[w]));
    return result;
}

/// Scans by every vector width, and holds all against the rays. Returns how many points are inside.
std::size_t expect_right(const Solid& mesh, const Lattice& lattice, const std::string& what) {
    const RunContext context(1);
    ScanReport report;
    const auto scan = scan_inside(mesh.view(), lattice, {}, context, &report);
    EXPECT_TRUE(scan.ok()) << what << ": " << (scan.ok() ? "" : scan.error().message);
    if (!scan.ok()) return 0;
    for (const int lanes : scan_lane_counts())
        EXPECT_EQ(differences(*scan, scan_inside_with_lanes(mesh.view(), lattice, lanes, context).value()), 0u)
            << what << ", " << lanes << " lanes";
    const auto [n, rows, layers] = lattice.counts();
    const auto winding = scan_winding(mesh.view(), lattice, 0, layers, context);
    EXPECT_TRUE(winding.ok());
    std::size_t wrong = 0, wrong_winding = 0;
    for (std::size_t k = 0; k < layers; ++k)
        for (std::size_t j = 0; j < rows; ++j) {
            const std::vector<RayCount> row = count_row(mesh, lattice, j, k);
            for (std::size_t i = 0; i < n; ++i) {
                wrong += scan->contains(i, j, k) != (row[i].crossings % 2 == 1);
                wrong_winding += (*winding)[(k * rows + j) * n + i] != row[i].net;
            }
        }
    EXPECT_EQ(wrong, 0u) << what << " of " << lattice.point_count();
    EXPECT_EQ(wrong_winding, 0u) << what << " of " << lattice.point_count();
    return scan->count();
}

Solid turned(Solid mesh, std::mt19937& random) {
    std::normal_distribution<double> normal;
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
    for (Vec3f& p : mesh.positions) p = (turn * p.cast<double>()).cast<float>();
    return mesh;
}

/// Vertices moved to the nearest multiples of `step`: parts may become flat or turn over, the mesh stays closed.
Solid snapped(Solid mesh, float step) {
    for (Vec3f& p : mesh.positions) p = (p / step).array().round().matrix() * step;
    return mesh;
}

TEST(InsideScan, IsRightOnShapesInEveryPosition) {
    std::mt19937 random(7);
    for (const char* const shape : {"wavy-cube", "wavy-sphere", "bar", "cylinder", "torus"}) {
        const Solid mesh = solid(shape, 6);
        EXPECT_GT(expect_right(mesh, lattice_over(mesh, 20), shape), 300u);
        expect_right(mesh, lattice_on_vertex(mesh, 18, 0), std::string(shape) + " on a vertex");
        expect_right(mesh, lattice_on_vertex(mesh, 13, mesh.positions.size() / 2), std::string(shape) + " on a vertex");
        for (int turn = 0; turn < 3; ++turn) {
            const Solid other = turned(mesh, random);
            EXPECT_GT(expect_right(other, lattice_over(other, 15), shape), 100u);
        }
    }
}

TEST(InsideScan, IsRightWhereTrianglesAreSmallAndLarge) {
    const Solid fine = solid("wavy-sphere", 24), coarse = solid("wavy-sphere", 2);
    expect_right(fine, lattice_over(fine, 9), "less than a triangle a row");
    expect_right(fine, lattice_over(fine, 40), "about one row a triangle");
    expect_right(coarse, lattice_over(coarse, 70), "hundreds of rows a triangle");
}

TEST(InsideScan, IsRightOnMeshesSnappedToTheLattice) {
    std::mt19937 random(8);
    for (const char* const shape : {"wavy-cube", "wavy-sphere", "torus"})
        for (const int n : {5, 8, 16}) {
            const float step = 2.0f / float(n);
            const Solid mesh = snapped(turned(solid(shape, 8), random), step);
            const std::array<std::size_t, 3> counts = {std::size_t(2 * n) + 3, std::size_t(2 * n) + 1,
                                                       std::size_t(2 * n) + 2};
            const double h = step;
            expect_right(mesh, make_points(Vec3d::Constant(-n * h), h, counts), shape);
            expect_right(mesh, make_points(Vec3d::Constant(-0.5 * n * h), 0.5 * h, counts),
                         std::string(shape) + ", halves");
            expect_right(mesh, make_points(Vec3d::Constant(-n * h), 3 * h, counts), std::string(shape) + ", thirds");
        }
}

TEST(InsideScan, IsRightOnRandomTetrahedraOfTheLattice) {
    std::mt19937 random(9);
    for (int trial = 0; trial < 400; ++trial) {
        const int size = 2 + trial % 7;
        const float scale = trial % 2 ? 1 : 0.1f; // tenths: ties that are none, or nearly
        Solid mesh;
        for (int part = 0; part < 2; ++part) {
            Solid tetrahedron{{}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
            for (int v = 0; v < 4; ++v)
                tetrahedron.positions.push_back(
                    scale * Vec3f(float(random() % size), float(random() % size), float(random() % size)));
            mesh.add(tetrahedron);
        }
        expect_right(mesh, make_points(Vec3d::Constant(-scale), scale, {10, 10, 10}), "tetrahedra");
    }
}

/// Lattices with a point within rounding of a face, so that only exact signs can tell its side.
TEST(InsideScan, IsRightWithinRoundingOfTheSurface) {
    std::mt19937 random(13);
    std::uniform_real_distribution<double> uniform;
    int crossed = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        Solid mesh{{}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
        const double flat = trial % 3 == 0 ? 1 : std::exp2(-30 * uniform(random)); // faces that hold +x, almost
        const double away = trial % 2 == 0 ? 0 : 4000;
        const Vec3d stretch(1, flat, 1);
        const auto shear = [&](const Vec3d& p) { return Vec3d(p[0], p[1] + p[2], p[2]); };
        for (int v = 0; v < 4; ++v) {
            const Vec3d p(uniform(random), uniform(random), uniform(random));
            mesh.positions.push_back((shear(stretch.cwiseProduct(p)) + Vec3d(away, 0, 0)).cast<float>());
        }
        // a row through the first face
        const Vec3d a = mesh.positions[0].cast<double>(), b = mesh.positions[2].cast<double>(),
                    c = mesh.positions[1].cast<double>();
        const double u = uniform(random), v = (1 - u) * uniform(random);
        const double y = a[1] + u * (b[1] - a[1]) + v * (c[1] - a[1]), z = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2]);
        const Eigen::Matrix<long double, 3, 1> e = (b - a).cast<long double>(), f = (c - a).cast<long double>(),
                                               n = e.cross(f);
        if (n[0] == 0) continue;
        const double x =
            double((long double)a[0] - (n[1] * ((long double)y - a[1]) + n[2] * ((long double)z - a[2])) / n[0]);
        const int rows = trial % 5 == 0 ? 8 : 1; // on either side: with 8, the triangle spans more than small ones do
        const double spacing = 0.25 / rows;
        Lattice lattice = make_points({x - 8 * spacing, y - rows * spacing * flat, z - rows * spacing}, spacing,
                                      {17, 2 * std::size_t(rows) + 1, 2 * std::size_t(rows) + 1});
        for (int j = 0; j <= 2 * rows; ++j) lattice.coordinates[1][std::size_t(j)] = y + (j - rows) * spacing * flat;
        lattice.coordinates[0][8] = x;
        lattice.coordinates[1][std::size_t(rows)] = y;
        lattice.coordinates[2][std::size_t(rows)] = z;
        crossed += expect_right(mesh, lattice, std::to_string(trial)) > 0;
    }
    EXPECT_GT(crossed, 1000);
}

/// Slivers seen edge-on along the rows, with a normal that doubles get wrong.
TEST(InsideScan, IsRightOnSlivers) {
    std::mt19937 random(14);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int trial = 0; trial < 1000; ++trial) {
        const double tiny = std::exp2(-20 - trial % 50);
        Solid mesh{{}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
        for (int v = 0; v < 3; ++v) { // on the line y = z, nearly
            const double y = v == 0 ? tiny * uniform(random) : v, z = v == 0 ? tiny * uniform(random) : v;
            mesh.positions.push_back(Vec3d(4 * uniform(random), y, z).cast<float>());
        }
        mesh.positions.push_back(Vec3d(uniform(random), 2 + uniform(random), uniform(random)).cast<float>());
        std::ranges::shuffle(mesh.positions, random);
        const int rows = trial % 2 == 0 ? 2 : 8; // a unit
        const std::size_t count = std::size_t(3 * rows);
        expect_right(mesh, make_points({-4, 0, 0}, 1.0 / rows, {8 * std::size_t(rows) + 1, count, count}), "sliver");
    }
}

TEST(InsideScan, IsRightWhereTrianglesAreFarLargerThanTheLattice) {
    std::mt19937 random(15);
    for (const float size : {1e3f, 1e6f, 1e9f})
        for (int turn = 0; turn < 10; ++turn) {
            const Solid mesh = turned(make_octahedron(size), random);
            const Vec3d a = mesh.positions[0].cast<double>(), b = mesh.positions[2].cast<double>(),
                        c = mesh.positions[4].cast<double>();
            for (const Vec3d& place : {a, Vec3d(0.5 * (a + b)), Vec3d((a + b + c) / 3)})
                for (const double spacing : {0.01, 1.0, 100.0})
                    expect_right(mesh, make_points(place - Vec3d::Constant(6 * spacing), spacing, {12, 13, 14}),
                                 "large");
        }
}

TEST(InsideScan, IsRightOnALatticeFarAway) {
    std::mt19937 random(10);
    for (const float away : {100.0f, 1e4f, 1e6f}) {
        Solid mesh = turned(solid("wavy-sphere", 6), random);
        for (Vec3f& p : mesh.positions) p += Vec3f(away, -away, 2 * away);
        const Box box = bounds(mesh.positions);
        const auto lattice = make_lattice(box, {.spacing = std::max(box.size().maxCoeff() / 20, 0x1p-20 * away)});
        ASSERT_TRUE(lattice.ok()) << lattice.error().message;
        EXPECT_GT(expect_right(mesh, *lattice, std::to_string(away)), 0u);
        // and one whose points are no multiples of anything
        expect_right(mesh, lattice_over(mesh, 17), std::to_string(away));
    }
}

TEST(InsideScan, IsRightAtTheEndsOfTheNumbers) {
    for (const float scale : {1e-42f, 1e-30f, 1e30f}) {
        Solid mesh = solid("torus", 6);
        for (Vec3f& p : mesh.positions) p *= scale;
        EXPECT_GT(expect_right(mesh, lattice_over(mesh, 15), std::to_string(scale)), 50u);
    }
}

TEST(InsideScan, BoxesAreHalfOpen) {
    const RunContext context(1);
    const Lattice lattice = make_points(Vec3d::Constant(-2), 1, {20, 20, 20});
    const Occupancy inside =
        scan_inside(make_box(Vec3f::Zero(), Vec3f::Constant(16)).view(), lattice, {}, context).value();
    EXPECT_EQ(inside.count(), 4096u);
    for (std::size_t k = 0; k < 20; ++k)
        for (std::size_t j = 0; j < 20; ++j)
            for (std::size_t i = 0; i < 20; ++i) {
                const bool expected = std::min({i, j, k}) >= 2 && std::max({i, j, k}) < 18;
                ASSERT_EQ(inside.contains(i, j, k), expected) << i << ' ' << j << ' ' << k;
            }
}

TEST(InsideScan, BoxesThatFillABoxShareNoPointAndMissNone) {
    const RunContext context(1);
    const Lattice lattice = make_points(Vec3d::Constant(-1), 1, {12, 12, 12});
    for (const std::array<float, 4>& cuts : {std::array{0.0f, 2.0f, 5.0f, 9.0f}, {0.0f, 2.5f, 3.0f, 9.5f}}) {
        Occupancy sum =
            scan_inside(make_box(Vec3f::Constant(cuts[0]), Vec3f::Constant(cuts[3])).view(), lattice, {}, context)
                .value();
        std::size_t points = sum.count();
        for (int part = 0; part < 27; ++part) {
            const int x = part % 3, y = part / 3 % 3, z = part / 9;
            const Solid piece = make_box({cuts[x], cuts[y], cuts[z]}, {cuts[x + 1], cuts[y + 1], cuts[z + 1]});
            const Occupancy inside = scan_inside(piece.view(), lattice, {}, context).value();
            points -= inside.count();
            for (std::size_t w = 0; w < sum.bits.size(); ++w) sum.bits[w] ^= inside.bits[w];
        }
        EXPECT_EQ(points, 0u);
        EXPECT_EQ(sum.count(), 0u);
    }
}

TEST(InsideScan, MirroringMovesPointsOfTheSurfaceOnly) {
    const RunContext context(1);
    const int radius = 9, n = 2 * radius + 3;
    const Lattice lattice =
        make_points(Vec3d::Constant(-radius - 1), 1, {std::size_t(n), std::size_t(n), std::size_t(n)});
    for (int mirror = 0; mirror < 8; ++mirror) {
        Solid mesh = make_octahedron(float(radius));
        for (Vec3f& p : mesh.positions)
            for (int axis = 0; axis < 3; ++axis)
                if (mirror >> axis & 1) p[axis] = -p[axis];
        ScanReport report;
        const Occupancy inside = scan_inside(mesh.view(), lattice, {}, context, &report).value();
        int on_surface = 0;
        for (int k = 0; k < n; ++k)
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < n; ++i) {
                    const int x = i - radius - 1, y = j - radius - 1, z = k - radius - 1;
                    const int distance = std::abs(x) + std::abs(y) + std::abs(z) - radius;
                    const bool contained = inside.contains(std::size_t(i), std::size_t(j), std::size_t(k));
                    if (distance != 0) {
                        ASSERT_EQ(contained, distance < 0);
                    }
                    // on the surface, what lies ahead in (e, e^2, e^3) decides: x first, so its sign, if it has one
                    if (distance == 0 && x != 0) {
                        ASSERT_EQ(contained, x < 0) << x << ' ' << y << ' ' << z;
                    }
                    on_surface += distance == 0 && contained;
                }
        EXPECT_GT(on_surface, 100);
        EXPECT_GT(report.tally.integers, 100u); // ties, all of them
    }
}

TEST(InsideScan, WholeStepsChangeNothing) {
    const RunContext context(1);
    std::mt19937 random(11);
    const Solid mesh = snapped(turned(solid("torus", 10), random), 1.0f / 64);
    const Lattice lattice = make_points(Vec3d::Constant(-1), 1.0 / 16, {40, 40, 40});
    const Occupancy before = scan_inside(mesh.view(), lattice, {}, context).value();
    EXPECT_GT(before.count(), 500u);
    Solid moved = mesh;
    for (Vec3f& p : moved.positions) p += Vec3f(3, -5, 8) / 16.0f;
    const Occupancy after = scan_inside(moved.view(), lattice, {}, context).value();
    for (std::size_t k = 0; k + 8 < 40; ++k)
        for (std::size_t j = 5; j < 40; ++j)
            for (std::size_t i = 0; i + 3 < 40; ++i)
                ASSERT_EQ(after.contains(i + 3, j - 5, k + 8), before.contains(i, j, k));
}

TEST(InsideScan, CoordinatesAloneDecide) {
    const RunContext context(1);
    std::mt19937 random(12);
    const Solid mesh = solid("wavy-cube", 8);
    const Lattice lattice = lattice_on_vertex(mesh, 31, 5);
    const Occupancy expected = scan_inside(mesh.view(), lattice, {}, context).value();
    Solid soup; // every triangle with its own vertices, in any order, begun anywhere, turned either way
    std::vector<Triangle> order = mesh.triangles;
    std::ranges::shuffle(order, random);
    for (const Triangle& t : order) {
        const Index first = Index(soup.positions.size());
        for (const Index v : t) soup.positions.push_back(mesh.positions[v]);
        Triangle mixed = {first, first + 1, first + 2};
        std::ranges::shuffle(mixed, random);
        soup.triangles.push_back(mixed);
    }
    for (Vec3f& p : soup.positions)
        for (float& x : p)
            if (x == 0) x = -0.0f;
    EXPECT_EQ(differences(scan_inside(soup.view(), lattice, {}, context).value(), expected), 0u);
}

TEST(InsideScan, DegenerateTrianglesAddNothing) {
    Solid mesh = solid("wavy-sphere", 5);
    const RunContext context(1);
    const Lattice lattice = lattice_on_vertex(mesh, 20, 3);
    const Occupancy expected = scan_inside(mesh.view(), lattice, {}, context).value();
    mesh.positions.insert(mesh.positions.end(), {{-1, -1, -1}, {0, 0, 0}, {1, 1, 1}, {0.1f, 0.3f, -0.2f}});
    const Index first = Index(mesh.positions.size()) - 4;
    for (Index v = 0; v < first; v += 3)
        mesh.triangles.insert(mesh.triangles.end(), {{v, v, v}, {v, v, first}, {v, first + 3, v}});
    mesh.triangles.insert(mesh.triangles.end(), {{first, first + 1, first + 2}, {first + 2, first, first + 1}});
    EXPECT_EQ(differences(scan_inside(mesh.view(), lattice, {}, context).value(), expected), 0u);
}

TEST(InsideScan, OpenMeshesAndNoMeshAreHarmless) {
    const RunContext context(1);
    Solid mesh = make_box(Vec3f::Zero(), Vec3f::Constant(10));
    const Lattice lattice = make_points(Vec3d::Constant(-1.5), 1, {70, 13, 13});
    mesh.triangles.resize(10); // without the side x = 10
    const Occupancy inside = scan_inside(mesh.view(), lattice, {}, context).value();
    EXPECT_EQ(inside.count(), 10u * 10 * 68); // rows filled to their end, and no bit beyond it
    EXPECT_EQ(scan_inside({}, lattice, {}, context).value().count(), 0u);
    EXPECT_EQ(scan_inside({}, lattice, {.overlap = Overlap::merged}, context).value().count(), 0u);
    const Occupancy none =
        scan_inside(mesh.view(), make_points(Vec3d::Zero(), 1, {5, 0, 5}), {.overlap = Overlap::merged}, context)
            .value();
    EXPECT_EQ(none.count(), 0u);
    EXPECT_TRUE(scan_winding(mesh.view(), lattice, 20, 5, context).value().empty());
}

TEST(InsideScan, CountsTheRowsThatCross) {
    const RunContext context(1);
    ScanReport report;
    const Lattice lattice = make_points(Vec3d::Constant(0.5), 1, {100, 100, 100});
    for (const Overlap overlap : {Overlap::parity, Overlap::merged}) {
        const Solid box = make_box(Vec3f::Zero(), {100, 100, 100});
        ASSERT_TRUE(scan_inside(box.view(), lattice, {.overlap = overlap}, context, &report).ok());
        EXPECT_EQ(report.crossings, 20000u);
        EXPECT_EQ(report.tally.integers + report.tally.expansions,
                  100u * 4); // the diagonals of two faces, from both sides
        EXPECT_GT(report.seconds, 0);
    }
}

TEST(InsideScan, MergedMakesTheOverlapInside) {
    const RunContext context(1);
    Solid both = make_box(Vec3f::Zero(), Vec3f::Constant(8));
    both.add(make_box(Vec3f::Constant(4), Vec3f::Constant(12)));
    const Lattice lattice = make_points(Vec3d::Constant(-1), 1, {14, 14, 14});
    EXPECT_EQ(scan_inside(both.view(), lattice, {}, context).value().count(), 2u * (512 - 64));
    EXPECT_EQ(scan_inside(both.view(), lattice, {.overlap = Overlap::merged}, context).value().count(), 2u * 512 - 64);
    const auto winding = scan_winding(both.view(), lattice, 0, 14, context).value();
    EXPECT_EQ(std::ranges::count(winding, 1), 2 * (512 - 64));
    EXPECT_EQ(std::ranges::count(winding, 2), 64);
    EXPECT_EQ(std::ranges::count(winding, 0), 14 * 14 * 14 - 960);
}

TEST(InsideScan, MergedIsParityWhereNothingOverlaps) {
    const RunContext context(1);
    for (const char* const shape : {"wavy-cube", "torus"}) {
        const Solid mesh = solid(shape, 16);
        const Lattice lattice = lattice_on_vertex(mesh, 100, 7);
        EXPECT_EQ(differences(scan_inside(mesh.view(), lattice, {}, context).value(),
                              scan_inside(mesh.view(), lattice, {.overlap = Overlap::merged}, context).value()),
                  0u);
    }
}

TEST(InsideScan, LayersOfWindingNumbersAreThoseOfTheWhole) {
    const RunContext context(1);
    const Solid mesh = solid("torus", 12);
    const Lattice lattice = lattice_over(mesh, 30);
    const auto [n, rows, layers] = lattice.counts();
    const auto whole = scan_winding(mesh.view(), lattice, 0, layers, context).value();
    const auto part = scan_winding(mesh.view(), lattice, 4, 3, context).value();
    EXPECT_TRUE(std::equal(part.begin(), part.end(), whole.begin() + std::ptrdiff_t(4 * rows * n)));
    EXPECT_EQ(part.size(), 3 * rows * n);
}

TEST(InsideScan, MergedGoesOnFromSlabToSlab) {
    const RunContext context(1);
    const Solid box = make_box(Vec3f::Zero(), {300, 300, 300}); // 2 bytes a point are more than a slab's 32 MiB
    const Lattice lattice = make_points(Vec3d::Constant(-0.5), 1, {302, 302, 302});
    EXPECT_EQ(scan_inside(box.view(), lattice, {.overlap = Overlap::merged}, context)->bits,
              scan_inside(box.view(), lattice, {}, context)->bits);
}

TEST(InsideScan, MoreSurfacesInOnePlaceThan16BitsCount) {
    constexpr int kBoxes = 40'000;
    const Lattice lattice = make_points(Vec3d::Constant(-0.5), 1, {6, 4, 4});
    Solid within, beside; // boxes in one place; plates between two points of a row, thinner and thinner
    for (int b = 0; b < kBoxes; ++b) {
        within.add(make_box(Vec3f::Zero(), {4, 2, 2}));
        const float x = 0.9f * float(b) / kBoxes;
        beside.add(make_box({0.6f + 0.5f * x, 0, 0}, {1.4f - 0.3f * x, 2, 2}));
    }
    beside.add(make_box(Vec3f::Zero(), {4, 2, 2}));
    for (const unsigned threads : {1u, 2u}) {
        const RunContext context(threads);
        ScanReport report;
        const Occupancy merged =
            scan_inside(within.view(), lattice, {.overlap = Overlap::merged}, context, &report).value();
        EXPECT_EQ(merged.count(), 4u * 2 * 2);
        EXPECT_EQ(report.crossings, 2u * 2 * 2 * kBoxes); // each counted once, though it was looked for twice
        const auto refused = scan_winding(within.view(), lattice, 0, 4, context);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::unsuitable);
        EXPECT_NE(refused.error().message.find("32767"), std::string::npos) << refused.error().message;
        EXPECT_EQ(scan_inside(beside.view(), lattice, {.overlap = Overlap::merged}, context)->count(), 4u * 2 * 2);
        const auto plates = scan_winding(beside.view(), lattice, 0, 4, context);
        ASSERT_TRUE(plates); // entered and left again between two points
        EXPECT_EQ(std::ranges::max(*plates), 1);
        EXPECT_EQ(std::ranges::count(*plates, 1), 4 * 2 * 2);
    }
}

TEST(InsideScan, ThreadsChangeNothing) {
    FILIGREE_NEEDS_TWO_THREADS();
    const RunContext one(1), two(2);
    for (const unsigned resolution : {1u, 60u}) { // some large triangles; many small ones
        const Solid mesh = solid("wavy-cube", resolution);
        const Lattice lattice = lattice_on_vertex(mesh, 150, 0);
        for (const Overlap overlap : {Overlap::parity, Overlap::merged}) {
            ScanReport report_one, report_two;
            const Occupancy a = scan_inside(mesh.view(), lattice, {.overlap = overlap}, one, &report_one).value();
            const Occupancy b = scan_inside(mesh.view(), lattice, {.overlap = overlap}, two, &report_two).value();
            EXPECT_GT(a.count(), 1000000u);
            EXPECT_EQ(a.bits, b.bits);
            EXPECT_EQ(report_one.crossings, report_two.crossings);
            EXPECT_EQ(report_one.tally.integers, report_two.tally.integers);
        }
    }
}

TEST(InsideScan, RefusesWhatIsTooMuchAndSaysHowMuch) {
    const RunContext context(1);
    const Solid box = make_box(Vec3f::Zero(), Vec3f::Ones());
    const auto large = make_lattice(bounds(box.positions), {.spacing = 1.0 / 8192});
    ASSERT_TRUE(large.ok());
    const auto refused = scan_inside(box.view(), *large, {}, context);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::unsuitable);
    EXPECT_NE(refused.error().message.find("8192 x 8192 x 8192 points takes 64 GiB"), std::string::npos)
        << refused.error().message;
    const Lattice small = make_points(Vec3d::Zero(), 0.01, {100, 100, 100});
    EXPECT_FALSE(scan_inside(box.view(), small, {.most_bytes = 100000}, context).ok());
    EXPECT_TRUE(scan_inside(box.view(), small, {.most_bytes = 200000}, context).ok());
    EXPECT_FALSE(scan_inside(box.view(), small, {.overlap = Overlap::merged, .most_bytes = 200000}, context).ok());
    const auto windings = scan_winding(box.view(), *large, 0, 4096, context);
    ASSERT_FALSE(windings.ok());
    EXPECT_EQ(windings.error().code, ErrorCode::unsuitable);
    EXPECT_NE(windings.error().message.find("8192 x 8192 x 4096"), std::string::npos) << windings.error().message;
    EXPECT_TRUE(scan_winding(box.view(), *large, 7, 1, context).ok());
}

TEST(InsideScan, RefusesLatticesThatAreNone) {
    const RunContext context(1);
    const Solid box = make_box(Vec3f::Zero(), Vec3f::Ones());
    const auto code_of = [&](const std::vector<double>& x) {
        Lattice lattice = make_points(Vec3d::Zero(), 0.25, {4, 4, 4});
        lattice.coordinates[1] = x;
        const auto scan = scan_inside(box.view(), lattice, {}, context);
        return scan.ok() ? 0 : int(scan.error().code);
    };
    EXPECT_EQ(code_of({0, 1, 2, 3}), 0);
    EXPECT_EQ(code_of({0.3}), 0);
    EXPECT_EQ(code_of({0, 1, 2, 4}), int(ErrorCode::usage));
    EXPECT_EQ(code_of({3, 2, 1, 0}), int(ErrorCode::usage));
    EXPECT_EQ(code_of({1, 1, 1}), int(ErrorCode::usage));
    EXPECT_EQ(code_of({0, std::nan(""), 2}), int(ErrorCode::usage));
    EXPECT_EQ(code_of({0, 1e-310}), int(ErrorCode::usage));
    EXPECT_EQ(code_of({0, std::numeric_limits<double>::infinity()}), int(ErrorCode::usage));
    EXPECT_EQ(code_of(std::vector<double>(70000, 0)), int(ErrorCode::unsuitable));
    std::vector<double> rounded; // 1e16 + i / 2 has no such numbers
    for (int i = 0; i < 10; ++i) rounded.push_back(1e16 + 0.5 * i);
    EXPECT_EQ(code_of(rounded), int(ErrorCode::usage));
}

TEST(InsideScan, ReportsProgressAndCanBeCancelled) {
    const Solid box = make_box(Vec3f::Zero(), Vec3f::Ones());
    const Lattice lattice = make_points(Vec3d::Constant(-0.1), 0.01, {120, 120, 120});
    RunContext context;
    std::vector<double> fractions;
    const auto thread = std::this_thread::get_id();
    context.progress = [&](std::string_view, double fraction) {
        EXPECT_EQ(std::this_thread::get_id(), thread);
        fractions.push_back(fraction);
    };
    ASSERT_TRUE(scan_inside(box.view(), lattice, {.overlap = Overlap::merged}, context).ok());
    EXPECT_TRUE(std::ranges::is_sorted(fractions));
    ASSERT_GE(fractions.size(), 1u);
    EXPECT_EQ(fractions.back(), 1);

    context.progress = [&](std::string_view, double) { context.cancel(); };
    const auto stopped = scan_inside(box.view(), lattice, {}, context);
    ASSERT_FALSE(stopped.ok());
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
    const auto scan = scan_inside(box.view(), lattice, {.overlap = Overlap::merged}, context);
    ASSERT_FALSE(scan.ok());
    EXPECT_EQ(scan.error().code, ErrorCode::cancelled);
    const auto winding = scan_winding(box.view(), lattice, 0, 10, context);
    ASSERT_FALSE(winding.ok());
    EXPECT_EQ(winding.error().code, ErrorCode::cancelled);
}

/// Every edge has an even number of triangles, vertices at one place being one.
bool is_closed(const Solid& mesh) {
    const std::vector<Index> welded = weld_map(mesh.positions);
    std::map<std::pair<Index, Index>, int> degree;
    for (const Triangle& t : mesh.triangles)
        for (int e = 0; e < 3; ++e) {
            const Index a = welded[t[e]], b = welded[t[(e + 1) % 3]];
            if (a != b) ++degree[std::minmax(a, b)];
        }
    return !degree.empty() && std::ranges::all_of(degree, [](const auto& edge) { return edge.second % 2 == 0; });
}

TEST(InsideScan, IsRightOnEveryClosedMeshOfTheCorpus) {
    const auto rows = filigree_test::read_corpus();
    if (rows.empty()) GTEST_SKIP() << "no corpus at " << filigree_test::corpus_folder();
    const RunContext context;
    int tested = 0;
    for (const auto& row : rows) {
        const auto read = read_mesh(row.path, context);
        if (!read.ok()) continue; // corpus_test says which may be refused
        const Solid mesh = solid(read->mesh);
        if (mesh.triangles.empty() || !is_closed(mesh)) continue;
        if (!all_cases() && mesh.triangles.size() > 60'000) continue;
        const Box box = bounds(mesh.positions);
        const auto lattice = make_lattice(box, {.spacing = box.size().maxCoeff() / 24});
        if (!lattice.ok()) {
            ADD_FAILURE() << row.file << ": " << lattice.error().message;
            continue;
        }
        expect_right(mesh, *lattice, row.file);
        if (mesh.triangles.size() < 30000)
            expect_right(mesh, lattice_on_vertex(mesh, 24, 0), row.file + " on a vertex");
        ++tested;
    }
    EXPECT_GT(tested, 40);
}

} // namespace
} // namespace filigree
