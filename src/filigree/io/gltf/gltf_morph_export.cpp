// Morph targets: every frame a target, and weights that hand over from one to the next.
#include "filigree/file.h"

#include "filigree/io/gltf/glb_parts.h"
#include "filigree/io/mesh/losses.h"
#include "filigree/mesh/normals.h"

#include <cmath>
#include <new>

namespace filigree {

namespace {

using Json = GlbBuilder::Json;

/// What viewers add to the rest shape in one frame.
struct Offsets {
    std::vector<Vec3f> positions, normals; ///< one a mesh vertex; normals may be empty

    void set(const MeshAnimation& animation, std::span<const Vec3f> moved, std::span<const Vec3f> moved_normals,
             std::span<const Vec3f> rest_normals) {
        positions.resize(moved.size());
        for (std::size_t v = 0; v < moved.size(); ++v) positions[v] = moved[v] - animation.rest->positions[v];
        normals.resize(moved_normals.size());
        for (std::size_t v = 0; v < normals.size(); ++v) normals[v] = moved_normals[v] - rest_normals[v];
    }
};

class MorphExport {
public:
    MorphExport(const MeshAnimation& animation, const MorphOptions& options, const RunContext& context)
        : animation_(animation), options_(options), context_(context), mesh_(*animation.rest) {}

    Result<ExportReport> write(const std::filesystem::path& path) {
        if (animation_.frames == 0)
            return Error{ErrorCode::unsuitable, "There are no frames to export as morph targets."};
        if (options_.morph_normals || (options_.normals == ExportNormals::keep && mesh_.normals.empty())) {
            mesh_.normals = {};
            mesh_.normals.values = vertex_normals(mesh_, mesh_.positions, context_);
        } else if (options_.normals == ExportNormals::leave) {
            mesh_.normals = {};
        }
        Result<GlbParts> parts = make_glb_parts(mesh_, {}, context_);
        if (!parts) return parts.error();
        parts_ = *std::move(parts);
        const std::size_t a_frame =
            parts_.vertex_count() * (options_.morph_normals ? 24 : 12) + 4 * animation_.frames; // offsets and weights
        if (a_frame > (std::uint64_t{1} << 32) / animation_.frames)
            return Error{ErrorCode::unsupported,
                         path.string() + ": " + std::to_string(animation_.frames) + " morph targets of " +
                             std::to_string(parts_.vertex_count()) +
                             " vertices pass the 4 GiB that a GLB can have; write a .pc2, fewer frames, or a skin."};
        if (options_.compress) builder_.round_positions();
        add_mesh();
        if (Status added = add_targets(); !added) return added.error();
        add_weights();
        report_.vertices = mesh_.vertex_count();
        report_.keys = animation_.frames;
        report_.seconds = double(animation_.frames - 1) / animation_.frames_per_second;
        builder_.json["asset"] = {{"extras", {{"filigree", report_json()}}}};
        if (options_.compress)
            if (Status packed = builder_.compress(); !packed) return packed.error();
        if (Status written = builder_.write(path, context_); !written) return written.error();
        report_.bytes = builder_.byte_count();
        return report_;
    }

private:
    const MeshAnimation& animation_;
    const MorphOptions& options_;
    const RunContext& context_;
    Mesh mesh_; ///< at rest, with the normals that are written
    GlbParts parts_;
    GlbBuilder builder_;
    Json meshes_ = Json::array();
    ExportReport report_;

    void add_mesh() {
        const MeshMaterials found = find_glb_materials(mesh_, options_.materials_beside);
        const GlbMaterials materials = add_glb_materials(builder_, parts_, found.materials);
        report_.warnings = found.warnings;
        report_.warnings.insert(report_.warnings.end(), materials.warnings.begin(), materials.warnings.end());
        if (const auto lost = losses_of_played(parts_.lost); !lost.empty())
            report_.warnings.push_back(cannot_hold("A GLB with morph targets", lost));
        Json attributes = add_glb_attributes(builder_, parts_, mesh_);
        attributes["POSITION"] = builder_.add_positions(parts_.spread(std::span<const Vec3f>(mesh_.positions)));
        const Json repeats = add_glb_repeats(builder_, parts_);
        Json nodes = Json::array(), roots = Json::array();
        for (const GlbObject& object : parts_.objects) {
            Json mesh = add_glb_mesh(builder_, parts_, object, materials, attributes);
            if (!repeats.is_null()) mesh["extras"] = repeats;
            mesh["weights"] = std::vector<int>(animation_.frames, 0);
            Json node = {{"name", object.name.empty() ? "mesh" : object.name}, {"mesh", meshes_.size()}};
            if (!mesh_.origin.isZero(0)) node["translation"] = {mesh_.origin[0], mesh_.origin[1], mesh_.origin[2]};
            roots.push_back(nodes.size());
            nodes.push_back(std::move(node));
            meshes_.push_back(std::move(mesh));
        }
        builder_.json["nodes"] = std::move(nodes);
        builder_.json["scenes"] = Json::array({{{"nodes", std::move(roots)}}});
        builder_.json["scene"] = 0;
    }

