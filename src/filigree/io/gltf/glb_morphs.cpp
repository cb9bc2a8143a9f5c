#include "filigree/io/gltf/glb_morphs.h"

#include <algorithm>

namespace filigree {

using Json = GlbMorphs::Json;

void GlbMorphs::take_out(std::span<Vec3f> positions) const {
    for (const SkinMorph& morph : morphs_)
        for (std::size_t i = 0; i < morph.vertices.size() && morph.weight != 0; ++i)
            positions[morph.vertices[i]] -= float(morph.weight) * inverse_scale_ * morph.positions[i];
}

void GlbMorphs::add_targets(GlbBuilder& builder, const GlbParts& parts, bool has_normals,
                            std::span<Json> meshes) const {
    Json targets = Json::array(), names = Json::array(), weights = Json::array();
    // All targets of a primitive have the same attributes. The normals of the file are those with the weights.
    const bool turns = has_normals && std::ranges::any_of(morphs_, [](const SkinMorph& morph) {
                           return !morph.normals.empty() && morph.weight == 0;
                       });
    for (const SkinMorph& morph : morphs_) {
        const auto spread = [&](std::span<const Vec3f> values, float factor) {
            std::vector<Vec3f> all(parts.mesh_vertices, Vec3f::Zero());
            for (std::size_t i = 0; i < values.size(); ++i) all[morph.vertices[i]] = factor * values[i];
            return parts.spread(std::span<const Vec3f>(all));
        };
        Json target = {{"POSITION", builder.add_positions(spread(morph.positions, inverse_scale_))}};
        if (turns)
            target["NORMAL"] = builder.add_vectors(
                spread(morph.weight == 0 ? std::span<const Vec3f>(morph.normals) : std::span<const Vec3f>(), 1));
        targets.push_back(std::move(target));
        names.push_back(morph.name);
        weights.push_back(float(morph.weight));
    }
    for (Json& mesh : meshes) {
        for (Json& primitive : mesh["primitives"]) primitive["targets"] = targets;
        mesh["weights"] = weights;
        mesh["extras"]["targetNames"] = names;
    }
}

void GlbMorphs::add_channels(GlbBuilder& builder, const NamedPoses& clip, std::span<const std::size_t> nodes,
                             Json& animation) const {
    if (!clip.morph_weights || morphs_.empty()) return;
    const std::size_t count = morphs_.size();
    std::vector<std::vector<float>> frames;
    std::vector<double> weights(count);
    bool moves = false;
    for (std::size_t frame = 0; frame < clip.poses.frames; ++frame) {
        clip.morph_weights(double(frame) / clip.poses.frames_per_second, weights);
        frames.emplace_back(weights.begin(), weights.end());
        for (std::size_t m = 0; m < count; ++m) moves = moves || frames[frame][m] != float(morphs_[m].weight);
    }
    if (!moves) return;
    std::vector<float> times, values;
    for (std::size_t frame = 0; frame < frames.size(); ++frame) {
        const bool is_inner = frame > 0 && frame + 1 < frames.size();
        if (is_inner && frames[frame] == frames[frame - 1] && frames[frame] == frames[frame + 1]) continue;
        times.push_back(float(double(frame) / clip.poses.frames_per_second));
        values.insert(values.end(), frames[frame].begin(), frames[frame].end());
    }
    if (animation.is_null())
        animation = {{"name", clip.name}, {"channels", Json::array()}, {"samplers", Json::array()}};
    const std::size_t input = builder.add_scalars(times, GltfTarget::none, true);
    const std::size_t output = builder.add_scalars(values, GltfTarget::none);
    const std::size_t sampler = animation["samplers"].size();
    animation["samplers"].push_back({{"input", input}, {"output", output}});
    for (const std::size_t node : nodes)
        animation["channels"].push_back({{"sampler", sampler}, {"target", {{"node", node}, {"path", "weights"}}}});
}

} // namespace filigree
