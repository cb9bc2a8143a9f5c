#include "filigree/hierarchy/bind.h"

#include "filigree/hierarchy/simplify.h"
#include "filigree/mesh.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/mesh/normals.h"
#include "hierarchy/part_meshes.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

struct Bound {
    Surface surface;
    std::vector<Triangle> cells;
    Binding binding;
};

Bound bound(const Mesh& mesh, std::vector<Triangle> cells, const RunContext& context = kOneThread) {
    Bound out;
    out.surface = make_surface(mesh, kOneThread).value();
    out.cells = std::move(cells);
    auto binding =
        bind_to_driver(mesh.positions, out.surface, vertex_normals(out.surface.triangles, mesh.positions, kOneThread),
                       out.cells, out.surface.triangles, context);
    EXPECT_TRUE(binding.ok());
    out.binding = std::move(*binding);
    EXPECT_EQ(out.binding.bonds.size(), mesh.vertex_count());
    for (const Bond& bond : out.binding.bonds) {
        EXPECT_LT(bond.cell, out.cells.size());
        EXPECT_TRUE(bond.u >= 0 && bond.v >= 0 && bond.u + bond.v <= 1 + 1e-6f) << bond.u << ' ' << bond.v;
    }
    return out;
}

Bound bound_to(const Mesh& mesh, std::size_t base, const RunContext& context = kOneThread) {
    return bound(
        mesh, simplify(mesh.positions, triangulate(mesh).triangles, {.target_vertices = base}, RunContext()).triangles,
        context);
}

Vec3d anchor(const Mesh& mesh, const Bound& bound, std::size_t vertex) {
    const Bond& bond = bound.binding.bonds[vertex];
    const Triangle& cell = bound.cells[bond.cell];
    return (1.0 - bond.u - bond.v) * mesh.positions[cell[0]].cast<double>() +
           bond.u * mesh.positions[cell[1]].cast<double>() + bond.v * mesh.positions[cell[2]].cast<double>();
}

/// Two wavy sheets, one facing up and one down, `gap` apart and joined by nothing (or along one side).
Mesh thin_plate(float gap, bool joined) {
    const Mesh sheet = make_wavy_plane({.resolution = 40, .frequency = 3, .amplitude = 0.03});
    Mesh mesh = sheet;
    const auto count = static_cast<Index>(sheet.vertex_count());
    for (const Vec3f& p : sheet.positions) mesh.positions.push_back(p - Vec3f(0, 0, gap));
    for (std::size_t f = 0; f < sheet.face_count(); ++f) {
        const auto face = sheet.face(f);
        mesh.add_face(std::array<Index, 4>{face[3] + count, face[2] + count, face[1] + count, face[0] + count});
    }
    mesh.uvs = {};
    if (joined)
        for (Index i = 0; i < 40; ++i) mesh.add_face(std::array<Index, 4>{i + 1, i, i + count, i + 1 + count});
    return mesh;
}

TEST(Bind, ThinPlatesBindToTheirOwnSide) {
    for (const float gap : {0.02f, 1e-3f, 1e-5f})
        for (const bool joined : {false, true}) {
            const Mesh mesh = thin_plate(gap, joined);
            const Index half = static_cast<Index>(mesh.vertex_count() / 2);
            const Bound out = bound_to(mesh, 200);
            std::size_t wrong = 0;
            for (Index v = 0; v < mesh.vertex_count(); ++v) {
                if (joined && mesh.positions[v].y() < -0.4f) continue; // around the fold, either side is the own one
                const Triangle& cell = out.cells[out.binding.bonds[v].cell];
                const auto lower = std::count_if(cell.begin(), cell.end(), [&](Index c) { return c >= half; });
                wrong += v < half ? lower == 3 : lower == 0;
            }
            EXPECT_EQ(wrong, 0u) << gap << ' ' << joined;
            EXPECT_TRUE(out.binding.across_gap.empty());
        }
}

