#include "filigree/render.h"

#include "filigree/core/parallel_for.h"
#include "filigree/render/drawable_content.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace filigree {

namespace {

using gl::Buffer;

/// Pictures lie row after row, whatever others in this context have asked for.
void set_unpacking() {
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    for (const GLenum name : {GL_UNPACK_ROW_LENGTH, GL_UNPACK_SKIP_ROWS, GL_UNPACK_SKIP_PIXELS, GL_UNPACK_SWAP_BYTES})
        glPixelStorei(name, 0);
}

gl::Texture color_texture(ColorMap map) {
    set_unpacking();
    std::vector<Vec3f> table; // linear light
    for (const Vec3f& srgb : color_table(map)) table.push_back(srgb_to_linear(srgb));
    gl::Texture texture = gl::Texture::make();
    glBindTexture(GL_TEXTURE_1D, texture.name());
    glTexImage1D(GL_TEXTURE_1D, 0, GL_RGB32F, static_cast<GLsizei>(table.size()), 0, GL_RGB, GL_FLOAT, table.data());
    glTexParameteri(GL_TEXTURE_1D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_1D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_1D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glBindTexture(GL_TEXTURE_1D, 0);
    return texture;
}

/// picture: rows from the bottom.
gl::Texture picture_texture(const Picture& picture) {
    set_unpacking();
    gl::Texture texture = gl::Texture::make();
    glBindTexture(GL_TEXTURE_2D, texture.name());
    glTexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8_ALPHA8, static_cast<GLsizei>(picture.width),
                 static_cast<GLsizei>(picture.height), 0, GL_RGBA, GL_UNSIGNED_BYTE, picture.rgba.data());
    glGenerateMipmap(GL_TEXTURE_2D);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glBindTexture(GL_TEXTURE_2D, 0);
    return texture;
}

/// Uploads values for a vertex input of the bound vertex array.
template <class T>
Status set_input(Buffer& buffer, std::span<T> values, GLuint input, GLint components, GLenum type, GLboolean normalized,
                 GLuint divisor = 0) {
    Result<Buffer> made = gl::make_buffer(std::span<const T>(values));
    if (!made) return made.error();
    buffer = std::move(made).value();
    glBindBuffer(GL_ARRAY_BUFFER, buffer.name());
    glEnableVertexAttribArray(input);
    glVertexAttribPointer(input, components, type, normalized, 0, nullptr);
    glVertexAttribDivisor(input, divisor);
    return Success{};
}

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

Box box_of_balls(std::span<const Vec3f> positions, const Vec3d& origin, double radius) {
    Box box = world_box(positions, origin);
    box.min.array() -= radius;
    box.max.array() += radius;
    return box;
}

/// Whoever else draws in this context (Qt's painter) finds nothing of ours bound.
struct Tidy {
    ~Tidy() {
        glBindVertexArray(0);
        for (const GLenum target : {GL_ARRAY_BUFFER, GL_COPY_WRITE_BUFFER, GL_SHADER_STORAGE_BUFFER})
            glBindBuffer(target, 0);
    }
};

/// All of a buffer, to be written anew; empty where the driver has no memory.
template <class T>
struct Mapped {
    std::span<T> values;

    Mapped(const Buffer& buffer, std::size_t count) : buffer_(buffer) {
        glBindBuffer(GL_COPY_WRITE_BUFFER, buffer_.name());
        void* at = glMapBufferRange(GL_COPY_WRITE_BUFFER, 0, static_cast<GLsizeiptr>(count * sizeof(T)),
                                    GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT);
        glBindBuffer(GL_COPY_WRITE_BUFFER, 0);
        if (at) values = {static_cast<T*>(at), count};
    }
    Mapped(const Mapped&) = delete;
    ~Mapped() {
        if (values.empty()) return;
        glBindBuffer(GL_COPY_WRITE_BUFFER, buffer_.name());
        glUnmapBuffer(GL_COPY_WRITE_BUFFER);
        glBindBuffer(GL_COPY_WRITE_BUFFER, 0);
    }

private:
    const Buffer& buffer_;
};

Error no_memory() {
    return {ErrorCode::out_of_memory, "The graphics memory has no room for the pose: draw a lower level."};
}

} // namespace

