// Skins: the layout of nodes and why it is like this are in docs/exchange.md.
#include "filigree/file.h"

#include "filigree/core/math.h"
#include "filigree/io/gltf/glb_levels.h"
#include "filigree/io/gltf/glb_morphs.h"
#include "filigree/io/gltf/glb_parts.h"
#include "filigree/io/gltf/glb_skeleton.h"
#include "filigree/io/gltf/glb_skin_animation.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/gltf/gltf_export_error.h"
#include "filigree/io/mesh/losses.h"
#include "filigree/mesh/normals.h"
#include "filigree/restore.h"
#include "filigree/skin.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <new>
#include <tuple>

namespace filigree {

namespace {

using Json = GlbBuilder::Json;

std::vector<float> json_numbers(const Vec3d& v) { return {float(v[0]), float(v[1]), float(v[2])}; }

/// What a level looks like when it is skinned: its positions are the skin's, and it has normals unless they are not
/// wanted.
void make_skinned(Mesh& mesh, const Skin& skin, ExportNormals normals, const RunContext& context) {
    if (normals == ExportNormals::leave)
        mesh.normals = {};
    else if (mesh.normals.empty())
        mesh.normals.values = vertex_normals(mesh, mesh.positions, context);
    mesh.positions = skin.positions;
}

std::string narrow_joints(std::span<const Index> joints, std::size_t first, const GlbParts& parts, std::size_t slots,
                          bool bytes) {
    std::vector<std::uint8_t> small;
    std::vector<std::uint16_t> large;
    for (std::size_t v = 0; v < parts.vertex_count(); ++v)
        for (std::size_t k = 0; k < 4; ++k) {
            const Index joint = joints[parts.source(v) * slots + first + k];
            if (bytes)
                small.push_back(static_cast<std::uint8_t>(joint));
            else
                large.push_back(static_cast<std::uint16_t>(joint));
        }
    return bytes ? bytes_of(std::span<const std::uint8_t>(small)) : bytes_of(std::span<const std::uint16_t>(large));
}

/// How weights leave.
enum class WeightSteps { bytes, words, exact };

/// Weights as multiples of 1 / 255; positions are such that the rest shape stays.
void round_to_bytes(Skin& skin) {
    constexpr int kSteps = 255;
    for (std::size_t v = 0; v < skin.positions.size(); ++v) {
        const std::span<float> weights = std::span(skin.vertex_weights).subspan(v * skin.slots, skin.slots);
        const std::span<const Index> joints = std::span(skin.vertex_joints).subspan(v * skin.slots, skin.slots);
        Vec3d shift = Vec3d::Zero();
        int left = kSteps;
        for (std::size_t k = 1; k < skin.slots; ++k) left -= int(std::lround(kSteps * weights[k]));
        for (std::size_t k = 0; k < skin.slots; ++k) { // the largest takes what is left over
            const float rounded = float(k == 0 ? left : std::lround(kSteps * weights[k])) / kSteps;
            shift += double(weights[k] - rounded) * skin.rest[joints[k]];
            weights[k] = rounded;
        }
        skin.positions[v] = (skin.positions[v].cast<double>() + shift).cast<float>();
    }
}

/// Joints in the order of their numbers, which neighbours share, and not by weight.
void sort_by_joint(Skin& skin) {
    std::vector<std::pair<Index, float>> influences;
    for (std::size_t v = 0; v < skin.positions.size(); ++v) {
        influences.clear();
        for (std::size_t i = v * skin.slots; i < (v + 1) * skin.slots; ++i)
            if (skin.vertex_weights[i] > 0) influences.emplace_back(skin.vertex_joints[i], skin.vertex_weights[i]);
        std::ranges::sort(influences);
        for (std::size_t k = 0; k < influences.size(); ++k)
            std::tie(skin.vertex_joints[v * skin.slots + k], skin.vertex_weights[v * skin.slots + k]) = influences[k];
        for (std::size_t k = influences.size(); k < skin.slots; ++k)
            skin.vertex_joints[v * skin.slots + k] = 0, skin.vertex_weights[v * skin.slots + k] = 0;
    }
}

std::string packed_weights(std::span<const float> weights, std::size_t first, const GlbParts& parts, std::size_t slots,
                           WeightSteps steps) {
    std::vector<float> floats;
    std::vector<std::uint16_t> words;
    std::vector<std::uint8_t> bytes;
    for (std::size_t v = 0; v < parts.vertex_count(); ++v)
        for (std::size_t k = 0; k < 4; ++k) {
            const float weight = weights[parts.source(v) * slots + first + k];
            if (steps == WeightSteps::exact)
                floats.push_back(weight);
            else if (steps == WeightSteps::words)
                words.push_back(static_cast<std::uint16_t>(std::lround(65535 * weight)));
            else
                bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * weight)));
        }
    if (steps == WeightSteps::bytes) return bytes_of(std::span<const std::uint8_t>(bytes));
    return steps == WeightSteps::exact ? bytes_of(std::span<const float>(floats))
                                       : bytes_of(std::span<const std::uint16_t>(words));
}

