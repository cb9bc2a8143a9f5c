// Pictures without a window: an OpenGL context and a renderer in it.
#pragma once

#include "filigree/render.h"

namespace filigree {

/// One at a time; its drawables are made after it and go before it, all in one thread.
class HeadlessRenderer {
public:
    /// Errors: as of HeadlessContext::create and Renderer::create.
    static Result<HeadlessRenderer> create();

    /// Errors: as of Renderer::picture.
    Result<Picture> picture(const Scene& scene, const Camera& camera, const PictureOptions& options,
                            const RunContext& context) {
        return renderer_.picture(scene, camera, options, context);
    }
    /// What draws, as OpenGL names itself.
    const std::string& name() const { return context_.renderer_name(); }

private:
    HeadlessRenderer(HeadlessContext context, Renderer renderer);

    HeadlessContext context_;
    Renderer renderer_;
};

} // namespace filigree
