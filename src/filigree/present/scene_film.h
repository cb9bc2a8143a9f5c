// Films of scenes: all bodies restored on the GPU, obstacles and the ground, from a camera that follows.
#pragma once

#include "filigree/present/headless_renderer.h"
#include "filigree/render.h"
#include "filigree/scene/recording.h"
#include "filigree/scene/world_setup.h"

namespace filigree {

/// Draws every recorded frame into every writer, which then is to be finished. Progress: "looking ahead" and "filming".
/// Returns what could not be loaded of the meshes' materials, as sentences. Errors: as of Drawable, Renderer::picture
/// and FilmWriter::add, cancelled.
Result<std::vector<std::string>> film_scene(const SceneFile& scene, const ReadyScene& ready, const Recording& recording,
                                            HeadlessRenderer& renderer, std::span<FilmWriter> writers,
                                            const RunContext& context);

} // namespace filigree
