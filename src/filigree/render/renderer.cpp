#include "filigree/render/gl_visit.h"
#include "filigree/render/renderer_content.h"
#include "filigree/render/shaders.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace filigree {

namespace {

using Mat4d = Eigen::Matrix4d;
using gl::Framebuffer;
using gl::Program;
using gl::Texture;
using gl::Visit;

constexpr int kLeastShadowSize = 512, kMostShadowSize = 2048;
constexpr double kGroundDarkness = 0.6; // of a shadow that no light reaches
constexpr unsigned kFewPasses = 4;      // below, the hardware's multisampling does the antialiasing
// Light that a white surface gets where it faces the source, over all passes. The sky is seen by half on average.
constexpr double kKeyLight = 0.92, kSkyLight = 2 * 0.46, kFillLight = 0.11, kBounceLight = 0.09;

void put(float (&to)[16], const Mat4d& m) { Eigen::Map<Eigen::Matrix4f>{to} = m.cast<float>(); }
void put(float (&to)[4], const Vec3d& v, double w) {
    for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(v[k]);
    to[3] = static_cast<float>(w);
}

unsigned passes_for(const Scene& scene) {
    double triangles = 0;
    for (const SceneObject& object : scene.objects)
        triangles += double(object.drawable->triangle_count()) + 2.0 * double(object.drawable->point_count());
    return static_cast<unsigned>(std::clamp(std::lround(40 * std::sqrt(2.5e5 / std::max(triangles, 1.0))), 12L, 40L));
}

} // namespace

Box Scene::box() const {
    Box all;
    for (const SceneObject& object : objects) {
        const Box& box = object.drawable->box();
        if (box.empty()) continue;
        all.extend(box.min);
        all.extend(box.max);
    }
    return all;
}

Renderer::Renderer(std::unique_ptr<Content> content) : content_(std::move(content)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

Result<Renderer> Renderer::create() {
    if (epoxy_gl_version() < 43)
        return Error{ErrorCode::unsupported, "The renderer needs OpenGL 4.3 and this context has " +
                                                 std::to_string(epoxy_gl_version() / 10) + "." +
                                                 std::to_string(epoxy_gl_version() % 10) +
                                                 "; install a newer driver, or set LIBGL_ALWAYS_SOFTWARE=1."};
    auto content = std::make_unique<Content>();
    const auto link = [](const std::string& vertex, const std::string& fragment) {
        const std::array<Program::Stage, 2> stages = {
            {{GL_VERTEX_SHADER, kGlslVersion + vertex}, {GL_FRAGMENT_SHADER, kGlslVersion + fragment}}};
        return Program::link(stages);
    };
    const std::string frame = shaders::frame, lighting = shaders::lighting;
    const std::string points = frame + shaders::coverage;
    content->points = link(frame + shaders::points_vertex, points + lighting + shaders::points_fragment);
    content->points_in_preview =
        link(frame + shaders::points_vertex, points + shaders::preview_lighting + shaders::points_fragment);
    content->copy = link(shaders::cover_vertex, shaders::copy_fragment);
    content->preview_background = link(shaders::cover_vertex, shaders::preview_background);
    content->lit = link(shaders::cover_vertex, frame + lighting + shaders::seen + shaders::lit_fragment);
    content->ground = link(frame + shaders::ground_vertex, frame + shaders::ground_fragment);
    content->ground_cover = link(shaders::cover_vertex, frame + shaders::ground_cover_fragment);
    content->add = link(shaders::cover_vertex, shaders::add_fragment);
    content->show = link(shaders::cover_vertex, shaders::show_fragment);
    content->nothing = gl::VertexArray::make();
    content->ground_sampler = gl::make_depth_sampler();
    Result<gl::Buffer> buffer = gl::make_buffer(nullptr, sizeof(FrameBlock));
    if (!buffer) return buffer.error();
    content->frame_buffer = std::move(buffer).value();
    std::array<GLint, 2> viewport = {};
    glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport.data());
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &content->largest);
    content->largest = std::min({content->largest, viewport[0], viewport[1]});
    glGetIntegerv(GL_MAX_SAMPLES, &content->most_samples);
    content->is_software = gl::is_software_renderer();
    return Renderer(std::move(content));
}

