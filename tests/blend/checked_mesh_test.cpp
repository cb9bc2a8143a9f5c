// Public calls of the layer look at the meshes they are given.
#include "broken_meshes.h"
#include "filigree/restore.h"
#include "filigree/strip.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(CheckedStrip, WhatIsBrokenIsRefused) {
    const Mesh sound = make_box(Vec3d::Zero(), Vec3d::Ones());
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return strip(m, {}, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return strip(m, {.reorder = true}, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([&](const Mesh& m) { return strip_to_driver(m, sound, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([&](const Mesh& m) { return strip_to_driver(sound, m, kOneThread); });
}

TEST(CheckedStrip, ADriverOfTheMeshesOwnVerticesHasToBeOne) {
    const Mesh mesh = make_wavy_sphere({.resolution = 8});
    const Level sound = strip(mesh, {.base = 40}, kOneThread).value().model.driver();
    ASSERT_TRUE(bind_to_own_driver(mesh, sound, kOneThread).ok());
    const auto refused = [&](const auto& damage) {
        Level driver = sound;
        damage(driver);
        const auto bound = bind_to_own_driver(mesh, std::move(driver), kOneThread);
        return !bound.ok() && bound.error().code == ErrorCode::usage;
    };
    EXPECT_TRUE(refused([&](Level& d) { d.vertices.back() = Index(mesh.vertex_count()); }));
    EXPECT_TRUE(refused([](Level& d) { std::swap(d.vertices[0], d.vertices[1]); }));
    EXPECT_TRUE(refused([](Level& d) { d.vertices[1] = d.vertices[0]; }));
    EXPECT_TRUE(refused([](Level& d) { d.corners[0] = Index(d.vertices.size()); }));
    EXPECT_TRUE(refused([](Level& d) { d.face_offsets[1] = 4; }));
    EXPECT_TRUE(refused([](Level& d) { d.face_offsets.pop_back(); }));
    for (const auto& [what, broken] : broken_meshes()) {
        const auto bound = bind_to_own_driver(broken, {{0, 1, 2}, {0, 3}, {0, 1, 2}}, kOneThread);
        EXPECT_TRUE(!bound.ok() && bound.error().code == ErrorCode::usage) << what;
    }
}

TEST(CheckedStrip, ALevelThatWasMovedFromHasNoFaces) {
    Level level = strip(make_wavy_sphere({.resolution = 8}), {.base = 40}, kOneThread).value().model.driver();
    const Level taken = std::move(level);
    EXPECT_EQ(level.face_count(), 0u); // NOLINT: what is left of it is the point
}

TEST(CheckedStrip, ARestorerThatIsCancelledIsNotMade) {
    const Model model = strip(make_wavy_sphere({.resolution = 8}), {.base = 40}, kOneThread).value().model;
    const RunContext cancelled(1);
    cancelled.cancel();
    const Result<Restorer> restorer = Restorer::create(model, {}, cancelled);
    ASSERT_FALSE(restorer.ok());
    EXPECT_EQ(restorer.error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
