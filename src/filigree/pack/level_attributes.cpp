#include "filigree/pack/level_attributes.h"

#include "filigree/pack/integer_frame.h"
#include "filigree/pack/vertex_items.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr unsigned kRestHasUv = 0, kRestUv = 1, kRestColor = 3;
static_assert(kRestColor + 4 == kRestContexts);

std::array<std::int32_t, 2> uv_steps(const Vec2f& uv, const AttributeOutline& outline) {
    std::array<std::int32_t, 2> steps{};
    for (int k = 0; k < 2; ++k)
        steps[std::size_t(k)] = static_cast<std::int32_t>(std::lround((uv[k] - outline.uv_low[k]) / outline.uv_step));
    return steps;
}

ByteColor byte_color(const Vec4f& color) {
    ByteColor bytes{};
    for (int k = 0; k < 4; ++k) bytes[std::size_t(k)] = color_byte(color[k]);
    return bytes;
}

AttributeOutline outline_of(const Mesh& mesh) {
    AttributeOutline outline{.has_uvs = !mesh.uvs.empty(),
                             .uvs_per_vertex = !mesh.uvs.empty() && mesh.uvs.per_vertex(),
                             .has_materials = !mesh.materials.empty(),
                             .has_colors = !mesh.colors.empty(),
                             .has_alpha = mesh.colors_have_alpha};
    if (!outline.has_uvs) return outline;
    Vec2f high = outline.uv_low = mesh.uvs.values[0];
    for (const Vec2f& uv : mesh.uvs.values) {
        outline.uv_low = outline.uv_low.cwiseMin(uv);
        high = high.cwiseMax(uv);
    }
    outline.uv_step = std::max((high - outline.uv_low).maxCoeff(), 1e-30f) / float((1u << kUvBits) - 1);
    return outline;
}

Index uv_at(const Mesh& mesh, Index corner) {
    return mesh.uvs.per_vertex() ? mesh.corners[corner] : mesh.uvs.corners[corner];
}

} // namespace

SurfaceAttributes surface_attributes(const Mesh& mesh, const ClosedSurface& surface, const FaceCorner& corner_of) {
    SurfaceAttributes made{.outline = outline_of(mesh), .wedges = {}, .wedge_at = {}, .colors = {}};
    const AttributeOutline& outline = made.outline;
    if (outline.empty()) return made;
    const ClosedMap& map = surface.map;
    std::vector<Index> face_of;
    for (std::size_t f = 0; f < mesh.face_count() && outline.has_materials; ++f)
        face_of.insert(face_of.end(), mesh.face_size(f), static_cast<Index>(f));
    VertexItems wedges(map.vertex_count());
    made.wedge_at.assign(map.opposite.size(), kNoIndex);
    for (Index h = 0; h < map.opposite.size(); ++h) {
        if (!map.is_own(map.triangles[h / 3])) continue;
        const Index corner = corner_of(h), uv = outline.has_uvs ? uv_at(mesh, corner) : kNoIndex;
        Wedge wedge{.vertex = map.origin(h),
                    .material = outline.has_materials ? mesh.materials.of_face[face_of[corner]] : kNoIndex,
                    .has_uv = uv != kNoIndex};
        if (wedge.has_uv) wedge.uv = uv_steps(mesh.uvs.values[uv], outline);
        const VertexItems::Key key = {std::int32_t(wedge.material), wedge.has_uv, wedge.uv[0], wedge.uv[1]};
        Index known = wedges.find(wedge.vertex, key);
        if (known == kNoIndex) {
            known = wedge.parent = wedges.add(wedge.vertex, key);
            made.wedges.push_back(wedge);
        }
        made.wedge_at[h] = known;
    }
    for (const Index v : surface.source)
        if (outline.has_colors) made.colors.push_back(v != kNoIndex ? byte_color(mesh.colors[v]) : ByteColor{});
    return made;
}