Status Renderer::Content::make_targets(int samples) {
    while (glGetError() != GL_NO_ERROR) {
    }
    // Shadows as fine as the picture: a coarse picture needs no fine map.
    const int side = std::clamp(static_cast<int>(std::max(width, height)) * 8 / 5, kLeastShadowSize, kMostShadowSize);
    if (!key_map || key_map->size != side) {
        key_map.emplace(side);
        sky_map.emplace(side * 3 / 4);
    }
    const bool complete = targets.make(width, height, samples);
    if (complete && glGetError() == GL_NO_ERROR) return Success{};
    targets.width = 0; // half made: not to be taken for the same
    return no_room();
}

Status Renderer::Content::make_preview_targets() {
    while (glGetError() != GL_NO_ERROR) {
    }
    const bool complete = preview_targets.make(width, height, is_software ? 0 : std::min(most_samples, 4));
    if (complete && glGetError() == GL_NO_ERROR) return Success{};
    preview_targets.width = 0;
    return no_room();
}

Error Renderer::Content::no_room() const {
    return {ErrorCode::out_of_memory, "The graphics memory has no room for a picture of " + std::to_string(width) +
                                          " by " + std::to_string(height) + " pixels; make it smaller."};
}

Status Renderer::Content::start(const Scene& new_scene, const Camera& new_camera, unsigned w, unsigned h) {
    if (w == 0 || h == 0 || w > static_cast<unsigned>(largest) || h > static_cast<unsigned>(largest))
        return Error{ErrorCode::unsuitable, "A picture of " + std::to_string(w) + " by " + std::to_string(h) +
                                                " pixels cannot be drawn here; sides go from 1 to " +
                                                std::to_string(largest) + "."};
    scene = new_scene;
    camera = new_camera;
    width = w;
    height = h;
    Box world = scene.box();
    if (world.empty()) world.extend(Vec3d::Zero());
    const Vec3d up = up_vector(scene.up);
    centre = world.centre();
    const double diagonal = world.diagonal();
    scale = diagonal > 0 ? 1 / diagonal : 1;
    box = {};
    box.extend(scale * (world.min - centre));
    box.extend(scale * (world.max - centre));
    const Mat3d basis = camera.basis();
    lights.emplace(basis.col(2), basis.col(0), up);

    // In a scene without height the ground lies a little below, not in it.
    double lowest = std::numeric_limits<double>::infinity();
    for (const Vec3d& corner : corners_of(box)) lowest = std::min(lowest, up.dot(corner));
    ground_level = scene.fixed_ground ? scale * (scene.ground_level - up.dot(centre)) : lowest - 1e-4;
    const double eye_height =
        camera.field_of_view_deg > 0 ? scale * up.dot(camera.eye - centre) - ground_level : up.dot(basis.col(2));
    shows_ground = scene.ground && eye_height > 0;
    return Success{};
}

Status Renderer::begin(const Scene& scene, const Camera& camera, unsigned width, unsigned height, unsigned passes) {
    Content& c = *content_;
    if (Status status = c.start(scene, camera, width, height); !status) return status;
    c.is_preview = false;
    c.passes = passes ? passes : passes_for(scene);
    c.done = 0;
    const Visit visit;
    const int samples = c.passes < kFewPasses ? std::min(c.most_samples, 8) : 0;
    if (c.targets.width != width || c.targets.height != height || c.targets.samples != samples)
        if (Status status = c.make_targets(samples); !status) return status;
    glBindFramebuffer(GL_FRAMEBUFFER, c.targets.total.name());
    const std::array<float, 4> zero = {};
    glClearBufferfv(GL_COLOR, 0, zero.data());

    const Vec3d up = up_vector(scene.up);
    c.ground_light = 0;
    for (unsigned i = 0; i < c.passes; ++i)
        c.ground_light +=
            kKeyLight * std::max(0.0, up.dot(c.lights->key(i))) + kSkyLight * std::max(0.0, up.dot(c.lights->sky(i)));
    c.ground_light = std::max(c.ground_light / c.passes, 1e-3);
    return Success{};
}

