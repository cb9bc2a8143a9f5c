// Levels made in clusters: as many vertices as asked, no seams, nothing torn, and the same for any number of threads.
#include "filigree/hierarchy/cluster_simplify.h"

#include "filigree/mesh.h"
#include "filigree/restore.h"
#include "filigree/strip.h"
#include "threads.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numeric>

namespace filigree {
namespace {

Mesh over_triangles(const Mesh& mesh, std::span<const Triangle> triangles) {
    Mesh result;
    std::vector<Index> local(mesh.vertex_count(), kNoIndex);
    for (Triangle t : triangles) {
        for (Index& v : t) {
            if (local[v] == kNoIndex) {
                local[v] = static_cast<Index>(result.positions.size());
                result.positions.push_back(mesh.positions[v]);
            }
            v = local[v];
        }
        result.add_face(t);
    }
    return result;
}

/// Some 384,000 vertices, 6 clusters.
const Mesh& cube() {
    static const Mesh mesh = make_wavy_cube({.resolution = 253});
    return mesh;
}
const std::vector<Triangle>& cube_triangles() {
    static const std::vector<Triangle> triangles = triangulate(cube()).triangles;
    return triangles;
}

TEST(ClusterSimplify, RoundsReachTheirTargetsAndStayClosed) {
    ClusterSimplifier clusters(cube().positions);
    std::vector<Triangle> triangles = cube_triangles();
    for (const std::size_t target : {96'000u, 24'000u}) {
        const std::optional<Simplified> left = clusters.simplify(triangles, target, 1e6, kAllThreads);
        ASSERT_TRUE(left);
        EXPECT_NEAR(double(left->vertex_count), double(target), 0.02 * double(target));
        EXPECT_GT(left->error, 0);
        const Mesh mesh = over_triangles(cube(), left->triangles);
        EXPECT_EQ(mesh.vertex_count(), left->vertex_count);
        const TopologyReport topology = analyse_topology(mesh, kAllThreads);
        EXPECT_TRUE(topology.is_closed());
        // meshoptimizer makes some, in one piece too.
        EXPECT_LT(topology.nonmanifold_edges.count, left->vertex_count / 1000);
        EXPECT_EQ(topology.inconsistent_edges.count, 0u);
        triangles = left->triangles;
    }
}

TEST(ClusterSimplify, SameBytesForAnyNumberOfThreads) {
    std::vector<std::vector<Triangle>> results;
    std::vector<std::vector<Index>> nearest;
    for (const unsigned threads : {1u, 2u, 5u}) {
        ClusterSimplifier clusters(cube().positions);
        results.push_back(clusters.simplify(cube_triangles(), 96'000, 1e6, RunContext(threads)).value().triangles);
        nearest.push_back(clusters.take_removed().nearest_left);
    }
    for (std::size_t k = 1; k < results.size(); ++k) {
        EXPECT_EQ(results[k], results[0]);
        EXPECT_EQ(nearest[k], nearest[0]);
    }
}

TEST(ClusterSimplify, EveryRemovedVertexHangsNearOneThatIsLeft) {
    ClusterSimplifier clusters(cube().positions);
    std::vector<bool> is_there(cube().vertex_count(), true);
    std::vector<Triangle> triangles = cube_triangles();
    for (const std::size_t target : {96'000u, 24'000u}) {
        triangles = clusters.simplify(triangles, target, 1e6, kAllThreads).value().triangles;
        is_there.assign(is_there.size(), false);
        for (const Triangle& t : triangles)
            for (const Index v : t) is_there[v] = true;
    }
    const RemovedVertices removed = clusters.take_removed();
    EXPECT_EQ(removed.rounds, 2);
    const double edge = 0.01; // of a cube of 1: a level of 24,000 has edges of 0.016
    for (Index v = 0; v < is_there.size(); ++v) {
        EXPECT_EQ(removed.removed[v] == 0, is_there[v]);
        Index at = v;
        unsigned steps = 0;
        while (!is_there[at] && steps++ < 3) {
            const Index next = removed.nearest_left[at];
            ASSERT_NE(next, kNoIndex) << v;
            EXPECT_TRUE(removed.removed[next] == 0 || removed.removed[next] > removed.removed[at]);
            at = next;
        }
        ASSERT_TRUE(is_there[at]) << v;
        EXPECT_LT((cube().positions[at] - cube().positions[v]).norm(), 6 * edge) << v;
    }
}

/// A border of the first round would stand out by its short edges.
TEST(ClusterSimplify, BordersOfClustersDoNotStay) {
    ClusterSimplifier clusters(cube().positions);
    std::vector<Triangle> triangles = cube_triangles();
    for (const std::size_t target : {96'000u, 24'000u, 6'000u})
        triangles = clusters.simplify(triangles, target, 1e6, kAllThreads).value().triangles;
    const Mesh level = over_triangles(cube(), triangles);
    const Mesh one = over_triangles(
        cube(), simplify(cube().positions, cube_triangles(), {.target_vertices = 6'000}, kAllThreads).triangles);
    const auto short_edges = [](const Mesh& mesh) {
        std::vector<float> lengths;
        for (std::size_t f = 0; f < mesh.face_count(); ++f)
            for (std::size_t k = 0; k < 3; ++k)
                lengths.push_back((mesh.positions[mesh.face(f)[k]] - mesh.positions[mesh.face(f)[(k + 1) % 3]]).norm());
        std::ranges::sort(lengths);
        const float tenth = 0.25f * lengths[lengths.size() / 2];
        return double(std::ranges::lower_bound(lengths, tenth) - lengths.begin()) / double(lengths.size());
    };
    EXPECT_LT(short_edges(level), 0.03); // in one piece 0.002
    const double far = mesh_distance(cube(), level, 0, kAllThreads)->surfaces->rms_a_to_b;
    const double one_far = mesh_distance(cube(), one, 0, kAllThreads)->surfaces->rms_a_to_b;
    EXPECT_LT(far, 1.15 * one_far);
}

TEST(ClusterSimplify, OpenBordersArePartOfIt) {
    const Mesh plane = make_wavy_plane({.resolution = 600});
    const std::vector<Triangle> triangles = triangulate(plane).triangles;
    ClusterSimplifier clusters(plane.positions);
    const Simplified left = clusters.simplify(triangles, plane.vertex_count() / 4, 1e6, kAllThreads).value();
    EXPECT_NEAR(double(left.vertex_count), double(plane.vertex_count()) / 4, 0.02 * double(plane.vertex_count()));
    const std::size_t before = analyse_topology(plane, kAllThreads).open_edges.count;
    const std::size_t after = analyse_topology(over_triangles(plane, left.triangles), kAllThreads).open_edges.count;
    EXPECT_LT(after, before / 2) << "the mesh's own border is simplified too";
    EXPECT_GT(after, before / 16);
}

TEST(ClusterSimplify, SmallPartsStay) {
    Mesh mesh = cube();
    const Mesh ball = make_wavy_sphere({.resolution = 6});
    const std::size_t own = mesh.vertex_count();
    for (int k = 0; k < 50; ++k) {
        const Index first = static_cast<Index>(mesh.vertex_count());
        for (const Vec3f& p : ball.positions)
            mesh.positions.push_back(0.002f * p + Vec3f(-0.5f + 0.02f * float(k), 0.7f, 0.1f));
        for (std::size_t f = 0; f < ball.face_count(); ++f) {
            std::vector<Index> face(ball.face(f).begin(), ball.face(f).end());
            for (Index& v : face) v += first;
            mesh.add_face(face);
        }
    }
    ClusterSimplifier clusters(mesh.positions);
    const Simplified left = clusters.simplify(triangulate(mesh).triangles, 110'000, 1e6, kAllThreads).value();
    std::vector<bool> is_there(mesh.vertex_count(), false);
    for (const Triangle& t : left.triangles)
        for (const Index v : t) is_there[v] = true;
    EXPECT_EQ(std::size_t(std::count(is_there.begin() + std::ptrdiff_t(own), is_there.end(), true)),
              mesh.vertex_count() - own);
}

TEST(ClusterSimplify, SaysWhereOnePieceHasTo) {
    // Dust: every part is small.
    Mesh dust;
    for (Index k = 0; k < 100'000; ++k) {
        const Vec3f at(0.01f * float(k % 100), 0.01f * float(k / 100 % 100), 0.01f * float(k / 10'000));
        dust.positions.insert(dust.positions.end(), {at, at + Vec3f(1e-3f, 0, 0), at + Vec3f(0, 1e-3f, 0)});
        dust.add_face(std::array{3 * k, 3 * k + 1, 3 * k + 2});
    }
    EXPECT_FALSE(ClusterSimplifier(dust.positions).simplify(triangulate(dust).triangles, 75'000, 1e6, kAllThreads));
    // Cancelled.
    const RunContext cancelled;
    cancelled.cancel();
    EXPECT_FALSE(ClusterSimplifier(cube().positions).simplify(cube_triangles(), 96'000, 1e6, cancelled));
    // Such a mesh is stripped all the same.
    const Stripped stripped = strip(dust, {.base = 1000, .one_piece = 100'000}, kAllThreads).value();
    EXPECT_EQ(check_model(stripped.model), "");
}

TEST(ClusterSimplify, AModelMadeSoIsAsGood) {
    StripOptions options{.base = 1000, .one_piece = 100'000};
    const Stripped clusters = strip(cube(), options, kAllThreads).value();
    options.one_piece = StripOptions().one_piece;
    const Stripped one = strip(cube(), options, kAllThreads).value();
    ASSERT_EQ(check_model(clusters.model), "");
    ASSERT_EQ(clusters.model.finest_level(), one.model.finest_level());
    EXPECT_EQ(clusters.report.across_gap, 0u);
    for (std::size_t k = 0; k < one.model.levels.size(); ++k)
        EXPECT_NEAR(double(clusters.model.levels[k].vertices.size()), double(one.model.levels[k].vertices.size()),
                    0.03 * double(one.model.levels[k].vertices.size()));
    // A twist, with gradients.
    const auto twisted = [](const Vec3f& p, Mat3f& gradient) {
        const float angle = 1.5f * p.y(), c = std::cos(angle), s = std::sin(angle);
        gradient << c, -1.5f * (s * p.x() - c * p.z()), s, 0, 1, 0, -s, -1.5f * (c * p.x() + s * p.z()), c;
        return Vec3f(c * p.x() + s * p.z(), p.y(), -s * p.x() + c * p.z());
    };
    const auto error = [&](const Model& model) {
        Pose pose;
        for (const Vec3f& p : driver_positions(model)) {
            pose.gradients.emplace_back();
            pose.positions.push_back(twisted(p, pose.gradients.back()));
        }
        const Restorer restorer = Restorer::create(model, {}, kAllThreads).value();
        const std::vector<Vec3f> restored = restorer.positions(pose, kAllThreads).value();
        double sum = 0;
        Mat3f unused;
        for (std::size_t v = 0; v < restored.size(); ++v)
            sum += double((restored[v] - twisted(model.mesh.positions[v], unused)).squaredNorm());
        return std::sqrt(sum / double(restored.size()));
    };
    EXPECT_LT(error(clusters.model), 1.3 * error(one.model));
}

} // namespace
} // namespace filigree
