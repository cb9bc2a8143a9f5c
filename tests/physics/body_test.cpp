#include "filigree/physics/body.h"

#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/sample/closure.h"
#include "io/corpus.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace filigree {
namespace {

Material of(MaterialModel model, double density = 1000) {
    Material material;
    material.model = model;
    material.density = density;
    return material;
}

double sum(const std::vector<float>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

TEST(Body, ABoxWeighsWhatItShould) {
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree}) {
        const Body body = make_body(box_cells(5, 4, 3, 0.1), of(model, 800));
        const bool corners = model != MaterialModel::meshfree;
        ASSERT_EQ(body.particle_count(), corners ? 6u * 5 * 4 : 60u);
        EXPECT_NEAR(sum(body.mass), 800 * 0.06, 1e-5);
        EXPECT_NEAR(sum(body.volume), 0.06, 1e-8);
        EXPECT_FLOAT_EQ(body.mass[0], corners ? 0.1f : 0.8f); // of one cell: an eighth, or all
        EXPECT_EQ(body.surface.points.size(), 4u * 2 * (5 * 4 + 4 * 3 + 3 * 5));
        EXPECT_NEAR(sum(body.surface.areas), 0.94, 1e-6);
        for (std::size_t p = 0; p < body.surface.points.size(); ++p) {
            const Vec3f out = body.surface.points.rest[p] + 0.01f * body.surface.normals[p];
            EXPECT_TRUE((out.array() < 0).any() || (out.array() > Eigen::Array3f(0.5f, 0.4f, 0.3f)).any());
        }
    }
}

TEST(Body, MeshfreeCellsWithoutNeighboursAroundAreSplit) {
    EXPECT_EQ(make_body(box_cells(6, 1, 1, 0.1), of(MaterialModel::meshfree)).particle_count(), 48u);
    EXPECT_EQ(make_body(box_cells(6, 5, 1, 0.1), of(MaterialModel::meshfree)).particle_count(), 240u);
    EXPECT_EQ(make_body(box_cells(1, 1, 1, 0.1), of(MaterialModel::meshfree)).particle_count(), 8u);
    EXPECT_EQ(make_body(box_cells(6, 2, 2, 0.1), of(MaterialModel::meshfree)).particle_count(), 24u);
    const Body line = make_body(box_cells(6, 1, 1, 0.1), of(MaterialModel::meshfree));
    EXPECT_NEAR(sum(line.mass), 6, 1e-5);
    EXPECT_LT((line.rest[0] - Vec3f(0.025f, 0.025f, 0.025f)).norm(), 1e-6f);
}

TEST(Body, ASphereHasItsMassAndSurface) {
    const double pi = 3.14159265358979;
    const Mesh sphere = make_wavy_sphere({.resolution = 40, .amplitude = 0});
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::meshfree}) {
        BodyReport report;
        const auto body = make_body(sphere, of(model), {.scale = 2, .cells = {.count = 8000}}, kAllThreads, &report);
        ASSERT_TRUE(body) << body.error().message;
        EXPECT_NEAR(double(body->particle_count()) / 8000, 1, 0.16);
        EXPECT_NEAR(sum(body->mass) / (1000 * pi / 6 * 8), 1, 0.015);
        EXPECT_NEAR(report.mass, sum(body->mass), 1e-3);
        EXPECT_NEAR(sum(body->surface.areas) / (4 * pi), 1, 0.01);
        EXPECT_EQ(report.surface_points, body->surface.points.size());
        const double wanted = 4 * pi / (0.25 * body->spacing() * body->spacing());
        EXPECT_GT(double(report.surface_points), 0.8 * wanted);
        EXPECT_LT(double(report.surface_points), 1.8 * wanted);
        for (std::size_t p = 0; p < report.surface_points; ++p) {
            const Vec3f& point = body->surface.points.rest[p];
            EXPECT_NEAR(point.norm(), 1, 2e-3);
            EXPECT_GT(body->surface.normals[p].dot(point.normalized()), 0.95f);
        }
        EXPECT_EQ(report.warning, "");
    }
}