/// shift: of the picture, in pixels.
FrameBlock Renderer::Content::view_of(const Eigen::Vector2d& shift) const {
    FrameBlock block = {};
    const Mat3d basis = camera.basis();
    const Vec3d eye = scale * (camera.eye - centre), back = basis.col(2), up = up_vector(scene.up);

    // Near and far enclose the scene, and the ground where it shows.
    double nearest = std::numeric_limits<double>::infinity(), furthest = -nearest;
    Box all = box;
    if (shows_ground) {
        const Vec3d base = up * ground_level;
        for (int axis = 0; axis < 3; ++axis)
            if (std::abs(up[axis]) < 0.5) {
                all.extend(base + kGroundSide * Vec3d::Unit(axis));
                all.extend(base - kGroundSide * Vec3d::Unit(axis));
            }
    }
    for (const Vec3d& corner : corners_of(all)) {
        const double along = -back.dot(corner - eye);
        nearest = std::min(nearest, along);
        furthest = std::max(furthest, along);
    }
    Camera scaled = camera;
    scaled.height *= scale;
    Vec3d from = eye;
    if (camera.field_of_view_deg > 0) {
        furthest = std::max(furthest * 1.001, 1e-3);
        nearest = std::clamp(nearest * 0.999, furthest * 1e-4, furthest * 0.999);
    } else { // the eye's place along the view does not matter
        from += back * (1 - nearest);
        furthest += 1.1 - nearest;
        nearest = 0.9;
    }
    Mat4d view = Mat4d::Identity();
    view.topLeftCorner<3, 3>() = basis.transpose();
    view.topRightCorner<3, 1>() = -basis.transpose() * from;
    Mat4d projection = scaled.projection(double(width) / height, nearest, furthest);
    Mat4d shifted = Mat4d::Identity();
    shifted(0, 3) = 2 * shift.x() / width;
    shifted(1, 3) = 2 * shift.y() / height;
    projection = shifted * projection;
    put(block.view_projection, projection * view);
    const Mat4d to_scene = (projection * view).inverse();
    const auto at = [&](double x, double y, double z) {
        return (to_scene * Eigen::Vector4d(x, y, z, 1)).hnormalized().eval();
    };
    for (const auto& [rays, z] : {std::pair(block.near, -1.0), std::pair(block.far, 1.0)}) {
        const Vec3d middle = at(0, 0, z);
        put(rays[0], middle, 0);
        put(rays[1], at(1, 0, z) - middle, 0);
        put(rays[2], at(0, 1, z) - middle, 0);
    }
    put(block.along, -back / (furthest - nearest), (back.dot(from) - nearest) / (furthest - nearest));
    if (camera.field_of_view_deg > 0)
        put(block.eye, eye, 1);
    else
        put(block.eye, back, 0);
    put(block.fill_direction, lights->fill(), 0);
    put(block.up, up, ground_level);
    put(block.viewport, {double(width), double(height), 0}, 0);
    put(block.strength, {kKeyLight, kSkyLight, kFillLight}, kBounceLight);
    return block;
}

FrameBlock Renderer::Content::preview_frame() const {
    FrameBlock block = view_of(Eigen::Vector2d::Zero());
    put(block.key_direction, lights->key(), 0);
    put(block.sky_direction, lights->sky(), 0);
    return block;
}

FrameBlock Renderer::Content::frame(unsigned number) const {
    Eigen::Vector2d shift = Eigen::Vector2d::Zero();
    if (targets.samples <= 1 || passes > 1) { // a tent over the pixel
        const auto [u, v] = evenly(number, 0.0);
        const auto tent = [](double x) { return x < 0.5 ? std::sqrt(2 * x) - 1 : 1 - std::sqrt(2 - 2 * x); };
        shift = (targets.samples > 1 ? 0.5 : 0.8) * Eigen::Vector2d(tent(u), tent(v));
    }
    FrameBlock block = view_of(shift);
    const Vec3d key = lights->key(number), sky = lights->sky(number);
    const LightView key_view(key, box, key_map->size), sky_view(sky, box, sky_map->size);
    put(block.key_matrix, key_view.to_texture());
    put(block.sky_matrix, sky_view.to_texture());
    put(block.key_direction, key, key_view.texel);
    put(block.sky_direction, sky, sky_view.texel);
    block.viewport[2] = static_cast<float>(number);
    const Vec3d up = up_vector(scene.up);
    put(block.ground,
        {kKeyLight * std::max(0.0, up.dot(key)) / ground_light, kSkyLight * std::max(0.0, up.dot(sky)) / ground_light,
         kGroundDarkness},
        1 / std::sqrt(double(passes)));
    return block;
}

