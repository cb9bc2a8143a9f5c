#include "filigree/render/renderer.h"

#include "filigree/render/color_map.h"
#include "filigree/render/drawable_content.h"
#include "filigree/render/shaders.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

namespace filigree {

namespace {

using Mat4f = Eigen::Matrix4f;
using Mat4d = Eigen::Matrix4d;
using gl::Framebuffer;
using gl::Program;
using gl::Texture;

constexpr int kLeastShadowSize = 512, kMostShadowSize = 2048;
constexpr double kKeyReach = 0.16;      // of the key light: tangent of half the angle it is seen under
constexpr double kGroundSide = 2.5;     // half, in diagonals of the scene
constexpr double kGroundDarkness = 0.6; // of a shadow that no light reaches
constexpr double kFinePixels = 150;     // of the picture for each triangle: no more, and vertices are lit, not pixels
constexpr GLuint kUnits = 5;            // of textures, that the shaders read
constexpr unsigned kFewPasses = 4;      // below, the hardware's multisampling does the antialiasing
// Light that a white surface gets where it faces the source, over all passes. The sky is seen by half on average.
constexpr double kKeyLight = 0.92, kSkyLight = 2 * 0.46, kFillLight = 0.11, kBounceLight = 0.09;

/// A sequence that fills the unit square evenly whatever its length [Roberts 2018].
std::array<double, 2> evenly(unsigned i, double shift) {
    const double g = 1.32471795724474602596;
    const auto part = [](double x) { return x - std::floor(x); };
    return {part(shift + (i + 1) / g), part(shift + (i + 1) / (g * g))};
}

/// Two directions that make a right-handed basis with the unit vector n.
std::array<Vec3d, 2> tangents(const Vec3d& n) {
    const Vec3d other = std::abs(n.x()) < 0.7 ? Vec3d::UnitX() : Vec3d::UnitY();
    const Vec3d t = other.cross(n).normalized();
    return {t, n.cross(t)};
}

/// Where light comes from, as the viewer sees it: key from the upper left, sky from above and behind the viewer. All of
/// it turns with the camera, so that the frames of a turntable are lit alike.
class Lights {
public:
    Lights(const Vec3d& back, const Vec3d& camera_right, const Vec3d& up) {
        const Vec3d level = up.cross(back);
        right_ = level.norm() > 1e-3 ? level.normalized() : camera_right;
        const Vec3d front = right_.cross(up);
        key_ = (-0.72 * right_ + 0.72 * up + 0.42 * front).normalized();
        sky_ = (up + 0.55 * front).normalized();
        fill_ = (0.80 * right_ + 0.05 * up + 0.45 * front).normalized();
        // Looking down (or up) along the axis, front is no longer towards the viewer: turn all that way.
        const double along = back.dot(up);
        if (std::abs(along) > 0.85)
            for (Vec3d* d : {&key_, &sky_, &fill_}) *d = (*d + 0.6 * along * up).normalized();
    }
    const Vec3d& fill() const { return fill_; }
    const Vec3d& key() const { return key_; } ///< the middle
    const Vec3d& sky() const { return sky_; }
    /// The i-th point of the key light.
    Vec3d key(unsigned i) const {
        const auto [u, v] = evenly(i, 0.5);
        const double r = kKeyReach * std::sqrt(u);
        return around(key_, 1, r, 2 * std::numbers::pi * v).normalized();
    }
    /// The i-th direction, evenly over the hemisphere around the sky's middle.
    Vec3d sky(unsigned i) const {
        const auto [u, v] = evenly(i, 0.25);
        const double z = 1 - u, r = std::sqrt(std::max(0.0, 1 - z * z));
        return around(sky_, z, r, 2 * std::numbers::pi * v);
    }

private:
    Vec3d around(const Vec3d& axis, double along, double across, double angle) const {
        const Vec3d a = (right_ - axis * axis.dot(right_)).normalized(), b = axis.cross(a);
        return along * axis + across * (std::cos(angle) * a + std::sin(angle) * b);
    }