    Status fetch(std::size_t frame, std::vector<Vec3f>& moved, Offsets& offsets) const {
        if (context_.is_cancelled()) return cancelled_error();
        if (Status s = animation_.positions(frame, moved); !s) return s;
        std::vector<Vec3f> normals;
        if (options_.morph_normals) normals = vertex_normals(mesh_, moved, context_);
        offsets.set(animation_, moved, normals, mesh_.normals.values);
        return Success{};
    }

    /// Frames are fetched twice, now for their bounds, which come first in the file, and later to be written.
    Status add_targets() {
        std::vector<Vec3f> moved(mesh_.vertex_count());
        Offsets offsets;
        Json targets = Json::array();
        double largest = 0, squares = 0, diagonal = 0;
        for (std::size_t frame = 0; frame < animation_.frames; ++frame) {
            context_.report("measuring frames", double(frame) / double(animation_.frames));
            if (Status s = fetch(frame, moved, offsets); !s) return s;
            if (frame == 0) diagonal = bounds(moved).diagonal();
            for (std::size_t v = 0; v < moved.size(); ++v) { // as a viewer adds
                const Vec3f shown = mesh_.positions[v] + offsets.positions[v];
                const double square = (shown.cast<double>() - moved[v].cast<double>()).squaredNorm();
                largest = std::max(largest, square);
                squares += square;
            }
            const Box box = bounds(offsets.positions);
            GltfAccessor accessor{.type = "VEC3", .target = GltfTarget::vertices, .count = parts_.vertex_count()};
            Json target;
            if (options_.morph_normals) target["NORMAL"] = add_streamed(accessor, frame, true);
            accessor.min.assign(box.min.data(), box.min.data() + 3);
            accessor.max.assign(box.max.data(), box.max.data() + 3);
            target["POSITION"] = add_streamed(accessor, frame, false);
            targets.push_back(std::move(target));
        }
        const double scale = diagonal > 0 ? 1 / diagonal : 0;
        report_.error_at_keys = scale * std::sqrt(largest);
        report_.rms_at_keys = scale * std::sqrt(squares / double(animation_.frames * mesh_.vertex_count()));
        report_.moments = report_.moments_checked = animation_.frames;
        for (Json& mesh : meshes_)
            for (Json& primitive : mesh["primitives"]) primitive["targets"] = targets;
        builder_.json["meshes"] = std::move(meshes_);
        return Success{};
    }

    std::size_t add_streamed(const GltfAccessor& accessor, std::size_t frame, bool normals) {
        const std::size_t bytes = 12 * parts_.vertex_count();
        return builder_.add(accessor, bytes, [this, frame, normals](const auto& write) -> Status {
            std::vector<Vec3f> moved(mesh_.vertex_count());
            Offsets offsets;
            context_.report("writing", double(frame) / double(animation_.frames));
            if (Status s = fetch(frame, moved, offsets); !s) return s;
            const std::vector<Vec3f> spread =
                parts_.spread(std::span<const Vec3f>(normals ? offsets.normals : offsets.positions));
            return write({reinterpret_cast<const char*>(spread.data()), 12 * spread.size()});
        });
    }

    void add_weights() {
        const std::size_t frames = animation_.frames;
        std::vector<float> times, weights(frames * frames, 0);
        for (std::size_t k = 0; k < frames; ++k) {
            times.push_back(static_cast<float>(double(k) / animation_.frames_per_second));
            weights[k * frames + k] = 1;
        }
        const std::size_t input = builder_.add_scalars(times, GltfTarget::none, true);
        const std::size_t output = builder_.add_scalars(weights, GltfTarget::none);
        Json channels = Json::array();
        for (std::size_t node = 0; node < builder_.json["nodes"].size(); ++node)
            channels.push_back({{"sampler", 0}, {"target", {{"node", node}, {"path", "weights"}}}});
        builder_.json["animations"] =
            Json::array({{{"name", "frames"},
                          {"channels", std::move(channels)},
                          {"samplers", Json::array({{{"input", input}, {"output", output}}})}}});
    }

    Json report_json() const {
        return {{"export", "morph"},
                {"vertices", report_.vertices},
                {"keys", report_.keys},
                {"frames", animation_.frames},
                {"frames_per_second", animation_.frames_per_second},
                {"seconds", report_.seconds},
                {"error_at_keys", report_.error_at_keys},
                {"rms_at_keys", report_.rms_at_keys},
                {"moments_checked", report_.moments_checked}};
    }
};

} // namespace

Result<ExportReport> write_morph_glb(const MeshAnimation& animation, const MorphOptions& options,
                                     const std::filesystem::path& path, const RunContext& context) {
    try {
        return MorphExport(animation, options, context).write(path);
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": does not fit into memory; export fewer frames."};
    }
}

} // namespace filigree