void Renderer::Content::use(const FrameBlock& block) const {
    glBindBuffer(GL_UNIFORM_BUFFER, frame_buffer.name());
    glBufferData(GL_UNIFORM_BUFFER, sizeof block, &block, GL_STREAM_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, frame_buffer.name());
}

void Renderer::Content::draw_depth(FrameBlock block, const LightView& view, const gl::ShadowMap& map) {
    glBindFramebuffer(GL_FRAMEBUFFER, map.framebuffer.name());
    glViewport(0, 0, map.size, map.size);
    glClear(GL_DEPTH_BUFFER_BIT);
    put(block.view_projection, view.matrix);
    // The light comes from one direction: the third row of its view, turned round.
    put(block.eye, -view.matrix.block<1, 3>(2, 0).transpose().normalized(), 0);
    block.viewport[3] = 1;
    use(block);
    draw_objects(Target::depth);
}

void Renderer::Content::draw_preview_background() {
    glUseProgram(preview_background.name());
    glUniform1f(preview_background.uniform("height"), static_cast<float>(height));
    glUniform3fv(preview_background.uniform("top"), 1, scene.background.top.data());
    glUniform3fv(preview_background.uniform("bottom"), 1, scene.background.bottom.data());
    glBindVertexArray(nothing.name());
    glDisable(GL_DEPTH_TEST);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glEnable(GL_DEPTH_TEST);
}

bool Renderer::add_pass() {
    Content& c = *content_;
    if (c.is_preview || c.done >= c.passes) return false;
    const Visit visit;
    const FrameBlock block = c.frame(c.done);
    c.draw_depth(block, LightView(c.lights->key(c.done), c.box, c.key_map->size), *c.key_map);
    c.draw_depth(block, LightView(c.lights->sky(c.done), c.box, c.sky_map->size), *c.sky_map);

    const gl::Targets& targets = c.targets;
    const bool lights_later = targets.samples <= 1;
    // Where each pixel is lit once, its light goes straight to the sum of the passes.
    const bool adds = lights_later && std::ranges::all_of(c.scene.objects, [&](const SceneObject& object) {
                          return c.is_lit_later(object) || object.appearance.coverage == 0;
                      });
    const Framebuffer& target = adds ? targets.adding : lights_later ? targets.pass : targets.multisampled.framebuffer;
    const auto w = static_cast<GLsizei>(c.width), h = static_cast<GLsizei>(c.height);
    glBindFramebuffer(GL_FRAMEBUFFER, target.name());
    glViewport(0, 0, w, h);
    const std::array<float, 4> zero = {};
    if (!adds) glClearBufferfv(GL_COLOR, 0, zero.data());
    glClear(GL_DEPTH_BUFFER_BIT);
    c.use(block);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, c.key_map->depth.name());
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_2D, c.sky_map->depth.name());
    if (lights_later) {
        glBindFramebuffer(GL_FRAMEBUFFER, targets.seeing.name());
        c.draw_objects(Content::Target::seen);
        glBindFramebuffer(GL_FRAMEBUFFER, target.name());
        glBlendFunc(GL_ONE, GL_ONE);
        if (adds) glEnable(GL_BLEND);
        c.light_seen();
        glDisable(GL_BLEND);
    }
    c.draw_objects(Content::Target::light);
    if (c.shows_ground) {
        c.draw_ground();
        glBindFramebuffer(GL_FRAMEBUFFER, target.name());
        glViewport(0, 0, w, h);
        if (adds) glEnable(GL_BLEND);
        c.cover_ground();
        glDisable(GL_BLEND);
    }

    ++c.done;
    if (adds) return true;
    if (targets.samples > 1) targets.multisampled.resolve_to(targets.pass, w, h);
    glBindFramebuffer(GL_FRAMEBUFFER, targets.total.name());
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    glUseProgram(c.add.name());
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, targets.color.name());
    glBindVertexArray(c.nothing.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
    return true;
}

