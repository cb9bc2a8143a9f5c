#include "filigree/scene/body_look.h"

#include <algorithm>
#include <map>

namespace filigree {

DrawnSurface with_materials_apart(Mesh surface, std::span<const Vec3f> colors) {
    if (surface.materials.empty() || surface.colors.empty()) return {std::move(surface), {}};
    std::vector<Index> copied;
    // Materials of one colour count as one; kNoIndex: faces without a material.
    std::vector<Index> group(colors.size());
    for (Index m = 0; m < colors.size(); ++m)
        group[m] = Index(std::find(colors.begin(), colors.begin() + m, colors[m]) - colors.begin());
    constexpr Index kUnused = kNoIndex - 1;
    std::vector<Index> group_of(surface.vertex_count(), kUnused);
    std::map<std::pair<Index, Index>, Index> copies; // of a vertex for a group
    const bool has_uvs_by_vertex = !surface.uvs.empty() && surface.uvs.per_vertex();
    const bool has_normals_by_vertex = !surface.normals.empty() && surface.normals.per_vertex();
    const auto copy_of = [&](Index v) {
        copied.push_back(v);
        surface.positions.push_back(surface.positions[v]);
        surface.colors.push_back(surface.colors[v]);
        for (VertexScalar& scalar : surface.scalars) scalar.values.push_back(scalar.values[v]);
        if (has_uvs_by_vertex) surface.uvs.values.push_back(surface.uvs.values[v]);
        if (has_normals_by_vertex) surface.normals.values.push_back(surface.normals.values[v]);
        return Index(surface.positions.size() - 1);
    };
    const auto paint = [&](Index v, Index of) {
        if (of != kNoIndex) surface.colors[v] = {colors[of][0], colors[of][1], colors[of][2], 1};
    };
    const std::vector<Vec4f> before = surface.colors;
    for (std::size_t f = 0; f < surface.face_count(); ++f) {
        const Index material = surface.materials.of_face[f];
        const Index of = material == kNoIndex ? kNoIndex : group[material];
        for (Index c = surface.face_offsets[f]; c < surface.face_offsets[f + 1]; ++c) {
            const Index v = surface.corners[c];
            if (group_of[v] == kUnused) {
                group_of[v] = of;
                paint(v, of);
            }
            if (group_of[v] == of) continue;
            const auto [found, is_new] = copies.try_emplace({v, of}, kNoIndex);
            if (is_new) {
                found->second = copy_of(v);
                surface.colors.back() = before[v];
                paint(found->second, of);
            }
            surface.corners[c] = found->second;
        }
    }
    return {std::move(surface), std::move(copied)};
}

} // namespace filigree
