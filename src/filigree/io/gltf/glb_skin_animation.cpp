#include "filigree/io/gltf/glb_skin_animation.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/io/gltf/glb_coded_keys.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

using Json = GlbBuilder::Json;

/// How far a normal may be off that is turned by the matrix itself: atan r - atan(1/r), r the largest stretch ratio.
double normal_error(const Mat3d& gradient) {
    const Vec3d s = singular_values_only(gradient);
    if (!(s[2] > 0)) return 90;
    const double ratio = s[0] / s[2];
    return (math::atan(ratio) - math::atan(1 / ratio)) * 180 / std::numbers::pi;
}

double percentile95(std::vector<float> values) {
    if (values.empty()) return 0;
    const std::size_t place = (values.size() - 1) * 95 / 100;
    std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(place), values.end());
    return values[place];
}

constexpr std::size_t kTracksOfJoint = 4;

std::array<KeyTrack, kTracksOfJoint> make_tracks(const std::vector<NestedRotations>& parts,
                                                 std::span<const Vec3f> translations, const Vec3d& rest,
                                                 double gradient_scale) {
    const Vec3d scale = resting_rotations(gradient_scale).outer_scale;
    std::array<KeyTrack, kTracksOfJoint> tracks = {{{"translation", false, 3, {}, {rest[0], rest[1], rest[2], 0}},
                                                    {"rotation", false, 4, {}, {0, 0, 0, 1}},
                                                    {"scale", false, 3, {}, {scale[0], scale[1], scale[2], 0}},
                                                    {"rotation", true, 4, {}, {0, 0, 0, 1}}}};
    const auto add = [](KeyTrack& track, const auto& numbers) {
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

/// How far from each joint the skin has vertices that it moves.
std::vector<double> joint_reach(const Skin& skin) {
    std::vector<double> reach(skin.joints.size(), 0);
    for (std::size_t i = 0; i < skin.vertex_joints.size(); ++i) {
        if (!(skin.vertex_weights[i] > 0)) continue;
        const Index joint = skin.vertex_joints[i];
        const Vec3d from = skin.positions[i / skin.slots].cast<double>() - skin.rest[joint];
        reach[joint] = std::max(reach[joint], from.norm());
    }
    return reach;
}

/// Tolerances with which each of a joint's tracks moves what hangs on it by `share` at most. A joint's matrix is
/// outer_rotation * diag(outer_scale) * inner_rotation * diag(kInnerScale).
void set_tolerances(std::array<KeyTrack, kTracksOfJoint>& tracks, double share, double reach) {
    constexpr double kMostTurn = 0.1, kMostScale = 0.05; // beyond which an angle is no longer small
    const double inner = kInnerScale.maxCoeff();
    double largest = 0; // scale
    for (const double value : tracks[2].values) largest = std::max(largest, std::abs(value));
    const double turn = reach * largest * inner;
    tracks[0].tolerance = share;
    tracks[1].tolerance = tracks[3].tolerance = turn > 0 ? std::min(share / turn, kMostTurn) : kMostTurn;
    tracks[2].tolerance = reach > 0 ? std::min(share / (reach * inner), kMostScale) : kMostScale;
}

/// Numbers as a sampler's output holds them: at keys alone, or each between its tangents.
std::vector<double> key_values(const KeyTrack& track, std::span<const SkinKey> keys, bool cubic) {
    std::vector<double> values;
    const auto number = [&](std::size_t sample, std::size_t k) { return track.values[sample * track.width + k]; };
    for (const SkinKey& key : keys)
        for (int part = cubic ? -1 : 0; part <= (cubic ? 1 : 0); ++part)
            for (std::size_t k = 0; k < track.width; ++k) {
                double slope = 0;
                for (const auto& [sample, weight] : key.slope) slope += weight * number(sample, k);
                values.push_back(part == 0 ? number(key.sample, k) : slope);
            }
    return values;
}

/// Writes the tracks of all joints as one animation.
class ChannelWriter {
public:
    ChannelWriter(GlbBuilder& builder, std::span<const SkinKey> keys, std::span<const float> times, bool cubic,
                  bool small_rotations)
        : builder_(builder), keys_(keys), cubic_(cubic), small_rotations_(small_rotations),
          input_(builder.add_scalars(times, GltfTarget::none, true)) {}

    /// A track that stays at rest is left out; one that stays elsewhere has a single key.
    void add(const KeyTrack& track, std::size_t node) {
        std::vector<double> values = key_values(track, keys_, cubic_);
        const std::size_t step = track.width * (cubic_ ? 3 : 1);
        const bool constant = is_constant(track, values, step);
        if (constant && is_at_rest(track)) return;
        const bool held = constant && keys_.size() > 1;
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
        const std::size_t output =
            samplers_.empty() ? builder_.add(accessor, std::move(bytes)) : builder_.append(accessor, bytes);
        if (held) held_.push_back(samplers_.size());
        Json sampler = {{"input", input_}, {"output", output}};
        if (cubic_ && !held) sampler["interpolation"] = "CUBICSPLINE";
        channels_.push_back({{"sampler", samplers_.size()}, {"target", {{"node", node}, {"path", track.path}}}});
        samplers_.push_back(std::move(sampler));
    }

    /// The animation, or null when nothing moves.
    Json finish(const std::string& name) {
        if (channels_.empty()) return nullptr;
        if (!held_.empty()) {
            const float zero = 0;
            const std::size_t moment = builder_.add_scalars(std::span(&zero, 1), GltfTarget::none, true);
            for (const std::size_t sampler : held_) samplers_[sampler]["input"] = moment;
        }
        return {{"name", name}, {"channels", std::move(channels_)}, {"samplers", std::move(samplers_)}};
    }

private:
    GlbBuilder& builder_;
    std::span<const SkinKey> keys_;
    bool cubic_, small_rotations_;
    std::size_t input_;
    std::vector<std::size_t> held_; ///< samplers with one key
    Json channels_ = Json::array(), samplers_ = Json::array();

    static bool same(double a, double b) { return static_cast<float>(a) == static_cast<float>(b); }
    bool is_constant(const KeyTrack& track, const std::vector<double>& values, std::size_t step) const {
        for (std::size_t k = 0; k < values.size(); ++k) {
            const bool tangent = cubic_ && (k % step < track.width || k % step >= 2 * track.width);
            if (!same(values[k], tangent ? 0 : values[k % step])) return false;
        }
        return true;
    }
    bool is_at_rest(const KeyTrack& track) const {
        for (std::size_t k = 0; k < track.width; ++k)
            if (!same(track.values[k], track.rest[k])) return false;
        return true;
    }
};

} // namespace

void SkinAnimation::plan(const FrameSource<Pose>& stream, const SkinOptions& options) {
    const double duration = double(stream.frames - 1) / stream.frames_per_second;
    const double rate = options.key_rate.value_or(stream.frames_per_second);
    std::vector<double> keys;
    const auto steps = static_cast<std::size_t>(std::floor(duration * rate * (1 + 1e-12)));
    for (std::size_t k = 0; k <= steps; ++k) keys.push_back(std::min(double(k) / rate, duration));
    if (duration - keys.back() > 1e-6 / rate) keys.push_back(duration); // the last frame is always a key
    cubic_ = options.interpolation == KeyInterpolation::cubic && keys.size() > 1;
    small_rotations_ = !options.full_precision && !cubic_; // tangents go beyond what 16 bits hold
    if (options.compress && small_rotations_) key_error_ = options.key_error;

    const auto sample = [&](double time) {
        times_.push_back(std::clamp(time, 0.0, duration));
        return times_.size() - 1;
    };
    // Differences of second order: from both sides, and at the ends from two steps inwards.
    const double aside = std::min({1 / stream.frames_per_second, 0.5 / rate, 0.5 * duration});
    for (const double time : keys) {
        const double side = time == 0 ? 1 : time == duration ? -1 : 0;
        if (!cubic_) {
            keys_.push_back({sample(time)});
        } else if (side == 0) {
            const std::size_t before = sample(time - aside), at = sample(time), after = sample(time + aside);
            const double weight = 0.5 / aside;
            keys_.push_back({at, {{{before, -weight}, {at, 0}, {after, weight}}}});
        } else {
            const double weight = 0.5 * side / aside;
            const std::size_t at = sample(time), near = sample(time + side * aside),
                              far = sample(time + 2 * side * aside);
            keys_.push_back({at, {{{at, -3 * weight}, {near, 4 * weight}, {far, -weight}}}});
        }
    }
}

Result<SkinAnimation> SkinAnimation::sample(const Skin& skin, const FrameSource<Pose>& stream, PoseSampler& poses,
                                            const Restorer& restorer, const SkinOptions& options,
                                            const RunContext& context) {
    constexpr double kMostBytes = 4294967296.0, kBytesAKey = 40; // of a joint, at 16 bits
    const double keys =
        1 + double(stream.frames - 1) / stream.frames_per_second * options.key_rate.value_or(stream.frames_per_second);
    if (keys * double(skin.joints.size()) * kBytesAKey > kMostBytes)
        return Error{ErrorCode::unsupported,
                     std::to_string(skin.joints.size()) + " joints with about " + std::to_string(std::llround(keys)) +
                         " keys each pass the 4 GiB that a GLB can have; choose a lower key rate, "
                         "fewer frames or a smaller driver."};
    SkinAnimation animation;
    animation.plan(stream, options);
    const std::size_t joints = skin.joints.size(), samples = animation.times_.size();
    animation.matrices_.assign(joints, std::vector<Mat3f>(samples));
    animation.translations_.assign(joints, std::vector<Vec3f>(samples));
    std::vector<bool> is_key(samples, false);
    for (const SkinKey& key : animation.keys_) is_key[key.sample] = true;
    std::vector<float> normal_errors;
    for (std::size_t s = 0; s < samples; ++s) {
        if (context.is_cancelled()) return cancelled_error();
        context.report("sampling the driver", double(s) / double(samples));
        const Result<Pose> pose = poses.at(animation.times_[s]);
        if (!pose) return pose.error();
        const Result<std::vector<Mat3f>> found = restorer.gradients(*pose, context);
        if (!found) return found.error();
        const std::vector<Mat3f>& gradients = *found;
        parallel_for(context, joints, 256, [&](std::size_t begin, std::size_t end) {
            for (std::size_t j = begin; j < end; ++j) {
                const JointTransform joint = joint_transform(skin, j, pose->positions, gradients);
                animation.matrices_[j][s] = joint.matrix.cast<float>();
                animation.translations_[j][s] = joint.translation.cast<float>();
            }
        });
        if (!is_key[s]) continue;
        const std::size_t before = normal_errors.size();
        normal_errors.resize(before + gradients.size());
        parallel_for(context, gradients.size(), 256, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                normal_errors[before + i] = float(normal_error(gradients[i].cast<double>()));
        });
    }
    animation.normal_error_degrees_ = percentile95(std::move(normal_errors));
    return animation;
}

