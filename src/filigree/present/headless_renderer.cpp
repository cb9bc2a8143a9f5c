#include "filigree/present/headless_renderer.h"

namespace filigree {

HeadlessRenderer::HeadlessRenderer(HeadlessContext context, Renderer renderer)
    : context_(std::move(context)), renderer_(std::move(renderer)) {}

Result<HeadlessRenderer> HeadlessRenderer::create() {
    Result<HeadlessContext> context = HeadlessContext::create();
    if (!context) return context.error();
    Result<Renderer> renderer = Renderer::create();
    if (!renderer) return renderer.error();
    return HeadlessRenderer(std::move(*context), std::move(*renderer));
}

} // namespace filigree