TEST(Body, TheSurfaceOfABoxHasItsEdgesAndCorners) {
    const Mesh bar = make_bar({.resolution = 4, .size = 0.2, .length = 2});
    const auto body = make_body(bar, of(MaterialModel::fem), {.cells = {.spacing = 0.05}}, kAllThreads);
    ASSERT_TRUE(body) << body.error().message;
    int corners = 0;
    for (const Vec3f& point : body->surface.points.rest)
        corners += (point.cwiseAbs() - Vec3f(0.2f, 0.1f, 0.1f)).norm() < 1e-6f;
    EXPECT_EQ(corners, 8);
    EXPECT_NEAR(sum(body->surface.areas), 2 * 0.04 + 4 * 0.08, 1e-6);
}

TEST(Body, SurfacePointsFollowTheParticles) {
    const Mesh cube = make_wavy_cube({.resolution = 24});
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::meshfree}) {
        const auto body = make_body(cube, of(model), {.cells = {.count = 2000}}, kAllThreads);
        ASSERT_TRUE(body) << body.error().message;
        const Embedding& points = body->surface.points;
        for (std::size_t p = 0; p < points.size(); ++p) {
            Vec3d at = Vec3d::Zero();
            double weights = 0;
            for (Index n = points.offsets[p]; n < points.offsets[p + 1]; ++n) {
                at += points.weights[n] * body->rest[points.particles[n]].cast<double>();
                weights += points.weights[n];
            }
            ASSERT_NEAR(weights, 1, 1e-6);
            ASSERT_LT((at - points.rest[p].cast<double>()).norm(), 1e-6);
        }
    }
}

TEST(Body, KoalaHasItsMassAndSurface) {
    const auto path = filigree_test::corpus_folder() / "good/koala_100k.obj";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no corpus";
    const Mesh koala = read_mesh(path, kAllThreads)->mesh;
    const WeldedTriangles welded = weld_triangles(koala, kAllThreads).value();
    double volume = 0, area = 0;
    for (const Triangle& t : welded.triangles) {
        const Vec3d a = koala.positions[t[0]].cast<double>(), b = koala.positions[t[1]].cast<double>(),
                    c = koala.positions[t[2]].cast<double>();
        volume += a.dot(b.cross(c)) / 6;
        area += (b - a).cross(c - a).norm() / 2;
    }
    const auto fine = make_body(koala, of(MaterialModel::fem), {.cells = {.count = 20000}}, kAllThreads);
    ASSERT_TRUE(fine) << fine.error().message;
    EXPECT_NEAR(sum(fine->mass) / (1000 * volume), 1, 0.01);
    const auto body = make_body(koala, of(MaterialModel::meshfree), {}, kAllThreads);
    ASSERT_TRUE(body) << body.error().message;
    EXPECT_NEAR(sum(body->mass) / (1000 * volume), 1, 0.01);
    EXPECT_NEAR(sum(body->surface.areas) / area, 1, 0.001);

    const ClosestPointTree tree(koala.positions, welded.triangles);
    const double size = bounds(koala.positions).diagonal();
    std::size_t outward = 0;
    for (std::size_t p = 0; p < body->surface.points.size(); ++p) {
        const SurfacePoint found = tree.closest(body->surface.points.rest[p]);
        ASSERT_LT(found.distance, 1e-6 * size);
        const Triangle& t = welded.triangles[found.triangle];
        const Vec3f normal =
            (koala.positions[t[1]] - koala.positions[t[0]]).cross(koala.positions[t[2]] - koala.positions[t[0]]);
        outward += normal.dot(body->surface.normals[p]) > 0;
    }
    EXPECT_GT(double(outward), 0.99 * double(body->surface.points.size()));
}