std::vector<double> SkinAnimation::key_times() const {
    std::vector<double> times;
    for (const SkinKey& key : keys_) times.push_back(times_[key.sample]);
    return times;
}

/// Of the driver where it is first: a pose may be in other units than the rest shape.
double SkinAnimation::diagonal() const {
    Box box;
    for (const std::vector<Vec3f>& places : translations_) box.extend(places.front().cast<double>());
    return box.diagonal();
}

Vec3d SkinAnimation::place(const Skin& skin, std::size_t vertex, std::size_t sample) const {
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = vertex * skin.slots; i < (vertex + 1) * skin.slots; ++i) {
        if (!(skin.vertex_weights[i] > 0)) continue;
        const Index joint = skin.vertex_joints[i];
        const Vec3d from = skin.positions[vertex].cast<double>() - skin.rest[joint];
        sum += double(skin.vertex_weights[i]) *
               (matrices_[joint][sample].cast<double>() * from + translations_[joint][sample].cast<double>());
    }
    return sum;
}

double SkinAnimation::distance(const Skin& a, const Skin& b, const RunContext& context) const {
    constexpr std::size_t kKeys = 5, kGrain = 4096;
    std::vector<double> farthest((a.positions.size() + kGrain - 1) / kGrain, 0);
    for (std::size_t k = 1; k <= kKeys; ++k) {
        const std::size_t sample = keys_[(keys_.size() - 1) * k / kKeys].sample;
        parallel_for(context, a.positions.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            double& largest = farthest[begin / kGrain];
            for (std::size_t v = begin; v < end; ++v)
                largest = std::max(largest, (place(a, v, sample) - place(b, v, sample)).norm());
        });
    }
    const double size = diagonal();
    return size > 0 && !farthest.empty() ? *std::ranges::max_element(farthest) / size : 0;
}

