// glTF 2.0 scenes from .gltf and .glb files: meshes in their pose, and their animations, evaluated.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/result.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

struct GltfAnimation {
    std::string name;     ///< as the file has it; empty where it has none
    double first_key = 0; ///< seconds
    double last_key = 0;
};

/// A file's default scene as one mesh: the triangles of every node that has a mesh, in the order of a walk from the
/// scene's roots. Vertices are the file's, in its order and not welded; primitives of one node that share their
/// attributes share their vertices. A mesh that several nodes use comes once a node.
///
/// Points and lines are left out, with a warning. Objects are the names of the nodes (of the mesh where a node has
/// none) when there is more than one. Attributes: NORMAL, TEXCOORD_0 (v turned up: ours is 1 - v), COLOR_0, and single
/// floats under names of their own (_confidence) as scalars. Materials are embedded, with their pictures' bytes.
///
/// Nothing in the file is trusted. Buffers and pictures are read from the file's own folder and below it only; other
/// places are an error for a buffer and a warning for a picture.
class GltfScene {
public:
    /// Errors: not_found, bad_file ("x.gltf: accessors[3].count: ..."), unsupported (a required extension that we do
    /// not know: Draco, meshopt), out_of_memory, cancelled. Cost: one pass; memory a small multiple of the file.
    static Result<GltfScene> read(const std::filesystem::path& path, const RunContext& context);
    /// From bytes, which the scene keeps; `name` stands in messages, and its folder is where other files are looked for
    /// (none: "" as folder).
    static Result<GltfScene> read(std::string bytes, const std::string& name, const RunContext& context);
    /// The same from bytes that outlive the scene, and are not copied.
    static Result<GltfScene> read_view(std::string_view bytes, const std::string& name, const RunContext& context);
    GltfScene(GltfScene&&) noexcept;
    GltfScene& operator=(GltfScene&&) noexcept;
    ~GltfScene();

    /// In the pose that the nodes' own transforms and the meshes' own morph weights give: what a viewer shows before it
    /// plays anything. Skins are applied.
    const Mesh& mesh() const;
    const std::vector<std::string>& warnings() const;
    const std::vector<GltfAnimation>& animations() const;
    std::size_t joint_count() const; ///< of its skins together
    std::size_t morph_count() const; ///< morph targets of the mesh that has most
    /// Names of the files that buffers and pictures lie in, as the document has them.
    const std::vector<std::string>& files_beside() const;

    /// What our own exports say about themselves: asset.extras.filigree as JSON text; empty where there is none.
    const std::string& export_report() const;

    /// Positions of mesh()'s vertices, relative to its origin, when an animation has played to `seconds` (held at its
    /// first and last key). Computed in double. Same bytes for any thread count. Cost O(V * influences + nodes).
    Status positions(std::size_t animation, double seconds, std::span<Vec3f> out, const RunContext& context) const;
    /// The mesh then: positions, and normals turned along by the cofactor of each vertex's transform.
    Result<Mesh> mesh_at(std::size_t animation, double seconds, const RunContext& context) const;

private:
    struct Scene;
    explicit GltfScene(std::unique_ptr<Scene> scene);
    std::unique_ptr<Scene> scene_;
};

/// Whether bytes are of GLB, or JSON that looks like glTF.
bool is_gltf(std::string_view bytes);

} // namespace filigree
