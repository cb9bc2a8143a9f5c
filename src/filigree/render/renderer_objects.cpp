// Surfaces, points and the ground, each by a program made for what it needs.
#include "filigree/render.h"
#include "filigree/render/renderer_content.h"
#include "filigree/render/shaders.h"

#include <algorithm>

namespace filigree {

namespace {

using gl::Program;

constexpr double kFinePixels = 150; // of the picture for each triangle: no more, and vertices are lit, not pixels

void set_color(const Program& program, const char* name, const Vec3f& srgb) {
    glUniform3fv(program.uniform(name), 1, srgb_to_linear(srgb).eval().data());
}

/// As in shaders/seen.glsl.
GLuint look_of(const Vec3f& srgb, float gloss) {
    const Eigen::Array3f root = 511 * srgb_to_linear(srgb).array().max(0).min(1).sqrt() + 0.5f;
    return GLuint(root[0]) | GLuint(root[1]) << 9 | GLuint(root[2]) << 18 | GLuint(gloss * 31 + 0.5f) << 27;
}

} // namespace

std::string Renderer::Content::vertex_source(const Kind& kind) {
    std::string source;
    if (kind.source != Source::given) source = "#define RESTORED\n" + GpuRestorer::shader_source();
    source += shaders::frame;
    if (kind.by_vertex) source += std::string(shaders::preview_lighting) + shaders::light_vertex;
    return source + shaders::surface_vertex;
}

const Program& Renderer::Content::surface_program(const Kind& kind) {
    Program& program = surface_programs[kind];
    if (program) return program;
    std::string head = kGlslVersion;
    for (const auto& [is_so, name] :
         {std::pair(kind.plain, "PLAIN"), std::pair(kind.edges, "EDGES"), std::pair(kind.clipped, "CLIPPED"),
          std::pair(kind.covered, "COVERED"), std::pair(kind.by_vertex, "BY_VERTEX")})
        if (is_so) head += std::string("#define ") + name + "\n";
    const std::string before = head + shaders::frame + (kind.covered ? shaders::coverage : "");
    std::vector<Program::Stage> stages = {{GL_VERTEX_SHADER, head + vertex_source(kind)}};
    if (kind.target == Target::depth) {
        stages.push_back({GL_FRAGMENT_SHADER, before + (kind.covered ? "void main() { if (!is_covered()) discard; }\n"
                                                                     : "void main() {}\n")});
        return program = Program::link(stages);
    }
    if (kind.by_vertex) {
        stages.push_back({GL_FRAGMENT_SHADER, before + shaders::light_fragment});
        return program = Program::link(stages);
    }
    if (kind.edges) stages.push_back({GL_GEOMETRY_SHADER, head + shaders::frame + shaders::edges_geometry});
    if (kind.target == Target::seen) {
        const bool look_given = kind.plain && !kind.clipped && !kind.covered;
        stages.push_back({GL_FRAGMENT_SHADER, head + "#define SEEN\n" + (look_given ? "#define LOOK_GIVEN\n" : "") +
                                                  shaders::frame + (kind.covered ? shaders::coverage : "") +
                                                  shaders::seen + shaders::surface_fragment});
        return program = Program::link(stages);
    }
    const char* lighting = kind.target == Target::preview ? shaders::preview_lighting : shaders::lighting;
    stages.push_back({GL_FRAGMENT_SHADER, before + lighting + shaders::surface_fragment});
    return program = Program::link(stages);
}

Renderer::Content::Source Renderer::Content::source_of(const Drawable::Content& drawable) {
    return drawable.restorer() ? Source::records : Source::given;
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
        if (target == Target::seen && !is_lit_later(object)) continue;
        if (target == Target::light && is_lit_later(object)) continue;
        if (object.drawable->content().point_count)
            draw_points(object, target);
        else if (target != Target::depth || object.appearance.surface)
            draw_surface(object, target);
    }
}

/// Lines are drawn over the light, and balls find their depth as they are lit.
bool Renderer::Content::is_lit_later(const SceneObject& object) const {
    const Appearance& look = object.appearance;
    return targets.samples <= 1 && !object.drawable->content().point_count && look.surface && !look.edges;
}

/// Half of a solid's triangles need not be drawn: from outside, back faces lie behind front faces. Edges alone hide
/// nothing.
bool Renderer::Content::hides_back_faces(const SceneObject& object) const {
    const Drawable::Content& drawable = object.drawable->content();
    const bool is_inside = camera.field_of_view_deg > 0 && (camera.eye.array() >= drawable.box.min.array()).all() &&
                           (camera.eye.array() <= drawable.box.max.array()).all();
    return object.appearance.surface && drawable.is_solid && !drawable.is_turned_out && !object.appearance.clip &&
           !is_inside;
}

/// Behind all that was seen, and in front of what was cleared.
void Renderer::Content::light_seen() {
    glUseProgram(lit.name());
    glActiveTexture(GL_TEXTURE5);
    glBindTexture(GL_TEXTURE_2D, targets.seen.name());
    glBindVertexArray(nothing.name());
    glDepthRange(1, 1);
    glDepthFunc(GL_GREATER);
    glDepthMask(GL_FALSE);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_LESS);
    glDepthRange(0, 1);
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
    if (hides_back_faces(object) && !has_pictures) glEnable(GL_CULL_FACE);
    if (only_depth) {
        const std::size_t fewer = drawable.shadow_triangle_count;
        if (fewer > 0) glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, drawable.shadow_triangles.name());
        glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * (fewer > 0 ? fewer : drawable.triangle_count)),
                       GL_UNSIGNED_INT, nullptr);
        if (fewer > 0) glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, drawable.triangles.name());
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
            glUniform1ui(program.uniform("look"), look_of(color, look.gloss));
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
    glDisable(GL_CULL_FACE);
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

/// At half the size, also where something will stand in front of it.
void Renderer::Content::draw_ground() {
    const auto [right, forward] = tangents(up_vector(scene.up));
    const Vec3f a = (kGroundSide * right).cast<float>(), b = (kGroundSide * forward).cast<float>();
    glBindFramebuffer(GL_FRAMEBUFFER, targets.ground_only.name());
    glViewport(0, 0, static_cast<GLsizei>((width + 1) / 2), static_cast<GLsizei>((height + 1) / 2));
    const std::array<float, 4> none = {};
    glClearBufferfv(GL_COLOR, 0, none.data());
    glUseProgram(ground.name());
    glUniform3fv(ground.uniform("ground_right"), 1, a.data());
    glUniform3fv(ground.uniform("ground_forward"), 1, b.data());
    glBindVertexArray(nothing.name());
    for (const GLuint unit : {0u, 1u}) glBindSampler(unit, ground_sampler.name());
    glDisable(GL_DEPTH_TEST);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    glEnable(GL_DEPTH_TEST);
    for (const GLuint unit : {0u, 1u}) glBindSampler(unit, 0);
}

/// Last, and behind everything.
void Renderer::Content::cover_ground() {
    glUseProgram(ground_cover.name());
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, targets.ground.name());
    glBindVertexArray(nothing.name());
    glDepthRange(1, 1);
    glDepthFunc(GL_LEQUAL);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDepthFunc(GL_LESS);
    glDepthRange(0, 1);
}

} // namespace filigree