LevelValues level_values(const ReadAttributes& read, const WalkedFaces& walked, std::size_t vertices) {
    const AttributeOutline& outline = read.outline;
    LevelValues made{.outline = outline, .met = walked.met, .walked_corners = walked.half_edges.size()};
    CornerAttribute<Vec2f>& uvs = made.uvs;
    if (outline.has_uvs && outline.uvs_per_vertex) {
        uvs.values.assign(vertices, outline.uv_low);
        for (std::size_t c = 0; c < walked.half_edges.size(); ++c)
            if (const Index wedge = read.wedge_at[walked.half_edges[c]]; wedge != kNoIndex)
                uvs.values[walked.corners[c]] = outline.uv(read.wedges[wedge]);
    } else if (outline.has_uvs) {
        uvs.corners.assign(walked.corners.size(), kNoIndex);
        std::vector<Index> value_of(read.wedges.size(), kNoIndex);
        VertexItems values(walked.met); // by their steps: materials share a value where it is the same
        for (std::size_t c = 0; c < walked.half_edges.size(); ++c) {
            const Index w = read.wedge_at[walked.half_edges[c]];
            if (w == kNoIndex || !read.wedges[w].has_uv) continue;
            Index& value = value_of[w];
            if (value == kNoIndex) {
                const VertexItems::Key key = {read.wedges[w].uv[0], read.wedges[w].uv[1]};
                value = values.find(walked.corners[c], key);
                if (value == kNoIndex) {
                    value = values.add(walked.corners[c], key);
                    uvs.values.push_back(outline.uv(read.wedges[w]));
                }
            }
            uvs.corners[c] = value;
        }
    }
    if (outline.has_colors) made.colors.assign(vertices, Vec4f::Ones());
    for (std::size_t w = 0; w < walked.number.size() && outline.has_colors; ++w)
        if (walked.number[w] != kNoIndex) made.colors[walked.number[w]] = AttributeOutline::color(read.colors[w]);
    return made;
}

void encode_rest(const Mesh& mesh, const LevelValues& with, unsigned first_context, SymbolWriter& out) {
    const AttributeOutline& outline = with.outline;
    std::array<std::int32_t, 2> uv_before{};
    const auto put_uv = [&](Index value) {
        const std::array<std::int32_t, 2> steps = uv_steps(mesh.uvs.values[value], outline);
        for (unsigned k = 0; k < 2; ++k) out.number_with_sign(first_context + kRestUv + k, steps[k] - uv_before[k]);
        uv_before = steps;
    };
    if (outline.has_uvs && outline.uvs_per_vertex)
        for (std::size_t v = with.met; v < mesh.vertex_count(); ++v) put_uv(static_cast<Index>(v));
    else if (outline.has_uvs)
        for (std::size_t c = with.walked_corners; c < mesh.corner_count(); ++c) {
            const Index value = mesh.uvs.corners[c];
            out.symbol(first_context + kRestHasUv, value != kNoIndex);
            if (value != kNoIndex) put_uv(value);
        }
    ByteColor before{};
    for (std::size_t v = with.met; v < mesh.vertex_count() && outline.has_colors; ++v) {
        const ByteColor color = byte_color(mesh.colors[v]);
        for (unsigned k = 0; k < outline.channels(); ++k)
            out.number_with_sign(first_context + kRestColor + k, std::int32_t(color[k]) - before[k]);
        before = color;
    }
}

bool decode_rest(LevelValues& values, unsigned first_context, SymbolReader& in) {
    const AttributeOutline& outline = values.outline;
    Wedge wedge;
    const auto next_uv = [&] {
        for (unsigned k = 0; k < 2; ++k) {
            const auto off = std::uint32_t(in.number_with_sign(first_context + kRestUv + k));
            wedge.uv[k] = std::clamp(std::int32_t(std::uint32_t(wedge.uv[k]) + off), -kFarthest, kFarthest);
        }
        return outline.uv(wedge);
    };
    CornerAttribute<Vec2f>& uvs = values.uvs;
    if (outline.has_uvs && outline.uvs_per_vertex)
        for (std::size_t v = values.met; v < uvs.values.size(); ++v) uvs.values[v] = next_uv();
    else
        for (std::size_t c = values.walked_corners; c < uvs.corners.size(); ++c) {
            if (in.symbol(first_context + kRestHasUv) == 0) continue;
            uvs.corners[c] = static_cast<Index>(uvs.values.size());
            uvs.values.push_back(next_uv());
        }
    ByteColor color{0, 0, 0, 255};
    for (std::size_t v = values.met; v < values.colors.size(); ++v) {
        for (unsigned k = 0; k < outline.channels(); ++k)
            color[k] = std::uint8_t(color[k] + in.number_with_sign(first_context + kRestColor + k));
        values.colors[v] = AttributeOutline::color(color);
    }
    if (uvs.values.empty()) uvs.corners.clear();
    return !in.is_damaged();
}

} // namespace filigree
