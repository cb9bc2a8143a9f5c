#include "filigree/render/gpu_restore.h"

#include "filigree/blend/blend_code.h"
#include "filigree/blend/blend_kernel.h"
#include "filigree/render/gl_objects.h"
#include "filigree/render/octahedron.h"
#include "filigree/render/shaders.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace filigree {

namespace {

constexpr GLuint kRecordInput = 4, kMoreInput = 5;                           // shaders/restore.glsl: vertex inputs
constexpr GLuint kTransformBinding = 0, kCellBinding = 1, kScaleBinding = 2; // and storage bindings

/// What shaders/restore.glsl reads, as it lies in its buffers.
struct PackedRecords {
    std::size_t words = 0;             ///< of 32 bits, a record
    std::vector<std::uint32_t> inputs; ///< `words` a record
    std::vector<std::array<std::uint32_t, 4>> cells;
};

PackedRecords pack(const blend_kernel::Records& records) {
    const bool with_normals = !records.normal[0].empty();
    PackedRecords packed;
    packed.words = 6u + (with_normals ? 1u : 0u);
    packed.inputs.reserve(packed.words * records.count);
    Index last = kNoIndex;
    for (const blend_kernel::Run& run : records.runs) {
        if (run.cell != last) { // cells without records are left out
            const Triangle& corners = records.cells[run.cell];
            packed.cells.push_back({corners[0], corners[1], corners[2], 0});
            last = run.cell;
        }
        const auto cell = static_cast<std::uint32_t>(packed.cells.size() - 1);
        for (Index r = run.first; r < run.first + run.count; ++r) {
            const auto add = [&](std::uint32_t word) { packed.inputs.push_back(word); };
            for (float value : {records.u[r], records.v[r], records.q[0][r], records.q[1][r], records.q[2][r]})
                add(std::bit_cast<std::uint32_t>(value));
            add(cell);
            if (with_normals) add(octahedral({records.normal[0][r], records.normal[1][r], records.normal[2][r]}));
        }
    }
    return packed;
}

GLint integer(GLenum name) {
    GLint value = 0;
    glGetIntegerv(name, &value);
    return value;
}

/// A buffer for shaders to read; never empty, which not every driver binds.
template <class T>
Result<gl::Buffer> make_storage(std::vector<T>& values) {
    if (values.empty()) values.emplace_back();
    const std::span<const T> span = values;
    if (span.size_bytes() > static_cast<std::size_t>(integer(GL_MAX_SHADER_STORAGE_BLOCK_SIZE)))
        return Error{ErrorCode::out_of_memory, "The driver's " + std::to_string(span.size_bytes() / 1'000'000) +
                                                   " MB are more than one storage buffer of this GPU holds: strip to "
                                                   "a smaller driver, or restore on the CPU."};
    return gl::make_buffer(span);
}

} // namespace

struct GpuRestorer::Content {
    const Model* model = nullptr;
    std::optional<Restorer> driver;     ///< at level 0: for its gradients
    std::optional<BlendRestorer> poses; ///< without items: for its transforms
    std::vector<Index> drawn_at;
    bool has_normals = false;
    std::size_t stride = 0, bytes = 0;
    gl::Buffer inputs, transforms, cells, scale;
    PackedRecords packed;            ///< until they are uploaded
    std::vector<float> output_scale; ///< one number
    std::vector<blend_kernel::VertexTransform> at_rest;

    /// pose: one that fits the model.
    std::vector<blend_kernel::VertexTransform> transforms_of(const Pose& pose, const RunContext& context) const {
        return poses->transforms(pose.positions, driver->gradients(pose, context).value(), context);
    }
    Status upload();
};

GpuRestorer::GpuRestorer(std::unique_ptr<Content> content) : content_(std::move(content)) {}
GpuRestorer::GpuRestorer(GpuRestorer&&) noexcept = default;
GpuRestorer& GpuRestorer::operator=(GpuRestorer&&) noexcept = default;
GpuRestorer::~GpuRestorer() = default;

Status GpuRestorer::Content::upload() {
    if (integer(GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS) < 3)
        return Error{ErrorCode::unsupported, "This GPU's vertex shaders read no storage buffers: restore on the CPU."};
    const auto keep = [](gl::Buffer& kept, Result<gl::Buffer> made) -> Status {
        if (!made) return made.error();
        kept = std::move(*made);
        return Success{};
    };
    if (Status status = keep(inputs, gl::make_buffer(std::span<const std::uint32_t>(packed.inputs))); !status)
        return status;
    if (Status status = keep(cells, make_storage(packed.cells)); !status) return status;
    if (Status status = keep(scale, make_storage(output_scale)); !status) return status;
    if (Status status = keep(transforms, make_storage(at_rest)); !status) return status;
    packed = {};
    at_rest = std::vector<blend_kernel::VertexTransform>(); // {} would keep the memory
    return Success{};
}

