// The one file of a live page: bodies as they are simulated, models and obstacles as they are drawn (docs/live.md).
#pragma once

#include "filigree/physics/step/live_world.h"
#include "filigree/scene/world_setup.h"

#include <functional>
#include <optional>
#include <string>

namespace filigree {

struct PageFile {
    std::string bytes;
    std::size_t physics_bytes = 0; ///< of them: of what moves (write_live_world)
};

/// Another model of a body to draw in place of its own, with materials; unset: its own.
using DressBody = std::function<std::optional<Model>(const ReadyBody&)>;

/// What the page simulates.
LiveWorld live_world(const SceneFile& scene, const ReadyScene& ready);
/// "FLGPAGE1", the length of a JSON text, the text, then the parts that it names by their place. Bodies that are alike
/// have one model. Errors: of write_live_world. Cost O(bytes).
Result<PageFile> write_page_file(const SceneFile& scene, const ReadyScene& ready, const DressBody& dress = {});

} // namespace filigree
