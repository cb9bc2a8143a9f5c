// Every mesh that can be read can be stripped, and comes back from the unmoved driver.
#include "io/corpus.h"
#include "sanitized.h"

#include "filigree/file.h"
#include "filigree/io/model_file.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <set>

using namespace filigree;
using namespace filigree_test;

namespace {

constexpr double kRoundTrip = 1e-6;              // of the diagonal
constexpr double kLimit = kSanitized ? 200 : 20; // seconds a file

const std::set<int> kDocumentedCodes = {3, 4, 5}; // what a file that cannot be read may be told

double largest_difference(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
    double largest = 0;
    for (std::size_t v = 0; v < a.size(); ++v)
        largest = std::max(largest, (a[v].cast<double>() - b[v].cast<double>()).norm());
    return largest;
}

void expect_round_trip(const Mesh& mesh, const RunContext& context) {
    const Result<Stripped> stripped = strip(mesh, {}, context);
    ASSERT_TRUE(stripped.ok()) << stripped.error().message;
    EXPECT_EQ(check_model(stripped->model), "");
    const Result<Model> model = read_model(write_model(stripped->model), "model", context);
    ASSERT_TRUE(model.ok()) << model.error().message;
    const Result<Restorer> restorer = Restorer::create(*model, {}, context);
    ASSERT_TRUE(restorer.ok()) << restorer.error().message;
    const Result<Mesh> restored = restorer->mesh(rest_pose(*model), context);
    ASSERT_TRUE(restored.ok()) << restored.error().message;
    EXPECT_EQ(check_mesh(*restored), "");
    EXPECT_EQ(restored->corners, mesh.corners);
    EXPECT_EQ(restored->face_offsets, mesh.face_offsets);
    ASSERT_EQ(restored->vertex_count(), mesh.vertex_count());
    EXPECT_LE(largest_difference(restored->positions, mesh.positions), kRoundTrip * bounds(mesh.positions).diagonal());
}

/// n x n quads of side 1, bent a little, each position mapped.
template <class Map>
Mesh sheet(Index n, const Map& map) {
    Mesh mesh;
    for (Index j = 0; j <= n; ++j)
        for (Index i = 0; i <= n; ++i)
            mesh.positions.push_back(map(Vec3f(float(i), float(j), 0.2f * float((i * j) % 7))));
    for (Index j = 0; j < n; ++j)
        for (Index i = 0; i < n; ++i) {
            const Index v = j * (n + 1) + i;
            mesh.add_face(std::array{v, v + 1, v + n + 2, v + n + 1});
        }
    return mesh;
}

Mesh ring(Index corners, bool fan) {
    Mesh mesh;
    std::vector<Index> polygon;
    for (Index i = 0; i < corners; ++i) {
        const double angle = 2 * std::numbers::pi * i / corners;
        mesh.positions.emplace_back(float(std::cos(angle)), float(std::sin(angle)), 0.01f * float(i % 3));
        polygon.push_back(i);
    }
    if (!fan) {
        mesh.add_face(polygon);
        return mesh;
    }
    mesh.positions.emplace_back(0.f, 0.f, 1.f);
    for (Index i = 0; i < corners; ++i) mesh.add_face(std::array{i, (i + 1) % corners, corners});
    return mesh;
}

Mesh loose_triangles(Index count) {
    Mesh mesh;
    for (Index t = 0; t < count; ++t) {
        const Vec3f corner(float(t % 200), float(t / 200), 0);
        for (const Vec3f& step : {Vec3f(0, 0, 0), Vec3f(0.5f, 0, 0), Vec3f(0, 0.5f, 0.1f)})
            mesh.positions.push_back(corner + step);
        mesh.add_face(std::array{3 * t, 3 * t + 1, 3 * t + 2});
    }
    return mesh;
}

/// Pages of a book: triangles that all share one edge. They once took cubic time.
Mesh book(Index pages) {
    Mesh mesh;
    mesh.positions = {Vec3f(0, 0, 0), Vec3f(0, 0, 1)};
    for (Index p = 0; p < pages; ++p) {
        const float angle = 0.01f * float(p);
        mesh.positions.emplace_back(std::cos(angle), std::sin(angle), 0.5f);
        mesh.add_face(std::array<Index, 3>{0, 1, p + 2});
    }
    return mesh;
}

} // namespace

TEST(HardMeshes, ComeBack) {
    const RunContext context;
    const auto as_it_is = [](const Vec3f& p) { return p; };
    Mesh points = sheet(40, as_it_is);
    points.corners.clear();
    points.face_offsets = {0};
    Mesh far = sheet(40, [](const Vec3f& p) { return Vec3f(p + Vec3f(1e9f, 0, 0)); });
    split_origin(far);
    const std::vector<std::pair<const char*, Mesh>> meshes = {
        {"of denormal size", sheet(40, [](const Vec3f& p) { return Vec3f(1e-42f * p); })},
        {"tiny", sheet(40, [](const Vec3f& p) { return Vec3f(1e-30f * p); })},
        {"huge", sheet(40, [](const Vec3f& p) { return Vec3f(1e30f * p); })},
        {"far away", far},
        {"all vertices at one place", sheet(40, [](const Vec3f&) { return Vec3f(1, 2, 3); })},
        {"on one line", sheet(40, [](const Vec3f& p) { return Vec3f(p[0], 0, 0); })},
        {"points only", points},
        {"one polygon", ring(50'000, false)},
        {"one fan", ring(100'000, true)},
        {"40,000 components", loose_triangles(40'000)},
        {"many faces at an edge", book(1500)},
    };
    for (const auto& [name, mesh] : meshes) {
        SCOPED_TRACE(name);
        const auto start = std::chrono::steady_clock::now();
        expect_round_trip(mesh, context);
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        EXPECT_LT(seconds, kLimit);
    }
}

TEST(CorpusRestore, EveryReadableMeshComesBack) {
    const std::vector<CorpusRow> rows = read_corpus();
    if (rows.empty()) GTEST_SKIP() << "no corpus at " << corpus_folder();
    const RunContext context;
    std::size_t restored = 0;
    for (const CorpusRow& row : rows) {
        SCOPED_TRACE(row.file + " (" + row.what + ")");
        const auto start = std::chrono::steady_clock::now();
        const Result<MeshFile> file = read_mesh(row.path, context);
        if (!file.ok()) {
            EXPECT_TRUE(kDocumentedCodes.contains(static_cast<int>(file.error().code)));
            EXPECT_EQ(file.error().message.find('\n'), std::string::npos) << file.error().message;
            continue;
        }
        ++restored;
        expect_round_trip(file->mesh, context);
        EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), kLimit);
    }
    EXPECT_GT(restored, 80u);
}
