#include "filigree/mesh.h"

#include "threads.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <set>

namespace filigree {
namespace {

using Places = std::vector<std::vector<Index>>;

Mesh triangles(std::vector<Vec3f> positions, const std::vector<Triangle>& faces) {
    Mesh mesh;
    mesh.positions = std::move(positions);
    for (const Triangle& t : faces) mesh.add_face(t);
    return mesh;
}

std::vector<Vec3f> scattered(std::size_t count) {
    std::vector<Vec3f> positions;
    for (std::size_t i = 0; i < count; ++i) positions.emplace_back(float(i), float(i * i % 7), float(i * i * i % 11));
    return positions;
}

TopologyReport analyse(const Mesh& mesh) { return analyse_topology(mesh, RunContext(1)); }

TEST(Topology, OfNothing) {
    const TopologyReport report = analyse(Mesh{});
    EXPECT_EQ(report.vertices + report.faces + report.edges + report.components, 0u);
    EXPECT_EQ(report.euler, 0);
    EXPECT_FALSE(report.is_closed());
    EXPECT_TRUE(report.box.empty());
}

TEST(Topology, OfTheShapes) {
    for (const std::string_view name : shape_names()) {
        SCOPED_TRACE(name);
        const TopologyReport report = analyse(*make_shape(name, {.resolution = 8}));
        EXPECT_TRUE(report.is_manifold() && report.is_oriented());
        EXPECT_EQ(report.is_closed(), name != "wavy-plane");
        EXPECT_EQ(report.euler, name == "wavy-plane" ? 1 : name == "torus" ? 0 : 2);
        EXPECT_EQ(report.components, 1u);
        EXPECT_EQ(report.quads, report.faces);
        EXPECT_EQ(report.corners, 4 * report.faces);
        EXPECT_EQ(report.open_edges.count, name == "wavy-plane" ? 32u : 0u);
        EXPECT_EQ(report.degenerate_faces.count + report.duplicate_faces.count + report.unused_vertices.count +
                      report.duplicate_vertices.count,
                  0u);
    }
}

TEST(Topology, MeasuresInWorldCoordinatesAtEveryScale) {
    for (const double scale : {1e-30, 1.0, 1e30}) {
        Mesh mesh = make_bar({.resolution = 4, .size = scale, .length = 2});
        mesh.origin = Vec3d(10 * scale, 0, 0);
        const TopologyReport report = analyse(mesh);
        EXPECT_NEAR(report.area / (10 * scale * scale), 1, 1e-6);
        EXPECT_NEAR(report.volume / (2 * scale * scale * scale), 1, 1e-6);
        EXPECT_NEAR(report.box.max.x() / (11 * scale), 1, 1e-6);
        EXPECT_EQ(report.degenerate_faces.count, 0u);
    }
}

TEST(Topology, VolumeOfAnOpenMeshIsThatOfTheConeFromTheOrigin) {
    Mesh mesh = make_wavy_plane({.resolution = 2, .amplitude = 0, .size = 2});
    mesh.origin = Vec3d(10, 20, 3);
    EXPECT_NEAR(analyse(mesh).volume, 4.0 * 3 / 3, 1e-12); // a pyramid
}

TEST(Topology, FindsOpenAndNonmanifoldEdges) {
    // three triangles around the edge 0-1
    const TopologyReport report = analyse(triangles(scattered(5), {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}));
    EXPECT_EQ(report.nonmanifold_edges.count, 1u);
    EXPECT_EQ(report.nonmanifold_edges.places, (Places{{0, 1}}));
    EXPECT_EQ(report.open_edges.count, 6u);
    EXPECT_EQ(report.open_edges.places, (Places{{0, 2}, {0, 3}, {0, 4}, {1, 2}, {1, 3}}));
    EXPECT_EQ(report.nonmanifold_vertices.count, 0u); // one fan, through the edge
    EXPECT_EQ(report.components, 1u);
    EXPECT_FALSE(report.is_manifold());
}

TEST(Topology, FindsBowtieVertices) {
    const TopologyReport report = analyse(triangles(scattered(5), {{0, 1, 2}, {2, 3, 4}}));
    EXPECT_EQ(report.nonmanifold_vertices.places, (Places{{2}}));
    EXPECT_EQ(report.components, 2u);
    EXPECT_EQ(report.nonmanifold_edges.count, 0u);
}

TEST(Topology, FindsTurnedFacesAndTheMoebiusStrip) {
    const TopologyReport turned = analyse(triangles(scattered(4), {{0, 1, 2}, {0, 1, 3}}));
    EXPECT_EQ(turned.inconsistent_edges.places, (Places{{0, 1}}));
    std::vector<Triangle> strip;
    for (Index i = 0; i < 9; ++i)
        strip.push_back(i % 2 ? Triangle{i, (i + 2) % 9, (i + 1) % 9} : Triangle{i, (i + 1) % 9, (i + 2) % 9});
    const TopologyReport moebius = analyse(triangles(scattered(9), strip));
    EXPECT_EQ(moebius.euler, 0);
    EXPECT_EQ(moebius.open_edges.count, 9u);
    EXPECT_EQ(moebius.inconsistent_edges.count, 1u);
}

TEST(Topology, FindsDegenerateDuplicateAndUnused) {
    Mesh mesh = triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {-0.0f, 0, 0}, {9, 9, 9}},
                          {{0, 1, 2}, {2, 1, 0}, {1, 1, 2}, {0, 1, 3}, {1, 2, 0}, {2, 1, 4}});
    const TopologyReport report = analyse(mesh);
    EXPECT_EQ(report.degenerate_faces.places, (Places{{2}, {3}})); // a repeated corner; no area
    EXPECT_EQ(report.duplicate_faces.places, (Places{{1}, {4}}));
    EXPECT_EQ(report.unused_vertices.places, (Places{{5}}));
    EXPECT_EQ(report.duplicate_vertices.places, (Places{{4}}));
}