TEST(Bind, DriverVerticesHangOnThemselves) {
    const Mesh mesh = make_wavy_sphere({.resolution = 32});
    const Bound out = bound_to(mesh, 300);
    for (const Triangle& cell : out.cells)
        for (const Index v : cell)
            EXPECT_LT((anchor(mesh, out, v) - mesh.positions[v].cast<double>()).norm(), 1e-7) << v;
}

/// On a body without thin parts the closest point along the surface is the closest point.
TEST(Bind, ThickBodiesBindToTheClosestPoint) {
    const Mesh mesh = make_wavy_sphere({.resolution = 32, .frequency = 3});
    const Bound out = bound_to(mesh, 300);
    const ClosestPointTree tree(mesh.positions, out.cells);
    std::size_t further = 0;
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        const double here = (anchor(mesh, out, v) - mesh.positions[v].cast<double>()).norm();
        further += here > tree.closest(mesh.positions[v]).distance + 1e-6;
    }
    EXPECT_LT(further, mesh.vertex_count() / 100);
}

TEST(Bind, PartsWithoutADriverVertexAreReported) {
    Mesh mesh = make_wavy_plane({.resolution = 8});
    const auto sheet = static_cast<Index>(mesh.vertex_count());
    std::vector<Triangle> cells = triangulate(mesh).triangles;
    mesh.uvs = {};
    for (const Vec3f& p : {Vec3f(0, 0, 0.3f), Vec3f(0.1f, 0, 0.3f), Vec3f(0, 0.1f, 0.3f), Vec3f(0.2f, 0.2f, 5)})
        mesh.positions.push_back(p); // a scrap above, and a loose vertex
    mesh.add_face(Triangle{sheet, sheet + 1, sheet + 2});
    const Bound out = bound(mesh, cells);
    EXPECT_EQ(out.binding.across_gap, (std::vector<Index>{sheet, sheet + 1, sheet + 2, sheet + 3}));
    EXPECT_TRUE(out.binding.facing_away.empty());
    for (Index v = sheet; v < sheet + 3; ++v)
        EXPECT_LT((anchor(mesh, out, v) - mesh.positions[v].cast<double>()).norm(), 0.4) << v;
}

/// How far the bonds of vertices from `first` on are from them, at most.
double furthest_bond(const Mesh& mesh, const Bound& bound, std::size_t first) {
    double furthest = 0;
    for (std::size_t v = first; v < mesh.vertex_count(); ++v)
        furthest = std::max(furthest, (anchor(mesh, bound, v) - mesh.positions[v].cast<double>()).norm());
    return furthest;
}

/// Half of a rivet's vertices face away from all of the surface below it.
TEST(Bind, ARivetHangsOnTheSurfaceBelowItWhateverItFaces) {
    Mesh mesh = make_ball(Vec3d::Zero(), 1);
    const std::size_t ball = mesh.vertex_count();
    const std::vector<Triangle> cells =
        simplify(mesh.positions, triangulate(mesh).triangles, {.target_vertices = 400}, RunContext()).triangles;
    for (const Vec3f& at : {Vec3f(0, 0, 1.015f), Vec3f(0.6f, -0.8f, 0), Vec3f(-0.577f, 0.577f, 0.6f)})
        filigree_test::add_part(mesh, make_ball(Vec3d::Zero(), 1), 0.02f, at);
    const Bound out = bound(mesh, cells);
    EXPECT_EQ(out.binding.across_gap.size(), mesh.vertex_count() - ball);
    EXPECT_LT(furthest_bond(mesh, out, ball), 0.06); // its size and its height, and what the driver cuts off the ball
}

