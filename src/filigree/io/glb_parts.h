// What every GLB of ours has in common: a mesh as glTF's vertices and primitives, and its materials.
#pragma once

#include "filigree/io/glb_builder.h"
#include "filigree/io/material_file.h"
#include "filigree/mesh.h"

#include <span>
#include <string>
#include <vector>

namespace filigree {

/// Triangles of one material.
struct GlbPrimitive {
    Index material = kNoIndex;  ///< in mesh.materials.names
    std::vector<Index> indices; ///< output vertices, three a triangle (a point cloud: one a point)
};

/// What becomes one glTF mesh: an object of the mesh, or all of it.
struct GlbObject {
    std::string name; ///< empty where the mesh has no objects
    std::vector<GlbPrimitive> primitives;
};

/// A mesh cut to glTF's shape. Output vertices are the mesh's V vertices in their order, each with the attributes of
/// its first corner, and after them a copy for every further pair of UV and normal that corners of a vertex have.
struct GlbParts {
    std::size_t mesh_vertices = 0;   ///< V
    std::vector<Index> repeats = {}; ///< the mesh vertex of output vertex V + i
    /// Empty or one an output vertex; unit length (kept to the bit where they had it).
    std::vector<Vec3f> normals = {};
    std::vector<Vec2f> uvs = {}; ///< empty or one an output vertex; v points down, as in glTF
    std::vector<GlbObject> objects = {};
    bool is_points = false;             ///< no faces: primitives are points
    bool has_colors = false;            ///< the mesh has some a vertex
    std::vector<std::string> lost = {}; ///< what glTF cannot hold, a noun each ("groups")

    std::size_t vertex_count() const { return mesh_vertices + repeats.size(); }
    Index source(std::size_t vertex) const {
        return vertex < mesh_vertices ? static_cast<Index>(vertex) : repeats[vertex - mesh_vertices];
    }
    /// Values of mesh vertices as values of output vertices.
    template <class T>
    std::vector<T> spread(std::span<const T> of_mesh_vertices) const {
        std::vector<T> values(of_mesh_vertices.begin(), of_mesh_vertices.end());
        values.reserve(vertex_count());
        for (const Index v : repeats) values.push_back(of_mesh_vertices[v]);
        return values;
    }
};

struct GlbPartsOptions {
    bool normals = true; ///< the mesh's own, where it has some
    bool objects = true; ///< a GlbObject each; else all in one
};

/// Cuts polygons into triangles; primitives are in the order of objects and materials, faces within in the mesh's
/// order. The mesh has vertices. Cost O(size), and what triangulate takes. Errors: cancelled.
Result<GlbParts> make_glb_parts(const Mesh& mesh, const GlbPartsOptions& options, const RunContext& context);

/// Adds NORMAL, TEXCOORD_0, COLOR_0 and the scalars (as _name), and returns the primitives' "attributes" without
/// POSITION, which is the caller's.
GlbBuilder::Json add_glb_attributes(GlbBuilder& builder, const GlbParts& parts, const Mesh& mesh);

/// The materials of a mesh as read_materials finds them beside its path. Without a path no library is looked for: those
/// that are not embedded are grey, and a warning says so. None where no face has one.
MeshMaterials find_glb_materials(const Mesh& mesh, const std::filesystem::path& materials_beside);

/// Whether some faces have no material.
bool has_unlabelled_faces(const GlbParts& parts);
/// Adds a material for faces that have none; returns its number.
std::size_t add_glb_plain_material(GlbBuilder& builder, const GlbParts& parts);

/// Adds these materials with their pictures, and one more for faces without a material, where there are some (glTF's
/// own default is metal). Warns of pictures that cannot be embedded.
struct GlbMaterials {
    std::size_t first = 0;
    std::size_t none = 0; ///< for faces without a material
    std::vector<std::string> warnings = {};

    std::size_t number(Index material) const { return material == kNoIndex ? none : first + material; }
};
GlbMaterials add_glb_materials(GlbBuilder& builder, const GlbParts& parts, std::span<const MeshMaterial> materials);

/// Adds the indices of an object and returns its mesh for json["meshes"]: name and primitives with these attributes.
GlbBuilder::Json add_glb_mesh(GlbBuilder& builder, const GlbParts& parts, const GlbObject& object,
                              const GlbMaterials& materials, const GlbBuilder::Json& attributes);

/// What our own reader needs to give the mesh's vertices back, for "extras" of each of its meshes; null where vertices
/// are as they were and no meshes share them. All meshes with the same numbers here, in nodes without a transform of
/// their own but `translation`, are one mesh over the same V vertices:
///     "extras": {"filigree": {"vertices": V, "repeats": <accessor: uint32 SCALAR, source of vertex V + i>}}
/// ("repeats" is left out when there are none.) A material for faces without one has "extras": {"filigree": "none"}.
GlbBuilder::Json add_glb_repeats(GlbBuilder& builder, const GlbParts& parts);

/// All of it for a mesh that stands still: attributes, positions, and a node for each object at the mesh's origin (in
/// double). Returns the numbers of the nodes, which are in no scene yet.
std::vector<std::size_t> add_glb_nodes(GlbBuilder& builder, const GlbParts& parts, const Mesh& mesh,
                                       const GlbMaterials& materials);

} // namespace filigree