Status Drawable::Content::upload_arrays(const DrawData::Content& data) {
    using namespace vertex_input;
    arrays = gl::VertexArray::make();
    glBindVertexArray(arrays.name());
    if (!data.positions.empty()) {
        if (Status s = set_input(positions, std::span(data.positions), kPosition, 3, GL_FLOAT, GL_FALSE); !s) return s;
        if (Status s = set_input(normals, std::span(data.normals), kNormal, 2, GL_SHORT, GL_FALSE); !s) return s;
    }
    has_uvs = !data.uvs.empty();
    if (has_uvs)
        if (Status s = set_input(uvs, std::span(data.uvs), kUv, 2, GL_FLOAT, GL_FALSE); !s) return s;
    has_colors = !data.colors.empty();
    if (has_colors)
        if (Status s = set_input(colors, std::span(data.colors), kColor, 4, GL_UNSIGNED_BYTE, GL_TRUE); !s) return s;
    Result<Buffer> indices = gl::make_buffer(std::span(data.triangles));
    if (!indices) return indices.error();
    triangles = std::move(indices).value();
    triangle_count = data.triangles.size();
    shadow_triangle_count = data.shadow_triangles.size();
    if (shadow_triangle_count > 0) {
        Result<Buffer> fewer = gl::make_buffer(std::span(data.shadow_triangles));
        if (!fewer) return fewer.error();
        shadow_triangles = std::move(fewer).value();
    }
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, triangles.name());

    Result<Buffer> flags = gl::make_buffer(std::span(data.edges));
    if (!flags) return flags.error();
    edge_flags = std::move(flags).value();
    edge_texture = gl::Texture::make();
    glBindTexture(GL_TEXTURE_BUFFER, edge_texture.name());
    glTexBuffer(GL_TEXTURE_BUFFER, GL_R8UI, edge_flags.name());
    glBindTexture(GL_TEXTURE_BUFFER, 0);
    return Success{};
}

Status Drawable::Content::upload_scalars(std::span<const float> places, ColorMap map, GLuint divisor) {
    has_scalars = !places.empty();
    if (!has_scalars) return Success{};
    glBindVertexArray(arrays.name());
    if (Status s = set_input(scalars, places, vertex_input::kScalar, 1, GL_FLOAT, GL_FALSE, divisor); !s) {
        has_scalars = false;
        return s;
    }
    scalar_colors = color_texture(map);
    return Success{};
}