GlbBuilder::Json SkinAnimation::add_to(GlbBuilder& builder, const std::string& name, const Skin& skin,
                                       std::size_t first_node, const RunContext& context) const {
    std::vector<std::vector<NestedRotations>> parts(skin.joints.size());
    parallel_for(context, parts.size(), 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j) {
            std::vector<Mat3d> matrices;
            for (const Mat3f& matrix : matrices_[j]) matrices.push_back(matrix.cast<double>());
            parts[j] = align_rotations(matrices);
        }
    });
    const std::vector<double> times = key_times();
    if (key_error_) return add_coded(builder, name, skin, first_node, parts, context);
    ChannelWriter channels(builder, keys_, std::vector<float>(times.begin(), times.end()), cubic_, small_rotations_);
    for (std::size_t j = 0; j < parts.size(); ++j)
        for (const KeyTrack& track : make_tracks(parts[j], translations_[j], skin.rest[j], skin.gradient_scale()))
            channels.add(track, first_node + 2 * j + (track.inner ? 1 : 0));
    return channels.finish(name);
}

GlbBuilder::Json SkinAnimation::add_coded(GlbBuilder& builder, const std::string& name, const Skin& skin,
                                          std::size_t first_node, std::span<const std::vector<NestedRotations>> parts,
                                          const RunContext& context) const {
    const std::vector<double> times = key_times();
    const std::vector<double> reach = joint_reach(skin);
    const double share = *key_error_ * diagonal() / kTracksOfJoint;
    std::vector<std::array<KeyTrack, kTracksOfJoint>> tracks(parts.size());
    std::vector<std::array<CodedTrack, kTracksOfJoint>> coded(parts.size());
    parallel_for(context, parts.size(), 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j) {
            tracks[j] = make_tracks(parts[j], translations_[j], skin.rest[j], skin.gradient_scale());
            set_tolerances(tracks[j], share, reach[j]);
            for (std::size_t k = 0; k < kTracksOfJoint; ++k) coded[j][k] = code_track(tracks[j][k], times);
        }
    });
    CodedChannels channels(builder, times);
    for (std::size_t j = 0; j < parts.size(); ++j)
        for (std::size_t k = 0; k < kTracksOfJoint; ++k)
            channels.add(tracks[j][k], std::move(coded[j][k]), first_node + 2 * j + (tracks[j][k].inner ? 1 : 0));
    return channels.finish(name);
}

} // namespace filigree