/// JOINTS_n and WEIGHTS_n, four influences each.
void add_influences(GlbBuilder& builder, const GlbParts& parts, const Skin& skin, WeightSteps steps, Json& attributes) {
    const bool exact = steps == WeightSteps::exact;
    const bool bytes = skin.joints.size() <= 256;
    for (std::size_t set = 0; 4 * set < skin.slots; ++set) {
        GltfAccessor joints{.component = bytes ? GltfComponent::uint8 : GltfComponent::uint16,
                            .type = "VEC4",
                            .target = GltfTarget::vertices,
                            .count = parts.vertex_count()};
        GltfAccessor weights{.component = exact                         ? GltfComponent::float32
                                          : steps == WeightSteps::words ? GltfComponent::uint16
                                                                        : GltfComponent::uint8,
                             .type = "VEC4",
                             .normalized = !exact,
                             .target = GltfTarget::vertices,
                             .count = parts.vertex_count()};
        const std::string number = std::to_string(set);
        attributes["JOINTS_" + number] =
            builder.add(joints, narrow_joints(skin.vertex_joints, 4 * set, parts, skin.slots, bytes));
        attributes["WEIGHTS_" + number] =
            builder.add(weights, packed_weights(skin.vertex_weights, 4 * set, parts, skin.slots, steps));
    }
}

/// Puts one skinned file together.
class SkinExport {
public:
    SkinExport(const Model& model, std::span<const NamedPoses> clips, std::span<const SkinMorph> morphs,
               const SkinOptions& options, const RunContext& context)
        : model_(model), clips_(clips), morphs_(morphs), options_(options), context_(context),
          levels_(model, options.materials_beside) {}