/// A patch on the upper side of a plate that is thinner than the driver is exact.
TEST(Bind, APatchOnAThinPlateHangsOnTheSideItLiesOn) {
    Mesh mesh = thin_plate(0.004f, false);
    const auto half = static_cast<Index>(mesh.vertex_count() / 2), plate = 2 * half;
    const std::vector<Triangle> cells =
        simplify(mesh.positions, triangulate(mesh).triangles, {.target_vertices = 60}, RunContext()).triangles;
    const Mesh patch = make_wavy_plane({.resolution = 4, .amplitude = 0});
    for (const Index at : {410u, 700u, 1230u}) // vertices of the upper side
        filigree_test::add_part(mesh, patch, 0.01f, mesh.positions[at] + Vec3f(0, 0, 0.001f));
    const Bound out = bound(mesh, cells);
    std::size_t wrong = 0;
    for (Index v = plate; v < mesh.vertex_count(); ++v) wrong += out.cells[out.binding.bonds[v].cell][0] >= half;
    EXPECT_EQ(wrong, 0u);
}

/// A hose that touches a plane at one end only: the other end hangs on what it passes there.
TEST(Bind, TheFarEndOfALongPartHangsOnWhatIsThere) {
    Mesh mesh = make_wavy_plane({.resolution = 40, .amplitude = 0});
    mesh.uvs = {};
    const std::vector<Triangle> cells =
        simplify(mesh.positions, triangulate(mesh).triangles, {.target_vertices = 100}, RunContext()).triangles;
    const std::size_t plane = mesh.vertex_count();
    for (Index i = 0; i <= 60; ++i) // a ribbon that rises slowly
        for (const float y : {-0.01f, 0.01f})
            mesh.positions.emplace_back(-0.45f + 0.015f * float(i), y, 0.01f + 0.0005f * float(i));
    for (Index i = 0; i < 60; ++i) {
        const auto a = static_cast<Index>(plane + 2 * i);
        mesh.add_face(std::array<Index, 4>{a, a + 2, a + 3, a + 1});
    }
    EXPECT_LT(furthest_bond(mesh, bound(mesh, cells), plane), 0.045);
}

TEST(Bind, WhatFacesTheOtherWayIsReported) {
    Mesh mesh; // a driver that faces up, and a flap at its corner that faces down
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.2f, 0.1f, 0.1f}, {0.1f, -0.2f, 0.1f}};
    mesh.add_face(Triangle{0, 1, 2});
    mesh.add_face(Triangle{0, 4, 3});
    EXPECT_EQ(bound(mesh, {{0, 1, 2}}).binding.facing_away, (std::vector<Index>{3, 4}));
}

TEST(Bind, DuplicatesShareABond) {
    Mesh mesh = make_wavy_plane({.resolution = 6});
    const std::vector<Triangle> cells = {{0, 6, 48}, {0, 48, 42}};
    const Index twin = static_cast<Index>(mesh.vertex_count());
    mesh.uvs = {};
    mesh.positions.push_back(mesh.positions[17]);
    const Bound out = bound(mesh, cells);
    const Bond &a = out.binding.bonds[17], &b = out.binding.bonds[twin];
    EXPECT_TRUE(a.cell == b.cell && a.u == b.u && a.v == b.v);
}

TEST(Bind, SameBondsForAnyThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh mesh = make_wavy_cube({.resolution = 80});
    const Bound one = bound_to(mesh, 400), two = bound_to(mesh, 400, RunContext(2));
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        const Bond &a = one.binding.bonds[v], &b = two.binding.bonds[v];
        ASSERT_TRUE(a.cell == b.cell && a.u == b.u && a.v == b.v) << v;
    }
}

TEST(Bind, CanBeCancelled) {
    const Mesh mesh = make_wavy_cube({.resolution = 8});
    const Bound bound = bound_to(mesh, 50);
    const RunContext cancelled(1);
    cancelled.cancel();
    const auto binding = bind_to_driver(mesh.positions, bound.surface,
                                        vertex_normals(bound.surface.triangles, mesh.positions, kOneThread),
                                        bound.cells, bound.surface.triangles, cancelled);
    EXPECT_EQ(binding.error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