Result<GpuRestorer> GpuRestorer::create(const Model& model, std::span<const Index> vertices,
                                        std::span<const Vec3f> normals, const RestoreOptions& options,
                                        const RunContext& context) {
    Result<GpuRestorer> restorer = prepare(model, vertices, normals, options, context);
    if (!restorer) return restorer;
    if (Status status = restorer->upload(); !status) return status.error();
    return restorer;
}

Status GpuRestorer::upload() { return content_->upload(); }

Result<GpuRestorer> GpuRestorer::prepare(const Model& model, std::span<const Index> vertices,
                                         std::span<const Vec3f> normals, const RestoreOptions& options,
                                         const RunContext& context) {
    if (const Result<unsigned> level = restored_level(model, options); !level) return level.error();
    const std::size_t vertex_count = model.mesh.vertex_count();
    for (Index vertex : vertices)
        if (vertex >= vertex_count)
            return Error{ErrorCode::mismatch, "Vertex " + std::to_string(vertex) + " is asked for and the model has " +
                                                  std::to_string(vertex_count) + "."};
    if (!normals.empty() && normals.size() != vertices.size())
        return Error{ErrorCode::mismatch, "There are " + std::to_string(normals.size()) + " normals for " +
                                              std::to_string(vertices.size()) + " vertices: give one each, or none."};
    if (context.is_cancelled()) return cancelled_error();

    const BlendDetail& detail = model.detail;
    auto content = std::make_unique<Content>();
    content->model = &model;
    content->has_normals = !normals.empty();
    Result<Restorer> driver = Restorer::create(model, {.level = 0}, context);
    if (!driver) return driver.error();
    content->driver.emplace(std::move(*driver));

    const auto prepared = [&](std::span<const BlendRestorer::Item> items, std::span<const Vec3f> item_normals) {
        return BlendRestorer(detail, model.mesh.positions, model.driver().vertices, items, item_normals, context);
    };
    content->poses.emplace(prepared({}, {}));
    std::vector<BlendRestorer::Item> items(vertices.size());
    for (Index i = 0; i < items.size(); ++i) items[i] = {vertices[i], i};
    const BlendRestorer restorer = prepared(items, normals);
    content->drawn_at.resize(items.size());
    for (Index r = 0; r < items.size(); ++r) content->drawn_at[restorer.slots()[r]] = r;
    if (context.is_cancelled()) return cancelled_error();

    Pose rest = rest_pose(model);
    rest.gradients.assign(rest.positions.size(), Mat3f::Identity());
    PackedRecords& packed = content->packed;
    packed = pack(restorer.records());
    content->output_scale = {restorer.output_scale()};
    std::vector<blend_kernel::VertexTransform>& at_rest = content->at_rest;
    at_rest = content->transforms_of(rest, context);
    content->stride = packed.words * sizeof(std::uint32_t);
    content->bytes = packed.inputs.size() * sizeof(packed.inputs[0]) + packed.cells.size() * sizeof(packed.cells[0]) +
                     sizeof(float) + at_rest.size() * sizeof(at_rest[0]);
    return GpuRestorer(std::move(content));
}

Status GpuRestorer::set_pose(const Pose& pose, const RunContext& context) {
    if (Status status = check_pose(*content_->model, pose); !status) return status;
    if (context.is_cancelled()) return cancelled_error();
    const std::vector<blend_kernel::VertexTransform> transforms = content_->transforms_of(pose, context);
    if (transforms.empty()) return Success{};
    glInvalidateBufferData(content_->transforms.name()); // draws in flight keep the old one, and nobody waits for them
    glBindBuffer(GL_COPY_WRITE_BUFFER, content_->transforms.name());
    glBufferSubData(GL_COPY_WRITE_BUFFER, 0, static_cast<GLsizeiptr>(transforms.size() * sizeof(transforms[0])),
                    transforms.data());
    return Success{};
}

