#include "filigree/io/gltf/glb_coded_keys.h"

#include "filigree/core/math.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <meshoptimizer.h>
#include <optional>

#include <Eigen/Geometry>

namespace filigree {

namespace {

using Json = GlbBuilder::Json;

constexpr unsigned kMostStep = 5;        // a key of 32
constexpr std::size_t kFewestKeys = 3;   // that a step may leave
constexpr double kMostOfTolerance = 0.9; // what leaving out keys may take of it
constexpr int kMantissaBits = 23;        // of the exponential filter, and of a float
constexpr int kFewestRotationBits = 4, kMostRotationBits = 16;
constexpr std::size_t kVectorBytes = 12, kRotationBytes = 8;

Eigen::Quaterniond rotation_at(std::span<const double> values, std::size_t key) {
    return {values[4 * key + 3], values[4 * key], values[4 * key + 1], values[4 * key + 2]};
}

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
    const Eigen::Quaterniond turn = a.conjugate() * b;
    return 2 * math::atan2(turn.vec().norm(), std::abs(turn.w()));
}

/// How far two keys of a track are from each other.
double distance(const KeyTrack& track, std::span<const double> a, std::size_t i, std::span<const double> b,
                std::size_t j) {
    if (track.is_rotation()) return angle_between(rotation_at(a, i), rotation_at(b, j));
    double squares = 0;
    for (std::size_t k = 0; k < track.width; ++k) {
        const double difference = a[i * track.width + k] - b[j * track.width + k];
        squares += difference * difference;
    }
    return std::sqrt(squares);
}

/// The largest distance of the track's keys from what `values` at the kept keys make of them.
double deviation(const KeyTrack& track, std::span<const double> values, std::span<const std::size_t> kept,
                 std::span<const double> times) {
    double largest = 0;
    std::vector<double> between(track.width);
    for (std::size_t piece = 0; piece < kept.size(); ++piece) {
        const std::size_t from = kept[piece];
        largest = std::max(largest, distance(track, track.values, from, values, piece));
        if (piece + 1 == kept.size()) break;
        for (std::size_t key = from + 1; key < kept[piece + 1]; ++key) {
            const double share = (times[key] - times[from]) / (times[kept[piece + 1]] - times[from]);
            if (track.is_rotation()) {
                const Eigen::Quaterniond turned =
                    math::slerp(rotation_at(values, piece), share, rotation_at(values, piece + 1));
                std::copy_n(turned.coeffs().data(), 4, between.begin());
            } else {
                for (std::size_t k = 0; k < track.width; ++k)
                    between[k] =
                        (1 - share) * values[piece * track.width + k] + share * values[(piece + 1) * track.width + k];
            }
            largest = std::max(largest, distance(track, track.values, key, between, 0));
        }
    }
    return largest;
}

std::vector<double> values_at(const KeyTrack& track, std::span<const std::size_t> kept) {
    std::vector<double> values;
    for (const std::size_t key : kept)
        values.insert(values.end(), track.values.begin() + std::ptrdiff_t(key * track.width),
                      track.values.begin() + std::ptrdiff_t((key + 1) * track.width));
    return values;
}

/// Vectors as whole multiples of a power of two: an exponent in the upper 8 bits, a mantissa in the lower 24.
CodedTrack code_vectors(std::span<const double> values, double tolerance) {
    double largest = 0;
    for (const double value : values) largest = std::max(largest, std::abs(value));
    int exponent = std::ilogb(std::max(2 * tolerance / std::sqrt(3.0), std::numeric_limits<double>::min()));
    if (largest > 0) exponent = std::max(exponent, std::ilogb(largest) + 2 - kMantissaBits);
    exponent = std::clamp(exponent, -126, 100);
    CodedTrack coded;
    coded.count = values.size() / 3;
    for (const double value : values) {
        const auto steps = static_cast<std::int32_t>(std::llround(std::ldexp(value, -exponent)));
        const auto unpacked = static_cast<float>(std::ldexp(double(steps), exponent));
        const std::uint32_t word = (std::uint32_t(exponent) << 24) | (std::uint32_t(steps) & 0xffffff);
        coded.bytes += bytes_of(std::span(&unpacked, 1));
        coded.filtered += bytes_of(std::span(&word, 1));
    }
    return coded;
}

/// Rotations with as many bits as keep them within the tolerance.
CodedTrack code_rotations(std::span<const double> values, double tolerance) {
    CodedTrack coded;
    coded.count = values.size() / 4;
    const std::vector<float> floats(values.begin(), values.end());
    const auto range = 1.5 / std::max(tolerance, 1e-9);
    int bits = std::clamp(std::ilogb(range) + 1, kFewestRotationBits, kMostRotationBits);
    for (;; ++bits) {
        coded.filtered.assign(coded.count * kRotationBytes, '\0');
        meshopt_encodeFilterQuat(coded.filtered.data(), coded.count, kRotationBytes, bits, floats.data());
        coded.bytes = coded.filtered;
        meshopt_decodeFilterQuat(coded.bytes.data(), coded.count, kRotationBytes);
        if (bits == kMostRotationBits) return coded;
        double largest = 0;
        for (std::size_t key = 0; key < coded.count; ++key) {
            std::array<std::int16_t, 4> steps;
            std::memcpy(steps.data(), coded.bytes.data() + key * kRotationBytes, kRotationBytes);
            const Eigen::Quaterniond unpacked(steps[3], steps[0], steps[1], steps[2]);
            largest = std::max(largest, angle_between(unpacked.normalized(), rotation_at(values, key).normalized()));
        }
        if (largest <= tolerance) return coded;
    }
}

CodedTrack code_keys(const KeyTrack& track, std::span<const double> values, double tolerance) {
    return track.is_rotation() ? code_rotations(values, tolerance) : code_vectors(values, tolerance);
}

/// About how many bits the vertex codec takes: it stores differences to the element before, byte by byte.
double estimated_bits(const CodedTrack& coded, std::size_t element) {
    double bits = 0;
    for (std::size_t at = element; at < coded.filtered.size(); at += 1) {
        const int now = static_cast<unsigned char>(coded.filtered[at]);
        const int before = static_cast<unsigned char>(coded.filtered[at - element]);
        const int difference = static_cast<std::int8_t>(now - before);
        const int size = std::abs(difference);
        bits += size == 0 ? 0.25 : size <= 1 ? 2 : size <= 7 ? 4.5 : 8;
    }
    return bits + 8 * double(element);
}

/// The middle of the least box around all keys; of rotations the key in the middle.
std::vector<double> middle_of(const KeyTrack& track) {
    const std::size_t keys = track.values.size() / track.width;
    if (track.is_rotation()) return values_at(track, std::array{keys / 2});
    std::vector<double> middle(track.width);
    for (std::size_t k = 0; k < track.width; ++k) {
        double least = track.values[k], most = least;
        for (std::size_t key = 0; key < keys; ++key) {
            least = std::min(least, track.values[key * track.width + k]);
            most = std::max(most, track.values[key * track.width + k]);
        }
        middle[k] = 0.5 * (least + most);
    }
    return middle;
}

double farthest_key(const KeyTrack& track, std::span<const double> from) {
    double largest = 0;
    for (std::size_t key = 0; key < track.values.size() / track.width; ++key)
        largest = std::max(largest, distance(track, track.values, key, from, 0));
    return largest;
}

} // namespace