TEST(Topology, PassesOverCollapsedFaces) {
    Mesh mesh = make_bar({.resolution = 2, .length = 1});
    const TopologyReport before = analyse(mesh);
    mesh.add_face(std::array<Index, 3>{0, 1, 0});
    mesh.add_face(std::array<Index, 5>{3, 3, 4, 4, 4});
    mesh.add_face(std::array<Index, 4>{7, 7, 7, 7});
    const TopologyReport after = analyse(mesh);
    EXPECT_EQ(after.degenerate_faces.count, 3u);
    EXPECT_EQ(after.faces, before.faces + 3);
    EXPECT_EQ(after.edges, before.edges);
    EXPECT_EQ(after.euler, before.euler);
    EXPECT_EQ(after.components, before.components);
    EXPECT_TRUE(after.is_closed() && after.is_manifold() && after.is_oriented());
}

TEST(Topology, RepeatedCornersAreOneCorner) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}};
    mesh.add_face(std::array<Index, 6>{0, 0, 1, 1, 2, 0});
    const TopologyReport report = analyse(mesh);
    EXPECT_EQ(report.edges, 3u);
    EXPECT_EQ(report.open_edges.count, 3u);
    EXPECT_TRUE(report.is_manifold());
    EXPECT_EQ(report.euler, 1);
}

TEST(Topology, BridgedPolygonIsARing) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 0}, {3, 3, 0}, {3, 6, 0}, {6, 6, 0}, {6, 3, 0}};
    mesh.add_face(std::array<Index, 10>{0, 1, 2, 3, 0, 4, 5, 6, 7, 4});
    const TopologyReport report = analyse(mesh);
    EXPECT_EQ(report.open_edges.count, 8u);
    EXPECT_EQ(report.edges, 9u);
    EXPECT_TRUE(report.is_manifold() && report.is_oriented());
    EXPECT_NEAR(report.area, 72, 1e-12);
}

