// The levels of a model as GLB, which programs show by the model's size on the screen.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/hierarchy/model.h"

#include <filesystem>
#include <string>
#include <vector>

namespace filigree {

/// Static levels as nodes that MSFT_lod names, finest first. materials_beside: where material libraries are looked for,
/// the mesh's or model's path. Returns warnings (what glTF cannot hold).
/// Errors: unwritable, unsupported, out_of_memory, cancelled.
Result<std::vector<std::string>> write_levels_glb(const Model& model, const std::filesystem::path& path,
                                                  const std::filesystem::path& materials_beside,
                                                  const RunContext& context);

} // namespace filigree
