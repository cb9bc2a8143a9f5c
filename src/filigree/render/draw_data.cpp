// The processor's half of drawables: nothing here calls OpenGL.
#include "filigree/blend/blend_code.h"
#include "filigree/core/parallel_for.h"
#include "filigree/mesh/vertex_cache.h"
#include "filigree/render/drawable_content.h"
#include "filigree/render/octahedron.h"
#include "filigree/render/solid.h"

#include <algorithm>
#include <cmath>

#include <meshoptimizer.h>

namespace filigree {

namespace {

constexpr std::size_t kDrawDataGrain = 1 << 14; // draw vertices

Error nothing_to_draw() { return {ErrorCode::unsuitable, "There is no face to draw; draw the vertices as points."}; }

ColorBytes to_bytes(const Vec4f& color) {
    ColorBytes bytes;
    for (int k = 0; k < 4; ++k)
        bytes[k] = static_cast<std::uint8_t>(std::lround(std::clamp(color[k], 0.0f, 1.0f) * 255.0f));
    return bytes;
}

/// A scalar as the place in its range, far below for none: so far that a triangle with such a corner has no value
/// anywhere, as there is none to interpolate.
float to_unit(float value, const ValueRange& range) {
    if (!std::isfinite(value)) return -1e6f;
    const float width = range.most - range.least;
    return width > 0 ? std::clamp((value - range.least) / width, 0.0f, 1.0f) : 0.5f;
}

/// value(i) for each i below count.
template <class T, class Value>
std::vector<T> values_of(std::size_t count, const RunContext& context, const Value& value) {
    std::vector<T> values(count);
    parallel_for(context, count, kDrawDataGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) values[i] = value(i);
    });
    return values;
}

Box moved_to(Box box, const Vec3d& origin) {
    box.min += origin;
    box.max += origin;
    return box;
}

/// UVs count from the bottom, pictures from the top.
Picture flipped(const Picture& picture) {
    Picture result(picture.width, picture.height);
    const std::size_t row = std::size_t{4} * picture.width;
    for (unsigned y = 0; y < picture.height; ++y)
        std::copy_n(picture.rgba.data() + row * y, row, result.rgba.data() + row * (picture.height - 1 - y));
    return result;
}

/// Fills all but the motion. `drawn_at`: the place of each draw vertex in the vertex buffer; empty: its own. It takes
/// the draw arrays' contents where it can.
void fill(DrawData::Content& content, const Mesh& mesh, const SurfaceOptions& options, DrawArrays& draw,
          std::span<const Index> drawn_at, const RunContext& context) {
    std::vector<Index> source; // the draw vertex at each place of the buffer
    if (!drawn_at.empty()) {
        source.resize(drawn_at.size());
        for (Index d = 0; d < source.size(); ++d) source[drawn_at[d]] = d;
        parallel_for(context, draw.triangles.size(), kDrawDataGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t t = begin; t < end; ++t)
                for (Index& v : draw.triangles[t]) v = drawn_at[v];
        });
    }
    const auto at = [&](std::size_t i) { return source.empty() ? i : source[i]; };
    const std::size_t count = draw.vertex.size();
    content.vertex = values_of<Index>(count, context, [&](std::size_t i) { return draw.vertex[at(i)]; });
    const std::vector<Index>& vertex = content.vertex;
    if (!content.motion.on_gpu) {
        content.positions = values_of<Vec3f>(count, context, [&](std::size_t i) { return mesh.positions[vertex[i]]; });
        content.normals =
            values_of<std::uint32_t>(count, context, [&](std::size_t i) { return octahedral(draw.normals[at(i)]); });
    }
    if (!draw.uvs.empty())
        content.uvs = values_of<Vec2f>(count, context, [&](std::size_t i) { return draw.uvs[at(i)]; });
    if (!mesh.colors.empty()) content.colors = color_bytes(mesh.colors, vertex, context);
    if (!options.scalars.values.empty()) content.scalars = scalar_places(options.scalars, vertex, context);
    content.map = options.scalars.map;
    content.triangles = std::move(draw.triangles);
    content.edges = std::move(draw.edges);
    // Flags of diagonals belong to their triangles: those stay where they are.
    const bool all_edges =
        std::all_of(content.edges.begin(), content.edges.end(), [](auto flags) { return flags == 7; });
    if (all_edges)
        for (const DrawArrays::Part& part : draw.parts)
            order_for_vertex_cache(std::span(content.triangles).subspan(part.first, part.count), count);
    content.mesh_vertex_count = mesh.vertex_count();
    content.is_solid =
        is_solid(mesh.positions, values_of<Triangle>(content.triangles.size(), context, [&](std::size_t t) {
                     const Triangle& drawn = content.triangles[t];
                     return Triangle{vertex[drawn[0]], vertex[drawn[1]], vertex[drawn[2]]};
                 }));
    content.origin = mesh.origin;
    content.box = moved_to(bounds(mesh), mesh.origin);
    for (const DrawArrays::Part& drawn : draw.parts) {
        DrawData::Content::Part part;
        part.first = drawn.first;
        part.count = drawn.count;
        if (drawn.material < options.materials.size()) {
            const SurfaceMaterial& material = options.materials[drawn.material];
            part.color = material.color;
            part.has_color = true;
            if (material.picture && !draw.uvs.empty()) part.picture = flipped(*material.picture);
        }
        content.parts.push_back(std::move(part));
    }
}

