// A strip in tasks: the bytes of one process, whoever makes which task, and after any stop.
#include "filigree/io/shared_strip.h"

#include "filigree/io/file.h"
#include "filigree/io/model_file.h"
#include "filigree/mesh/shapes.h"
#include "threads.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <gtest/gtest.h>
#include <random>
#include <thread>
#include <unistd.h>

namespace filigree {
namespace {

namespace fs = std::filesystem;

/// Some 97,000 vertices: 6 clusters, then 1.
const Mesh& cube() {
    static const Mesh mesh = make_wavy_cube({.resolution = 127});
    return mesh;
}
constexpr StripOptions kClusters{.base = 1000, .one_piece = 7'500};

/// Adds a mesh behind another.
void append(Mesh& mesh, const Mesh& other, float scale, const Vec3f& shift) {
    const auto first = static_cast<Index>(mesh.vertex_count());
    for (const Vec3f& p : other.positions) mesh.positions.push_back(scale * p + shift);
    for (std::size_t f = 0; f < other.face_count(); ++f) {
        std::vector<Index> face(other.face(f).begin(), other.face(f).end());
        for (Index& v : face) v += first;
        mesh.add_face(face);
    }
}

class SharedStrips : public testing::Test {
protected:
    SharedStrips() {
        fs::remove_all(root_);
        fs::create_directory(root_);
    }
    ~SharedStrips() override { fs::remove_all(root_); }

    static SharedStripReport ok(const SharedStrip& strip, std::size_t number, std::size_t count,
                                const RunContext& context = kTwoThreads) {
        const Result<SharedStripReport> report =
            strip_in_chunks(strip, {.number = number, .count = count, .job = "job"}, context);
        EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
        return report.ok() ? *report : SharedStripReport{};
    }
    SharedStrip strip_of(const Mesh& mesh, const StripOptions& options) const {
        return {.path = root_ / "model.fil",
                .options = options,
                .read = [&mesh]() -> Result<Mesh> { return mesh; },
                .bound_together = 7'500};
    }
    std::string bytes() const {
        const Result<std::string> file = read_file(root_ / "model.fil");
        return file ? *file : "";
    }
    static std::string serial(const Mesh& mesh, const StripOptions& options) {
        return write_model(strip(mesh, options, kTwoThreads).value().model);
    }
    bool is_tidy() const {
        return std::distance(fs::directory_iterator(root_), fs::directory_iterator()) == 2;
    } // model and plan
    void expect_same(const Mesh& mesh, const StripOptions& options) const {
        const SharedStripReport made = ok(strip_of(mesh, options), 1, 1);
        EXPECT_EQ(made.made, made.tasks);
        EXPECT_TRUE(bytes() == serial(mesh, options));
        EXPECT_TRUE(is_tidy());
    }

    fs::path root_ = fs::temp_directory_path() / ("filigree-shared-" + std::to_string(::getpid()) +
                                                  testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(SharedStrips, AnyNumberOfProcessesInAnyOrderGiveTheBytesOfOne) {
    const std::string whole = serial(cube(), kClusters);
    for (const std::vector<std::size_t>& order :
         {std::vector<std::size_t>{1}, {2, 1}, {1, 2}, {3, 1, 2}, {2, 3, 1}, {1, 1, 2}}) {
        const SharedStrip strip = strip_of(cube(), kClusters);
        const std::size_t count = *std::ranges::max_element(order);
        std::vector<SharedStripReport> reports(order.size());
        std::vector<std::jthread> processes;
        for (std::size_t k = 0; k < order.size(); ++k) {
            processes.emplace_back([&, k] { reports[k] = ok(strip, order[k], count, RunContext(1)); });
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
        processes.clear();
        EXPECT_TRUE(bytes() == whole);
        EXPECT_TRUE(is_tidy());
        std::size_t made = 0;
        for (const SharedStripReport& report : reports) made += report.made;
        // 6 and 1 clusters, 9 parts that are bound, mesh, 2 cuts and joins, finish, model: none twice
        EXPECT_EQ(made, 23u);
        EXPECT_EQ(ok(strip, 1, count).tasks, 0u) << "it is finished";
        fs::remove_all(root_);
        fs::create_directory(root_);
    }
}

/// Every step in turn is cancelled in one process, and taken up by another.
TEST_F(SharedStrips, WhatIsThereIsNotMadeAgain) {
    const SharedStrip strip = strip_of(cube(), kClusters);
    for (const std::string stop : {"cut", "reduce", "join", "finish", "bind", "write"}) {
        RunContext stopped(1);
        std::size_t asked = 0;
        stopped.progress = [&](std::string_view phase, double) {
            if (phase == stop && asked++ == 0) stopped.cancel();
        };
        const Result<SharedStripReport> report =
            strip_in_chunks(strip, {.number = 2, .count = 2, .job = "job"}, stopped);
        ASSERT_FALSE(report);
        EXPECT_EQ(report.error().code, ErrorCode::cancelled);
        EXPECT_EQ(bytes(), "");
    }
    EXPECT_EQ(ok(strip, 1, 2).made, 1u) << "the model; all else was there";
    EXPECT_TRUE(bytes() == serial(cube(), kClusters));
    EXPECT_TRUE(is_tidy());
}

TEST_F(SharedStrips, EverySettingIsTheSame) {
    StripOptions options = kClusters;
    options.precision = Precision::int16;
    options.reorder = true;
    expect_same(cube(), options);
}

TEST_F(SharedStrips, ByLevels) { expect_same(cube(), {.levels = 2, .one_piece = 50'000}); }

/// The error is used up while there are clusters.
TEST_F(SharedStrips, ByErrorInClusters) {
    expect_same(make_wavy_cube({.resolution = 90}), {.error = 1e-6, .one_piece = 1'000});
}
TEST_F(SharedStrips, ByError) { expect_same(cube(), {.error = 5e-3, .one_piece = 7'500}); }

TEST_F(SharedStrips, InOnePiece) { expect_same(make_wavy_sphere({.resolution = 60}), {}); }
TEST_F(SharedStrips, WithLongestEdges) { expect_same(make_wavy_sphere({.resolution = 60}), {.max_edge = 0.1}); }

TEST_F(SharedStrips, PointsAlone) {
    Mesh points;
    for (int k = 0; k < 1000; ++k) points.positions.emplace_back(float(k % 10), float(k / 10 % 10), float(k / 100));
    expect_same(points, {});
}

/// Parts that are dropped, parts without a driver vertex, vertices in no face and at one place.
TEST_F(SharedStrips, ScrapsAndLooseVertices) {
    Mesh mesh = make_wavy_cube({.resolution = 200});
    const Mesh ball = make_wavy_sphere({.resolution = 6});
    for (int k = 0; k < 50; ++k) append(mesh, ball, 0.002f, {-0.5f + 0.02f * float(k), 0.7f, 0.1f});
    append(mesh, make_wavy_sphere({.resolution = 30}), 0.05f, {0, 2, 0});
    for (int k = 0; k < 100; ++k) mesh.positions.push_back(mesh.positions[std::size_t(k) * 7]);
    mesh.positions.emplace_back(3.0f, 3.0f, 3.0f);
    expect_same(mesh, {.base = 300, .one_piece = 20'000});
}

/// Vertices on borders of clusters that no cluster keeps.
TEST_F(SharedStrips, Holes) {
    const Mesh whole = make_wavy_cube({.resolution = 200});
    Mesh mesh;
    mesh.positions = whole.positions;
    std::mt19937 random(3);
    for (std::size_t f = 0; f < whole.face_count(); ++f)
        if (random() % 100 >= 42) mesh.add_face(whole.face(f));
    expect_same(mesh, {.base = 300, .one_piece = 20'000});
}

/// Clusters do not get there: in the first round, and after one.
TEST_F(SharedStrips, Dust) {
    Mesh dust = make_wavy_cube({.resolution = 150});
    for (Index k = 0; k < 30'000; ++k) {
        const Vec3f at(0.01f * float(k % 100), 0.01f * float(k / 100 % 100), 0.01f * float(k / 10'000));
        const auto first = static_cast<Index>(dust.vertex_count());
        dust.positions.insert(dust.positions.end(), {at, at + Vec3f(1e-3f, 0, 0), at + Vec3f(0, 1e-3f, 0)});
        dust.add_face(std::array{first, first + 1, first + 2});
    }
    expect_same(dust, {.base = 500, .one_piece = 20'000});
    fs::remove_all(root_);
    fs::create_directory(root_);
    expect_same(dust, {.levels = 2, .one_piece = 1'000});
}

/// Whom a vertex hangs near may be anywhere in the file.
TEST_F(SharedStrips, AHopelessOrder) {
    const Mesh tidy = make_wavy_cube({.resolution = 150});
    std::vector<Index> now(tidy.vertex_count());
    for (Index v = 0; v < now.size(); ++v) now[v] = v;
    std::ranges::shuffle(now, std::mt19937(5));
    Mesh mesh = tidy;
    for (Index v = 0; v < now.size(); ++v) mesh.positions[now[v]] = tidy.positions[v];
    for (Index& v : mesh.corners) v = now[v];
    expect_same(mesh, {.base = 500, .one_piece = 10'000});
}

TEST_F(SharedStrips, WhatIsWrongIsSaid) {
    const Mesh ball = make_wavy_sphere({.resolution = 20}), none;
    SharedStrip strip = strip_of(ball, {.code = DetailCode::reference});
    const WorkChunk chunk{.number = 1, .count = 2, .job = "job"};
    EXPECT_EQ(strip_in_chunks(strip, chunk, kTwoThreads).error().code, ErrorCode::usage);
    strip.options = {};
    EXPECT_EQ(strip_in_chunks(strip, {.number = 3, .count = 2, .job = ""}, kTwoThreads).error().code, ErrorCode::usage);
    EXPECT_EQ(strip_in_chunks(strip_of(none, {}), chunk, kTwoThreads).error().code, ErrorCode::unsuitable);
    fs::remove_all(root_ / "model.fil.chunks");
    // Another mesh under the same name, half way.
    std::size_t calls = 0;
    strip.read = [&]() -> Result<Mesh> { return calls++ == 0 ? ball : make_wavy_sphere({.resolution = 21}); };
    const Result<SharedStripReport> changed = strip_in_chunks(strip, chunk, kTwoThreads);
    ASSERT_FALSE(changed);
    EXPECT_EQ(changed.error().code, ErrorCode::mismatch);
    EXPECT_NE(changed.error().message.find("has changed"), std::string::npos);
    EXPECT_EQ(strip_in_chunks(strip, {.number = 1, .count = 2, .job = "other"}, kTwoThreads).error().code,
              ErrorCode::mismatch);
    strip.read = [] { return Result<Mesh>(Error{ErrorCode::not_found, "gone"}); };
    fs::remove_all(root_ / "model.fil.chunks");
    EXPECT_EQ(strip_in_chunks(strip, chunk, kTwoThreads).error().message, "gone");
}

} // namespace
} // namespace filigree
