// Clips: within the error that was asked for, few curves for simple motion, damage named.
#include "filigree/pack/clip_code.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

using namespace filigree;

namespace {

constexpr std::size_t kSide = 16, kVertices = kSide * kSide;

ClipOrder grid_order() {
    std::vector<Index> offsets = {0}, corners;
    for (Index j = 0; j + 1 < kSide; ++j)
        for (Index i = 0; i + 1 < kSide; ++i) {
            const Index a = j * Index(kSide) + i;
            corners.insert(corners.end(), {a, a + 1, a + Index(kSide) + 1, a + Index(kSide)});
            offsets.push_back(Index(corners.size()));
        }
    return clip_order(offsets, corners, kVertices);
}

/// A sheet that swings: a few curves in time, different from vertex to vertex.
ClipFrames swinging(std::size_t frames) {
    ClipFrames clip;
    for (std::size_t t = 0; t < frames; ++t) {
        std::vector<float>& values = clip.emplace_back();
        for (std::size_t v = 0; v < kVertices; ++v) {
            const double x = double(v % kSide) / kSide, y = double(v / kSide) / kSide, s = 0.1 * double(t);
            for (const double value : {x + 0.1 * std::sin(s) * y, y, 0.2 * std::sin(s + 3 * x)})
                values.push_back(float(value));
        }
    }
    return clip;
}

double rms(const ClipFrames& a, const ClipFrames& b) {
    double squares = 0;
    for (std::size_t t = 0; t < a.size(); ++t)
        for (std::size_t i = 0; i < a[t].size(); ++i) squares += std::pow(double(a[t][i]) - double(b[t][i]), 2);
    return std::sqrt(squares / double(a.size() * a[0].size()));
}

} // namespace

TEST(ClipCode, OrderVisitsEveryVertexBesideAKnownOne) {
    const ClipOrder order = grid_order();
    ASSERT_EQ(order.vertex.size(), kVertices);
    std::vector<bool> is_known(kVertices);
    for (std::size_t i = 0; i < kVertices; ++i) {
        EXPECT_FALSE(is_known[order.vertex[i]]);
        EXPECT_TRUE(i == 0 || is_known[order.near[i]]);
        is_known[order.vertex[i]] = true;
    }
    EXPECT_EQ(clip_order({}, {}, 3).vertex.size(), 3u) << "points have no neighbours";
}

TEST(ClipCode, WithinTheErrorAskedFor) {
    const ClipFrames clip = swinging(90);
    const ClipOrder order = grid_order();
    const std::vector<double> weights(3, 1.0);
    std::size_t before = 0;
    for (const double error : {1e-3, 1e-4, 1e-5}) {
        const std::string code = encode_clip(clip, weights, error, order);
        const ClipFrames read = decode_clip(code, 3, order).value();
        ASSERT_EQ(read.size(), clip.size());
        EXPECT_LT(rms(read, clip), 1.05 * error);
        EXPECT_GT(code.size(), before);
        before = code.size();
    }
    EXPECT_LT(before * 8, 2 * kVertices * clip.size()) << "two bits a vertex and frame: it follows four curves";
}

TEST(ClipCode, NoiseAndStandingStill) {
    const ClipOrder order = grid_order();
    std::mt19937 random(1);
    ClipFrames noise(20, std::vector<float>(3 * kVertices));
    for (auto& frame : noise)
        for (float& value : frame) value = float(random() % 1000) / 1000;
    const std::vector<double> weights(3, 1.0);
    EXPECT_LT(rms(decode_clip(encode_clip(noise, weights, 1e-3, order), 3, order).value(), noise), 1.05e-3);
    const ClipFrames nothing(5, std::vector<float>(3 * kVertices, 0.0f));
    EXPECT_EQ(decode_clip(encode_clip(nothing, weights, 1e-3, order), 3, order).value(), nothing);
}

TEST(ClipCode, DamageIsNamedOrHarmless) {
    const ClipOrder order = grid_order();
    const std::vector<double> weights(3, 1.0);
    const std::string code = encode_clip(swinging(20), weights, 1e-4, order);
    for (std::size_t at = 0; at < code.size(); ++at)
        for (const int by : {1, 255}) {
            std::string damaged = code;
            damaged[at] = char(damaged[at] ^ by);
            const auto read = decode_clip(damaged, 3, order);
            EXPECT_TRUE(!read || read->size() <= kClipFrames);
        }
    for (std::size_t length = 0; length < code.size(); length += 7)
        EXPECT_FALSE(decode_clip(std::string_view(code).substr(0, length), 3, order));
}

TEST(ClipCode, MoreFramesThanThereIsRoomForAreDamage) {
    const ClipFrames still(100, std::vector<float>(30, 1.5f));
    const std::vector<double> weights(3, 1);
    const std::vector<Index> offsets = {0, 3, 6, 9}, corners = {0, 1, 2, 3, 4, 5, 6, 7, 8};
    const ClipOrder order = clip_order(offsets, corners, 10);
    const std::string code = encode_clip(still, weights, 1e-3, order);
    EXPECT_TRUE(decode_clip(code, 3, order));
    EXPECT_TRUE(decode_clip(code, 3, order, 100));
    EXPECT_FALSE(decode_clip(code, 3, order, 99));
}