/// The triangles for shadow maps of a model, which is drawn again and again: as many as its shape asks for. Half a
/// texel of a map is the error: less than the bias that keeps a surface out of its own shadow.
std::vector<Triangle> triangles_for_shadows(const Mesh& mesh, std::span<const Triangle> triangles,
                                            std::span<const Index> vertex) {
    constexpr std::size_t kFew = 20'000, kLargestFan = 4096; // triangles at a vertex; more take quadratic time
    constexpr float kError = 1.2e-4f;                        // of the longest side
    if (triangles.size() < kFew) return {};
    std::vector<Index> first(mesh.vertex_count(), kNoIndex), fan(mesh.vertex_count(), 0);
    for (Index d = 0; d < vertex.size(); ++d)
        if (first[vertex[d]] == kNoIndex) first[vertex[d]] = d;
    std::vector<Triangle> from(triangles.begin(), triangles.end()), fewer(triangles.size());
    for (Triangle& t : from)
        for (Index& v : t) {
            v = vertex[v]; // of the mesh: seams of normals and of pictures are none for shadows
            if (++fan[v] > kLargestFan) return {};
        }
    const std::size_t corners =
        meshopt_simplify(fewer.front().data(), from.front().data(), 3 * from.size(), mesh.positions.front().data(),
                         mesh.positions.size(), sizeof(Vec3f), 3 * kFew / 4, kError, 0, nullptr);
    fewer.resize(corners / 3);
    if (2 * fewer.size() > triangles.size()) return {};
    for (Triangle& t : fewer)
        for (Index& v : t) v = first[v];
    return fewer;
}

Result<DrawArrays> arrays_of(const Mesh& mesh, const SurfaceOptions& options, const RunContext& context) {
    if (mesh.face_count() == 0) return nothing_to_draw();
    Result<DrawArrays> draw = make_draw_arrays(mesh, mesh.positions, options, context);
    if (draw && draw->triangles.empty()) return nothing_to_draw();
    return draw;
}

} // namespace

std::vector<float> scalar_places(const ScalarColors& scalars, std::span<const Index> vertex,
                                 const RunContext& context) {
    return values_of<float>(vertex.size(), context,
                            [&](std::size_t d) { return to_unit(scalars.values[vertex[d]], scalars.range); });
}

std::vector<ColorBytes> color_bytes(std::span<const Vec4f> colors, std::span<const Index> vertex,
                                    const RunContext& context) {
    return values_of<ColorBytes>(vertex.size(), context, [&](std::size_t d) { return to_bytes(colors[vertex[d]]); });
}

bool turns_out(std::span<const Mat3f> gradients) {
    return !std::ranges::all_of(gradients, [](const Mat3f& a) { return a.determinant() > 0; });
}