Status Drawable::Content::upload_parts(std::vector<DrawData::Content::Part> data_parts) {
    for (DrawData::Content::Part& from : data_parts) {
        Part part;
        part.first = from.first;
        part.count = from.count;
        part.color = from.color;
        part.has_color = from.has_color;
        if (from.picture) {
            GLint most = 0;
            glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
            if (std::max(from.picture->width, from.picture->height) > static_cast<unsigned>(most))
                return Error{ErrorCode::unsuitable, "A texture is larger than the " + std::to_string(most) +
                                                        " pixels a side that can be drawn here; scale it down."};
            part.picture = picture_texture(*from.picture);
            from.picture.reset();
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

Result<Drawable> Drawable::upload(DrawData draw_data) {
    DrawData::Content& data = *draw_data.content_;
    auto content = std::make_unique<Content>();
    const Tidy tidy;
    if (Status s = content->upload_arrays(data); !s) return s.error();
    if (Status s = content->upload_scalars(data.scalars, data.map, 0); !s) return s.error();
    if (Status s = content->upload_parts(std::move(data.parts)); !s) return s.error();
    content->origin = data.origin;
    content->box = data.box;
    content->vertex = std::move(data.vertex);
    content->mesh_vertex_count = data.mesh_vertex_count;
    content->is_solid = data.is_solid;
    content->motion = std::move(data.motion);
    if (std::optional<GpuRestorer>& on_gpu = content->motion.on_gpu) {
        if (Status s = on_gpu->upload(); !s) return s.error();
        glBindVertexArray(content->arrays.name());
        on_gpu->bind();
    }
    return Drawable(std::move(content));
}

Result<Drawable> Drawable::surface(const Mesh& mesh, const SurfaceOptions& options, const RunContext& context) {
    Result<DrawData> data = DrawData::surface(mesh, options, context);
    if (!data) return data.error();
    return upload(std::move(*data));
}

Result<Drawable> Drawable::model(const Model& model, const RestoreOptions& restore, const SurfaceOptions& options,
                                 const RunContext& context) {
    // A software renderer's vertex shaders would restore in every pass, and for every shadow map.
    const RestoreOn where = gl::is_software_renderer() ? RestoreOn::cpu : RestoreOn::gpu;
    Result<DrawData> data = DrawData::model(model, restore, options, where, context);
    if (!data) return data.error();
    return upload(std::move(*data));
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
    content->box = box_of_balls(positions, origin, content->radius);
    content->vertex.resize(positions.size());
    std::iota(content->vertex.begin(), content->vertex.end(), Index{0});

    const Tidy tidy;
    content->arrays = gl::VertexArray::make();
    glBindVertexArray(content->arrays.name());
    if (Status s = set_input(content->positions, positions, kPosition, 3, GL_FLOAT, GL_FALSE, 1); !s) return s.error();
    content->has_colors = !options.colors.empty();
    if (content->has_colors) {
        const std::vector<ColorBytes> bytes = color_bytes(options.colors, content->vertex, context);
        if (Status s = set_input(content->colors, std::span(bytes), kColor, 4, GL_UNSIGNED_BYTE, GL_TRUE, 1); !s)
            return s.error();
    }
    const std::vector<float> places = options.scalars.values.empty()
                                          ? std::vector<float>()
                                          : scalar_places(options.scalars, content->vertex, context);
    if (Status s = content->upload_scalars(places, options.scalars.map, 1); !s) return s.error();
    return Drawable(std::move(content));
}

Status Drawable::set_pose(const Pose& pose, const RunContext& context) {
    Content& content = *content_;
    ModelMotion& motion = content.motion;
    if (!motion.model) return Error{ErrorCode::usage, "Only a model can be posed."};
    Box box;
    if (motion.on_gpu) {
        if (Status s = motion.on_gpu->set_pose(pose, context); !s) return s;
        const Result<std::vector<Mat3f>> gradients = motion.restorer->gradients(pose, context);
        if (!gradients) return gradients.error();
        box = motion.pose_box->at(pose.positions, *gradients);
        content.is_turned_out = turns_out(*gradients);
    } else {
        const std::size_t count = content.vertex.size();
        if (Status s = move_vertices(motion, pose, count, context); !s) return s;
        content.is_turned_out = motion.turns_out;
        const Mapped<Vec3f> positions(content.positions, count);
        const Mapped<std::uint32_t> normals(content.normals, count);
        if (positions.values.empty() || normals.values.empty()) return no_memory();
        box = write_moved(motion, positions.values, normals.values, context);
    }
    content.box = box;
    content.box.min += content.origin;
    content.box.max += content.origin;
    return Success{};
}

Status Drawable::set_scalars(const ScalarColors& scalars) {
    Content& content = *content_;
    const std::size_t count = content.point_count ? content.point_count : content.mesh_vertex_count;
    if (!scalars.values.empty() && scalars.values.size() != count)
        return Error{ErrorCode::mismatch, "There are " + std::to_string(scalars.values.size()) + " values for " +
                                              std::to_string(count) + " vertices: give one each, or none."};
    const Tidy tidy;
    if (scalars.values.empty()) return content.upload_scalars({}, scalars.map, 0);
    return content.upload_scalars(scalar_places(scalars, content.vertex, RunContext()), scalars.map,
                                  content.point_count ? 1 : 0);
}

Status Drawable::set_positions(std::span<const Vec3f> positions) {
    Content& content = *content_;
    if (!content.point_count) return Error{ErrorCode::usage, "Only points can be put elsewhere; models are posed."};
    if (positions.size() != content.point_count)
        return Error{ErrorCode::mismatch, "There are " + std::to_string(positions.size()) + " positions for " +
                                              std::to_string(content.point_count) + " points: give one each."};
    glBindBuffer(GL_COPY_WRITE_BUFFER, content.positions.name());
    glBufferData(GL_COPY_WRITE_BUFFER, static_cast<GLsizeiptr>(positions.size_bytes()), positions.data(),
                 GL_DYNAMIC_DRAW); // draws in flight keep the old one
    glBindBuffer(GL_COPY_WRITE_BUFFER, 0);
    content.box = box_of_balls(positions, content.origin, content.radius);
    return Success{};
}

} // namespace filigree
