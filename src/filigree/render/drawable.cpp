#include "filigree/render/drawable.h"

#include "filigree/core/parallel_for.h"
#include "filigree/render/color_map.h"
#include "filigree/render/drawable_content.h"
#include "filigree/render/octahedron.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace filigree {

namespace {

using gl::Buffer;

std::array<std::uint8_t, 4> to_bytes(const Vec4f& color) {
    std::array<std::uint8_t, 4> bytes;
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

gl::Texture color_texture(ColorMap map) {
    std::vector<Vec3f> table; // linear light
    for (const Vec3f& srgb : color_table(map)) table.push_back(srgb_to_linear(srgb));
    gl::Texture texture = gl::Texture::make();
    glBindTexture(GL_TEXTURE_1D, texture.name());
    glTexImage1D(GL_TEXTURE_1D, 0, GL_RGB32F, static_cast<GLsizei>(table.size()), 0, GL_RGB, GL_FLOAT, table.data());
    glTexParameteri(GL_TEXTURE_1D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_1D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_1D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    return texture;
}

/// UVs count from the bottom, pictures from the top.
gl::Texture picture_texture(const Picture& picture) {
    Picture flipped(picture.width, picture.height);
    const std::size_t row = std::size_t{4} * picture.width;
    for (unsigned y = 0; y < picture.height; ++y)
        std::copy_n(picture.rgba.data() + row * y, row, flipped.rgba.data() + row * (picture.height - 1 - y));
    gl::Texture texture = gl::Texture::make();
    glBindTexture(GL_TEXTURE_2D, texture.name());
    glTexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8_ALPHA8, static_cast<GLsizei>(picture.width),
                 static_cast<GLsizei>(picture.height), 0, GL_RGBA, GL_UNSIGNED_BYTE, flipped.rgba.data());
    glGenerateMipmap(GL_TEXTURE_2D);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    return texture;
}

/// Uploads values for a vertex input of the bound vertex array.
template <class T>
Status set_input(Buffer& buffer, std::span<const T> values, GLuint input, GLint components, GLenum type,
                 GLboolean normalized, GLuint divisor = 0) {
    Result<Buffer> made = gl::make_buffer(values);
    if (!made) return made.error();
    buffer = std::move(made).value();
    glBindBuffer(GL_ARRAY_BUFFER, buffer.name());
    glEnableVertexAttribArray(input);
    glVertexAttribPointer(input, components, type, normalized, 0, nullptr);
    glVertexAttribDivisor(input, divisor);
    return Success{};
}

/// values[v] of each draw vertex, in the order of drawing.
template <class T, class Value>
std::vector<T> in_draw_order(const DrawArrays& draw, std::span<const Index> drawn_at, const Value& value) {
    std::vector<T> values(draw.vertex.size());
    for (std::size_t d = 0; d < values.size(); ++d) values[drawn_at.empty() ? d : drawn_at[d]] = value(d);
    return values;
}

Error nothing_to_draw() { return {ErrorCode::unsuitable, "There is no face to draw; draw the vertices as points."}; }

/// The median distance from a point to its sixth neighbour, over some of the points: the spacing of a lattice, and on
/// a scanned surface about the way to the furthest of those around.
float typical_distance(std::span<const Vec3f> positions, const RunContext& context) {
    constexpr std::size_t kProbes = 200, kNeighbours = 6;
    const std::size_t probes = std::min(positions.size(), kProbes);
    if (positions.size() < 2) return 0;
    std::vector<float> nearest(probes);
    parallel_for(context, probes, 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const std::size_t self = i * positions.size() / probes;
            std::array<double, kNeighbours> best; // ascending; float holds no squares of the very small and large
            best.fill(std::numeric_limits<double>::infinity());
            for (std::size_t j = 0; j < positions.size(); ++j) {
                double d = (positions[j] - positions[self]).cast<double>().squaredNorm();
                if (j == self || !(d > 0) || d >= best.back()) continue;
                for (double& known : best)
                    if (d < known) std::swap(d, known);
            }
            const auto none = std::find(best.begin(), best.end(), std::numeric_limits<double>::infinity());
            nearest[i] = none == best.begin() ? 0 : static_cast<float>(std::sqrt(*(none - 1)));
        }
    });
    std::nth_element(nearest.begin(), nearest.begin() + probes / 2, nearest.end());
    return nearest[probes / 2];
}

Box world_box(std::span<const Vec3f> positions, const Vec3d& origin) {
    Box box = bounds(positions);
    box.min += origin;
    box.max += origin;
    return box;
}

} // namespace