    Vec3d right_, key_, sky_, fill_;
};

/// The block that shaders/frame.glsl declares.
struct FrameBlock {
    float view_projection[16], key_matrix[16], sky_matrix[16];
    float eye[4], key_direction[4], sky_direction[4], fill_direction[4], up[4], viewport[4], strength[4], ground[4];
};

void put(float (&to)[16], const Mat4d& m) { Eigen::Map<Mat4f>{to} = m.cast<float>(); }
void put(float (&to)[4], const Vec3d& v, double w) {
    for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(v[k]);
    to[3] = static_cast<float>(w);
}

std::array<Vec3d, 8> corners_of(const Box& box) {
    std::array<Vec3d, 8> corners;
    for (int k = 0; k < 8; ++k)
        corners[k] = Vec3d((k & 1) ? box.max.x() : box.min.x(), (k & 2) ? box.max.y() : box.min.y(),
                           (k & 4) ? box.max.z() : box.min.z());
    return corners;
}

/// Parallel light from a direction over a box: to clip space, and the size of a texel.
struct LightView {
    Mat4d matrix;
    double texel;

    LightView(const Vec3d& direction, const Box& box, int size) {
        const auto [a, b] = tangents(direction);
        Vec3d lo = Vec3d::Constant(std::numeric_limits<double>::infinity()), hi = -lo;
        for (const Vec3d& c : corners_of(box)) {
            const Vec3d p(a.dot(c), b.dot(c), direction.dot(c));
            lo = lo.cwiseMin(p);
            hi = hi.cwiseMax(p);
        }
        const double margin = 4.0 / size; // so that the outermost texels stay empty
        const Vec3d extent = (hi - lo).cwiseMax(1e-6) * (1 + 2 * margin);
        const Vec3d centre = 0.5 * (lo + hi);
        const double near = hi.z() + 0.02, far = lo.z() - 4 * kGroundSide; // the ground far behind is lit too
        matrix = Mat4d::Zero();
        matrix.row(0) << 2 / extent.x() * a.transpose(), -2 / extent.x() * centre.x();
        matrix.row(1) << 2 / extent.y() * b.transpose(), -2 / extent.y() * centre.y();
        matrix.row(2) << -2 / (near - far) * direction.transpose(), (near + far) / (near - far);
        matrix(3, 3) = 1;
        texel = std::max(extent.x(), extent.y()) / size;
    }
    Mat4d to_texture() const {
        Mat4d half = Mat4d::Identity();
        half.diagonal() << 0.5, 0.5, 0.5, 1;
        half.col(3) << 0.5, 0.5, 0.5, 1;
        return half * matrix;
    }
};

void set_color(const Program& program, const char* name, const Vec3f& srgb) {
    glUniform3fv(program.uniform(name), 1, srgb_to_linear(srgb).eval().data());
}

Texture make_texture(GLenum format, GLsizei width, GLsizei height) {
    Texture texture = Texture::make();
    glBindTexture(GL_TEXTURE_2D, texture.name());
    glTexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

Framebuffer make_framebuffer(const Texture* color, const Texture* depth) {
    Framebuffer framebuffer = Framebuffer::make();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
    if (color) glFramebufferTexture(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color->name(), 0);
    if (depth) glFramebufferTexture(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth->name(), 0);
    if (!color) glDrawBuffer(GL_NONE);
    return framebuffer;
}

/// A depth map that light is compared with.
struct ShadowMap {
    Texture depth;
    Framebuffer framebuffer;
    int size = 0;

    explicit ShadowMap(int side) : depth(make_texture(GL_DEPTH_COMPONENT32F, side, side)), size(side) {
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
        framebuffer = make_framebuffer(nullptr, &depth);
    }
};

const std::string kVersion = "#version 430 core\n";

/// Everything that drawing depends on and that others who draw in this context (Qt's painter) may have left otherwise.
void set_state() {
    for (const GLenum ability : {GL_BLEND, GL_CULL_FACE, GL_SCISSOR_TEST, GL_STENCIL_TEST, GL_COLOR_LOGIC_OP,
                                 GL_POLYGON_OFFSET_FILL, GL_SAMPLE_ALPHA_TO_COVERAGE, GL_SAMPLE_COVERAGE,
                                 GL_PRIMITIVE_RESTART, GL_RASTERIZER_DISCARD, GL_FRAMEBUFFER_SRGB, GL_DEPTH_CLAMP})
        glDisable(ability);
    glEnable(GL_DEPTH_TEST);
    glEnable(GL_MULTISAMPLE);
    glDepthFunc(GL_LESS);
    glDepthMask(GL_TRUE);
    glDepthRange(0, 1);
    glClearDepth(1);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
    glBlendEquation(GL_FUNC_ADD);
    for (GLuint unit = 0; unit < kUnits; ++unit) glBindSampler(unit, 0);
}

/// Leaves nothing of ours behind that others trip over: no program, arrays, textures or tests; and the framebuffer that
/// was bound before.
class Visit {
public:
    Visit() : Visit(bound_framebuffer()) {}
    explicit Visit(GLuint leave_bound) : framebuffer_(leave_bound) { set_state(); }
    Visit(const Visit&) = delete;
    ~Visit() {
        glDisable(GL_DEPTH_TEST);
        glDisable(GL_BLEND);
        glUseProgram(0);
        glBindVertexArray(0);
        for (const GLenum target : {GL_ARRAY_BUFFER, GL_UNIFORM_BUFFER, GL_SHADER_STORAGE_BUFFER})
            glBindBuffer(target, 0);
        for (GLuint unit = kUnits; unit-- > 0;) {
            glActiveTexture(GL_TEXTURE0 + unit);
            for (const GLenum target : {GL_TEXTURE_1D, GL_TEXTURE_2D, GL_TEXTURE_BUFFER}) glBindTexture(target, 0);
        }
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    }

private:
    static GLuint bound_framebuffer() {
        GLint name = 0;
        glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &name);
        return static_cast<GLuint>(name);
    }
    GLuint framebuffer_ = 0;
};

/// A colour and a depth of several samples a pixel.
struct Multisampled {
    gl::Renderbuffer color, depth;
    Framebuffer framebuffer;

