// Meshes whose faces change in time as GLB: a node a key, shown from its time to the next one's.
#include "filigree/io/glb_parts.h"
#include "filigree/io/point_cache.h"

#include <algorithm>
#include <cmath>
#include <new>

namespace filigree {

namespace {

using Json = GlbBuilder::Json;

class MomentsWriter {
public:
    /// A node for the mesh, and nodes of its objects below it.
    Status add(const Mesh& mesh, double time, const RunContext& context) {
        const Result<GlbParts> parts = make_glb_parts(mesh, {}, context);
        if (!parts) return parts.error();
        if (times_.empty()) {
            const MeshMaterials found = find_glb_materials(mesh, {});
            materials_ = add_glb_materials(builder_, *parts, found.materials);
            has_plain_ = has_unlabelled_faces(*parts);
        } else if (!has_plain_ && has_unlabelled_faces(*parts)) { // the first had none
            materials_.none = add_glb_plain_material(builder_, *parts);
            has_plain_ = true;
        }
        const std::vector<std::size_t> below = add_glb_nodes(builder_, *parts, mesh, materials_);
        const double shown = times_.empty() ? 1 : 0; // where nothing plays, the first
        nodes_.push_back(builder_.json["nodes"].size());
        builder_.json["nodes"].push_back(
            {{"name", "key " + std::to_string(times_.size())}, {"children", below}, {"scale", {shown, shown, shown}}});
        times_.push_back(float(time));
        return Success{};
    }

    Status write(const std::filesystem::path& path, double end, const RunContext& context) {
        Json channels = Json::array(), samplers = Json::array();
        for (std::size_t k = 0; k < nodes_.size() && nodes_.size() > 1; ++k) {
            // Hidden, shown, hidden: steps at these times.
            std::vector<float> times, values;
            const auto key = [&](float time, float scale) {
                times.push_back(time);
                values.insert(values.end(), 3, scale);
            };
            if (k > 0) key(0, 0);
            key(times_[k], 1);
            if (k + 1 < nodes_.size()) key(times_[k + 1], 0);
            key(std::max(float(end), times.back() + 1e-3f), k + 1 < nodes_.size() ? 0 : 1);
            const std::size_t input = builder_.add_scalars(times, GltfTarget::none, true);
            const std::size_t output =
                builder_.add({.type = "VEC3", .count = times.size()}, bytes_of(std::span<const float>(values)));
            channels.push_back({{"sampler", samplers.size()}, {"target", {{"node", nodes_[k]}, {"path", "scale"}}}});
            samplers.push_back({{"input", input}, {"output", output}, {"interpolation", "STEP"}});
        }
        if (!channels.empty())
            builder_.json["animations"].push_back({{"name", "keys"}, {"channels", channels}, {"samplers", samplers}});
        builder_.json["asset"] = {{"extras", {{"filigree", report_json(end)}}}};
        builder_.json["scene"] = 0;
        builder_.json["scenes"].push_back({{"nodes", nodes_}});
        return builder_.write(path, context);
    }

private:
    Json report_json(double end) const { return {{"export", "key frames"}, {"keys", times_.size()}, {"seconds", end}}; }

    GlbBuilder builder_;
    GlbMaterials materials_;
    bool has_plain_ = false; ///< a material for faces without one
    std::vector<std::size_t> nodes_;
    std::vector<float> times_;
};

} // namespace

Status write_glb_moments(const FrameSource<MeshMoment>& moments, double keys_per_second,
                         const std::filesystem::path& path, const RunContext& context) {
    const std::size_t frames = moments.frames;
    if (frames == 0) return Error{ErrorCode::unsuitable, path.string() + ": there are no frames to write."};
    const double ratio = moments.frames_per_second / keys_per_second;
    if (!(keys_per_second > 0) || !(ratio > 0) || !std::isfinite(ratio))
        return Error{ErrorCode::usage, "Keys a second have to be above 0."};
    const auto every = static_cast<std::size_t>(std::clamp(std::round(ratio), 1.0, double(frames)));
    try {
        MomentsWriter writer;
        for (std::size_t frame = 0; frame < frames; ++frame) {
            context.report("writing", double(frame) / double(frames));
            if (context.is_cancelled()) return cancelled_error();
            const Result<MeshMoment> now = moments.frame(frame);
            if (!now) return now.error();
            if (frame % every != 0 && frame + 1 != frames) continue;
            if (Status added = writer.add(now->mesh, double(frame) / moments.frames_per_second, context); !added)
                return added;
        }
        return writer.write(path, double(frames - 1) / moments.frames_per_second, context);
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": its keys do not fit into memory; take fewer."};
    }
}

} // namespace filigree
