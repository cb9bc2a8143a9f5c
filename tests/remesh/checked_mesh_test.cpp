// Public calls of the layer look at the meshes they are given.
#include "broken_meshes.h"
#include "filigree/remesh.h"
#include "filigree/remesh/manifold_surface.h"
#include "filigree/remesh/transfer_attributes.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(CheckedRemesh, WhatIsBrokenIsRefused) {
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return quad_remesh(m, {}, kOneThread); });
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) {
        CleanReport report;
        return make_manifold(m, report, kOneThread);
    });
    const Mesh sound = make_box(Vec3d::Zero(), Vec3d::Ones());
    const std::vector<CornerPoint> points(sound.vertex_count(), {{0, 1, 2}, {1, 0, 0}});
    for (const auto& [what, broken] : broken_meshes()) {
        Mesh to = sound, no = broken;
        const Status from_broken = transfer_attributes(broken, points, to, kOneThread);
        EXPECT_TRUE(!from_broken.ok() && from_broken.error().code == ErrorCode::usage) << what;
        const Status to_broken = transfer_attributes(sound, points, no, kOneThread);
        EXPECT_TRUE(!to_broken.ok() && to_broken.error().code == ErrorCode::usage) << what;
    }
    Mesh to = sound;
    EXPECT_FALSE(transfer_attributes(sound, std::span(points).first(3), to, kOneThread).ok());
    const std::vector<CornerPoint> outside(sound.vertex_count(), {{0, 1, 999}, {1, 0, 0}});
    EXPECT_FALSE(transfer_attributes(sound, outside, to, kOneThread).ok());
    EXPECT_TRUE(transfer_attributes(sound, points, to, kOneThread).ok());
}

} // namespace
} // namespace filigree