    Multisampled() = default;
    Multisampled(int samples, GLenum color_format, GLenum depth_format, GLsizei width, GLsizei height)
        : color(gl::Renderbuffer::make()), depth(gl::Renderbuffer::make()), framebuffer(Framebuffer::make()) {
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
        const auto attach = [&](const gl::Renderbuffer& buffer, GLenum format, GLenum attachment) {
            glBindRenderbuffer(GL_RENDERBUFFER, buffer.name());
            glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, width, height);
            glFramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer.name());
        };
        attach(color, color_format, GL_COLOR_ATTACHMENT0);
        attach(depth, depth_format, GL_DEPTH_ATTACHMENT);
        glBindRenderbuffer(GL_RENDERBUFFER, 0);
    }
    void resolve_to(const Framebuffer& to, GLsizei width, GLsizei height) const {
        glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer.name());
        glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to.name());
        glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    }
};

bool is_complete() { return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE; }

/// Where passes are drawn and added up.
struct Targets {
    Texture color, depth, sum;
    Framebuffer pass, total;
    Multisampled multisampled;
    unsigned width = 0, height = 0;
    int samples = 0;

    /// Whether there was room.
    bool make(unsigned w, unsigned h, int samples_a_pixel) {
        const auto x = static_cast<GLsizei>(w), y = static_cast<GLsizei>(h);
        color = make_texture(GL_RGBA16F, x, y);
        depth = make_texture(GL_DEPTH_COMPONENT32F, x, y);
        sum = make_texture(GL_RGBA32F, x, y);
        pass = make_framebuffer(&color, &depth);
        total = make_framebuffer(&sum, nullptr);
        bool complete = is_complete();
        multisampled = samples_a_pixel > 1 ? Multisampled(samples_a_pixel, GL_RGBA16F, GL_DEPTH_COMPONENT32F, x, y)
                                           : Multisampled();
        complete = complete && (samples_a_pixel <= 1 || is_complete());
        width = w;
        height = h;
        samples = samples_a_pixel;
        return complete;
    }
};

/// Where a preview is drawn: sRGB, as it is shown.
struct PreviewTargets {
    Texture color, depth;
    Framebuffer framebuffer;
    Multisampled multisampled;
    unsigned width = 0, height = 0;

    bool make(unsigned w, unsigned h, int samples) {
        const auto x = static_cast<GLsizei>(w), y = static_cast<GLsizei>(h);
        color = make_texture(GL_RGBA8, x, y);
        depth = samples > 1 ? Texture() : make_texture(GL_DEPTH_COMPONENT24, x, y);
        framebuffer = make_framebuffer(&color, samples > 1 ? nullptr : &depth);
        bool complete = is_complete();
        multisampled = samples > 1 ? Multisampled(samples, GL_RGBA8, GL_DEPTH_COMPONENT24, x, y) : Multisampled();
        complete = complete && (samples <= 1 || is_complete());
        width = w;
        height = h;
        return complete;
    }
};