    Result<ExportReport> write(const std::filesystem::path& path) {
        if (Status fine = check(); !fine) return fine.error();
        const unsigned level = restored_level(model_, options_.restore).value();
        if (level < model_.finest_level() && !morphs_.empty()) {
            morphs_ = {};
            lost_morphs_ = true;
        }
        Result<Restorer> restorer = Restorer::create(model_, options_.restore, context_);
        if (!restorer) return restorer.error();
        if (options_.compress) builder_.round_positions(bits_of_positions());
        const auto skin_of = [&](unsigned k) {
            return make_skin(model_, k, options_.influences, options_.full_precision);
        };
        Result<Skin> finest = skin_of(level);
        if (!finest) return finest.error();
        if (finest->joints.size() > 65536)
            return Error{ErrorCode::unsuitable,
                         "The driver would need " + std::to_string(finest->joints.size()) +
                             " joints, and glTF counts to 65536; use a model with a smaller driver."};
        std::vector<Played> played;
        for (const NamedPoses& clip : clips_) {
            PoseSampler poses(clip.poses, [&](const Pose& pose) { return check_pose(model_, pose); });
            Result<SkinAnimation> animation =
                SkinAnimation::sample(*finest, clip.poses, poses, *restorer, options_, context_);
            if (!animation) return animation.error();
            played.push_back({clip, *std::move(animation), std::move(poses)});
        }
        choose_weight_steps(*finest, played);
        const Skin skin = *finest;
        for (unsigned k = level + 1; k-- > 0;) {
            if (k < level && !options_.all_levels) break;
            Result<Skin> made = k == level ? std::move(finest) : skin_of(k);
            if (!made) return made.error();
            // Joints of edges are numbered as they are met, and coarser levels meet no others.
            if (k < level && made->influences == 6) renumber(*made, skin);
            if (options_.compress && made->influences == 3) {
                if (weight_steps_ == WeightSteps::bytes) round_to_bytes(*made);
                sort_by_joint(*made);
            }
            if (Status added = add_level(k, *made); !added) return added.error();
        }
        if (!options_.skeleton_of.empty()) {
            Result<GlbSkeleton> read = GlbSkeleton::read(options_.skeleton_of, context_);
            if (!read) return read.error();
            skeleton_.emplace(std::move(*read));
        }
        add_joints(skin, played);
        report_.vertices = skin.positions.size();
        report_.joints = skin.joints.size();
        for (const Played& clip : played) {
            const std::vector<double> keys = clip.animation.key_times();
            report_.keys += keys.size();
            report_.seconds += keys.back();
            report_.normal_error_degrees =
                std::max(report_.normal_error_degrees, clip.animation.normal_error_degrees());
        }
        const std::vector<Json> weights = morph_channels(played, skin); // its bytes are part of what is measured
        if (Status measured = measure(played, *restorer); !measured) return measured.error();
        move_morphs(played, weights);
        builder_.json["asset"] = {{"extras", {{"filigree", report_json()}}}};
        if (options_.compress)
            if (Status packed = builder_.compress(); !packed) return packed.error();
        if (Status written = builder_.write(path, context_); !written) return written.error();
        report_.bytes = builder_.byte_count();
        return report_;
    }

private:
    /// One animation of the file.
    struct Played {
        const NamedPoses& clip;
        SkinAnimation animation;
        PoseSampler poses;
        std::optional<std::size_t> number = {}; ///< in the file; none: nothing moves in it
    };

    const Model& model_;
    std::span<const NamedPoses> clips_;
    std::span<const SkinMorph> morphs_;
    const SkinOptions& options_;
    const RunContext& context_;
    GlbBuilder builder_;
    Json meshes_ = Json::array(), nodes_ = Json::array(), roots_ = Json::array();
    GlbLevels levels_;
    std::optional<GlbSkeleton> skeleton_;
    std::vector<std::size_t> level_nodes_;
    std::vector<std::size_t> morphed_nodes_; ///< of the finest level
    std::vector<std::string> lost_;          ///< what glTF cannot hold
    bool lost_morphs_ = false;
    WeightSteps weight_steps_ = WeightSteps::words;
    ExportReport report_;

    Status check() const {
        if (clips_.empty() ||
            std::ranges::any_of(clips_, [](const NamedPoses& clip) { return clip.poses.frames == 0; }))
            return Error{ErrorCode::unsuitable,
                         "There are no poses to export; give the model some, by a simulation or from another "
                         "program."};
        for (std::size_t c = 0; c < clips_.size(); ++c)
            for (std::size_t other = 0; other < c; ++other)
                if (clips_[other].name == clips_[c].name)
                    return Error{ErrorCode::usage, "Two animations are called '" + clips_[c].name + "'."};
        for (const SkinMorph& morph : morphs_)
            if (const std::string wrong = check_morph(morph, model_.mesh.vertex_count()); !wrong.empty())
                return Error{ErrorCode::usage, wrong};
        if (options_.influences != 3 && options_.influences != 6)
            return Error{ErrorCode::usage,
                         "A vertex of a skin has 3 or 6 influences, not " + std::to_string(options_.influences) + "."};
        if (options_.key_rate && !(*options_.key_rate > 0 && *options_.key_rate <= 1e6))
            return Error{ErrorCode::usage, "The key rate has to be above 0 and at most 1000000, in keys a second."};
        if (!(options_.key_error > 0 && options_.key_error <= 0.1))
            return Error{ErrorCode::usage,
                         "The error of keys has to be above 0 and at most 0.1, a fraction of the diagonal."};
        if (Result<unsigned> level = restored_level(model_, options_.restore); !level) return level.error();
        return Success{};
    }

