// Public calls of the layer look at the meshes they are given, and stop where they are told to.
#include "broken_meshes.h"
#include "filigree/file.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

constexpr MeshFormat kAllFormats[] = {MeshFormat::obj, MeshFormat::ply, MeshFormat::stl, MeshFormat::off,
                                      MeshFormat::gltf};

TEST(CheckedWriting, WhatIsBrokenIsRefused) {
    for (const MeshFormat format : kAllFormats)
        FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([&](const Mesh& m) {
            std::string bytes;
            return write_mesh(m, format, bytes, {}, kOneThread);
        });
}

TEST(CheckedWriting, FormatsOfTrianglesCanBeCancelled) {
    const RunContext cancelled(1);
    cancelled.cancel();
    for (const MeshFormat format : {MeshFormat::stl, MeshFormat::gltf}) {
        std::string bytes;
        const auto written = write_mesh(make_box(Vec3d::Zero(), Vec3d::Ones()), format, bytes, {}, cancelled);
        ASSERT_FALSE(written.ok());
        EXPECT_EQ(written.error().code, ErrorCode::cancelled);
    }
}

} // namespace
} // namespace filigree
