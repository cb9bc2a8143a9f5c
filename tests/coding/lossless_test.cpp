// Any numbers and any lists come back as they were; what is expected takes next to nothing; damage is named or
// harmless.
#include "filigree/coding/lossless_corners.h"
#include "filigree/coding/lossless_numbers.h"
#include "filigree/mesh.h"

#include <bit>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>

using namespace filigree;

namespace {

using Words = std::vector<std::uint32_t>;

std::uint32_t bits_of(float value) { return std::bit_cast<std::uint32_t>(value); }

/// Coded, read, and compared. Bytes of the code.
std::size_t round_trip(const Words& known, const Words& words, WordLayout layout,
                       std::span<const Expectation> expected) {
    const std::string code = encode_numbers(known, words, layout, expected);
    const auto read = decode_numbers(code, known, words.size() / layout.columns, layout, expected);
    EXPECT_TRUE(read && *read == words);
    return code.size();
}

Words positions_of(const Mesh& mesh) {
    Words words;
    for (const Vec3f& p : mesh.positions)
        for (int k = 0; k < 3; ++k) words.push_back(bits_of(p[k]));
    return words;
}

std::vector<Expectation> expectations_of(const Mesh& mesh) {
    return vertex_expectations(mesh.face_offsets, mesh.corners, mesh.vertex_count(), kNoIndex);
}

} // namespace

TEST(LosslessNumbers, AnyWordsComeBack) {
    std::mt19937 engine(5);
    const auto random = [&] { return static_cast<std::uint32_t>(engine()); };
    for (int round = 0; round < 200; ++round) {
        const WordLayout layout{1 + unsigned(random() % 9), random() % 2 == 0, random() % 2 == 0};
        const std::size_t items = random() % 300, known = random() % 2 ? 0 : random() % 20;
        Words all((known + items) * layout.columns);
        const std::uint32_t values = random() % 3 ? 0 : 1 + random() % 40; // few different ones: a list
        for (std::uint32_t& word : all) word = values ? 77 * (random() % values) : std::uint32_t(random());
        std::vector<Expectation> expected(random() % 2 ? 0 : items);
        for (Expectation& e : expected) e = {Index(random() % 400), Index(random() % 400), Index(random() % 400)};
        const auto middle = all.begin() + std::ptrdiff_t(known * layout.columns);
        round_trip({all.begin(), middle}, {middle, all.end()}, layout, expected);
    }
}

TEST(LosslessNumbers, NumbersThatAreNone) {
    constexpr float kHuge = std::numeric_limits<float>::max(), kSmall = std::numeric_limits<float>::denorm_min();
    Words words = {0x7fc00001,     0xff800000,      0x7f800000,      0x80000000, 0xffffffff,
                   bits_of(kHuge), bits_of(-kHuge), bits_of(kSmall), 0,          bits_of(kHuge)};
    std::vector<Expectation> expected(words.size());
    for (Index i = 2; i < words.size(); ++i) expected[i] = {i - 1, i - 1, i - 2};
    round_trip({}, words, {1, true}, expected);
    round_trip({}, words, {1, false}, expected);
}

TEST(LosslessNumbers, WhatIsExpectedTakesLittle) {
    // A plane on a power of two: every parallelogram is exact.
    Mesh plane;
    constexpr Index kSide = 100;
    for (Index v = 0; v < kSide * kSide; ++v)
        plane.positions.emplace_back(float(v % kSide) / 64, float(v / kSide) / 64, 0.0f);
    for (Index y = 0; y + 1 < kSide; ++y)
        for (Index x = 0; x + 1 < kSide; ++x) {
            const Index v = y * kSide + x;
            plane.add_face(std::array{v, v + 1, v + kSide + 1, v + kSide});
        }
    EXPECT_LT(round_trip({}, positions_of(plane), {3, true}, expectations_of(plane)), 3000u);

    const Mesh wavy = make_wavy_sphere({.resolution = 60});
    const Words words = positions_of(wavy);
    const std::size_t guided = round_trip({}, words, {3, true}, expectations_of(wavy));
    EXPECT_LT(double(guided), 0.85 * double(round_trip({}, words, {3, true}, {})));
    EXPECT_LT(double(guided), 0.8 * double(4 * words.size()));

    Words rising, colours;
    for (std::uint32_t i = 0; i < 10'000; ++i) {
        rising.push_back(7 * i);
        colours.push_back(bits_of(float((i * i / 64) % 256) / 255));
    }
    EXPECT_LT(round_trip({}, rising, {1, false, true}, {}), 200u);
    EXPECT_LT(round_trip({}, colours, {1, true}, {}), colours.size() * 5 / 4);
}

TEST(LosslessNumbers, DamageIsNamedOrHarmless) {
    const Mesh wavy = make_wavy_sphere({.resolution = 6});
    const Words words = positions_of(wavy);
    const std::vector<Expectation> expected = expectations_of(wavy);
    const std::string code = encode_numbers({}, words, {3, true}, expected);
    for (std::size_t at = 0; at < code.size(); ++at) {
        std::string damaged = code;
        damaged[at] = char(damaged[at] ^ 0x15);
        const auto read = decode_numbers(damaged, {}, wavy.vertex_count(), {3, true}, expected);
        EXPECT_TRUE(!read || read->size() == words.size());
    }
    EXPECT_FALSE(decode_numbers(code.substr(0, code.size() / 2), {}, wavy.vertex_count(), {3, true}, expected));
    EXPECT_FALSE(decode_numbers("", {}, 10, {1, false}, {}));
    EXPECT_FALSE(decode_numbers(code, {}, std::size_t{1} << 40, {3, true}, {})); // no more memory than it has numbers
}