    /// Bytes where a small file is wanted and they move no vertex by much of the error that is allowed.
    void choose_weight_steps(const Skin& skin, std::span<const Played> played) {
        constexpr double kShareOfWeights = 0.6;
        weight_steps_ = options_.full_precision ? WeightSteps::exact : WeightSteps::words;
        if (!options_.compress || options_.full_precision || skin.influences != 3) return;
        Skin rounded = skin;
        round_to_bytes(rounded);
        for (const Played& clip : played)
            if (!(clip.animation.distance(skin, rounded, context_) <= kShareOfWeights * options_.key_error)) return;
        weight_steps_ = WeightSteps::bytes;
    }
    /// Along the longest side: 17, or what moves a vertex by an eighth of the keys' error.
    int bits_of_positions() const {
        constexpr int kFewest = 12, kMost = 17;
        const int enough = 3 - int(std::floor(math::log2(options_.key_error)));
        return options_.full_precision ? kMost : std::clamp(enough, kFewest, kMost);
    }

    /// Numbers of a node as floats; short ones in a small file.
    Json numbers_of(const Vec3d& v) const {
        if (options_.compress) return {v[0], v[1], v[2]};
        return json_numbers(v);
    }
    /// Where a joint is at rest; in a small file to a 2^-20th of the diagonal, in decimals.
    Json place_of_joint(const Vec3d& rest, double diagonal) const {
        if (!options_.compress || !(diagonal > 0)) return json_numbers(rest);
        const double steps = math::power_of_ten(int(std::ceil(math::log10(std::ldexp(1 / diagonal, 20)))));
        return {std::round(rest[0] * steps) / steps, std::round(rest[1] * steps) / steps,
                std::round(rest[2] * steps) / steps};
    }

    static void renumber(Skin& skin, const Skin& finest) {
        std::map<Skin::Joint, Index> number;
        for (Index j = 0; j < finest.joints.size(); ++j) number[finest.joints[j]] = j;
        for (Index& joint : skin.vertex_joints) joint = number.at(skin.joints[joint]);
        skin.joints = finest.joints;
    }

