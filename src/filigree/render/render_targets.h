// What pictures are drawn into: textures with a depth, one or several samples a pixel, and depth maps for shadows. Only
// for this layer's own sources; OpenGL has to be current.
#pragma once

#include "filigree/render/gl_objects.h"

namespace filigree::gl {

Texture make_texture(GLenum format, GLsizei width, GLsizei height);
/// Null: without that.
Framebuffer make_framebuffer(const Texture* color, const Texture* depth);

/// A depth map that light is compared with.
struct ShadowMap {
    Texture depth;
    Framebuffer framebuffer;
    int size = 0;

    explicit ShadowMap(int side);
};

/// Gives a shadow map's depth at the nearest place, without a comparison.
Sampler make_depth_sampler();

/// A colour and a depth of several samples a pixel.
struct Multisampled {
    Renderbuffer color, depth;
    Framebuffer framebuffer;

    Multisampled() = default;
    Multisampled(int samples, GLenum color_format, GLenum depth_format, GLsizei width, GLsizei height);
    void resolve_to(const Framebuffer& to, GLsizei width, GLsizei height) const;
};

/// Where passes are drawn and added up.
struct Targets {
    Texture color, depth, sum;
    Texture seen;   ///< shaders/seen.glsl; none with several samples a pixel
    Texture ground; ///< the share of its light that does not reach it, at half the size
    Framebuffer pass, total, seeing, ground_only;
    Framebuffer adding; ///< the total, with the pass's depth
    Multisampled multisampled;
    unsigned width = 0, height = 0;
    int samples = 0;

    /// Whether there was room.
    bool make(unsigned w, unsigned h, int samples_a_pixel);
};

/// Where a preview is drawn: sRGB, as it is shown.
struct PreviewTargets {
    Texture color, depth;
    Framebuffer framebuffer;
    Multisampled multisampled;
    unsigned width = 0, height = 0;

    bool make(unsigned w, unsigned h, int samples);
};

} // namespace filigree::gl