Status Drawable::Content::upload_surface(const Mesh& mesh, std::span<const Vec3f> mesh_positions,
                                         const SurfaceOptions& surface, const DrawArrays& draw,
                                         std::span<const Index> drawn_at) {
    using namespace vertex_input;
    if (draw.triangles.empty()) return nothing_to_draw();
    if (!arrays) arrays = gl::VertexArray::make();
    glBindVertexArray(arrays.name());
    const auto vertex = [&](std::size_t d) { return draw.vertex[d]; };

    if (!on_gpu) {
        const auto points =
            in_draw_order<Vec3f>(draw, drawn_at, [&](std::size_t d) { return mesh_positions[vertex(d)]; });
        if (Status s = set_input(positions, std::span(points), kPosition, 3, GL_FLOAT, GL_FALSE); !s) return s;
        const auto packed =
            in_draw_order<std::uint32_t>(draw, drawn_at, [&](std::size_t d) { return octahedral(draw.normals[d]); });
        if (Status s = set_input(normals, std::span(packed), kNormal, 2, GL_SHORT, GL_FALSE); !s) return s;
    }
    has_uvs = !draw.uvs.empty();
    if (has_uvs) {
        const auto values = in_draw_order<Vec2f>(draw, drawn_at, [&](std::size_t d) { return draw.uvs[d]; });
        if (Status s = set_input(uvs, std::span(values), kUv, 2, GL_FLOAT, GL_FALSE); !s) return s;
    }
    has_colors = !mesh.colors.empty();
    if (has_colors) {
        const auto values = in_draw_order<std::array<std::uint8_t, 4>>(
            draw, drawn_at, [&](std::size_t d) { return to_bytes(mesh.colors[vertex(d)]); });
        if (Status s = set_input(colors, std::span(values), kColor, 4, GL_UNSIGNED_BYTE, GL_TRUE); !s) return s;
    }
    has_scalars = !surface.scalars.values.empty();
    if (has_scalars) {
        const auto values = in_draw_order<float>(draw, drawn_at, [&](std::size_t d) {
            return to_unit(surface.scalars.values[vertex(d)], surface.scalars.range);
        });
        if (Status s = set_input(scalars, std::span(values), kScalar, 1, GL_FLOAT, GL_FALSE); !s) return s;
        scalar_colors = color_texture(surface.scalars.map);
    }

    std::vector<Triangle> order(draw.triangles);
    if (!drawn_at.empty())
        for (Triangle& t : order)
            for (Index& v : t) v = drawn_at[v];
    Result<Buffer> indices = gl::make_buffer(std::span<const Triangle>(order));
    if (!indices) return indices.error();
    triangles = std::move(indices).value();
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, triangles.name());
    glBindVertexArray(0);
    triangle_count = order.size();

    Result<Buffer> flags = gl::make_buffer(std::span<const std::uint8_t>(draw.edges));
    if (!flags) return flags.error();
    edge_flags = std::move(flags).value();
    edge_texture = gl::Texture::make();
    glBindTexture(GL_TEXTURE_BUFFER, edge_texture.name());
    glTexBuffer(GL_TEXTURE_BUFFER, GL_R8UI, edge_flags.name());

    parts.clear();
    for (const DrawArrays::Part& drawn : draw.parts) {
        Part part;
        part.first = drawn.first;
        part.count = drawn.count;
        if (drawn.material < surface.materials.size()) {
            const SurfaceMaterial& material = surface.materials[drawn.material];
            part.color = material.color;
            part.has_color = true;
            if (material.picture && has_uvs) {
                GLint most = 0;
                glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
                if (std::max(material.picture->width, material.picture->height) > static_cast<unsigned>(most))
                    return Error{ErrorCode::unsuitable, "A texture is larger than the " + std::to_string(most) +
                                                            " pixels a side that can be drawn here; scale it down."};
                part.picture = picture_texture(*material.picture);
            }
        }
        parts.push_back(std::move(part));
    }
    return Success{};
}

Drawable::Drawable(std::unique_ptr<Content> content) : content_(std::move(content)) {}
Drawable::Drawable(Drawable&&) noexcept = default;
Drawable& Drawable::operator=(Drawable&&) noexcept = default;
Drawable::~Drawable() = default;

const Box& Drawable::box() const { return content_->box; }
std::size_t Drawable::triangle_count() const { return content_->triangle_count; }
std::size_t Drawable::point_count() const { return content_->point_count; }
float Drawable::point_radius() const { return content_->radius; }

Result<Drawable> Drawable::surface(const Mesh& mesh, const SurfaceOptions& options, const RunContext& context) {
    if (mesh.face_count() == 0) return nothing_to_draw();
    Result<DrawArrays> draw = make_draw_arrays(mesh, mesh.positions, options, context);
    if (!draw) return draw.error();
    auto content = std::make_unique<Content>();
    content->origin = mesh.origin;
    content->box = world_box(mesh.positions, mesh.origin);
    if (Status status = content->upload_surface(mesh, mesh.positions, options, *draw, {}); !status)
        return status.error();
    return Drawable(std::move(content));
}

