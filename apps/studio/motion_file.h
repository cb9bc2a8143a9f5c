// Animations of other programs as they are read: glTF, point caches, numbered meshes.
#pragma once

#include "document.h"

#include <optional>

namespace filigree::studio {

/// Whether a file holds positions alone, of a mesh that another file has: .pc2, .mdd.
bool is_point_cache(const std::string& path);
bool is_gltf_file(const std::string& path); ///< by its name
/// Whether a mesh is one of several that are numbered, in its folder.
bool is_numbered(const std::string& path);

/// A whole new state from a glTF, with its clip of that number where it has clips; settings as at the start.
/// frames_per_second: that are taken; unset: 30. Errors: those of GltfScene::read and strip; unsuitable (the frames
/// take more memory than there should be).
Result<State> gltf_state(const std::string& path, std::size_t clip, std::optional<double> frames_per_second,
                         const RunContext& context);
/// The same from numbered meshes. The frame from which the others are stretched least is the mesh.
Result<State> numbered_state(const std::string& path, double frames_per_second, const RunContext& context);
/// A point cache of the source's mesh. Adds a sentence to `warnings` where it seems to lie on its face.
Result<std::shared_ptr<const Recording>> cache_recording(const std::string& path, const State& state,
                                                         double frames_per_second, std::vector<std::string>& warnings,
                                                         const RunContext& context);

} // namespace filigree::studio
