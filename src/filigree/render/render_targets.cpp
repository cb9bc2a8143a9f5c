#include "filigree/render/render_targets.h"

namespace filigree::gl {

namespace {

bool is_complete() { return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE; }

} // namespace

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

ShadowMap::ShadowMap(int side) : depth(make_texture(GL_DEPTH_COMPONENT32F, side, side)), size(side) {
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    framebuffer = make_framebuffer(nullptr, &depth);
}

Sampler make_depth_sampler() {
    Sampler sampler = Sampler::make();
    const auto set = [&](GLenum what, GLenum to) { glSamplerParameteri(sampler.name(), what, static_cast<GLint>(to)); };
    set(GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    set(GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    set(GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    set(GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    set(GL_TEXTURE_COMPARE_MODE, GL_NONE);
    return sampler;
}

Multisampled::Multisampled(int samples, GLenum color_format, GLenum depth_format, GLsizei width, GLsizei height)
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

void Multisampled::resolve_to(const Framebuffer& to, GLsizei width, GLsizei height) const {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer.name());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to.name());
    glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

bool Targets::make(unsigned w, unsigned h, int samples_a_pixel) {
    const auto x = static_cast<GLsizei>(w), y = static_cast<GLsizei>(h);
    color = make_texture(GL_RGBA16F, x, y);
    depth = make_texture(GL_DEPTH_COMPONENT32F, x, y);
    sum = make_texture(GL_RGBA32F, x, y);
    pass = make_framebuffer(&color, &depth);
    total = make_framebuffer(&sum, nullptr);
    bool complete = is_complete();
    seen = samples_a_pixel > 1 ? Texture() : make_texture(GL_RGBA32UI, x, y);
    seeing = samples_a_pixel > 1 ? Framebuffer() : make_framebuffer(&seen, &depth);
    complete = complete && (samples_a_pixel > 1 || is_complete());
    adding = samples_a_pixel > 1 ? Framebuffer() : make_framebuffer(&sum, &depth);
    ground = make_texture(GL_R16F, (x + 1) / 2, (y + 1) / 2);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
        glTexParameteri(GL_TEXTURE_2D, filter, GL_LINEAR);
    for (const GLenum side : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
        glTexParameteri(GL_TEXTURE_2D, side, GL_CLAMP_TO_EDGE);
    ground_only = make_framebuffer(&ground, nullptr);
    complete = complete && is_complete();
    multisampled =
        samples_a_pixel > 1 ? Multisampled(samples_a_pixel, GL_RGBA16F, GL_DEPTH_COMPONENT32F, x, y) : Multisampled();
    complete = complete && (samples_a_pixel <= 1 || is_complete());
    width = w;
    height = h;
    samples = samples_a_pixel;
    return complete;
}

bool PreviewTargets::make(unsigned w, unsigned h, int samples) {
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

} // namespace filigree::gl
