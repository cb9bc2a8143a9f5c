// Skins: the layout of nodes and why it is like this are in docs/exchange.md.
#include "filigree/io/gltf_export.h"

#include "filigree/core/parallel_for.h"
#include "filigree/hierarchy/skin.h"
#include "filigree/io/animation_error.h"
#include "filigree/io/glb_parts.h"
#include "filigree/io/gltf.h"
#include "filigree/io/material_file.h"
#include "filigree/mesh/normals.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <new>

#include <Eigen/SVD>

namespace filigree {

namespace {

using Json = GlbBuilder::Json;

/// A key, and how its tangent follows from what lies around it: sum of weights times samples.
struct Key {
    std::size_t sample;
    std::array<std::pair<std::size_t, double>, 3> slope = {};
};

/// Moments of the animation at which the driver is looked at: keys, and for cubic keys two more for each.
struct Sampling {
    std::vector<double> times; ///< seconds
    std::vector<Key> keys;     ///< ascending
};

Sampling plan_samples(const PoseStream& poses, const SkinOptions& options) {
    const double duration = double(poses.frames - 1) / poses.frames_per_second;
    const double rate = options.key_rate.value_or(poses.frames_per_second);
    std::vector<double> keys;
    const auto steps = static_cast<std::size_t>(std::floor(duration * rate * (1 + 1e-12)));
    for (std::size_t k = 0; k <= steps; ++k) keys.push_back(std::min(double(k) / rate, duration));
    if (duration - keys.back() > 1e-6 / rate) keys.push_back(duration); // the last frame is always a key

    Sampling sampling;
    const auto sample = [&](double time) {
        sampling.times.push_back(std::clamp(time, 0.0, duration));
        return sampling.times.size() - 1;
    };
    // Differences of second order: from both sides, and at the ends from two steps inwards.
    const double aside = std::min({1 / poses.frames_per_second, 0.5 / rate, 0.5 * duration});
    const bool tangents = options.interpolation == KeyInterpolation::cubic && keys.size() > 1;
    for (const double time : keys) {
        const double side = time == 0 ? 1 : time == duration ? -1 : 0;
        if (!tangents) {
            sampling.keys.push_back({sample(time)});
        } else if (side == 0) {
            const std::size_t before = sample(time - aside), at = sample(time), after = sample(time + aside);
            const double weight = 0.5 / aside;
            sampling.keys.push_back({at, {{{before, -weight}, {at, 0}, {after, weight}}}});
        } else {
            const double weight = 0.5 * side / aside;
            const std::size_t at = sample(time), near = sample(time + side * aside),
                              far = sample(time + 2 * side * aside);
            sampling.keys.push_back({at, {{{at, -3 * weight}, {near, 4 * weight}, {far, -weight}}}});
        }
    }
    return sampling;
}

/// What every joint does, sample after sample.
struct Motion {
    std::vector<std::vector<Mat3d>> matrices;     ///< of each joint, already scaled
    std::vector<std::vector<Vec3d>> translations; ///< the same
    std::vector<float> normal_errors;             ///< degrees, one a joint that is a driver vertex and key
};

/// How far a normal may be off that is turned by the matrix itself: atan r - atan(1/r), r the largest stretch ratio.
double normal_error(const Mat3d& gradient) {
    const Vec3d s = Eigen::JacobiSVD<Mat3d>(gradient).singularValues();
    if (!(s[2] > 0)) return 90;
    const double ratio = s[0] / s[2];
    return (std::atan(ratio) - std::atan(1 / ratio)) * 180 / M_PI;
}

Result<Motion> sample_motion(const Skin& skin, const Sampling& sampling, PoseSampler& poses, const Restorer& restorer,
                             const RunContext& context) {
    Motion motion;
    const std::size_t joints = skin.joints.size(), samples = sampling.times.size();
    motion.matrices.assign(joints, std::vector<Mat3d>(samples));
    motion.translations.assign(joints, std::vector<Vec3d>(samples));
    std::size_t next_key = 0;
    for (std::size_t s = 0; s < samples; ++s) {
        if (context.is_cancelled()) return cancelled_error();
        context.report("sampling the driver", double(s) / double(samples));
        const Result<Pose> pose = poses.at(sampling.times[s]);
        if (!pose) return pose.error();
        const std::vector<Mat3f> gradients = restorer.gradients(*pose, context);
        parallel_for(context, joints, 256, [&](std::size_t begin, std::size_t end) {
            for (std::size_t j = begin; j < end; ++j) {
                const JointTransform joint = joint_transform(skin, j, pose->positions, gradients);
                motion.matrices[j][s] = joint.matrix;
                motion.translations[j][s] = joint.translation;
            }
        });
        if (sampling.keys[next_key].sample != s) continue;
        next_key = std::min(next_key + 1, sampling.keys.size() - 1);
        std::vector<float> errors(gradients.size());
        parallel_for(context, errors.size(), 256, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) errors[i] = float(normal_error(gradients[i].cast<double>()));
        });
        motion.normal_errors.insert(motion.normal_errors.end(), errors.begin(), errors.end());
    }
    return motion;
}

