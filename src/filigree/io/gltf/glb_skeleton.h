// The nodes of a glTF and how they move, put into another file beside what is drawn there.
#pragma once

#include "filigree/io/gltf/glb_builder.h"
#include "filigree/io/gltf/gltf_scene.h"

#include <filesystem>
#include <memory>

namespace filigree {

class GlbSkeleton {
public:
    using Json = GlbBuilder::Json;
    /// Errors: those of GltfScene::read.
    static Result<GlbSkeleton> read(const std::filesystem::path& path, const RunContext& context);

    /// Adds all nodes without their meshes and skins to `nodes`, those without a parent to `roots`, and the cameras
    /// that they hold to the document.
    void add_nodes(GlbBuilder& builder, Json& nodes, Json& roots);
    /// Adds what the animation of this name (of the n-th without one: "clip n") does to the nodes, from its first key
    /// on. animation: null, or one that goes on.
    void add_channels(GlbBuilder& builder, const std::string& name, Json& animation) const;

private:
    std::shared_ptr<const gltf::Scene> scene_;
    std::size_t first_node_ = 0; ///< in the other file
};

} // namespace filigree