/// Whether the processor draws, for which several samples a pixel are several times the work.
bool is_software_renderer() {
    const auto* text = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    const std::string name = text ? text : "";
    return name.find("llvmpipe") != std::string::npos || name.find("softpipe") != std::string::npos ||
           name.find("SWR") != std::string::npos || name.find("Software") != std::string::npos;
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

struct Renderer::Content {
    enum class Source { given, float_records, int16_records };
    enum class Target { light, preview, depth };
    /// What a surface's program is made for: nothing is computed that is not needed.
    struct Kind {
        Target target = Target::light;
        Source source = Source::given;
        bool plain = true; ///< no colours, numbers and pictures of its own
        bool edges = false, clipped = false, covered = false;
        bool by_vertex = false; ///< light; previews only
        auto operator<=>(const Kind&) const = default;
    };

    // Made once.
    std::map<Kind, Program> surface_programs;
    Program points, points_in_preview, ground, add, show, copy, preview_background;
    gl::Buffer frame_buffer;
    gl::VertexArray nothing; ///< for shaders that need no input
    std::optional<ShadowMap> key_map, sky_map;
    GLint largest = 0, most_samples = 0;
    bool is_software = false;

    // One picture.
    Scene scene;
    Camera camera;
    unsigned width = 0, height = 0, passes = 0, done = 0;
    bool is_preview = false; ///< what was drawn last
    Targets targets;
    PreviewTargets preview_targets;
    Vec3d centre = Vec3d::Zero();
    double scale = 1;
    Box box; ///< of the scene, in scene space
    bool shows_ground = false;
    double ground_level = 0, ground_light = 1;
    std::optional<Lights> lights;

    static std::string vertex_source(const Kind& kind) {
        std::string source;
        if (kind.source != Source::given)
            source = "#define RESTORED\n" + GpuRestorer::shader_source(kind.source == Source::float_records
                                                                           ? Precision::float32
                                                                           : Precision::int16);
        source += shaders::frame;
        if (kind.by_vertex) source += std::string(shaders::preview_lighting) + shaders::light_vertex;
        return source + shaders::surface_vertex;
    }
    const Program& surface_program(const Kind& kind) {
        Program& program = surface_programs[kind];
        if (program) return program;
        std::string head = kVersion;
        for (const auto& [is_so, name] :
             {std::pair(kind.plain, "PLAIN"), std::pair(kind.edges, "EDGES"), std::pair(kind.clipped, "CLIPPED"),
              std::pair(kind.covered, "COVERED"), std::pair(kind.by_vertex, "BY_VERTEX")})
            if (is_so) head += std::string("#define ") + name + "\n";
        const std::string before = head + shaders::frame + (kind.covered ? shaders::coverage : "");
        std::vector<Program::Stage> stages = {{GL_VERTEX_SHADER, head + vertex_source(kind)}};
        if (kind.target == Target::depth) {
            stages.push_back(
                {GL_FRAGMENT_SHADER,
                 before + (kind.covered ? "void main() { if (!is_covered()) discard; }\n" : "void main() {}\n")});
            return program = Program::link(stages);
        }
        if (kind.by_vertex) {
            stages.push_back({GL_FRAGMENT_SHADER, before + shaders::light_fragment});
            return program = Program::link(stages);
        }
        if (kind.edges) stages.push_back({GL_GEOMETRY_SHADER, head + shaders::frame + shaders::edges_geometry});
        stages.push_back(
            {GL_FRAGMENT_SHADER, before + lighting_source(kind.target == Target::preview) + shaders::surface_fragment});
        return program = Program::link(stages);
    }
    static const char* lighting_source(bool preview) { return preview ? shaders::preview_lighting : shaders::lighting; }
    static Source source_of(const Drawable::Content& drawable) {
        if (!drawable.restorer()) return Source::given;
        return drawable.restorer()->precision() == Precision::int16 ? Source::int16_records : Source::float_records;
    }

    Status start(const Scene& new_scene, const Camera& new_camera, unsigned w, unsigned h);
    Status make_targets(int samples);
    Status make_preview_targets();
    Error no_room() const;
    FrameBlock view_of(const Eigen::Vector2d& shift) const;
    FrameBlock frame(unsigned number) const;
    FrameBlock preview_frame() const;
    void use(const FrameBlock& block) const;
    void draw_depth(FrameBlock block, const LightView& view, const ShadowMap& map);
    void draw_objects(Target target);
    void draw_surface(const SceneObject& object, Target target);
    void draw_points(const SceneObject& object, Target target);
    void set_place(const Program& program, const SceneObject& object) const;
    void draw_ground();
    void draw_preview_background();
};

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
            {{GL_VERTEX_SHADER, kVersion + vertex}, {GL_FRAGMENT_SHADER, kVersion + fragment}}};
        return Program::link(stages);
    };
    const std::string frame = shaders::frame, lighting = shaders::lighting;
    const std::string points = frame + shaders::coverage;
    content->points = link(frame + shaders::points_vertex, points + lighting + shaders::points_fragment);
    content->points_in_preview =
        link(frame + shaders::points_vertex, points + shaders::preview_lighting + shaders::points_fragment);
    content->copy = link(shaders::cover_vertex, shaders::copy_fragment);
    content->preview_background = link(shaders::cover_vertex, shaders::preview_background);
    content->ground = link(frame + shaders::ground_vertex, frame + lighting + shaders::ground_fragment);
    content->add = link(shaders::cover_vertex, shaders::add_fragment);
    content->show = link(shaders::cover_vertex, shaders::show_fragment);
    content->nothing = gl::VertexArray::make();
    Result<gl::Buffer> buffer = gl::make_buffer(nullptr, sizeof(FrameBlock));
    if (!buffer) return buffer.error();
    content->frame_buffer = std::move(buffer).value();
    std::array<GLint, 2> viewport = {};
    glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport.data());
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &content->largest);
    content->largest = std::min({content->largest, viewport[0], viewport[1]});
    glGetIntegerv(GL_MAX_SAMPLES, &content->most_samples);
    content->is_software = is_software_renderer();
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
        0);
    return block;
}

