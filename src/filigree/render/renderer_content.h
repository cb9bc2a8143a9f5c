// The renderer's inside: what is made once, and what belongs to one picture. renderer.cpp has the passes,
// renderer_objects.cpp draws what is in the scene. Only for this layer's own sources.
#pragma once

#include "filigree/render.h"
#include "filigree/render/drawable_content.h"
#include "filigree/render/lights.h"
#include "filigree/render/render_targets.h"

#include <compare>
#include <map>

namespace filigree {

inline constexpr const char* kGlslVersion = "#version 430 core\n";

/// The block that shaders/frame.glsl declares.
struct FrameBlock {
    float view_projection[16], key_matrix[16], sky_matrix[16];
    float eye[4], key_direction[4], sky_direction[4], fill_direction[4], up[4], viewport[4], strength[4], ground[4];
    float near[3][4], far[3][4], along[4];
};

struct Renderer::Content {
    enum class Source { given, records };
    /// seen: what lies at each pixel, to be lit later; light: lit as it is drawn.
    enum class Target { seen, light, preview, depth };
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
    std::map<Kind, gl::Program> surface_programs;
    gl::Program points, points_in_preview, lit, ground, ground_cover, add, show, copy, preview_background;
    gl::Buffer frame_buffer;
    gl::VertexArray nothing; ///< for shaders that need no input
    std::optional<gl::ShadowMap> key_map, sky_map;
    gl::Sampler ground_sampler; ///< of both maps, for the ground
    GLint largest = 0, most_samples = 0;
    bool is_software = false;

    // One picture.
    Scene scene;
    Camera camera;
    unsigned width = 0, height = 0, passes = 0, done = 0;
    bool is_preview = false; ///< what was drawn last
    gl::Targets targets;
    gl::PreviewTargets preview_targets;
    Vec3d centre = Vec3d::Zero();
    double scale = 1;
    Box box; ///< of the scene, in scene space
    bool shows_ground = false;
    double ground_level = 0, ground_light = 1;
    std::optional<Lights> lights;

    Status start(const Scene& new_scene, const Camera& new_camera, unsigned w, unsigned h);
    Status make_targets(int samples);
    Status make_preview_targets();
    Error no_room() const;
    FrameBlock view_of(const Eigen::Vector2d& shift) const;
    FrameBlock frame(unsigned number) const;
    FrameBlock preview_frame() const;
    void use(const FrameBlock& block) const;
    void draw_depth(FrameBlock block, const LightView& view, const gl::ShadowMap& map);
    void draw_preview_background();

    // renderer_objects.cpp
    void draw_objects(Target target);
    void light_seen();
    void draw_ground();
    void cover_ground();
    /// Whether a pass keeps what it sees of the object, and lights it later.
    bool is_lit_later(const SceneObject& object) const;
    bool hides_back_faces(const SceneObject& object) const;
    static std::string vertex_source(const Kind& kind);
    static Source source_of(const Drawable::Content& drawable);
    const gl::Program& surface_program(const Kind& kind);
    void draw_surface(const SceneObject& object, Target target);
    void draw_points(const SceneObject& object, Target target);
    void set_place(const gl::Program& program, const SceneObject& object) const;
};

} // namespace filigree