Status move_vertices(ModelMotion& motion, const Pose& pose, std::size_t count, const RunContext& context) {
    if (Status status = check_pose(*motion.model, pose); !status) return status.error();
    if (context.is_cancelled()) return cancelled_error();
    motion.positions.resize(count);
    motion.normals.resize(count);
    const Result<std::vector<Mat3f>> gradients = motion.restorer->gradients(pose, context);
    if (!gradients) return gradients.error();
    motion.turns_out = turns_out(*gradients);
    motion.on_cpu->restore(pose.positions, *gradients, motion.positions, motion.normals, false, context);
    return Success{};
}

Box write_moved(const ModelMotion& motion, std::span<Vec3f> positions, std::span<std::uint32_t> normals,
                const RunContext& context) {
    std::vector<Box> boxes((positions.size() + kDrawDataGrain - 1) / kDrawDataGrain);
    parallel_for(context, positions.size(), kDrawDataGrain, [&](std::size_t begin, std::size_t end) {
        const std::span piece = std::span(motion.positions).subspan(begin, end - begin);
        boxes[begin / kDrawDataGrain] = bounds(piece);
        std::copy(piece.begin(), piece.end(), positions.begin() + begin);
        for (std::size_t d = begin; d < end; ++d) normals[d] = octahedral(motion.normals[d]);
    });
    Box box;
    for (const Box& piece : boxes) {
        box.extend(piece.min);
        box.extend(piece.max);
    }
    return box;
}

DrawData::DrawData(std::unique_ptr<Content> content) : content_(std::move(content)) {}
DrawData::DrawData(DrawData&&) noexcept = default;
DrawData& DrawData::operator=(DrawData&&) noexcept = default;
DrawData::~DrawData() = default;

Result<DrawData> DrawData::surface(const Mesh& mesh, const SurfaceOptions& options, const RunContext& context) {
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    Result<DrawArrays> draw = arrays_of(mesh, options, context);
    if (!draw) return draw.error();
    auto content = std::make_unique<Content>();
    fill(*content, mesh, options, *draw, {}, context);
    return DrawData(std::move(content));
}

Result<DrawData> DrawData::model(const Model& model, const RestoreOptions& restore, const SurfaceOptions& options,
                                 RestoreOn where, const RunContext& context) {
    const Result<unsigned> level = restored_level(model, restore);
    if (!level) return level.error();
    const Mesh rest = level_mesh(model, *level);
    Result<DrawArrays> draw = arrays_of(rest, options, context);
    if (!draw) return draw.error();

    auto content = std::make_unique<Content>();
    ModelMotion& motion = content->motion;
    motion.model = &model;
    Result<Restorer> restorer = Restorer::create(model, {.level = 0}, context);
    if (!restorer) return restorer.error();
    motion.restorer = std::move(restorer).value();

    std::vector<Index> vertices(draw->vertex); // of the finest mesh
    if (*level < model.finest_level())
        for (Index& v : vertices) v = model.levels[*level].vertices[v];
    std::vector<Index> drawn_at;
    if (where == RestoreOn::gpu) {
        Result<GpuRestorer> on_gpu = GpuRestorer::prepare(model, vertices, draw->normals, restore, context);
        if (!on_gpu) return on_gpu.error();
        motion.on_gpu = std::move(on_gpu).value();
        motion.pose_box.emplace(model, vertices);
        drawn_at.assign(motion.on_gpu->drawn_at().begin(), motion.on_gpu->drawn_at().end());
    } else {
        std::vector<BlendRestorer::Item> items(vertices.size());
        for (Index i = 0; i < items.size(); ++i) items[i] = {vertices[i], i};
        motion.on_cpu.emplace(model.detail, model.mesh.positions, model.driver().vertices, items, draw->normals,
                              context);
        drawn_at.resize(items.size());
        for (Index r = 0; r < items.size(); ++r) drawn_at[motion.on_cpu->slots()[r]] = r;
    }
    if (context.is_cancelled()) return cancelled_error();
    fill(*content, rest, options, *draw, drawn_at, context);
    content->shadow_triangles = triangles_for_shadows(rest, content->triangles, content->vertex);
    return DrawData(std::move(content));
}

} // namespace filigree