TEST(Body, ThreadsDoNotMatter) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh cube = make_wavy_cube({.resolution = 16});
    const BodyOptions options{.cells = {.count = 1500}};
    const Body one = *make_body(cube, of(MaterialModel::meshfree), options, RunContext(1));
    const Body two = *make_body(cube, of(MaterialModel::meshfree), options, RunContext(2));
    EXPECT_EQ(one.rest.x, two.rest.x);
    EXPECT_EQ(one.mass, two.mass);
    EXPECT_EQ(one.surface.points.rest, two.surface.points.rest);
    EXPECT_EQ(one.surface.points.weights, two.surface.points.weights);
    EXPECT_EQ(one.surface.normals, two.surface.normals);
}

TEST(Body, ThinPartsAreSaid) {
    const Mesh plate = make_wavy_plane({.resolution = 8, .amplitude = 0});
    BodyReport report;
    const auto body = make_body(plate, of(MaterialModel::meshfree), {.cells = {.spacing = 0.1}}, kAllThreads, &report);
    ASSERT_TRUE(body) << body.error().message;
    EXPECT_EQ(report.split_cells, 100u);
    EXPECT_EQ(body->particle_count(), 800u);
    EXPECT_NE(report.warning.find("fewer than two cells across"), std::string::npos) << report.warning;
}

/// A warning is for who has to do something about it.
TEST(Body, AFewThinCellsAreNotWorthAWarning) {
    Mesh mesh = make_wavy_cube({.resolution = 8, .amplitude = 0});
    const Mesh plate = make_wavy_plane({.resolution = 8, .amplitude = 0});
    const auto first = static_cast<Index>(mesh.vertex_count());
    for (const Vec3f& p : plate.positions) mesh.positions.push_back(0.4f * p + Vec3f(3, 0, 0));
    for (std::size_t f = 0; f < plate.face_count(); ++f) {
        std::vector<Index> face(plate.face(f).begin(), plate.face(f).end());
        for (Index& v : face) v += first;
        mesh.add_face(face);
    }
    BodyReport report;
    ASSERT_TRUE(make_body(mesh, of(MaterialModel::fem), {.cells = {.spacing = 0.1}}, kAllThreads, &report));
    EXPECT_GT(report.cells.thin_cells, 0u);
    EXPECT_LT(report.cells.thin_cells, report.cells.cells / 20);
    EXPECT_EQ(report.warning.find("fewer than two cells across"), std::string::npos) << report.warning;
}

TEST(Body, PartsOneCellThickAreNoSheets) {
    for (int k = 1; k < 40; ++k)
        EXPECT_EQ(make_body(box_cells(3, 2, 1, 0.013 * k), of(MaterialModel::fem)).field_radius, 0) << k;
}

TEST(Body, BadMaterialsAndScalesAreRefused) {
    const Mesh cube = make_wavy_cube({.resolution = 4});
    EXPECT_EQ(make_body(cube, of(MaterialModel::fem, -1), {}, kAllThreads).error().code, ErrorCode::usage);
    EXPECT_EQ(make_body(cube, {}, {.scale = 0, .cells = {}}, kAllThreads).error().code, ErrorCode::usage);
    EXPECT_EQ(make_body(cube, {}, {.cells = {.spacing = -1}}, kAllThreads).error().code, ErrorCode::usage);
    EXPECT_EQ(make_body(Mesh{}, {}, {}, kAllThreads).error().code, ErrorCode::unsuitable);
}

/// A cube of 4^2 quads a side, about the origin.
Mesh cube_of(float half, bool inwards) {
    Mesh cube = make_wavy_cube({.resolution = 4, .amplitude = 0});
    const float size = 0.5f * float(bounds(cube).size().x());
    for (Vec3f& p : cube.positions) p *= half / size;
    if (inwards)
        for (std::size_t f = 0; f < cube.face_count(); ++f)
            std::reverse(cube.corners.begin() + cube.face_offsets[f], cube.corners.begin() + cube.face_offsets[f + 1]);
    return cube;
}

