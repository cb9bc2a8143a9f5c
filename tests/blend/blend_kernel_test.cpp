// The kernel against the formula it comes from, in double and written out plainly.
#include "blend/stripping.h"
#include "filigree/blend/blend_kernel.h"
#include "threads.h"

#include <Eigen/LU>
#include <cstring>
#include <gtest/gtest.h>
#include <numeric>
#include <random>

namespace filigree {
namespace {

using namespace blend_kernel;

/// Random records and transforms, and all that the plain formula needs.
struct Scene {
    Records records;
    std::vector<VertexTransform> transforms;
    std::vector<Vec3d> rest, now;
    std::vector<Mat3d> gradients;
    std::vector<Vec3d> points, normals; ///< p and n of each record, as its rounded numbers say
};

/// run_lengths: records of each run; every run has a cell of its own, so its number is the cell's.
Scene make_scene(const std::vector<Index>& run_lengths, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(-1, 1), weight(0, 0.5);
    const auto any3 = [&] { return Vec3d(any(random), any(random), any(random)); };
    const auto as_float = [](const Vec3d& x) { return Vec3d(x.cast<float>().cast<double>()); };
    Scene scene;
    const Index drivers = 50;
    for (Index i = 0; i < drivers; ++i) {
        scene.rest.push_back(as_float(any3()));
        scene.now.push_back(as_float(any3()));
        Mat3d a;
        a << any3(), any3(), any3();
        scene.gradients.push_back((a + Mat3d::Identity()).cast<float>().cast<double>());
        VertexTransform& t = scene.transforms.emplace_back();
        const Vec3d half = 0.5 * scene.rest[i], shifted = scene.now[i] - scene.gradients[i] * half;
        for (int k = 0; k < 3; ++k) t.t[k] = static_cast<float>(shifted[k]);
        for (int k = 0; k < 9; ++k) t.a[k] = static_cast<float>(scene.gradients[i](k % 3, k / 3));
    }
    Records& records = scene.records;
    for (const Index length : run_lengths) {
        const Index cell = static_cast<Index>(records.cells.size());
        records.cells.push_back({static_cast<Index>(random() % drivers), static_cast<Index>(random() % drivers),
                                 static_cast<Index>(random() % drivers)});
        records.runs.push_back({cell, static_cast<Index>(records.count), length});
        for (Index k = 0; k < length; ++k, ++records.count) {
            Vec3d b(0, weight(random), weight(random));
            const Vec3d offset = 0.1 * any3(), n = as_float(any3().normalized());
            records.u.push_back(static_cast<float>(b[1]));
            records.v.push_back(static_cast<float>(b[2]));
            b = {0, records.u.back(), records.v.back()};
            b[0] = 1 - b[1] - b[2];
            Vec3d m = Vec3d::Zero(), rounded;
            for (int i = 0; i < 3; ++i) m += b[i] * scene.rest[records.cells[cell][i]];
            for (int i = 0; i < 3; ++i) {
                records.q[i].push_back(static_cast<float>(offset[i] + m[i] / 2));
                rounded[i] = records.q[i].back() + m[i] / 2;
                records.normal[i].push_back(k % 5 == 3 ? 0 : static_cast<float>(n[i]));
            }
            scene.points.push_back(rounded);
            scene.normals.push_back(k % 5 == 3 ? Vec3d(Vec3d::Zero()) : n);
        }
    }
    const std::size_t padded = records.count + kPadding;
    for (auto* floats : {&records.u, &records.v, &records.q[0], &records.q[1], &records.q[2], &records.normal[0],
                         &records.normal[1], &records.normal[2]})
        floats->resize(padded);
    records.slot.resize(records.count);
    std::iota(records.slot.begin(), records.slot.end(), Index{0});
    std::shuffle(records.slot.begin(), records.slot.end(), random);
    return scene;
}

/// p' = sum b_i [c_i' + 1/2 (A_i + A_p)(p - c_i)] and n' = unit(det(A_p) A_p^-T n).
std::pair<Vec3d, Vec3d> plain(const Scene& scene, std::size_t record) {
    const Records& records = scene.records;
    const Run& run = *(std::upper_bound(records.runs.begin(), records.runs.end(), record,
                                        [](std::size_t r, const Run& x) { return r < x.first; }) -
                       1);
    const Triangle& cell = records.cells[run.cell];
    const double u = double(records.u[record]);
    const double v = double(records.v[record]);
    const Vec3d b(1 - u - v, u, v), p = scene.points[record];
    Mat3d blended = Mat3d::Zero();
    for (int i = 0; i < 3; ++i) blended += b[i] * scene.gradients[cell[i]];
    Vec3d moved = Vec3d::Zero();
    for (int i = 0; i < 3; ++i)
        moved += b[i] * (scene.now[cell[i]] + 0.5 * (scene.gradients[cell[i]] + blended) * (p - scene.rest[cell[i]]));
    Mat3d cofactor;
    cofactor << blended.col(1).cross(blended.col(2)), blended.col(2).cross(blended.col(0)),
        blended.col(0).cross(blended.col(1));
    return {moved, (cofactor * scene.normals[record]).normalized()};
}

struct Restored {
    std::vector<Vec3f> positions, normals;
};

Restored restored(const Scene& scene, int lanes, bool in_order, const RunContext& context = kOneThread) {
    Restored out;
    out.positions.resize(scene.records.count, Vec3f::Constant(NAN));
    out.normals.resize(scene.records.count, Vec3f::Constant(NAN));
    blend_kernel::restore(scene.records, scene.transforms,
                          {.positions = out.positions.data(), .normals = out.normals.data(), .in_order = in_order},
                          lanes, context);
    return out;
}

using filigree_test::same_bytes;

std::vector<Index> every_length() {
    std::vector<Index> lengths(kMaxRun);
    std::iota(lengths.begin(), lengths.end(), Index{1});
    return lengths;
}

TEST(BlendKernel, IsTheHermiteBlend) {
    const Scene scene = make_scene(every_length(), 1);
    const Restored out = restored(scene, lane_counts().back(), false);
    for (std::size_t r = 0; r < scene.records.count; ++r) {
        const auto [p, n] = plain(scene, r);
        ASSERT_LT((out.positions[r].cast<double>() - p).norm(), 2e-6) << r;
        if (scene.normals[r].isZero()) {
            ASSERT_EQ(out.normals[r], Vec3f(Vec3f::Zero())) << r;
            continue;
        }
        ASSERT_NEAR(out.normals[r].norm(), 1, 1e-6) << r;
        // A cofactor that nearly vanishes has lost its digits before it is normalised.
        ASSERT_LT((out.normals[r].cast<double>() - n).norm(), 2e-3) << r;
    }
}

TEST(BlendKernel, EveryWidthGivesTheSameBytes) {
    const Scene scene = make_scene(every_length(), 2);
    const Restored first = restored(scene, lane_counts().front(), false);
    for (const int lanes : lane_counts()) {
        const Restored out = restored(scene, lanes, false);
        EXPECT_TRUE(same_bytes(out.positions, first.positions)) << lanes;
        EXPECT_TRUE(same_bytes(out.normals, first.normals)) << lanes;
    }
}

TEST(BlendKernel, OrderAndChoiceOfOutputsDoNotMatter) {
    const Scene scene = make_scene({1, 17, 512, 3, 64, 511}, 3);
    const Restored by_record = restored(scene, lane_counts().back(), false);
    const Restored by_slot = restored(scene, lane_counts().back(), true);
    std::vector<Vec3f> alone(scene.records.count), normals_alone(scene.records.count);
    blend_kernel::restore(scene.records, scene.transforms, {.positions = alone.data()}, kOneThread);
    blend_kernel::restore(scene.records, scene.transforms, {.normals = normals_alone.data()}, kOneThread);
    EXPECT_TRUE(same_bytes(alone, by_record.positions));
    EXPECT_TRUE(same_bytes(normals_alone, by_record.normals));
    for (std::size_t r = 0; r < scene.records.count; ++r) {
        ASSERT_EQ(by_slot.positions[scene.records.slot[r]], by_record.positions[r]);
        ASSERT_EQ(by_slot.normals[scene.records.slot[r]], by_record.normals[r]);
    }
}

TEST(BlendKernel, ScaleMultipliesPositionsExactly) {
    const Scene scene = make_scene({100, 200}, 4);
    const Restored plain_size = restored(scene, lane_counts().back(), false);
    std::vector<Vec3f> scaled(scene.records.count);
    blend_kernel::restore(scene.records, scene.transforms, {.positions = scaled.data(), .scale = 1024}, kOneThread);
    for (std::size_t r = 0; r < scaled.size(); ++r) ASSERT_EQ(scaled[r], Vec3f(1024 * plain_size.positions[r]));
}

/// Above 16 MB stores go past the caches; what stands behind the output must not be touched, wherever it begins.
TEST(BlendKernel, LargeOutputsOnThreadsAreTheSameBytes) {
    std::vector<Index> lengths;
    for (unsigned i = 0; i < 6000; ++i) lengths.push_back(1 + i * 37 % 509);
    const Scene scene = make_scene(lengths, 5);
    const std::size_t count = scene.records.count;
    ASSERT_GT(count * sizeof(Vec3f), std::size_t{16} << 20);
    std::vector<Vec3f> by_slot(count);
    blend_kernel::restore(scene.records, scene.transforms, {.positions = by_slot.data(), .in_order = true}, kOneThread);
    for (const std::size_t shift : {0u, 1u, 2u, 3u}) // twelve bytes each: every alignment of a float
        for (const unsigned threads : {1u, 2u}) {
            std::vector<Vec3f> streamed(count + shift + 4, Vec3f::Constant(7));
            blend_kernel::restore(scene.records, scene.transforms, {.positions = streamed.data() + shift},
                                  RunContext(threads));
            for (std::size_t i = 0; i < shift; ++i) ASSERT_EQ(streamed[i], Vec3f(Vec3f::Constant(7)));
            for (std::size_t i = count + shift; i < streamed.size(); ++i)
                ASSERT_EQ(streamed[i], Vec3f(Vec3f::Constant(7)));
            for (std::size_t r = 0; r < count; ++r) ASSERT_EQ(streamed[shift + r], by_slot[scene.records.slot[r]]);
        }
}

/// Gives every block of slots its own records, in some order.
void sort_into_blocks(Scene& scene) {
    Records& records = scene.records;
    std::mt19937 random(8);
    for (std::size_t begin = 0; begin < records.count; begin += kBlock) {
        const std::size_t end = std::min(records.count, begin + kBlock);
        std::iota(records.slot.begin() + begin, records.slot.begin() + end, static_cast<Index>(begin));
        std::shuffle(records.slot.begin() + begin, records.slot.begin() + end, random);
    }
    records.from.resize(records.count);
    for (std::size_t r = 0; r < records.count; ++r)
        records.from[records.slot[r]] = static_cast<std::uint16_t>(r % kBlock);
    for (std::size_t run = 0; run < records.runs.size(); ++run)
        if (records.runs[run].first % kBlock == 0) records.block_runs.push_back(static_cast<Index>(run));
    records.block_runs.push_back(static_cast<Index>(records.runs.size()));
}

/// In memory that the caches hold and in more, at every alignment of a float, in every width and on threads.
TEST(BlendKernel, BlocksAreTheSameBytesAsScatteredRecords) {
    for (const std::size_t blocks : {3u, 44u}) {
        std::vector<Index> lengths(blocks * kBlock / 256, 256);
        for (Index length : {200, 3}) lengths.push_back(length); // the last block is not full
        Scene scene = make_scene(lengths, 9);
        sort_into_blocks(scene);
        Scene scattered = scene;
        scattered.records.block_runs.clear();
        const Restored wanted = restored(scattered, lane_counts().back(), true);
        for (const int lanes : lane_counts()) {
            const Restored out = restored(scene, lanes, true, RunContext(2));
            EXPECT_TRUE(same_bytes(out.positions, wanted.positions)) << blocks << ' ' << lanes;
            EXPECT_TRUE(same_bytes(out.normals, wanted.normals)) << blocks << ' ' << lanes;
        }
        for (const std::size_t shift : {1u, 2u, 3u}) {
            std::vector<Vec3f> out(scene.records.count + 4, Vec3f::Constant(7));
            blend_kernel::restore(scene.records, scene.transforms,
                                  {.positions = out.data() + shift, .in_order = true, .scale = 2}, kOneThread);
            EXPECT_EQ(out[shift - 1], Vec3f(Vec3f::Constant(7)));
            EXPECT_EQ(out[shift + scene.records.count], Vec3f(Vec3f::Constant(7)));
            for (std::size_t v = 0; v < scene.records.count; ++v)
                ASSERT_EQ(out[shift + v], Vec3f(2 * wanted.positions[v])) << v;
        }
    }
}

/// A run's last lanes may write past its end, but not into what follows the output, nor into another thread's part.
TEST(BlendKernel, WritesNothingBehindItsOutput) {
    for (Index last = 1; last <= 40; ++last) {
        const Scene scene = make_scene({100, 3, last}, last);
        const Restored wanted = restored(scene, lane_counts().back(), true);
        for (const int lanes : lane_counts()) {
            std::vector<Vec3f> out(scene.records.count + 16, Vec3f::Constant(7)), normals = out;
            blend_kernel::restore(scene.records, scene.transforms, {.positions = out.data(), .normals = normals.data()},
                                  lanes, kOneThread);
            for (std::size_t r = 0; r < scene.records.count; ++r) {
                ASSERT_EQ(out[r], wanted.positions[scene.records.slot[r]]) << lanes << ' ' << last;
                ASSERT_EQ(normals[r], wanted.normals[scene.records.slot[r]]) << lanes << ' ' << last;
            }
            for (std::size_t r = scene.records.count; r < out.size(); ++r) {
                ASSERT_EQ(out[r], Vec3f(Vec3f::Constant(7))) << lanes << ' ' << last;
                ASSERT_EQ(normals[r], Vec3f(Vec3f::Constant(7))) << lanes << ' ' << last;
            }
        }
    }
}

TEST(BlendKernel, NoThreadChangesAByte) {
    FILIGREE_NEEDS_TWO_THREADS();
    std::vector<Index> lengths(200, 300);
    const Scene scene = make_scene(lengths, 6);
    const Restored one = restored(scene, lane_counts().back(), true);
    for (const unsigned threads : {2u, 5u}) {
        const Restored out = restored(scene, lane_counts().back(), true, RunContext(threads));
        EXPECT_TRUE(same_bytes(out.positions, one.positions));
        EXPECT_TRUE(same_bytes(out.normals, one.normals));
    }
}

TEST(BlendKernel, NoRecordsAreFine) {
    const Scene scene = make_scene({}, 7);
    Vec3f untouched(1, 2, 3);
    blend_kernel::restore(scene.records, scene.transforms, {.positions = &untouched}, kOneThread);
    EXPECT_EQ(untouched, Vec3f(1, 2, 3));
}

} // namespace
} // namespace filigree
