// Meshes that check_mesh refuses, and one that was moved from: what every public call has to survive.
#pragma once

#include "filigree/mesh.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

/// One for each kind of damage.
inline std::vector<std::pair<std::string, filigree::Mesh>> broken_meshes() {
    using namespace filigree;
    const Mesh sound = make_box(Vec3d::Zero(), Vec3d::Ones());
    std::vector<std::pair<std::string, Mesh>> broken;
    const auto add = [&](const char* name, const auto& damage) {
        broken.emplace_back(name, sound);
        damage(broken.back().second);
    };
    add("a corner out of range", [](Mesh& m) { m.corners[5] = Index(m.vertex_count()); });
    add("a corner that is none", [](Mesh& m) { m.corners[5] = kNoIndex; });
    add("a position that is no number", [](Mesh& m) { m.positions[3].y() = std::nanf(""); });
    add("an infinite position", [](Mesh& m) { m.positions[3].y() = INFINITY; });
    add("offsets that descend", [](Mesh& m) { std::swap(m.face_offsets[1], m.face_offsets[2]); });
    add("offsets beyond the corners", [](Mesh& m) { m.face_offsets.back() += 3; });
    add("too few normals", [](Mesh& m) { m.normals.values.assign(1, Vec3f::UnitZ()); });
    add("UVs out of range", [](Mesh& m) { m.uvs = {{{0, 0}}, std::vector<Index>(m.corner_count(), 7)}; });
    return broken;
}

inline filigree::Mesh moved_from() {
    filigree::Mesh mesh = filigree::make_box(filigree::Vec3d::Zero(), filigree::Vec3d::Ones());
    const filigree::Mesh taken = std::move(mesh);
    return mesh; // NOLINT: what is left of it is the point
}

/// Tests that call(mesh), which returns a Result, refuses each of them as an argument that makes no sense, and takes
/// what is left of a mesh that was moved from for an empty mesh.
#define FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED(call)                                                                \
    do {                                                                                                               \
        for (const auto& [what, broken] : broken_meshes()) {                                                           \
            const auto result = (call)(broken);                                                                        \
            ASSERT_FALSE(result.ok()) << what;                                                                         \
            EXPECT_EQ(result.error().code, filigree::ErrorCode::usage) << what << ": " << result.error().message;      \
            EXPECT_NE(result.error().message.find(" is inconsistent: "), std::string::npos) << result.error().message; \
        }                                                                                                              \
        const auto of_moved = (call)(moved_from()), of_empty = (call)(filigree::Mesh());                               \
        ASSERT_EQ(of_moved.ok(), of_empty.ok());                                                                       \
        if (!of_moved.ok()) {                                                                                          \
            EXPECT_EQ(of_moved.error().message, of_empty.error().message);                                             \
        }                                                                                                              \
    } while (false)