/// One animated property of one node: `width` numbers a sample.
struct Track {
    const char* path; ///< as glTF names it
    bool inner;       ///< of the joint's inner node
    std::size_t width;
    std::vector<double> values;
    std::array<double, 4> rest; ///< what the node has when nothing plays
};

std::array<Track, 4> make_tracks(const std::vector<NestedRotations>& parts, std::span<const Vec3d> translations,
                                 const Vec3d& rest, double gradient_scale) {
    const Vec3d scale = resting_rotations(gradient_scale).outer_scale;
    std::array<Track, 4> tracks = {{{"translation", false, 3, {}, {rest[0], rest[1], rest[2], 0}},
                                    {"rotation", false, 4, {}, {0, 0, 0, 1}},
                                    {"scale", false, 3, {}, {scale[0], scale[1], scale[2], 0}},
                                    {"rotation", true, 4, {}, {0, 0, 0, 1}}}};
    const auto add = [](Track& track, const auto& numbers) {
        track.values.insert(track.values.end(), numbers.data(), numbers.data() + track.width);
    };
    for (std::size_t s = 0; s < parts.size(); ++s) {
        add(tracks[0], translations[s]);
        add(tracks[1], parts[s].outer_rotation.coeffs());
        add(tracks[2], parts[s].outer_scale);
        add(tracks[3], parts[s].inner_rotation.coeffs());
    }
    return tracks;
}

/// Numbers as a sampler's output holds them: at keys alone, or each between its tangents.
std::vector<double> key_values(const Track& track, const Sampling& sampling, bool cubic) {
    std::vector<double> values;
    const auto number = [&](std::size_t sample, std::size_t k) { return track.values[sample * track.width + k]; };
    for (const Key& key : sampling.keys)
        for (int part = cubic ? -1 : 0; part <= (cubic ? 1 : 0); ++part)
            for (std::size_t k = 0; k < track.width; ++k) {
                double slope = 0;
                for (const auto& [sample, weight] : key.slope) slope += weight * number(sample, k);
                values.push_back(part == 0 ? number(key.sample, k) : slope);
            }
    return values;
}

/// Writes the tracks of all joints as one animation.
class AnimationWriter {
public:
    AnimationWriter(GlbBuilder& builder, const Sampling& sampling, const SkinOptions& options)
        : builder_(builder), sampling_(sampling),
          cubic_(options.interpolation == KeyInterpolation::cubic && sampling.keys.size() > 1),
          small_rotations_(!options.full_precision && !cubic_) {
        std::vector<float> times;
        for (const Key& key : sampling.keys) times.push_back(float(sampling.times[key.sample]));
        input_ = builder_.add_scalars(times, GltfTarget::none, true);
    }

