#include "filigree/io/gltf_export_error.h"

#include <algorithm>
#include <cmath>

namespace filigree {

PoseSampler::PoseSampler(const FrameSource<Pose>& stream, std::function<Status(const Pose&)> check)
    : stream_(stream), check_(std::move(check)) {}

Result<const Pose*> PoseSampler::frame(std::size_t number) {
    for (const Kept& kept : kept_)
        if (kept.frame == number) return &kept.pose;
    Result<Pose> pose = stream_.frame(number);
    if (!pose) return pose.error();
    if (Status fine = check_(*pose); !fine) return fine.error();
    if (kept_.size() == 2) kept_.erase(kept_.begin());
    kept_.push_back({number, std::move(*pose)});
    return &kept_.back().pose;
}

Result<Pose> PoseSampler::at(double seconds) {
    constexpr double kSameMoment = 1e-6; // of a frame
    const double place = std::clamp(seconds * stream_.frames_per_second, 0.0, double(stream_.frames - 1));
    const auto before = static_cast<std::size_t>(std::floor(place + kSameMoment));
    const auto part = static_cast<float>(place - double(before));
    Result<const Pose*> first = frame(before);
    if (!first) return first.error();
    if (part <= kSameMoment || before + 1 >= stream_.frames) return **first;
    Pose pose = **first;
    const Result<const Pose*> second = frame(before + 1);
    if (!second) return second.error();
    const auto blend = [part](auto& from, const auto& to) {
        if (from.size() != to.size()) from.clear();
        for (std::size_t i = 0; i < from.size(); ++i) from[i] = (1 - part) * from[i] + part * to[i];
    };
    blend(pose.positions, (*second)->positions);
    blend(pose.gradients, (*second)->gradients);
    return pose;
}

namespace {

struct Moment {
    double seconds;
    bool is_key;
};

/// Keys, and between two of them every frame that lies strictly between, or the middle where none does.
std::vector<Moment> list_moments(std::span<const double> keys, double frames_per_second) {
    constexpr double kSameMoment = 1e-3; // of a frame
    std::vector<Moment> moments;
    for (std::size_t k = 0; k < keys.size(); ++k) {
        moments.push_back({keys[k], true});
        if (k + 1 == keys.size()) break;
        const double first = std::floor(keys[k] * frames_per_second + kSameMoment) + 1;
        const double end = keys[k + 1] * frames_per_second - kSameMoment;
        for (double frame = first; frame < end; ++frame) moments.push_back({frame / frames_per_second, false});
        if (moments.back().is_key) moments.push_back({0.5 * (keys[k] + keys[k + 1]), false});
    }
    return moments;
}

struct ErrorSum {
    double largest = 0, squares = 0;
    std::size_t count = 0;

    void add(std::span<const Vec3f> a, std::span<const Vec3f> b) {
        for (std::size_t v = 0; v < b.size(); ++v) {
            const double square = (a[v].cast<double>() - b[v].cast<double>()).squaredNorm();
            largest = std::max(largest, square);
            squares += square;
        }
        count += b.size();
    }
    double max() const { return std::sqrt(largest); }
    double rms() const { return count ? std::sqrt(squares / double(count)) : 0; }
};

} // namespace

Status measure_animation(const PositionsAt& played, std::size_t played_count, const PositionsAt& restored,
                         std::size_t restored_count, std::span<const double> keys, double frames_per_second,
                         ExportReport& report, const RunContext& context) {
    constexpr double kVerticesChecked = 1e8;
    if (restored_count == 0 || played_count < restored_count)
        return Error{ErrorCode::unsuitable, "The exported GLB has fewer vertices than the mesh: please report this."};
    const std::vector<Moment> moments = list_moments(keys, frames_per_second);
    const std::size_t most =
        std::max<std::size_t>(16, static_cast<std::size_t>(kVerticesChecked / double(restored_count)));
    const std::size_t checked = std::min(moments.size(), most);
    std::vector<Vec3f> a(played_count), b(restored_count);
    ErrorSum at_keys, between;
    double diagonal = 0;
    for (std::size_t i = 0; i < checked; ++i) {
        if (context.is_cancelled()) return cancelled_error();
        context.report("measuring the error", double(i) / double(checked));
        const Moment& moment = moments[checked > 1 ? i * (moments.size() - 1) / (checked - 1) : 0];
        if (Status s = played(moment.seconds, a); !s) return s;
        if (Status s = restored(moment.seconds, b); !s) return s;
        if (i == 0) diagonal = bounds(b).diagonal();
        (moment.is_key ? at_keys : between).add(a, b);
    }
    report.moments = moments.size();
    report.moments_checked = checked;
    const double scale = diagonal > 0 ? 1 / diagonal : 0;
    report.error_at_keys = scale * at_keys.max();
    report.rms_at_keys = scale * at_keys.rms();
    report.error_between_keys = scale * between.max();
    report.rms_between_keys = scale * between.rms();
    return Success{};
}

} // namespace filigree