TEST(LosslessNumbers, ParallelogramsLieInTheirBlockAndBefore) {
    for (const Mesh& mesh : {make_wavy_sphere({.resolution = 20}), make_wavy_cube({.resolution = 12})}) {
        constexpr std::size_t kBlock = 300;
        const std::vector<Expectation> expected =
            vertex_expectations(mesh.face_offsets, mesh.corners, mesh.vertex_count(), kBlock);
        std::size_t over = 0;
        for (Index v = 0; v < expected.size(); ++v) {
            const Expectation& e = expected[v];
            for (const Index u : {e.near, e.across, e.behind})
                if (u != kNoIndex) {
                    EXPECT_LT(u, v);
                    EXPECT_EQ(u / kBlock, v / kBlock);
                }
            over += e.behind != kNoIndex;
        }
        EXPECT_GT(double(over), 0.5 * double(expected.size()));
    }
}

TEST(LosslessCorners, AnyFacesComeBackAsTheyWere) {
    std::mt19937 engine(9);
    const auto random = [&] { return static_cast<std::uint32_t>(engine()); };
    for (int round = 0; round < 200; ++round) {
        std::vector<Index> offsets = {0}, corners;
        const Index vertices = 1 + Index(random() % 60);
        for (unsigned f = random() % 120; f > 0; --f) {
            for (unsigned k = random() % 7; k > 0; --k)
                corners.push_back(random() % 50 ? Index(random() % vertices) : Index(random()));
            offsets.push_back(Index(corners.size()));
        }
        const auto read = decode_corners(encode_corners(offsets, corners), offsets);
        ASSERT_TRUE(read && *read == corners);
    }
}

TEST(LosslessCorners, MeshesTakeFewBits) {
    const Mesh quads = make_wavy_cube({.resolution = 64}), triangles = make_wavy_sphere({.resolution = 60});
    for (const auto& [mesh, most] : {std::pair(quads, 2.0), std::pair(triangles, 14.0)}) {
        const std::string code = encode_corners(mesh.face_offsets, mesh.corners);
        const auto read = decode_corners(code, mesh.face_offsets);
        ASSERT_TRUE(read && *read == mesh.corners);
        EXPECT_LT(8.0 * double(code.size()) / double(mesh.face_count()), most);
    }
}

TEST(LosslessCorners, ValuesAndRecords) {
    const Mesh mesh = make_wavy_sphere({.resolution = 30});
    std::vector<Index> values; // a seam: two values at every tenth vertex, none here and there
    for (std::size_t c = 0; c < mesh.corner_count(); ++c) {
        const Index v = mesh.corners[c];
        values.push_back(c % 97 == 0 ? kNoIndex : v % 10 == 0 && c % 2 ? Index(mesh.vertex_count() + v / 10) : v);
    }
    const std::string code = encode_values(mesh.corners, values);
    const auto read = decode_values(code, mesh.corners);
    ASSERT_TRUE(read && *read == values);
    EXPECT_LT(code.size(), values.size() / 2);

    std::mt19937 engine(3);
    const auto random = [&] { return static_cast<std::uint32_t>(engine()); };
    constexpr std::size_t kBlock = 1000, kVertices = 2500;
    std::vector<std::uint32_t> runs;
    std::vector<std::uint16_t> records(kVertices);
    std::vector<Index> near(kVertices);
    for (std::size_t begin = 0; begin < kVertices; begin += kBlock) {
        const std::size_t count = std::min(kBlock, kVertices - begin);
        std::vector<std::size_t> run_of(count), size(20);
        for (std::size_t v = 0; v < count; ++v) ++size[run_of[v] = std::min<std::size_t>(v / 70 + random() % 3, 19)];
        std::vector<std::size_t> next(20, 0);
        for (std::size_t r = 1; r < 20; ++r) next[r] = next[r - 1] + size[r - 1];
        for (const std::size_t s : size)
            if (s > 0) runs.push_back(std::uint32_t(s));
        for (std::size_t v = 0; v < count; ++v) {
            records[begin + v] = std::uint16_t(next[run_of[v]]++);
            near[begin + v] = v > 0 ? Index(begin + v - 1) : kNoIndex;
        }
    }
    const std::string order = encode_records(records, runs, kBlock, near);
    const auto back = decode_records(order, kVertices, runs, kBlock, near);
    ASSERT_TRUE(back && *back == records);
    EXPECT_LT(order.size(), kVertices / 2);
    for (std::uint16_t& record : records) record = std::uint16_t(random()); // no records at all
    const auto any = decode_records(encode_records(records, runs, kBlock, near), kVertices, runs, kBlock, near);
    ASSERT_TRUE(any && *any == records);
}

TEST(LosslessCorners, DamageIsNamedOrHarmless) {
    const Mesh mesh = make_wavy_cube({.resolution = 6});
    const std::string code = encode_corners(mesh.face_offsets, mesh.corners);
    for (std::size_t at = 0; at < code.size(); ++at)
        for (const char change : {char(1), char(0x80), char(0xff)}) {
            std::string damaged = code;
            damaged[at] = char(damaged[at] ^ change);
            const auto read = decode_corners(damaged, mesh.face_offsets);
            EXPECT_TRUE(!read || read->size() == mesh.corner_count());
            decode_values(damaged, mesh.corners);
            decode_records(damaged, 500, std::vector<std::uint32_t>{100, 400}, 200, {});
        }
}