void Renderer::show(unsigned framebuffer, int x, int y) const {
    const Content& c = *content_;
    const Visit visit(framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    const auto w = static_cast<GLsizei>(c.width), h = static_cast<GLsizei>(c.height);
    glViewport(x, y, w, h);
    GLint samples = 0;
    glGetIntegerv(GL_SAMPLES, &samples);
    if (c.is_preview && samples == 0) { // where the formats agree, no more than copying
        glBindFramebuffer(GL_READ_FRAMEBUFFER, c.preview_targets.framebuffer.name());
        glBlitFramebuffer(0, 0, w, h, x, y, x + w, y + h, GL_COLOR_BUFFER_BIT, GL_NEAREST);
        return;
    }
    const Program& program = c.is_preview ? c.copy : c.show;
    glDisable(GL_DEPTH_TEST);
    glUseProgram(program.name());
    glUniform2f(program.uniform("corner"), static_cast<float>(x), static_cast<float>(y));
    glUniform1f(program.uniform("passes"), static_cast<float>(std::max(1u, c.done)));
    glUniform2f(program.uniform("size"), static_cast<float>(c.width), static_cast<float>(c.height));
    glUniform3fv(program.uniform("top"), 1, c.scene.background.top.data());
    glUniform3fv(program.uniform("bottom"), 1, c.scene.background.bottom.data());
    glUniform1i(program.uniform("is_transparent"), c.scene.background.transparent);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, c.is_preview ? c.preview_targets.color.name() : c.targets.sum.name());
    glBindVertexArray(c.nothing.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

Status Renderer::preview(const Scene& scene, const Camera& camera, unsigned width, unsigned height) {
    Content& c = *content_;
    if (Status status = c.start(scene, camera, width, height); !status) return status;
    c.is_preview = true;
    c.passes = c.done = 0;
    const Visit visit;
    if (c.preview_targets.width != width || c.preview_targets.height != height)
        if (Status status = c.make_preview_targets(); !status) return status;
    const bool multisampled = bool(c.preview_targets.multisampled.framebuffer);
    const Framebuffer& framebuffer =
        multisampled ? c.preview_targets.multisampled.framebuffer : c.preview_targets.framebuffer;
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
    const auto w = static_cast<GLsizei>(width), h = static_cast<GLsizei>(height);
    glViewport(0, 0, w, h);
    glClear(GL_DEPTH_BUFFER_BIT);
    c.use(c.preview_frame());
    const std::array<float, 4> zero = {};
    if (scene.background.transparent)
        glClearBufferfv(GL_COLOR, 0, zero.data());
    else
        c.draw_preview_background();
    c.draw_objects(Content::Target::preview);
    if (multisampled) c.preview_targets.multisampled.resolve_to(c.preview_targets.framebuffer, w, h);
    return Success{};
}

Result<Picture> Renderer::picture(const Scene& scene, const Camera& camera, const PictureOptions& options,
                                  const RunContext& context) {
    if (Status status = begin(scene, camera, options.width, options.height, options.passes); !status)
        return status.error();
    Content& c = *content_;
    while (add_pass()) {
        glFinish();
        if (context.is_cancelled()) return cancelled_error();
        context.report("drawing", double(c.done) / c.passes);
    }
    c.scene.objects.clear(); // they need not outlive this call
    const auto w = static_cast<GLsizei>(c.width), h = static_cast<GLsizei>(c.height);
    const Texture color = gl::make_texture(GL_RGBA8, w, h);
    const Framebuffer framebuffer = gl::make_framebuffer(&color, nullptr);
    show(framebuffer.name());
    Picture picture(c.width, c.height), flipped(c.width, c.height);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, w, h, GL_RGBA, GL_UNSIGNED_BYTE, flipped.rgba.data());
    const std::size_t row = std::size_t{4} * c.width;
    for (unsigned y = 0; y < c.height; ++y)
        std::copy_n(flipped.rgba.data() + row * (c.height - 1 - y), row, picture.rgba.data() + row * y);
    if (glGetError() == GL_OUT_OF_MEMORY)
        return Error{ErrorCode::out_of_memory, "The graphics memory ran out; draw a smaller mesh or picture."};
    return picture;
}

} // namespace filigree
