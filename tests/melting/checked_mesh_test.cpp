// Public calls of the layer look at the meshes they are given.
#include "broken_meshes.h"
#include "filigree/melting/composite_surface.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(CheckedMelting, WhatIsBrokenIsRefused) {
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return CompositeMesher::create(m, kOneThread); });
    const CompositeMesher mesher = CompositeMesher::create(make_box(Vec3d::Zero(), Vec3d::Ones()), kOneThread).value();
    for (const auto& [what, broken] : broken_meshes()) {
        std::vector<std::uint8_t> dead;
        const std::vector<float> renewal(broken.vertex_count(), 0);
        const auto made = mesher.make(broken, renewal, {}, {}, ParticleField(), dead, kOneThread);
        EXPECT_TRUE(!made.ok() && made.error().code == ErrorCode::usage) << what;
    }
}

} // namespace
} // namespace filigree
