// Morph targets of a skin, put into a file of ours.
#pragma once

#include "filigree/io/gltf/glb_builder.h"
#include "filigree/io/gltf/glb_parts.h"
#include "filigree/skin.h"

#include <span>
#include <string>
#include <vector>

namespace filigree {

/// The first thing wrong with a morph target, as a sentence, or "".
std::string check_morph(const SkinMorph& morph, std::size_t vertex_count);

/// The targets on a level's meshes. At rest a joint's matrix is gradient_scale times the identity, so positions are
/// added that many times less.
class GlbMorphs {
public:
    using Json = GlbBuilder::Json;
    GlbMorphs(std::span<const SkinMorph> morphs, double gradient_scale)
        : morphs_(morphs), inverse_scale_(float(1 / gradient_scale)) {}

    /// Takes the targets out of the positions of a mesh that has them with their weights.
    void take_out(std::span<Vec3f> positions) const;
    /// Adds targets, names and weights to glTF meshes that share these vertices.
    void add_targets(GlbBuilder& builder, const GlbParts& parts, bool has_normals, std::span<Json> meshes) const;
    /// What the weights of the targets do in `frames` frames, as samplers and channels of `nodes` that are added to an
    /// animation (null: one that is to be). A clip in which they stay adds nothing.
    void add_channels(GlbBuilder& builder, const NamedPoses& clip, std::span<const std::size_t> nodes,
                      Json& animation) const;

private:
    std::span<const SkinMorph> morphs_;
    float inverse_scale_;
};

} // namespace filigree