void Renderer::Content::use(const FrameBlock& block) const {
    glBindBuffer(GL_UNIFORM_BUFFER, frame_buffer.name());
    glBufferData(GL_UNIFORM_BUFFER, sizeof block, &block, GL_STREAM_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, frame_buffer.name());
}

void Renderer::Content::draw_depth(FrameBlock block, const LightView& view, const ShadowMap& map) {
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

void Renderer::Content::set_place(const Program& program, const SceneObject& object) const {
    const Drawable::Content& drawable = object.drawable->content();
    const Vec3f offset = (drawable.origin - centre).cast<float>();
    glUniform3f(program.uniform("offset"), offset.x(), offset.y(), offset.z());
    glUniform1f(program.uniform("scale"), static_cast<float>(scale));
    const std::optional<ClipPlane>& clip = object.appearance.clip;
    glUniform1i(program.uniform("is_clipped"), clip.has_value());
    glUniform1f(program.uniform("coverage"), object.appearance.coverage);
    if (clip) {
        const Vec3d n = clip->normal.normalized();
        const double d = scale * (clip->offset / clip->normal.norm() - n.dot(centre));
        glUniform4f(program.uniform("clip"), float(n.x()), float(n.y()), float(n.z()), static_cast<float>(d));
    }
}

void Renderer::Content::draw_objects(Target target) {
    for (const SceneObject& object : scene.objects) {
        if (object.appearance.coverage == 0) continue;
        if (object.drawable->content().point_count)
            draw_points(object, target);
        else if (target != Target::depth || object.appearance.surface)
            draw_surface(object, target);
    }
}

void Renderer::Content::draw_surface(const SceneObject& object, Target target) {
    const Drawable::Content& drawable = object.drawable->content();
    const Appearance& look = object.appearance;
    const bool only_depth = target == Target::depth;
    const bool with_edges = !only_depth && (look.edges || !look.surface);
    const bool has_pictures = std::any_of(drawable.parts.begin(), drawable.parts.end(),
                                          [](const Drawable::Content::Part& part) { return bool(part.picture); });
    Kind kind;
    kind.target = target;
    kind.source = source_of(drawable);
    kind.plain = only_depth || !look.own_colors || !(drawable.has_colors || drawable.has_scalars || has_pictures);
    kind.edges = with_edges;
    kind.clipped = look.clip.has_value();
    kind.covered = look.coverage != 1;
    kind.by_vertex = target == Target::preview && !with_edges && !look.clip && !(look.own_colors && has_pictures) &&
                     double(drawable.triangle_count) * kFinePixels > double(width) * height;
    const Program& program = surface_program(kind);
    glUseProgram(program.name());
    set_place(program, object);
    if (look.clip) glEnable(GL_CLIP_DISTANCE0);
    glBindVertexArray(drawable.arrays.name());
    if (drawable.restorer()) drawable.restorer()->bind();
    if (only_depth) {
        glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * drawable.triangle_count), GL_UNSIGNED_INT, nullptr);
    } else {
        const bool own = look.own_colors;
        glUniform1f(program.uniform("gloss"), look.gloss);
        glUniform1i(program.uniform("has_colors"), own && drawable.has_colors);
        glUniform1i(program.uniform("has_scalars"), own && drawable.has_scalars);
        if (drawable.has_scalars) {
            glActiveTexture(GL_TEXTURE3);
            glBindTexture(GL_TEXTURE_1D, drawable.scalar_colors.name());
        }
        if (with_edges) {
            set_color(program, "edge_color", look.edge_color);
            glUniform1f(program.uniform("edge_width"), look.edge_width);
            glUniform1i(program.uniform("has_surface"), look.surface);
            glUniform1i(program.uniform("edge_flags"), 4);
            glActiveTexture(GL_TEXTURE4);
            glBindTexture(GL_TEXTURE_BUFFER, drawable.edge_texture.name());
        }
        for (const Drawable::Content::Part& part : drawable.parts) {
            const Vec3f& color = own && part.has_color ? part.color : look.color;
            set_color(program, "base_color", color);
            glUniform1i(program.uniform("has_picture"), own && part.picture);
            if (part.picture) {
                glActiveTexture(GL_TEXTURE2);
                glBindTexture(GL_TEXTURE_2D, part.picture.name());
            }
            glUniform1i(program.uniform("first_triangle"), static_cast<GLint>(part.first));
            glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * part.count), GL_UNSIGNED_INT,
                           reinterpret_cast<const void*>(std::size_t{12} * part.first));
        }
    }
    glDisable(GL_CLIP_DISTANCE0);
}