std::size_t GpuRestorer::item_count() const { return content_->drawn_at.size(); }
std::span<const Index> GpuRestorer::drawn_at() const { return content_->drawn_at; }
bool GpuRestorer::has_normals() const { return content_->has_normals; }
std::size_t GpuRestorer::bytes() const { return content_->bytes; }

std::string GpuRestorer::shader_source() { return std::string(shaders::restore); }

void GpuRestorer::bind() const {
    const GLint words = static_cast<GLint>(content_->stride / sizeof(std::uint32_t));
    const GLint first = std::min(words, 4);
    const GLsizei stride = static_cast<GLsizei>(content_->stride);
    glBindBuffer(GL_ARRAY_BUFFER, content_->inputs.name());
    glEnableVertexAttribArray(kRecordInput);
    glVertexAttribIPointer(kRecordInput, first, GL_UNSIGNED_INT, stride, nullptr);
    if (words > first) {
        glEnableVertexAttribArray(kMoreInput);
        glVertexAttribIPointer(kMoreInput, words - first, GL_UNSIGNED_INT, stride,
                               reinterpret_cast<const void*>(4 * sizeof(std::uint32_t)));
    }
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kTransformBinding, content_->transforms.name());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kCellBinding, content_->cells.name());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kScaleBinding, content_->scale.name());
}

Result<GpuRestorer::ReadBack> GpuRestorer::read_back() const {
    constexpr std::size_t kPiece = std::size_t{1} << 18; // items at a time
    const std::size_t count = item_count();
    ReadBack result;
    if (count == 0) return result;
    result.positions.resize(count);
    if (has_normals()) result.normals.resize(count);

    const std::string main = has_normals() ? "out vec3 position, normal;\n"
                                             "void main() { restore_vertex(position, normal); }\n"
                                           : "out vec3 position;\n"
                                             "void main() { position = restored_position(); }\n";
    const gl::Program::Stage stage{GL_VERTEX_SHADER, "#version 430 core\n" + shader_source() + main};
    const char* const outputs[] = {"position", "normal"};
    const std::size_t values = has_normals() ? 2 : 1; // points an item
    const gl::Program program = gl::Program::link({&stage, 1}, std::span(outputs).first(values));

    std::vector<Vec3f> points(std::min(count, kPiece) * values);
    const Result<gl::Buffer> captured = gl::make_buffer(std::span<const Vec3f>(points));
    if (!captured) return captured.error();
    // Without a window OpenGL draws nothing at all unless some framebuffer is there, even one without pixels.
    const GLint drawn_to = integer(GL_DRAW_FRAMEBUFFER_BINDING);
    const gl::Framebuffer nowhere = gl::Framebuffer::make();
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, nowhere.name());
    glFramebufferParameteri(GL_DRAW_FRAMEBUFFER, GL_FRAMEBUFFER_DEFAULT_WIDTH, 1);
    glFramebufferParameteri(GL_DRAW_FRAMEBUFFER, GL_FRAMEBUFFER_DEFAULT_HEIGHT, 1);
    const gl::VertexArray inputs = gl::VertexArray::make();
    glBindVertexArray(inputs.name());
    bind();
    glUseProgram(program.name());
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, captured->name());
    glEnable(GL_RASTERIZER_DISCARD);

    std::vector<Index> item_at(count);
    for (Index i = 0; i < count; ++i) item_at[content_->drawn_at[i]] = i;
    for (std::size_t begin = 0; begin < count; begin += kPiece) {
        const std::size_t piece = std::min(kPiece, count - begin);
        glBeginTransformFeedback(GL_POINTS);
        glDrawArrays(GL_POINTS, static_cast<GLint>(begin), static_cast<GLsizei>(piece));
        glEndTransformFeedback();
        glGetBufferSubData(GL_TRANSFORM_FEEDBACK_BUFFER, 0, static_cast<GLsizeiptr>(piece * values * sizeof(Vec3f)),
                           points.data());
        for (std::size_t k = 0; k < piece; ++k) {
            const Index item = item_at[begin + k];
            result.positions[item] = points[values * k];
            if (has_normals()) result.normals[item] = points[values * k + 1];
        }
    }

    const bool drawn = glGetError() == GL_NO_ERROR;
    glDisable(GL_RASTERIZER_DISCARD);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
    glUseProgram(0);
    glBindVertexArray(0);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(drawn_to));
    if (!drawn)
        return Error{ErrorCode::out_of_memory, "The GPU could not restore " + std::to_string(count) +
                                                   " vertices: restore a lower level, or on the CPU."};
    return result;
}

} // namespace filigree