    /// A track that stays at rest is left out; one that stays elsewhere has a single key.
    void add(const Track& track, std::size_t node) {
        std::vector<double> values = key_values(track, sampling_, cubic_);
        const std::size_t step = track.width * (cubic_ ? 3 : 1);
        const bool constant = is_constant(track, values, step);
        if (constant && is_at_rest(track)) return;
        const bool held = constant && sampling_.keys.size() > 1;
        if (held) values.assign(track.values.begin(), track.values.begin() + std::ptrdiff_t(track.width));
        const bool small = small_rotations_ && track.width == 4;
        GltfAccessor accessor{.component = small ? GltfComponent::int16 : GltfComponent::float32,
                              .type = track.width == 4 ? "VEC4" : "VEC3",
                              .normalized = small,
                              .count = values.size() / track.width};
        std::string bytes;
        if (small) {
            std::vector<std::int16_t> rounded;
            for (const double x : values)
                rounded.push_back(static_cast<std::int16_t>(std::lround(32767 * std::clamp(x, -1.0, 1.0))));
            bytes = bytes_of(std::span<const std::int16_t>(rounded));
        } else {
            const std::vector<float> floats(values.begin(), values.end());
            bytes = bytes_of(std::span<const float>(floats));
        }
        const std::size_t output = samplers_.empty() ? builder_.add(std::move(accessor), std::move(bytes))
                                                     : builder_.append(std::move(accessor), bytes);
        if (held) held_.push_back(samplers_.size());
        Json sampler = {{"input", input_}, {"output", output}};
        if (cubic_ && !held) sampler["interpolation"] = "CUBICSPLINE";
        channels_.push_back({{"sampler", samplers_.size()}, {"target", {{"node", node}, {"path", track.path}}}});
        samplers_.push_back(std::move(sampler));
    }

    /// The animation, or null when nothing moves.
    Json finish() {
        if (channels_.empty()) return nullptr;
        if (!held_.empty()) {
            const float zero = 0;
            const std::size_t moment = builder_.add_scalars(std::span(&zero, 1), GltfTarget::none, true);
            for (const std::size_t sampler : held_) samplers_[sampler]["input"] = moment;
        }
        return {{"name", "driver"}, {"channels", std::move(channels_)}, {"samplers", std::move(samplers_)}};
    }

private:
    GlbBuilder& builder_;
    const Sampling& sampling_;
    bool cubic_, small_rotations_;
    std::size_t input_ = 0;
    std::vector<std::size_t> held_; ///< samplers with one key
    Json channels_ = Json::array(), samplers_ = Json::array();

    static bool same(double a, double b) { return static_cast<float>(a) == static_cast<float>(b); }
    bool is_constant(const Track& track, const std::vector<double>& values, std::size_t step) const {
        for (std::size_t k = 0; k < values.size(); ++k) {
            const bool tangent = cubic_ && (k % step < track.width || k % step >= 2 * track.width);
            if (!same(values[k], tangent ? 0 : values[k % step])) return false;
        }
        return true;
    }
    bool is_at_rest(const Track& track) const {
        for (std::size_t k = 0; k < track.width; ++k)
            if (!same(track.values[k], track.rest[k])) return false;
        return true;
    }
};

std::vector<float> json_numbers(const Vec3d& v) { return {float(v[0]), float(v[1]), float(v[2])}; }

