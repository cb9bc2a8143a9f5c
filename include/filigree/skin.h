// Skins: a mesh, the joints that carry its vertices, and the clips that move the joints.
//
//     const SkinnedMesh skin = read_skin("fox.glb").value();
//     std::vector<Eigen::Affine3d> transforms(skin.joints.size());
//     skin.transforms(0, 0.5, transforms);                       // clip 0, half a second after its start
//     skin_positions(skin, transforms, positions);               // as a viewer shows it
//
// Next: flesh.h makes soft matter of it.
#pragma once

#include "filigree/context.h"
#include "filigree/file.h"
#include "filigree/mesh.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace filigree {

struct SkinJoint {
    std::string name;
    Index parent = kNoIndex;      ///< the joint above it; kNoIndex: none
    Vec3d place = Vec3d::Zero();  ///< in the bind pose, relative to the mesh's origin, model units
    bool is_node_of_mesh = false; ///< no joint of a skin: a node that carries a mesh of its own
};

/// The joints of vertex v are joints[first[v]] .. joints[first[v + 1] - 1]; their weights are above 0 and sum to 1.
struct SkinWeights {
    std::vector<Index> first = {0}, joints;
    std::vector<float> weights;
};

struct SkinClip {
    std::string name;   ///< as the file has it, or "clip 1" and so on
    double seconds = 0; ///< from its first key to its last
};

/// A morph target of a skin: what it adds to the bind pose, before the joints carry it.
struct SkinMorph {
    std::string name;
    double weight = 0;                     ///< so much of it is in SkinnedMesh::mesh
    std::vector<Index> vertices;           ///< that it moves, ascending
    std::vector<Vec3f> positions, normals; ///< what it adds to each; normals: empty where the file has none
};
/// The weights of all morph targets of a skin, seconds after the start of a clip.
using MorphWeights = std::function<void(double seconds, std::span<double> weights)>;

struct SkinnedMesh {
    Mesh mesh; ///< in the bind pose, upright as the file shows it
    std::vector<SkinJoint> joints;
    SkinWeights weights; ///< of the mesh's vertices
    std::vector<SkinClip> clips;
    /// Where a clip has the joints: maps the bind pose to the world, both relative to the mesh's origin; one a joint.
    /// seconds: from the clip's start; held at its ends. Called from several threads.
    std::function<void(std::size_t clip, double seconds, std::span<Eigen::Affine3d> transforms)> transforms;
    std::vector<std::string> warnings; ///< sentences: what is left out
    /// Whether joints are bones. Else they are patches of a surface that moves by itself (skin_of_surface, flesh.h).
    bool has_bones = true;
    /// Where a clip has the vertices, one each, relative to the mesh's origin, if the joints only come near to it.
    /// Null: skin_positions says it.
    std::function<Status(std::size_t clip, double seconds, std::span<Vec3f> positions)> surface = {};
    /// Of the file; neither transforms nor surface know them.
    std::vector<SkinMorph> morphs = {};
    std::vector<MorphWeights> morph_weights = {}; ///< of each clip; empty: there are no morph targets
};

/// Reads an animated glTF. Vertices are those of read_mesh, in its order. Skins that share joints become one. Meshes
/// without a skin get their node as a joint. Morph targets are as at rest in the mesh, and beside it. Errors: those of
/// read_mesh; unsuitable (no skin; no animation; joints of scale zero).
Result<SkinnedMesh> read_skin(const std::filesystem::path& path, const RunContext& context = RunContext());

/// Where a clip has the vertices, relative to the mesh's origin: SkinnedMesh::surface, or skin_positions. Errors: those
/// of SkinnedMesh::surface.
Status clip_positions(const SkinnedMesh& skin, std::size_t clip, double seconds, std::span<Vec3f> positions,
                      const RunContext& context = RunContext());

/// Linear blend skinning: where the vertices are, relative to the mesh's origin. transforms: one a joint. positions:
/// one a vertex. Cost O(weights).
void skin_positions(const SkinnedMesh& skin, std::span<const Eigen::Affine3d> transforms, std::span<Vec3f> positions,
                    const RunContext& context = RunContext());

/// What the joints' transforms are together at a vertex.
Eigen::Affine3d blended_transform(const SkinnedMesh& skin, std::span<const Eigen::Affine3d> transforms, Index vertex);

/// Poses of a model's driver, with a name.
struct NamedPoses {
    std::string name;
    FrameSource<Pose> poses;
    MorphWeights morph_weights = {}; ///< null: morph targets stay
};

/// As write_skin_glb of one animation (file.h), with several: each becomes an animation of its name on the same joints.
/// morphs: targets that move the model's vertices, at the finest level; the report's errors are without them. The
/// report's errors are the largest of all, its keys and seconds are those of all together. Errors: those of
/// write_skin_glb, usage (two of one name; a morph target of other vertices).
Result<ExportReport> write_skin_glb(const Model& model, std::span<const NamedPoses> animations,
                                    std::span<const SkinMorph> morphs, const SkinOptions& options,
                                    const std::filesystem::path& path, const RunContext& context = RunContext());

/// The first thing wrong with a skin, as a sentence, or "". Cost O(size).
std::string check_skin(const SkinnedMesh& skin);

} // namespace filigree