TEST(Body, ItsMatterIsInsideHoweverFacesLook) {
    for (const bool inwards : {false, true})
        for (const bool has_hollow : {false, true}) {
            Mesh mesh = cube_of(1, inwards);
            if (has_hollow) { // whose faces look outwards, as exporters write them
                const Mesh hollow = cube_of(0.5f, false);
                for (std::size_t f = 0; f < hollow.face_count(); ++f) {
                    std::vector<Index> face;
                    for (const Index v : hollow.face(f)) face.push_back(v + Index(mesh.vertex_count()));
                    mesh.add_face(face);
                }
                mesh.positions.insert(mesh.positions.end(), hollow.positions.begin(), hollow.positions.end());
            }
            for (const MaterialModel model : {MaterialModel::fem, MaterialModel::springs, MaterialModel::rigid,
                                              MaterialModel::meshfree, MaterialModel::mpm}) {
                BodyReport report;
                const auto body = make_body(mesh, of(model), {.cells = {.spacing = 0.25}}, kAllThreads, &report);
                ASSERT_TRUE(body) << body.error().message;
                EXPECT_NEAR(sum(body->mass), has_hollow ? 7000 : 8000, 10);
                EXPECT_EQ(report.warning.find("inwards") != std::string::npos, inwards) << report.warning;
                EXPECT_EQ(report.warning.find("hollow") != std::string::npos, has_hollow) << report.warning;
            }
        }
}

TEST(Body, WeighsWhatItsMeshHolds) {
    Mesh plate = cube_of(1, false);
    for (Vec3f& p : plate.positions) p = p.cwiseProduct(Vec3f(0.5f, 0.5f, 0.01f)); // in cells of 0.047
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::rigid, MaterialModel::mpm}) {
        const auto body = make_body(plate, of(model), {.cells = {.spacing = 0.047}}, kAllThreads);
        EXPECT_NEAR(sum(body->mass), 1000 * 0.02, 0.2);
    }
    const Mesh ball = make_wavy_sphere({.resolution = 40, .amplitude = 0});
    for (const double spacing : {0.3, 0.2, 0.1}) {
        const auto body = make_body(ball, of(MaterialModel::fem), {.cells = {.spacing = spacing}}, kAllThreads);
        EXPECT_NEAR(sum(body->mass) / 523.6, 1, 0.01) << spacing;
    }
}

TEST(Body, MatterOfARoundBeamLiesWhereItIs) {
    constexpr int kSides = 48, kRings = 9;
    Mesh beam;
    for (int ring = 0; ring < kRings; ++ring)
        for (int side = 0; side < kSides; ++side) {
            const double angle = 2 * 3.14159265358979 * side / kSides;
            beam.positions.emplace_back(0.25f * float(ring), float(0.5 * std::cos(angle)),
                                        float(0.5 * std::sin(angle)));
        }
    std::vector<Index> first(kSides), last(kSides);
    for (Index side = 0; side < kSides; ++side) {
        first[side] = kSides - 1 - side;
        last[side] = (kRings - 1) * kSides + side;
        for (Index ring = 0; ring + 1 < kRings; ++ring) {
            const Index next = (side + 1) % kSides, at = ring * kSides;
            beam.add_face(std::array<Index, 4>{at + side, at + next, at + kSides + next, at + kSides + side});
        }
    }
    beam.add_face(first);
    beam.add_face(last);
    const double area = kSides * 0.125 * std::sin(2 * 3.14159265358979 / kSides),
                 exact = area * area / (4 * 3.14159265);
    for (const int across : {4, 6, 8}) {
        const auto body = make_body(beam, of(MaterialModel::fem), {.cells = {.spacing = 1.0 / across}}, kAllThreads);
        const Cells& cells = body->cells;
        const double h = cells.spacing;
        double sum = 0, bending = 0; // of all, and of the second moment about z, which bending stiffness goes by
        for (std::size_t c = 0; c < cells.cells.size(); ++c) {
            const double y = cells.origin.y() + h * (cells.cells[c][1] + 0.5);
            sum += double(cells.fraction[c]) * h * h * h;
            bending += double(cells.fraction[c]) * h * h * h * (y * y + h * h / 12);
        }
        EXPECT_NEAR(sum, 2 * area, 0.01 * area);
        EXPECT_NEAR(bending / (2 * exact), 1, 0.055) << across; // 1.115 and more where cells keep what is theirs
    }
}

} // namespace
} // namespace filigree
