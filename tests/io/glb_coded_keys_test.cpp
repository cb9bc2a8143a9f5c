// Keys of joints in few bytes: no key moves farther than the tolerance, and what does not move costs nothing.
#include "filigree/io/gltf/glb_coded_keys.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

namespace filigree {
namespace {

std::vector<double> times_of(std::size_t keys) {
    std::vector<double> times;
    for (std::size_t k = 0; k < keys; ++k) times.push_back(double(k) / 24);
    return times;
}

template <class T>
std::vector<T> numbers_of(const std::string& bytes) {
    std::vector<T> numbers(bytes.size() / sizeof(T));
    std::memcpy(numbers.data(), bytes.data(), bytes.size());
    return numbers;
}

/// The farthest that the unpacked track is from the given one at any of the times, in the tolerance's unit.
double farthest(const KeyTrack& track, const CodedTrack& coded, const std::vector<double>& times) {
    const std::vector<std::size_t> kept =
        coded.count == 1 ? std::vector<std::size_t>{0} : kept_keys(times.size(), coded.step);
    const auto at = [&](std::size_t key) {
        Eigen::VectorXd value(Eigen::Index(track.width));
        for (std::size_t k = 0; k < track.width; ++k)
            value[Eigen::Index(k)] = track.width == 4
                                         ? numbers_of<std::int16_t>(coded.bytes)[key * track.width + k] / 32767.0
                                         : double(numbers_of<float>(coded.bytes)[key * track.width + k]);
        return value;
    };
    EXPECT_EQ(kept.size(), coded.count);
    double largest = 0;
    for (std::size_t t = 0; t < times.size(); ++t) {
        const std::size_t after = std::size_t(std::lower_bound(kept.begin(), kept.end(), t) - kept.begin());
        const std::size_t before = after < kept.size() && kept[after] == t ? after : after - 1;
        const std::size_t next = std::min(after, kept.size() - 1), first = std::min(before, kept.size() - 1);
        const double share =
            next == first ? 0 : (times[t] - times[kept[first]]) / (times[kept[next]] - times[kept[first]]);
        const Eigen::Map<const Eigen::VectorXd> truth(track.values.data() + t * track.width, Eigen::Index(track.width));
        if (track.width == 3) {
            largest = std::max(largest, ((1 - share) * at(first) + share * at(next) - truth).norm());
        } else {
            const Eigen::Quaterniond a = Eigen::Quaterniond(Eigen::Vector4d(at(first))).normalized();
            const Eigen::Quaterniond b = Eigen::Quaterniond(Eigen::Vector4d(at(next))).normalized();
            largest = std::max(largest, a.slerp(share, b).angularDistance(Eigen::Quaterniond(Eigen::Vector4d(truth))));
        }
    }
    return largest;
}

KeyTrack wandering(std::size_t width, std::size_t keys, double step, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, step);
    KeyTrack track{width == 4 ? "rotation" : "translation", false, width, {}, {0, 0, 0, 1}, 0};
    Eigen::Vector4d now(0.3, -0.2, 0.1, 0.9);
    for (std::size_t key = 0; key < keys; ++key) {
        now += Eigen::Vector4d(normal(random), normal(random), normal(random), normal(random));
        const Eigen::Vector4d value = width == 4 ? now.normalized() : now;
        track.values.insert(track.values.end(), value.data(), value.data() + width);
    }
    return track;
}

TEST(CodedKeys, StayWithinTheToleranceAndShrinkWithIt) {
    const std::vector<double> times = times_of(50);
    for (const std::size_t width : {3u, 4u}) {
        for (const double tolerance : {2e-4, 1e-3, 1e-2}) {
            KeyTrack track = wandering(width, times.size(), 0.02, 7);
            track.tolerance = tolerance;
            const CodedTrack coded = code_track(track, times);
            const double error = farthest(track, coded, times);
            EXPECT_LE(error, tolerance * 1.001) << width;
            EXPECT_GT(error, tolerance * 0.1) << width << ": far more digits than are asked for";
            EXPECT_EQ(coded.bytes.size(), coded.filtered.size());
        }
    }
}

TEST(CodedKeys, SmoothMotionLosesKeysAndStillnessAll) {
    const std::vector<double> times = times_of(65);
    KeyTrack line{"translation", false, 3, {}, {0, 0, 0, 0}, 1e-4};
    for (const double t : times) line.values.insert(line.values.end(), {t, -t, 0.5});
    const CodedTrack straight = code_track(line, times);
    EXPECT_EQ(straight.step, 5u);
    EXPECT_EQ(straight.count, 3u);
    EXPECT_LE(farthest(line, straight, times), 1e-4);

    KeyTrack still = line;
    for (std::size_t k = 0; k < still.values.size(); ++k) still.values[k] = 1e-5 * double(k % 2);
    EXPECT_EQ(code_track(still, times).count, 0u) << "at rest";
    for (double& value : still.values) value += 1;
    EXPECT_EQ(code_track(still, times).count, 1u) << "elsewhere";
    EXPECT_LE(farthest(still, code_track(still, times), times), 1e-4);

    KeyTrack turned = wandering(4, times.size(), 0, 1);
    turned.tolerance = 1e-3;
    EXPECT_EQ(code_track(turned, times).count, 1u);
    turned.tolerance = 3;
    EXPECT_EQ(code_track(turned, times).count, 0u);
}

TEST(CodedKeys, HugeAndTinyNumbersStayFinite) {
    const std::vector<double> times = times_of(3);
    for (const double scale : {1e-30, 1e30}) {
        KeyTrack track{"translation", false, 3, {}, {0, 0, 0, 0}, 1e-9 * scale};
        for (int k = 0; k < 9; ++k) track.values.push_back(scale * (k + 1));
        const CodedTrack coded = code_track(track, times);
        EXPECT_LE(farthest(track, coded, times), 4e-6 * scale);
    }
    KeyTrack exact{"translation", false, 3, {1, 2, 3, 4, 5, 6, 7, 8, 10}, {0, 0, 0, 0}, 0};
    EXPECT_LE(farthest(exact, code_track(exact, times), times), 1e-5);
}

} // namespace
} // namespace filigree