    /// A node for each object of the level; the finest level's first names the coarser levels.
    Status add_level(unsigned level, const Skin& skin) {
        Mesh mesh = levels_.mesh(level);
        make_skinned(mesh, skin, options_.normals, context_);
        const Result<GlbParts> cut = make_glb_parts(mesh, {.objects = !options_.all_levels}, context_);
        if (!cut) return cut.error();
        const GlbParts& parts = *cut;
        if (level_nodes_.empty()) lost_ = losses_of_played(parts.lost);
        const GlbMaterials& materials = levels_.add_materials(builder_, parts);
        Json attributes = add_glb_attributes(builder_, parts, mesh);
        const bool is_finest = level_nodes_.empty();
        const GlbMorphs morphs(is_finest ? morphs_ : std::span<const SkinMorph>(), skin.gradient_scale());
        std::vector<Vec3f> positions = skin.positions;
        morphs.take_out(positions);
        attributes["POSITION"] = builder_.add_positions(parts.spread(std::span<const Vec3f>(positions)));
        add_influences(builder_, parts, skin, weight_steps_, attributes);
        const Json repeats = add_glb_repeats(builder_, parts);
        std::vector<Json> entries;
        for (const GlbObject& object : parts.objects) {
            Json entry = add_glb_mesh(builder_, parts, object, materials, attributes);
            if (!repeats.is_null()) entry["extras"] = repeats;
            const std::string name = object.name.empty() ? "level " + std::to_string(level) : object.name;
            if (is_finest) roots_.push_back(nodes_.size());
            if (is_finest) morphed_nodes_.push_back(nodes_.size());
            nodes_.push_back({{"name", name}, {"mesh", meshes_.size() + entries.size()}, {"skin", 0}});
            entries.push_back(std::move(entry));
        }
        if (is_finest && !morphs_.empty()) morphs.add_targets(builder_, parts, !mesh.normals.empty(), entries);
        for (Json& entry : entries) meshes_.push_back(std::move(entry));
        level_nodes_.push_back(nodes_.size() - 1);
        return Success{};
    }
    void add_joints(const Skin& skin, std::span<Played> played) {
        if (level_nodes_.size() > 1) {
            nodes_[0]["extensions"] = {
                {"MSFT_lod", {{"ids", std::vector<std::size_t>(level_nodes_.begin() + 1, level_nodes_.end())}}}};
            nodes_[0]["extras"]["MSFT_screencoverage"] =
                levels_.screen_coverages(restored_level(model_, options_.restore).value(), level_nodes_.size());
            builder_.json["extensionsUsed"] = {"MSFT_lod"};
        }
        const std::size_t root = nodes_.size();
        Json driver = {{"name", "driver"}, {"children", Json::array()}};
        const Vec3d& origin = model_.mesh.origin;
        if (!origin.isZero(0)) driver["translation"] = {origin[0], origin[1], origin[2]};
        roots_.push_back(root);
        nodes_.push_back(std::move(driver));

        const Vec3d rest_scale = resting_rotations(skin.gradient_scale()).outer_scale;
        const double diagonal = bounds(skin.positions).diagonal();
        const std::size_t first_joint = nodes_.size();
        Json joints = Json::array();
        std::vector<Eigen::Matrix4f> inverse_binds;
        for (std::size_t j = 0; j < skin.joints.size(); ++j) {
            const std::size_t outer = nodes_.size();
            nodes_[root]["children"].push_back(outer);
            nodes_.push_back({{"translation", place_of_joint(skin.rest[j], diagonal)},
                              {"scale", numbers_of(rest_scale)},
                              {"children", {outer + 1}}});
            nodes_.push_back({{"scale", numbers_of(kInnerScale)}});
            joints.push_back(outer + 1);
            inverse_binds.push_back(Eigen::Matrix4f::Identity());
            inverse_binds.back().topRightCorner<3, 1>() = -skin.rest[j].cast<float>();
        }
        if (skeleton_) skeleton_->add_nodes(builder_, nodes_, roots_);
        Json animations = Json::array();
        for (Played& clip : played) {
            Json moves = clip.animation.add_to(builder_, clip.clip.name, skin, first_joint, context_);
            if (skeleton_) skeleton_->add_channels(builder_, clip.clip.name, moves);
            if (moves.is_null()) continue;
            clip.number = animations.size();
            animations.push_back(std::move(moves));
        }
        if (!animations.empty()) builder_.json["animations"] = std::move(animations);
        const std::size_t binds = builder_.add({.type = "MAT4", .count = inverse_binds.size()},
                                               bytes_of(std::span<const Eigen::Matrix4f>(inverse_binds)));
        builder_.json["skins"] =
            Json::array({{{"joints", std::move(joints)}, {"inverseBindMatrices", binds}, {"skeleton", root}}});
        builder_.json["meshes"] = std::move(meshes_);
        builder_.json["nodes"] = std::move(nodes_);
        builder_.json["scenes"] = Json::array({{{"nodes", std::move(roots_)}}});
        builder_.json["scene"] = 0;
        report_.warnings = levels_.warnings();
        if (lost_morphs_)
            report_.warnings.push_back("Morph targets move the vertices of the finest level; this coarser one is "
                                       "written without them.");
        if (!lost_.empty()) report_.warnings.push_back(cannot_hold("A skinned GLB", lost_));
    }

    /// What morph targets do in each clip: an animation of their own.
    std::vector<Json> morph_channels(std::span<const Played> played, const Skin& skin) {
        std::vector<Json> channels(played.size());
        for (std::size_t c = 0; c < played.size(); ++c)
            GlbMorphs(morphs_, skin.gradient_scale())
                .add_channels(builder_, played[c].clip, morphed_nodes_, channels[c]);
        return channels;
    }

    /// Morph targets are at rest while the file is measured, as our restore does not know them.
    void move_morphs(std::span<Played> played, std::span<const Json> channels) {
        Json& animations = builder_.json["animations"];
        for (std::size_t c = 0; c < played.size(); ++c) {
            if (channels[c].is_null()) continue;
            if (!played[c].number) {
                animations.push_back(channels[c]);
                continue;
            }
            Json& animation = animations[*played[c].number];
            const std::size_t before = animation["samplers"].size();
            for (const Json& sampler : channels[c]["samplers"]) animation["samplers"].push_back(sampler);
            for (Json channel : channels[c]["channels"]) {
                channel["sampler"] = before + channel["sampler"].get<std::size_t>();
                animation["channels"].push_back(std::move(channel));
            }
        }
        if (animations.is_null()) builder_.json.erase("animations");
    }