TEST(Topology, AgreesWithPlainCountingOnRandomSoups) {
    std::mt19937 random(3);
    for (int round = 0; round < 200; ++round) {
        const Index vertex_count = 3 + Index(random() % 12);
        Mesh mesh = triangles(scattered(vertex_count), {});
        for (std::size_t f = random() % 30; f > 0; --f) {
            Triangle t;
            do t = {Index(random() % vertex_count), Index(random() % vertex_count), Index(random() % vertex_count)};
            while (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]);
            mesh.add_face(t);
        }
        std::map<std::pair<Index, Index>, std::vector<std::pair<Index, bool>>> edges; // faces and directions
        std::map<std::set<Index>, int> vertex_sets;
        for (Index f = 0; f < mesh.face_count(); ++f) {
            ++vertex_sets[{mesh.face(f).begin(), mesh.face(f).end()}];
            for (std::size_t i = 0; i < 3; ++i) {
                const Index a = mesh.face(f)[i], b = mesh.face(f)[(i + 1) % 3];
                edges[std::minmax(a, b)].emplace_back(f, a < b);
            }
        }
        std::size_t open = 0, nonmanifold = 0, inconsistent = 0, duplicates = 0;
        for (const auto& [edge, sides] : edges) {
            open += sides.size() == 1;
            nonmanifold += sides.size() > 2;
            inconsistent += sides.size() == 2 && sides[0].second == sides[1].second;
        }
        for (const auto& [set, count] : vertex_sets) duplicates += std::size_t(count - 1);
        // flood over faces: all, and those around one vertex
        const auto sets_of_faces = [&](Index around) {
            std::vector<Index> label(mesh.face_count());
            std::iota(label.begin(), label.end(), Index{0});
            std::set<Index> seen;
            for (std::size_t pass = 0; pass < mesh.face_count(); ++pass)
                for (const auto& [edge, sides] : edges) {
                    if (around != kNoIndex && edge.first != around && edge.second != around) continue;
                    Index lowest = kNoIndex;
                    for (const auto& side : sides) lowest = std::min(lowest, label[side.first]);
                    for (const auto& side : sides) label[side.first] = lowest;
                }
            for (Index f = 0; f < mesh.face_count(); ++f)
                if (around == kNoIndex || std::ranges::count(mesh.face(f), around)) seen.insert(label[f]);
            return seen.size();
        };
        std::size_t nonmanifold_vertices = 0;
        for (Index v = 0; v < vertex_count; ++v) nonmanifold_vertices += sets_of_faces(v) > 1;

        const TopologyReport report = analyse(mesh);
        EXPECT_EQ(report.edges, edges.size());
        EXPECT_EQ(report.open_edges.count, open);
        EXPECT_EQ(report.nonmanifold_edges.count, nonmanifold);
        EXPECT_EQ(report.inconsistent_edges.count, inconsistent);
        EXPECT_EQ(report.duplicate_faces.count, duplicates);
        EXPECT_EQ(report.components, sets_of_faces(kNoIndex));
        EXPECT_EQ(report.nonmanifold_vertices.count, nonmanifold_vertices);
    }
}

TEST(Topology, DoesNotDependOnThreads) {
    Mesh mesh = make_wavy_sphere({.resolution = 100});
    std::mt19937 random(5);
    const auto some_face = [&, quads = mesh.face_count()] { return mesh.face(random() % quads); };
    for (int i = 0; i < 500; ++i) { // spoil it
        const std::span<const Index> chosen = some_face();
        const std::vector<Index> twin(chosen.begin(), chosen.end()), folded(3, chosen[0]);
        const std::vector<Index> turned = {some_face()[0], some_face()[3], some_face()[1]};
        std::reverse(mesh.corners.begin() + 4 * (40 * i), mesh.corners.begin() + 4 * (40 * i + 1));
        mesh.add_face(twin);
        mesh.add_face(folded);
        mesh.add_face(turned);
    }
    FILIGREE_NEEDS_TWO_THREADS();
    const TopologyReport one = analyse_topology(mesh, RunContext(1)), three = analyse_topology(mesh, RunContext(3));
    EXPECT_EQ(one.components, three.components);
    EXPECT_EQ(one.euler, three.euler);
    EXPECT_EQ(one.area, three.area);
    EXPECT_EQ(one.volume, three.volume);
    for (Finding TopologyReport::*finding :
         {&TopologyReport::open_edges, &TopologyReport::nonmanifold_edges, &TopologyReport::inconsistent_edges,
          &TopologyReport::nonmanifold_vertices, &TopologyReport::degenerate_faces, &TopologyReport::duplicate_faces}) {
        EXPECT_GT((one.*finding).count, 0u);
        EXPECT_EQ((one.*finding).count, (three.*finding).count);
        EXPECT_EQ((one.*finding).places, (three.*finding).places);
    }
}

TEST(Topology, HugeFansAndFacesAreQuick) {
    const Index count = 100000;
    Mesh fan = triangles(scattered(count + 1), {});
    std::vector<Index> outline(count);
    std::iota(outline.begin(), outline.end(), Index{1});
    for (Index i = 1; i < count; ++i) fan.add_face(Triangle{0, i, i + 1});
    fan.add_face(outline);
    const TopologyReport report = analyse(fan);
    EXPECT_EQ(report.open_edges.count, 3u); // the fan's two ends, and the outline's closing edge
    EXPECT_EQ(report.components, 1u);
    EXPECT_TRUE(report.is_manifold());
}

} // namespace
} // namespace filigree
