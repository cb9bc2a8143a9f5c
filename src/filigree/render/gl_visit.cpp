#include "filigree/render/gl_visit.h"

namespace filigree::gl {

namespace {

constexpr GLuint kUnits = 6; // of textures, that the shaders read

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

GLuint bound_framebuffer() {
    GLint name = 0;
    glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &name);
    return static_cast<GLuint>(name);
}

} // namespace

Visit::Visit() : Visit(bound_framebuffer()) {}

Visit::Visit(GLuint leave_bound) : framebuffer_(leave_bound) { set_state(); }

Visit::~Visit() {
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_BLEND);
    glUseProgram(0);
    glBindVertexArray(0);
    for (const GLenum target : {GL_ARRAY_BUFFER, GL_UNIFORM_BUFFER, GL_SHADER_STORAGE_BUFFER}) glBindBuffer(target, 0);
    for (GLuint unit = kUnits; unit-- > 0;) {
        glActiveTexture(GL_TEXTURE0 + unit);
        for (const GLenum target : {GL_TEXTURE_1D, GL_TEXTURE_2D, GL_TEXTURE_BUFFER}) glBindTexture(target, 0);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
}

} // namespace filigree::gl
