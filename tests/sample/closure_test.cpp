#include "filigree/sample/closure.h"

#include "filigree/mesh.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace filigree {
namespace {

TEST(Closure, KnowsOpenEdgesAndTurnedFaces) {
    Mesh cube = make_wavy_cube({.resolution = 2, .amplitude = 0});
    EXPECT_TRUE(weld_triangles(cube, kAllThreads)->closure.is_closed());
    EXPECT_TRUE(weld_triangles(cube, kAllThreads)->closure.is_oriented());
    std::swap(cube.corners[1], cube.corners[3]); // the first quad, turned round
    const Closure turned = weld_triangles(cube, kAllThreads)->closure;
    EXPECT_TRUE(turned.is_closed());
    EXPECT_TRUE(turned.is_oriented()); // turned back
    cube.corners.erase(cube.corners.begin(), cube.corners.begin() + 4);
    cube.face_offsets.pop_back();
    const Closure open = weld_triangles(cube, kAllThreads)->closure;
    EXPECT_EQ(open.open_edges, 4u);
    EXPECT_EQ(open.unbalanced, 4u);
    EXPECT_NEAR((open.first_open[0] - open.first_open[1]).norm(), bounds(cube.positions).size().x() / 2, 1e-6);
}

TEST(Closure, WhatHasOnlyOneSideStaysUnbalanced) {
    Mesh band; // of Moebius
    for (int i = 0; i < 12; ++i)
        for (const double side : {-0.3, 0.3}) {
            const double a = i * std::numbers::pi / 6, r = 1 + side * std::cos(a / 2);
            band.positions.push_back(Vec3d(r * std::cos(a), r * std::sin(a), side * std::sin(a / 2)).cast<float>());
        }
    for (Index i = 0; i < 12; ++i) {
        const Index a = 2 * i, b = a + 1, next = 2 * ((i + 1) % 12);
        const bool crosses = i == 11;
        band.add_face(std::array<Index, 4>{a, b, crosses ? next : next + 1, crosses ? next + 1 : next});
    }
    const Closure closure = weld_triangles(band, kAllThreads)->closure;
    EXPECT_EQ(closure.open_edges, 24u);
    EXPECT_EQ(closure.turned, 1u);
}

TEST(Closure, VerticesAtOnePlaceAreOne) {
    Mesh cube = make_wavy_cube({.resolution = 3});
    Mesh apart;
    for (std::size_t f = 0; f < cube.face_count(); ++f) {
        std::vector<Index> face;
        for (const Index v : cube.face(f)) {
            face.push_back(Index(apart.positions.size()));
            apart.positions.push_back(cube.positions[v]);
        }
        apart.add_face(face);
    }
    EXPECT_TRUE(weld_triangles(apart, kAllThreads)->closure.is_closed());
    const RunContext cancelled;
    cancelled.cancel();
    EXPECT_EQ(weld_triangles(apart, cancelled).error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
