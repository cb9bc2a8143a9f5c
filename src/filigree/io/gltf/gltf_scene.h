// A glTF scene as arrays: what the reader leaves and the evaluation moves. All of it is checked.
#pragma once

#include "filigree/io/gltf/gltf.h"
#include "filigree/io/gltf/gltf_document.h"

#include <functional>
#include <memory>
#include <set>
#include <span>

namespace filigree::gltf {

/// x -> linear x + translation, in double.
struct Affine {
    Mat3d linear = Mat3d::Identity();
    Vec3d translation = Vec3d::Zero();

    Vec3d operator*(const Vec3d& x) const { return linear * x + translation; }
    Affine operator*(const Affine& inner) const { return {linear * inner.linear, *this * inner.translation}; }
    bool operator==(const Affine& other) const = default;
    bool is_identity() const { return *this == Affine(); }
};

struct Node {
    std::string name;
    std::size_t parent = 0; ///< the node itself: a root
    std::vector<std::size_t> children;
    std::optional<std::size_t> mesh, skin;
    Vec3d translation = Vec3d::Zero(), scale = Vec3d::Ones();
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity(); ///< of unit length
    std::optional<Affine> matrix;                                 ///< instead of the three
    std::vector<double> weights;                                  ///< of morph targets: its own, else its mesh's
};

struct Skin {
    std::vector<std::size_t> joints;
    std::vector<Affine> inverse_binds; ///< one a joint
    std::vector<bool> damaged;         ///< joints whose matrix is none; empty: no joint
};

/// What moves a vertex: influences first[v] .. first[v + 1] - 1, those of weight 0 left out.
struct Influences {
    std::vector<Index> first, joints;
    std::vector<double> weights;
    std::size_t joints_used = 0; ///< 1 + the largest

    bool empty() const { return first.empty(); }
};

struct MorphTarget {
    std::optional<Accessor> positions, normals; ///< differences from the vertices
};

/// Which UVs a material's picture is laid by, and how they are moved for it (KHR_texture_transform).
struct UvUse {
    std::size_t set = 0; ///< of TEXCOORD_0, TEXCOORD_1, ...
    double offset[2] = {0, 0}, scale[2] = {1, 1};
    double rotation = 0; ///< radians

    bool operator==(const UvUse& other) const = default;
    /// Ours (v up) of one as the file has it (v down).
    Vec2f apply(const Vec2f& uv) const;
};

/// What is told once of a file's attributes, by their names.
struct AttributeNotes {
    std::set<std::string> left_out;      ///< not read by us
    std::set<std::string> unsuited;      ///< left out: numbers of a kind that glTF does not have for them
    std::set<std::string> as_normalized; ///< integers without "normalized", taken as if they had it
    std::set<std::string> as_they_are;   ///< the same, where none is beyond 1
    std::set<std::string> whole_numbers; ///< joints whose numbers are not of the kind that glTF has for them
};

/// Vertices as attributes give them; primitives and nodes share them.
struct Geometry {
    std::vector<Vec3f> positions, normals;
    std::map<std::size_t, std::vector<Vec2f>> uvs; ///< by the number of their set, as the file has them
    std::vector<Vec4f> colors;
    bool colors_have_alpha = false;
    std::vector<VertexScalar> scalars;
    Influences influences;
    std::vector<MorphTarget> targets;
    /// Our own files: the first `kept` vertices are the mesh's, vertex kept + i is another corner of repeats[i].
    std::size_t kept = 0;
    std::vector<Index> repeats;
    bool is_ours = false; ///< so nodes that share it may be one mesh