    /// Reads the file's own bytes and holds them against our restore: the worst of all animations.
    Status measure(std::span<Played> clips, const Restorer& restorer) {
        const Result<std::string_view> bytes = builder_.gather(); // without a copy, as they may be gigabytes
        if (!bytes) return bytes.error();
        const Result<GltfScene> scene = GltfScene::read_view(*bytes, "the exported GLB", context_);
        if (!scene) return scene.error();
        const Vec3d shift = scene->mesh().origin - model_.mesh.origin;
        std::vector<Vec3f> rest = scene->mesh().positions;
        for (Played& clip : clips) {
            const auto played = [&](double seconds, std::span<Vec3f> out) -> Status {
                if (!clip.number) std::copy(rest.begin(), rest.end(), out.begin());
                if (clip.number)
                    if (Status s = scene->positions(*clip.number, seconds, out, context_); !s) return s;
                if (!shift.isZero(0))
                    for (Vec3f& p : out) p = (p.cast<double>() + shift).cast<float>();
                return Success{};
            };
            const auto restored = [&](double seconds, std::span<Vec3f> out) -> Status {
                const Result<Pose> pose = clip.poses.at(seconds);
                if (!pose) return pose.error();
                return restorer.positions(*pose, out, context_);
            };
            ExportReport of;
            if (Status s =
                    measure_animation(played, scene->mesh().vertex_count(), restored, restorer.vertex_count(),
                                      clip.animation.key_times(), clip.clip.poses.frames_per_second, of, context_);
                !s)
                return s;
            for (double ExportReport::*error : {&ExportReport::error_at_keys, &ExportReport::error_between_keys,
                                                &ExportReport::rms_at_keys, &ExportReport::rms_between_keys})
                report_.*error = std::max(report_.*error, of.*error);
            report_.moments += of.moments;
            report_.moments_checked += of.moments_checked;
        }
        return Success{};
    }

    Json report_json() const {
        Json report = report_of_all();
        if (clips_.size() > 1)
            for (const NamedPoses& clip : clips_) report["clips"].push_back(clip.name);
        return report;
    }
    std::size_t frame_count() const {
        std::size_t count = 0;
        for (const NamedPoses& clip : clips_) count += clip.poses.frames;
        return count;
    }
    Json report_of_all() const {
        return {{"export", "skin"},
                {"influences", options_.influences},
                {"interpolation", options_.interpolation == KeyInterpolation::cubic ? "cubic" : "linear"},
                {"vertices", report_.vertices},
                {"joints", report_.joints},
                {"keys", report_.keys},
                {"frames", frame_count()},
                {"frames_per_second", clips_.front().poses.frames_per_second},
                {"seconds", report_.seconds},
                {"error_at_keys", report_.error_at_keys},
                {"rms_at_keys", report_.rms_at_keys},
                {"error_between_keys", report_.error_between_keys},
                {"rms_between_keys", report_.rms_between_keys},
                {"moments", report_.moments},
                {"moments_checked", report_.moments_checked},
                {"normal_error_degrees", report_.normal_error_degrees}};
    }
};

} // namespace

Result<ExportReport> write_skin_glb(const Model& model, std::span<const NamedPoses> animations,
                                    std::span<const SkinMorph> morphs, const SkinOptions& options,
                                    const std::filesystem::path& path, const RunContext& context) {
    try {
        return SkinExport(model, animations, morphs, options, context).write(path);
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": does not fit into memory; export fewer keys."};
    }
}

Result<ExportReport> write_skin_glb(const Model& model, const FrameSource<Pose>& poses, const SkinOptions& options,
                                    const std::filesystem::path& path, const RunContext& context) {
    const NamedPoses driver{"driver", poses};
    return write_skin_glb(model, std::span(&driver, 1), {}, options, path, context);
}

} // namespace filigree
