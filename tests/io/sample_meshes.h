// Small meshes that carry everything a Mesh can carry.
#pragma once

#include "filigree/mesh.h"

namespace filigree_test {

/// Two triangles, a quad and a pentagon over 8 vertices, without attributes.
inline filigree::Mesh make_plain_mesh() {
    using filigree::Index;
    filigree::Mesh mesh;
    mesh.positions = {{0, 0, 0},        {1, 0.1f, 0},         {1, 1, -0.0f}, {0, 1, 1e-30f},
                      {2, 0, 1.0f / 3}, {2, 16777216, 3e-6f}, {-1e7f, 2, 0}, {0.5f, 3, 1}};
    mesh.add_face(std::array<Index, 3>{0, 1, 2});
    mesh.add_face(std::array<Index, 4>{1, 4, 5, 2});
    mesh.add_face(std::array<Index, 5>{0, 2, 5, 7, 3});
    mesh.add_face(std::array<Index, 3>{3, 7, 6});
    return mesh;
}

/// The same with attributes of one value a vertex.
inline filigree::Mesh make_vertex_attribute_mesh() {
    filigree::Mesh mesh = make_plain_mesh();
    const auto count = static_cast<int>(mesh.vertex_count());
    mesh.scalars = {{"quality", {}}, {"f00", {}}};
    for (int v = 0; v < count; ++v) {
        const float x = static_cast<float>(v) / 7;
        mesh.uvs.values.emplace_back(x, 1 - x);
        mesh.normals.values.emplace_back(x, -0.5f, 2 * x);
        mesh.colors.emplace_back(static_cast<float>(v) / 255, 1.0f, 0.0f, static_cast<float>(200 + v) / 255);
        mesh.scalars[0].values.push_back(x * 1e-7f);
        mesh.scalars[1].values.push_back(-x);
    }
    mesh.colors_have_alpha = true;
    return mesh;
}

/// The same with UVs and normals of corners (one corner without), labels, and smoothing groups.
inline filigree::Mesh make_corner_attribute_mesh() {
    filigree::Mesh mesh = make_plain_mesh();
    mesh.uvs.values = {{0, 0}, {0.25f, 1}, {-3, 1e-5f}};
    mesh.normals.values = {{0, 0, 1}, {0.6f, 0, 0.8f}};
    for (std::size_t c = 0; c < mesh.corner_count(); ++c) {
        mesh.uvs.corners.push_back(static_cast<filigree::Index>(c % 3));
        mesh.normals.corners.push_back(static_cast<filigree::Index>(c % 2));
    }
    mesh.uvs.corners[4] = filigree::kNoIndex;
    mesh.normals.corners.back() = filigree::kNoIndex;
    for (int v = 0; v < 8; ++v) mesh.colors.emplace_back(0.125f * static_cast<float>(v), 0.3f, 1.0f, 1.0f);
    mesh.objects = {{"body"}, {0, 0, 0, 0}};
    mesh.groups = {{"left # side", "right"}, {filigree::kNoIndex, 0, 1, 0}};
    mesh.materials = {{"stone", "wood"}, {1, 1, filigree::kNoIndex, 0}};
    mesh.smoothing = {0, 1, 1, 4000000000};
    mesh.material_files = {"../some folder/a.mtl", "b.mtl"};
    return mesh;
}

/// Metres, 4,500 km from the origin: as many digits as double has there.
inline filigree::Mesh make_far_mesh() {
    filigree::Mesh mesh;
    mesh.positions = {{-1.25f, 0.1f, 0}, {1.75f, -2, 0.1f}, {0.3f, 2, 0.5f}};
    mesh.origin = {500000, -4500000, 0};
    mesh.add_face(filigree::Triangle{0, 1, 2});
    return mesh;
}

} // namespace filigree_test