    std::size_t vertex_count() const { return positions.size(); }
    Index source(std::size_t vertex) const {
        return vertex < kept ? static_cast<Index>(vertex) : repeats[vertex - kept];
    }
};

/// The vertices of one node (or of several that are one mesh in our own files) in the mesh.
struct Block {
    std::size_t node = 0, geometry = 0;
    bool skinned = false;         ///< by the node's skin; its transform does not count then
    bool mirrored = false;        ///< its node turns it inside out, so faces were turned over
    std::size_t first_vertex = 0; ///< geometry.kept of them
    std::size_t first_normal = 0; ///< in the values of mesh.normals: one a vertex of the geometry, where it has them
};

enum class Path { translation, rotation, scale, weights };
enum class Interpolation { step, linear, cubic };

struct Sampler {
    Accessor times, values;
    Interpolation interpolation = Interpolation::linear;
    std::size_t width = 0; ///< numbers a key
};

struct Channel {
    std::size_t node = 0, sampler = 0;
    Path path = Path::translation;
};

struct Animation {
    GltfAnimation summary;
    std::vector<Sampler> samplers;
    std::vector<Channel> channels;
};

struct Scene {
    std::string name;  ///< the file's, for messages
    std::string owned; ///< its bytes, unless they are kept elsewhere
    std::unique_ptr<Document> document;
    std::vector<Node> nodes;
    std::vector<std::size_t> order; ///< all nodes, parents first
    std::vector<Skin> skins;
    std::vector<Geometry> geometries;
    std::vector<Block> blocks;
    std::vector<Animation> animations;
    std::vector<GltfAnimation> summaries; ///< of the animations
    Mesh mesh;
    std::vector<std::string> warnings, files_beside;
    std::string export_report;
};

/// All of a file, into `scene`, which has its name. The bytes must stay. Errors: those of GltfScene::read_view.
Status read_scene(std::string_view bytes, Scene& scene, const RunContext& context);

/// Reads all of it but the places of the mesh's vertices. Throws Damage.
void read_nodes(Scene& scene);
void read_skins(Scene& scene);
void read_animations(Scene& scene);
/// A primitive's attributes and morph targets. uv_sets: the numbers of the sets of UVs to read.
Geometry read_geometry(Document& document, const Value& primitive, const std::set<std::size_t>& uv_sets,
                       std::vector<std::string>& warnings, AttributeNotes& notes);
/// What is done with integers that lack "normalized" where glTF has only normalized ones.
enum class Unflagged { none, as_normalized, as_they_are };
/// Marks such accessors as normalized when one of their numbers is beyond 1: nobody means a colour or a weight of 255.
Unflagged mend_unflagged(std::span<Accessor* const> accessors);
/// Geometries, blocks, and the mesh's faces and attributes.
void read_meshes(Scene& scene, const RunContext& context);
/// The document's materials, and for each its number in the mesh (kNoIndex for our own stand-in for none) and how its
/// picture is laid.
struct Materials {
    std::vector<MeshMaterial> materials;
    std::vector<Index> number;
    std::vector<UvUse> uvs;
};
Materials read_materials(Document& document, std::vector<std::string>& warnings);

/// Where nodes are: with an animation at a moment, else as they are. Weights and skins are of the scene's blocks only,
/// as a file may have far more nodes that nothing shows.
struct ScenePose {
    std::vector<Affine> world;                ///< of nodes
    std::vector<std::vector<double>> weights; ///< of morph targets, by node
    std::vector<std::vector<Affine>> joints;  ///< by skin: its joints' matrices with the inverse binds
};
ScenePose rest_pose(const Scene& scene);
ScenePose pose_at(const Scene& scene, const Animation& animation, double seconds);

/// Hands out the world positions of the mesh's vertices, a piece at a time, from many threads at once. These two stop
/// between blocks when the work is cancelled, which the caller must look at.
void place_vertices(const Scene& scene, const ScenePose& pose, const RunContext& context,
                    const std::function<void(std::size_t first_vertex, std::span<const Vec3d> positions)>& take);
/// Values of mesh.normals, turned along.
std::vector<Vec3f> turned_normals(const Scene& scene, const ScenePose& pose, const RunContext& context);

} // namespace filigree::gltf