/// A level's mesh to be skinned: its positions are the skin's, and it has normals unless they are not wanted.
Mesh make_skinned_mesh(const Model& model, unsigned level, const Skin& skin, ExportNormals normals,
                       const RunContext& context) {
    Mesh mesh = level_mesh(model, level);
    if (normals == ExportNormals::leave)
        mesh.normals = {};
    else if (mesh.normals.empty())
        mesh.normals.values = vertex_normals(mesh, mesh.positions, context);
    // Faces of coarser levels have no labels; where all of the mesh is of one material they do not need any.
    if (level < model.finest_level() && model.mesh.materials.names.size() == 1) {
        mesh.materials.names = model.mesh.materials.names;
        mesh.materials.of_face.assign(mesh.face_count(), 0);
    }
    mesh.positions = skin.positions;
    return mesh;
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

std::string packed_weights(std::span<const float> weights, std::size_t first, const GlbParts& parts, std::size_t slots,
                           bool exact) {
    std::vector<float> floats;
    std::vector<std::uint16_t> steps;
    for (std::size_t v = 0; v < parts.vertex_count(); ++v)
        for (std::size_t k = 0; k < 4; ++k) {
            const float weight = weights[parts.source(v) * slots + first + k];
            if (exact)
                floats.push_back(weight);
            else
                steps.push_back(static_cast<std::uint16_t>(std::lround(65535 * weight)));
        }
    return exact ? bytes_of(std::span<const float>(floats)) : bytes_of(std::span<const std::uint16_t>(steps));
}

/// JOINTS_n and WEIGHTS_n, four influences each.
void add_influences(GlbBuilder& builder, const GlbParts& parts, const Skin& skin, bool exact, Json& attributes) {
    const bool bytes = skin.joints.size() <= 256;
    for (std::size_t set = 0; 4 * set < skin.slots; ++set) {
        GltfAccessor joints{.component = bytes ? GltfComponent::uint8 : GltfComponent::uint16,
                            .type = "VEC4",
                            .target = GltfTarget::vertices,
                            .count = parts.vertex_count()};
        GltfAccessor weights{.component = exact ? GltfComponent::float32 : GltfComponent::uint16,
                             .type = "VEC4",
                             .normalized = !exact,
                             .target = GltfTarget::vertices,
                             .count = parts.vertex_count()};
        const std::string number = std::to_string(set);
        attributes["JOINTS_" + number] =
            builder.add(joints, narrow_joints(skin.vertex_joints, 4 * set, parts, skin.slots, bytes));
        attributes["WEIGHTS_" + number] =
            builder.add(weights, packed_weights(skin.vertex_weights, 4 * set, parts, skin.slots, exact));
    }
}

/// Puts one skinned file together.
class SkinExport {
public:
    SkinExport(const Model& model, const PoseStream& poses, const SkinOptions& options, const RunContext& context)
        : model_(model), poses_(poses), options_(options), context_(context) {}

    Result<ExportReport> write(const std::filesystem::path& path) {
        if (Status fine = check(); !fine) return fine.error();
        const unsigned level = restored_level(model_, options_.restore).value();
        Result<Restorer> restorer = Restorer::create(model_, options_.restore, context_);
        if (!restorer) return restorer.error();
        PoseSampler poses(poses_, [&](const Pose& pose) { return check_pose(model_, pose); });
        const Sampling sampling = plan_samples(poses_, options_);

        Skin skin;
        for (unsigned k = level + 1; k-- > 0;) {
            if (k < level && !options_.all_levels) break;
            Result<Skin> made = make_skin(model_, k, options_.influences, options_.full_precision);
            if (!made) return made.error();
            // Joints of edges are numbered as they are met, and coarser levels meet no others.
            if (k == level) skin = *made;
            if (k < level && made->influences == 6) renumber(*made, skin);
            add_level(k, *made);
        }
        if (skin.joints.size() > 65536)
            return Error{ErrorCode::unsuitable, "The driver would need " + std::to_string(skin.joints.size()) +
                                                    " joints, and glTF counts to 65536; strip with a smaller --base."};
        Result<Motion> motion = sample_motion(skin, sampling, poses, *restorer, context_);
        if (!motion) return motion.error();
        add_joints(skin, sampling, *motion);

        report_.vertices = skin.positions.size();
        report_.joints = skin.joints.size();
        report_.keys = sampling.keys.size();
        report_.seconds = sampling.times.back();
        report_.normal_error_degrees = percentile95(motion->normal_errors);
        if (Status measured = measure(sampling, poses, *restorer); !measured) return measured.error();
        builder_.json["asset"] = {{"extras", {{"filigree", report_json()}}}};
        if (Status written = builder_.write(path, context_); !written) return written.error();
        report_.bytes = builder_.byte_count();
        return report_;
    }

private:
    const Model& model_;
    const PoseStream& poses_;
    const SkinOptions& options_;
    const RunContext& context_;
    GlbBuilder builder_;
    Json meshes_ = Json::array(), nodes_ = Json::array(), roots_ = Json::array();
    std::vector<std::size_t> level_nodes_;
    ExportReport report_;

    Status check() const {
        if (poses_.frames == 0)
            return Error{ErrorCode::unsuitable,
                         "There are no poses to export; 'filigree simulate' makes them, and --poses "
                         "takes another program's."};
        if (options_.influences != 3 && options_.influences != 6)
            return Error{ErrorCode::usage,
                         "A vertex of a skin has 3 or 6 influences, not " + std::to_string(options_.influences) + "."};
        if (options_.key_rate && !(*options_.key_rate > 0 && *options_.key_rate <= 1e6))
            return Error{ErrorCode::usage, "The key rate has to be above 0, in keys a second."};
        if (Result<unsigned> level = restored_level(model_, options_.restore); !level) return level.error();
        return Success{};
    }

    static void renumber(Skin& skin, const Skin& finest) {
        std::map<Skin::Joint, Index> number;
        for (Index j = 0; j < finest.joints.size(); ++j) number[finest.joints[j]] = j;
        for (Index& joint : skin.vertex_joints) joint = number.at(skin.joints[joint]);
        skin.joints = finest.joints;
    }

    /// A node for each object of the level; the finest level's first names the coarser levels.
    void add_level(unsigned level, const Skin& skin) {
        const Mesh mesh = make_skinned_mesh(model_, level, skin, options_.normals, context_);
        const GlbParts parts = make_glb_parts(mesh, {.objects = !options_.all_levels});
        if (level_nodes_.empty())
            for (const std::string& what : parts.lost) lost_.push_back(what);
        MeshMaterials found;
        if (!mesh.materials.empty()) found = read_materials(mesh, options_.materials_beside);
        GlbMaterials materials;
        if (level_nodes_.empty() || mesh.materials.empty() != no_materials_) {
            materials = add_glb_materials(builder_, parts, found.materials);
            report_.warnings.insert(report_.warnings.end(), found.warnings.begin(), found.warnings.end());
            report_.warnings.insert(report_.warnings.end(), materials.warnings.begin(), materials.warnings.end());
            materials_ = materials;
            no_materials_ = mesh.materials.empty();
        } else {
            materials = materials_;
        }
        Json attributes = add_glb_attributes(builder_, parts, mesh);
        attributes["POSITION"] = builder_.add_positions(parts.spread(std::span<const Vec3f>(skin.positions)));
        add_influences(builder_, parts, skin, options_.full_precision, attributes);
        const Json repeats = add_glb_repeats(builder_, parts);
        for (const GlbObject& object : parts.objects) {
            Json entry = add_glb_mesh(builder_, parts, object, materials, attributes);
            if (!repeats.is_null()) entry["extras"] = repeats;
            const std::string name = object.name.empty() ? "level " + std::to_string(level) : object.name;
            if (level_nodes_.empty()) roots_.push_back(nodes_.size());
            nodes_.push_back({{"name", name}, {"mesh", meshes_.size()}, {"skin", 0}});
            meshes_.push_back(std::move(entry));
        }
        level_nodes_.push_back(nodes_.size() - 1);
    }
    std::vector<std::string> lost_;
    GlbMaterials materials_;
    bool no_materials_ = false;

    void add_joints(const Skin& skin, const Sampling& sampling, const Motion& motion) {
        if (level_nodes_.size() > 1) {
            nodes_[0]["extensions"] = {
                {"MSFT_lod", {{"ids", std::vector<std::size_t>(level_nodes_.begin() + 1, level_nodes_.end())}}}};
            builder_.json["extensionsUsed"] = {"MSFT_lod"};
        }
        const std::size_t root = nodes_.size();
        Json driver = {{"name", "driver"}, {"children", Json::array()}};
        const Vec3d& origin = model_.mesh.origin;
        if (!origin.isZero(0)) driver["translation"] = {origin[0], origin[1], origin[2]};
        roots_.push_back(root);
        nodes_.push_back(std::move(driver));

        std::vector<std::vector<NestedRotations>> parts(skin.joints.size());
        parallel_for(context_, parts.size(), 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t j = begin; j < end; ++j) parts[j] = align_rotations(motion.matrices[j]);
        });
        const Vec3d rest_scale = resting_rotations(skin.gradient_scale()).outer_scale;
        AnimationWriter animation(builder_, sampling, options_);
        Json joints = Json::array();
        std::vector<Eigen::Matrix4f> inverse_binds;
        for (std::size_t j = 0; j < skin.joints.size(); ++j) {
            const std::size_t outer = nodes_.size();
            nodes_[root]["children"].push_back(outer);
            nodes_.push_back({{"translation", json_numbers(skin.rest[j])},
                              {"scale", json_numbers(rest_scale)},
                              {"children", {outer + 1}}});
            nodes_.push_back({{"scale", json_numbers(kInnerScale)}});
            joints.push_back(outer + 1);
            inverse_binds.push_back(Eigen::Matrix4f::Identity());
            inverse_binds.back().topRightCorner<3, 1>() = -skin.rest[j].cast<float>();
            for (const Track& track :
                 make_tracks(parts[j], motion.translations[j], skin.rest[j], skin.gradient_scale()))
                animation.add(track, track.inner ? outer + 1 : outer);
        }
        if (Json moves = animation.finish(); !moves.is_null()) builder_.json["animations"] = Json::array({moves});
        const std::size_t binds = builder_.add({.type = "MAT4", .count = inverse_binds.size()},
                                               bytes_of(std::span<const Eigen::Matrix4f>(inverse_binds)));
        builder_.json["skins"] =
            Json::array({{{"joints", std::move(joints)}, {"inverseBindMatrices", binds}, {"skeleton", root}}});
        builder_.json["meshes"] = std::move(meshes_);
        builder_.json["nodes"] = std::move(nodes_);
        builder_.json["scenes"] = Json::array({{{"nodes", std::move(roots_)}}});
        builder_.json["scene"] = 0;
        if (!lost_.empty()) report_.warnings.push_back(cannot_hold("A skinned GLB", lost_));
    }

    /// Reads the file's own bytes and holds them against our restore.
    Status measure(const Sampling& sampling, PoseSampler& poses, const Restorer& restorer) {
        Result<std::string> bytes = builder_.bytes();
        if (!bytes) return bytes.error();
        const Result<GltfScene> scene = GltfScene::read(*bytes, "the exported GLB", context_);
        if (!scene) return scene.error();
        const Vec3d shift = scene->mesh().origin - model_.mesh.origin;
        const bool moves = !scene->animations().empty();
        std::vector<Vec3f> rest = scene->mesh().positions;
        const auto played = [&](double seconds, std::span<Vec3f> out) -> Status {
            if (!moves) std::copy(rest.begin(), rest.end(), out.begin());
            if (moves)
                if (Status s = scene->positions(0, seconds, out, context_); !s) return s;
            if (!shift.isZero(0))
                for (Vec3f& p : out) p = (p.cast<double>() + shift).cast<float>();
            return Success{};
        };
        const auto restored = [&](double seconds, std::span<Vec3f> out) -> Status {
            const Result<Pose> pose = poses.at(seconds);
            if (!pose) return pose.error();
            return restorer.positions(*pose, out, context_);
        };
        std::vector<double> keys;
        for (const Key& key : sampling.keys) keys.push_back(sampling.times[key.sample]);
        return measure_animation(played, scene->mesh().vertex_count(), restored, restorer.vertex_count(), keys,
                                 poses_.frames_per_second, report_, context_);
    }

    Json report_json() const {
        return {{"export", "skin"},
                {"influences", options_.influences},
                {"interpolation", options_.interpolation == KeyInterpolation::cubic ? "cubic" : "linear"},
                {"vertices", report_.vertices},
                {"joints", report_.joints},
                {"keys", report_.keys},
                {"frames", poses_.frames},
                {"frames_per_second", poses_.frames_per_second},
                {"seconds", report_.seconds},
                {"error_at_keys", report_.error_at_keys},
                {"rms_at_keys", report_.rms_at_keys},
                {"error_between_keys", report_.error_between_keys},
                {"rms_between_keys", report_.rms_between_keys},
                {"moments_checked", report_.moments_checked},
                {"normal_error_degrees", report_.normal_error_degrees}};
    }

    static double percentile95(std::vector<float> values) {
        if (values.empty()) return 0;
        const std::size_t place = (values.size() - 1) * 95 / 100;
        std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(place), values.end());
        return values[place];
    }
};

} // namespace

Result<ExportReport> write_skin_glb(const Model& model, const PoseStream& poses, const SkinOptions& options,
                                    const std::filesystem::path& path, const RunContext& context) {
    try {
        return SkinExport(model, poses, options, context).write(path);
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": does not fit into memory; export fewer keys."};
    }
}

} // namespace filigree