Result<Drawable> Drawable::points(std::span<const Vec3f> positions, const Vec3d& origin, const PointOptions& options,
                                  const RunContext& context) {
    using namespace vertex_input;
    if (positions.empty()) return Error{ErrorCode::unsuitable, "There is no point to draw."};
    auto content = std::make_unique<Content>();
    content->origin = origin;
    content->point_count = positions.size();
    content->box = world_box(positions, origin);
    content->radius = options.radius > 0 ? options.radius : 0.48f * typical_distance(positions, context);
    if (!(content->radius > 0))
        content->radius = static_cast<float>(content->box.diagonal() > 0 ? 0.01 * content->box.diagonal() : 1.0);
    content->box.min.array() -= content->radius;
    content->box.max.array() += content->radius;

    content->arrays = gl::VertexArray::make();
    glBindVertexArray(content->arrays.name());
    if (Status s = set_input(content->positions, positions, kPosition, 3, GL_FLOAT, GL_FALSE, 1); !s) return s.error();
    content->has_colors = !options.colors.empty();
    if (content->has_colors) {
        std::vector<std::array<std::uint8_t, 4>> bytes;
        for (const Vec4f& color : options.colors) bytes.push_back(to_bytes(color));
        if (Status s = set_input(content->colors, std::span<const std::array<std::uint8_t, 4>>(bytes), kColor, 4,
                                 GL_UNSIGNED_BYTE, GL_TRUE, 1);
            !s)
            return s.error();
    }
    content->has_scalars = !options.scalars.values.empty();
    if (content->has_scalars) {
        std::vector<float> places;
        for (float value : options.scalars.values) places.push_back(to_unit(value, options.scalars.range));
        if (Status s = set_input(content->scalars, std::span<const float>(places), kScalar, 1, GL_FLOAT, GL_FALSE, 1);
            !s)
            return s.error();
        content->scalar_colors = color_texture(options.scalars.map);
    }
    glBindVertexArray(0);
    return Drawable(std::move(content));
}

Result<Drawable> Drawable::model(const Model& model, const RestoreOptions& restore, const SurfaceOptions& options,
                                 const RunContext& context) {
    if (restore.level && *restore.level > model.finest_level())
        return Error{ErrorCode::usage, "The model has levels 0 to " + std::to_string(model.finest_level()) +
                                           "; there is no level " + std::to_string(*restore.level) + "."};
    const unsigned level = restore.level.value_or(model.finest_level());
    const Mesh rest = level_mesh(model, level);
    if (rest.face_count() == 0) return nothing_to_draw();
    Result<DrawArrays> draw = make_draw_arrays(rest, rest.positions, options, context);
    if (!draw) return draw.error();

    auto content = std::make_unique<Content>();
    content->model = &model;
    content->restore = restore;
    content->origin = model.mesh.origin;
    content->box = world_box(rest.positions, model.mesh.origin);
    if (model.code() == DetailCode::reference) {
        content->options = options;
        Result<Restorer> restorer = Restorer::create(model, restore, context);
        if (!restorer) return restorer.error();
        content->restorer = std::move(restorer).value();
        if (Status s = content->upload_surface(rest, rest.positions, options, *draw, {}); !s) return s.error();
        return Drawable(std::move(content));
    }
    std::vector<Index> vertices(draw->vertex);
    if (level < model.finest_level())
        for (Index& v : vertices) v = model.levels[level].vertices[v];
    Result<GpuRestorer> on_gpu = GpuRestorer::create(model, vertices, draw->normals, restore, context);
    if (!on_gpu) return on_gpu.error();
    content->on_gpu = std::move(on_gpu).value();
    content->pose_box.emplace(model, vertices);
    RestoreOptions driver_alone = restore;
    driver_alone.level = 0;
    Result<Restorer> driver = Restorer::create(model, driver_alone, context);
    if (!driver) return driver.error();
    content->restorer = std::move(driver).value();
    if (Status s = content->upload_surface(rest, rest.positions, options, *draw, content->on_gpu->drawn_at()); !s)
        return s.error();
    glBindVertexArray(content->arrays.name());
    content->on_gpu->bind();
    glBindVertexArray(0);
    return Drawable(std::move(content));
}

Status Drawable::set_pose(const Pose& pose, const RunContext& context) {
    Content& content = *content_;
    if (!content.model) return Error{ErrorCode::usage, "Only a model can be posed."};
    if (content.on_gpu) {
        if (Status s = content.on_gpu->set_pose(pose, context); !s) return s;
        content.box = content.pose_box->at(pose.positions, content.restorer->gradients(pose, context));
        content.box.min += content.origin;
        content.box.max += content.origin;
        return Success{};
    }
    Result<Mesh> mesh = content.restorer->mesh(pose, context);
    if (!mesh) return mesh.error();
    Result<DrawArrays> draw = make_draw_arrays(*mesh, mesh->positions, content.options, context);
    if (!draw) return draw.error();
    content.box = world_box(mesh->positions, content.origin);
    return content.upload_surface(*mesh, mesh->positions, content.options, *draw, {});
}

} // namespace filigree