std::vector<std::size_t> kept_keys(std::size_t keys, unsigned step) {
    std::vector<std::size_t> kept;
    for (std::size_t key = 0; key < keys; key += std::size_t{1} << step) kept.push_back(key);
    if (keys > 0 && kept.back() != keys - 1) kept.push_back(keys - 1);
    return kept;
}

CodedTrack code_track(const KeyTrack& track, std::span<const double> times) {
    if (farthest_key(track, std::span(track.rest).first(track.width)) <= track.tolerance) return {};
    const std::vector<double> middle = middle_of(track);
    if (const double off = farthest_key(track, middle); off <= kMostOfTolerance * track.tolerance || times.size() == 1)
        return code_keys(track, middle, track.tolerance - off);
    std::optional<CodedTrack> best;
    double least = std::numeric_limits<double>::infinity();
    for (unsigned step = 0; step <= kMostStep; ++step) {
        const std::vector<std::size_t> kept = kept_keys(times.size(), step);
        if (step > 0 && kept.size() < kFewestKeys) break;
        const std::vector<double> values = values_at(track, kept);
        const double off = step == 0 ? 0 : deviation(track, values, kept, times);
        if (off > kMostOfTolerance * track.tolerance) break;
        CodedTrack coded = code_keys(track, values, track.tolerance - off);
        const double bits = estimated_bits(coded, track.is_rotation() ? kRotationBytes : kVectorBytes);
        if (bits >= least) continue;
        least = bits;
        coded.step = step;
        best = std::move(coded);
    }
    return *std::move(best);
}

void CodedChannels::add(const KeyTrack& track, CodedTrack coded, std::size_t node) {
    if (coded.count == 0) return;
    Stream& stream = track.is_rotation() ? rotations_ : vectors_;
    channels_.push_back({node, track.path, coded.step, coded.count, stream.bytes.size(), track.is_rotation()});
    stream.bytes += coded.bytes;
    stream.filtered += coded.filtered;
}

Json CodedChannels::finish(const std::string& name) {
    if (channels_.empty()) return nullptr;
    std::map<std::pair<std::size_t, unsigned>, std::size_t> inputs; // by keys and step: accessors of times
    const auto input_of = [&](const Channel& channel) {
        const auto [known, is_new] = inputs.try_emplace({channel.count, channel.step}, 0);
        if (!is_new) return known->second;
        std::vector<float> times;
        if (channel.count == 1) {
            times = {0};
        } else {
            for (const std::size_t key : kept_keys(times_.size(), channel.step)) times.push_back(float(times_[key]));
        }
        return known->second = builder_.add_scalars(times, GltfTarget::none, true);
    };
    for (const Channel& channel : channels_) input_of(channel); // small numbers, which many samplers name
    std::size_t views[2] = {0, 0};
    if (!vectors_.bytes.empty())
        views[0] = builder_.add_filtered_view("EXPONENTIAL", kVectorBytes, std::move(vectors_.bytes),
                                              std::move(vectors_.filtered));
    if (!rotations_.bytes.empty())
        views[1] = builder_.add_filtered_view("QUATERNION", kRotationBytes, std::move(rotations_.bytes),
                                              std::move(rotations_.filtered));
    Json channels = Json::array(), samplers = Json::array();
    for (const Channel& channel : channels_) {
        const GltfAccessor accessor{.component = channel.rotation ? GltfComponent::int16 : GltfComponent::float32,
                                    .type = channel.rotation ? "VEC4" : "VEC3",
                                    .normalized = channel.rotation,
                                    .count = channel.count};
        const std::size_t output = builder_.add_accessor(accessor, views[channel.rotation ? 1 : 0], channel.offset);
        channels.push_back(
            {{"sampler", samplers.size()}, {"target", {{"node", channel.node}, {"path", channel.path}}}});
        samplers.push_back({{"input", input_of(channel)}, {"output", output}});
    }
    return {{"name", name}, {"channels", std::move(channels)}, {"samplers", std::move(samplers)}};
}

} // namespace filigree