void Renderer::Content::draw_points(const SceneObject& object, Target target) {
    const Drawable::Content& drawable = object.drawable->content();
    const Appearance& look = object.appearance;
    const Program& program = target == Target::preview ? points_in_preview : points;
    glUseProgram(program.name());
    set_place(program, object);
    glUniform1f(program.uniform("radius"), static_cast<float>(drawable.radius * scale));
    glUniform1f(program.uniform("gloss"), look.gloss);
    set_color(program, "base_color", look.color);
    glUniform1i(program.uniform("has_colors"), look.own_colors && drawable.has_colors);
    glUniform1i(program.uniform("has_scalars"), look.own_colors && drawable.has_scalars);
    if (drawable.has_scalars) {
        glActiveTexture(GL_TEXTURE3);
        glBindTexture(GL_TEXTURE_1D, drawable.scalar_colors.name());
    }
    glBindVertexArray(drawable.arrays.name());
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(drawable.point_count));
}

void Renderer::Content::draw_ground() {
    const auto [right, forward] = tangents(up_vector(scene.up));
    const Vec3f a = (kGroundSide * right).cast<float>(), b = (kGroundSide * forward).cast<float>();
    glUseProgram(ground.name());
    glUniform3fv(ground.uniform("ground_right"), 1, a.data());
    glUniform3fv(ground.uniform("ground_forward"), 1, b.data());
    glBindVertexArray(nothing.name());
    glDisable(GL_DEPTH_TEST);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    glEnable(GL_DEPTH_TEST);
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

    const Targets& targets = c.targets;
    const Framebuffer& target = targets.samples > 1 ? targets.multisampled.framebuffer : targets.pass;
    const auto w = static_cast<GLsizei>(c.width), h = static_cast<GLsizei>(c.height);
    glBindFramebuffer(GL_FRAMEBUFFER, target.name());
    glViewport(0, 0, w, h);
    const std::array<float, 4> zero = {};
    glClearBufferfv(GL_COLOR, 0, zero.data());
    glClear(GL_DEPTH_BUFFER_BIT);
    c.use(block);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, c.key_map->depth.name());
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_2D, c.sky_map->depth.name());
    if (c.shows_ground) c.draw_ground();
    c.draw_objects(Content::Target::light);

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
    ++c.done;
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
    const Texture color = make_texture(GL_RGBA8, w, h);
    const Framebuffer framebuffer = make_framebuffer(&color, nullptr);
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
