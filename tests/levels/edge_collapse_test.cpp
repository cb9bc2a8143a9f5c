// Orders of collapses: every moment of them, other shapes that count, parts that keep vertices.
#include "filigree/levels/edge_collapse.h"

#include "filigree/mesh.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace filigree {
namespace {

std::vector<Triangle> triangles_of(const Mesh& mesh) { return triangulate(mesh).triangles; }

std::set<Index> vertices_of(std::span<const Triangle> triangles) {
    std::set<Index> vertices;
    for (const Triangle& t : triangles) vertices.insert(t.begin(), t.end());
    return vertices;
}

TEST(CollapseOrder, EveryMomentIsWhatCollapsesWouldLeave) {
    const Mesh mesh = make_wavy_cube({.resolution = 24}); // 3,458 vertices: of 108 and fewer the prices are the same
    const std::vector<Triangle> triangles = triangles_of(mesh);
    const CollapseOrder order = order_collapses(mesh.positions, triangles, {.target_vertices = 4}, kOneThread);
    for (const std::size_t target : {4u, 12u, 57u, 100u}) {
        const EdgeCollapseResult once =
            collapse_edges(mesh.positions, triangles, {.target_vertices = target}, kOneThread);
        const EdgeCollapseResult moment = order.at(target);
        EXPECT_EQ(moment.triangles, once.triangles) << target;
        EXPECT_EQ(moment.vertex_count, once.vertex_count);
        EXPECT_EQ(moment.error, once.error);
        EXPECT_EQ(moment.forced, once.forced);
    }
    EXPECT_EQ(order.at(mesh.vertex_count()).triangles, triangles);
}

TEST(CollapseOrder, LaterMomentsHaveFewerOfTheSameVertices) {
    const Mesh mesh = make_wavy_cube({.resolution = 20});
    const CollapseOrder order = order_collapses(mesh.positions, triangles_of(mesh), {}, kOneThread);
    std::set<Index> before = vertices_of(triangles_of(mesh));
    for (const std::size_t target : {2'000u, 1'000u, 300u, 299u, 40u, 5u}) {
        const EdgeCollapseResult moment = order.at(target);
        const std::set<Index> now = vertices_of(moment.triangles);
        EXPECT_EQ(now.size(), moment.vertex_count);
        EXPECT_LE(now.size(), target);
        EXPECT_GE(now.size(), target - 3);
        EXPECT_TRUE(std::ranges::includes(before, now));
        before = now;
    }
}

TEST(CollapseOrder, OtherShapesCount) {
    // A flat sheet that another shape folds along x = 0.5: the fold keeps its vertices.
    Mesh mesh = make_wavy_plane({.resolution = 40, .amplitude = 0});
    std::vector<Vec3f> folded = mesh.positions;
    const float middle = float(bounds(mesh).centre().x());
    for (Vec3f& p : folded) p.z() += 2 * std::abs(p.x() - middle);
    const std::vector<Triangle> triangles = triangles_of(mesh);
    const auto on_fold = [&](const CollapseOrder& order) {
        const std::set<Index> kept = vertices_of(order.at(60).triangles);
        return std::ranges::count_if(kept, [&](Index v) { return std::abs(mesh.positions[v].x() - middle) < 1e-4f; });
    };
    const std::vector<std::vector<Vec3f>> shapes = {folded};
    const EdgeCollapseOptions flat{.length_weight = 2e-4}, both{.length_weight = 2e-4, .other_shapes = shapes};
    const auto without = on_fold(order_collapses(mesh.positions, triangles, flat, kOneThread));
    const auto with = on_fold(order_collapses(mesh.positions, triangles, both, kOneThread));
    EXPECT_LT(without, 10);
    EXPECT_GT(with, 2 * without);
}

TEST(CollapseOrder, LargePartsKeepVertices) {
    // A wavy ball, and beside it a smooth one that would go first; a rivet may go.
    Mesh mesh = make_wavy_cube({.resolution = 24});
    const auto append = [&](const Mesh& other, const Vec3f& shift) {
        const auto first = static_cast<Index>(mesh.vertex_count());
        for (const Vec3f& p : other.positions) mesh.positions.push_back(p + shift);
        for (std::size_t f = 0; f < other.face_count(); ++f) {
            std::vector<Index> face(other.face(f).begin(), other.face(f).end());
            for (Index& v : face) v += first;
            mesh.add_face(face);
        }
        return first;
    };
    const Index smooth = append(make_ball(Vec3d::Zero(), 0.3), {2, 0, 0});
    const Index rivet = append(make_ball(Vec3d::Zero(), 0.01), {0, 2, 0});
    const CollapseOrder order = order_collapses(mesh.positions, triangles_of(mesh), {.least_of_part = 30}, kOneThread);
    const std::set<Index> kept = vertices_of(order.at(3).triangles);
    const auto count = [&](Index from, Index to) {
        return std::ranges::count_if(kept, [&](Index v) { return v >= from && v < to; });
    };
    EXPECT_EQ(count(0, smooth), 30);
    EXPECT_EQ(count(smooth, rivet), 30);
    EXPECT_LT(count(rivet, Index(mesh.vertex_count())), 10);
}

} // namespace
} // namespace filigree
