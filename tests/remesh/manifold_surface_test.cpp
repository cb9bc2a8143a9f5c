#include "filigree/remesh/manifold_surface.h"

#include "filigree/file.h"
#include "filigree/mesh.h"
#include "io/corpus.h"
#include "remesh/manifold_check.h"
#include "threads.h"

#include <cmath>
#include <numbers>

namespace filigree_test {
namespace {

struct Cleaned {
    ManifoldSurface surface;
    CleanReport report;
    SurfaceTopology topology;
};

/// Cleans a mesh and checks what must be true of every result.
Cleaned clean(const Mesh& mesh, const RunContext& context = RunContext(1)) {
    Cleaned cleaned;
    Result<ManifoldSurface> surface = make_manifold(mesh, cleaned.report, context);
    if (!surface.ok()) {
        ADD_FAILURE() << surface.error().message;
        return cleaned;
    }
    cleaned.surface = std::move(*surface);
    cleaned.topology = surface_topology(cleaned.surface);
    expect_manifold(cleaned.surface);
    expect_sources(cleaned.surface, mesh);
    const CleanReport& report = cleaned.report;
    EXPECT_EQ(mesh.vertex_count() + report.split_vertices,
              cleaned.surface.positions.size() + report.welded_vertices + report.unused_vertices);
    EXPECT_EQ(mesh.corner_count() - 2 * mesh.face_count(),
              cleaned.surface.triangles.size() + report.degenerate_faces + report.duplicate_faces);
    return cleaned;
}

void expect_untouched(const CleanReport& report) {
    EXPECT_EQ(report.welded_vertices + report.unused_vertices + report.degenerate_faces + report.duplicate_faces +
                  report.flipped_faces + report.cut_edges + report.separated_edges + report.split_vertices,
              0u);
}

/// Every corner with a vertex of its own, as in STL.
Mesh exploded(const Mesh& mesh) {
    Mesh loose;
    for (const Index vertex : mesh.corners) loose.positions.push_back(mesh.positions[vertex]);
    loose.corners.resize(mesh.corner_count());
    std::iota(loose.corners.begin(), loose.corners.end(), Index{0});
    loose.face_offsets = mesh.face_offsets;
    return loose;
}

Mesh reversed(const Mesh& mesh, const std::function<bool(std::size_t)>& turns) {
    Mesh turned = mesh;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        if (turns(f))
            std::reverse(turned.corners.begin() + mesh.face_offsets[f],
                         turned.corners.begin() + mesh.face_offsets[f + 1]);
    return turned;
}

TEST(MakeManifold, GoodMeshesStayAsTheyAre) {
    for (const auto name : shape_names()) {
        const Mesh mesh = *make_shape(name, {.resolution = 8});
        const Cleaned cleaned = clean(mesh);
        expect_untouched(cleaned.report);
        EXPECT_EQ(cleaned.topology.components, 1u) << name;
        EXPECT_EQ(cleaned.topology.genus(), name == "torus" ? 1 : 0) << name;
        EXPECT_EQ(cleaned.topology.border_loops, name == "wavy-plane" ? 1u : 0u) << name;
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v) // the mesh's order
            ASSERT_EQ(cleaned.surface.positions[v], mesh.positions[v].cast<double>());
    }
}

TEST(MakeManifold, LooseTrianglesAreWelded) {
    const Mesh ball = make_ball({0, 0, 0}, 1);
    const Cleaned whole = clean(ball), loose = clean(exploded(ball));
    EXPECT_EQ(loose.surface.positions.size(), whole.surface.positions.size());
    EXPECT_EQ(loose.report.welded_vertices, ball.corner_count() - ball.vertex_count());
    EXPECT_EQ(loose.topology.border_edges, 0u);
    EXPECT_EQ(loose.topology.euler, 2);
    EXPECT_EQ(volume(loose.surface), volume(whole.surface));
}

TEST(MakeManifold, TurnedFacesAreTurnedBack) {
    const Mesh ball = make_ball({0, 0, 0}, 1);
    std::mt19937 random(3);
    std::size_t count = 0;
    const Mesh mixed = reversed(ball, [&](std::size_t) {
        const bool turns = random() % 10 < 3;
        count += turns;
        return turns;
    });
    const Cleaned cleaned = clean(mixed);
    EXPECT_EQ(cleaned.report.flipped_faces, count);
    EXPECT_EQ(cleaned.topology.border_edges, 0u);
    // quads have other diagonals when turned, so the volume is only close
    EXPECT_NEAR(volume(cleaned.surface), 4 * std::numbers::pi / 3, 0.02);
}

TEST(MakeManifold, TheLargerAreaStaysInsideOutToo) {
    const Mesh cube = make_box({0, 0, 0}, {1, 1, 1});
    EXPECT_DOUBLE_EQ(volume(clean(reversed(cube, [](std::size_t) { return true; })).surface), -1);
    const Cleaned five = clean(reversed(cube, [](std::size_t f) { return f != 2; }));
    EXPECT_EQ(five.report.flipped_faces, 1u);
    EXPECT_DOUBLE_EQ(volume(five.surface), -1);
}

/// A band of n quads between two rows, closed after k half turns.
Mesh band(Index n, int half_turns) {
    Mesh mesh;
    for (Index i = 0; i < n; ++i) {
        const double angle = 2 * std::numbers::pi * i / n, tilt = 0.5 * half_turns * angle;
        for (const double side : {-0.3, 0.3}) {
            const double radius = 1 + side * std::cos(tilt);
            mesh.positions.push_back(
                Vec3d(radius * std::cos(angle), radius * std::sin(angle), side * std::sin(tilt)).cast<float>());
        }
    }
    for (Index i = 0; i < n; ++i) {
        const bool swapped = i + 1 == n && half_turns % 2;
        const Index j = (i + 1) % n;
        mesh.add_face(std::array<Index, 4>{2 * i, 2 * i + 1, swapped ? 2 * j : 2 * j + 1, swapped ? 2 * j + 1 : 2 * j});
    }
    return mesh;
}

TEST(MakeManifold, MoebiusBandIsCutOnce) {
    const Cleaned two_sided = clean(band(40, 2));
    EXPECT_EQ(two_sided.report.cut_edges, 0u);
    EXPECT_EQ(two_sided.topology.border_loops, 2u);
    const Cleaned one_sided = clean(band(40, 1));
    EXPECT_EQ(one_sided.report.cut_edges, 1u);
    EXPECT_EQ(one_sided.report.split_vertices, 2u);
    EXPECT_EQ(one_sided.topology.components, 1u);
    EXPECT_EQ(one_sided.topology.euler, 1);
    EXPECT_EQ(one_sided.topology.border_edges, 82u);
}

TEST(MakeManifold, KleinBottleIsCutOpen) {
    constexpr Index n = 12;
    Mesh mesh;
    std::mt19937 random(1);
    for (Index i = 0; i < n * n; ++i)
        mesh.positions.emplace_back(float(random() % 1000), float(random() % 1000), float(i));
    const auto at = [](Index i, Index j) { return i < n ? i * n + j % n : (n - j % n) % n; };
    for (Index i = 0; i < n; ++i)
        for (Index j = 0; j < n; ++j) {
            add_triangle(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1));
            add_triangle(mesh, at(i, j), at(i + 1, j + 1), at(i, j + 1));
        }
    const Cleaned cleaned = clean(mesh);
    EXPECT_GT(cleaned.report.cut_edges, 0u);
    EXPECT_EQ(cleaned.surface.triangles.size(), mesh.face_count());
    EXPECT_EQ(cleaned.topology.border_edges, 2 * cleaned.report.cut_edges);
}

TEST(MakeManifold, CubesThatTouchComeApartClosed) {
    const Cleaned edge = clean(voxel_body({{0, 0, 0}, {1, 1, 0}}, false));
    EXPECT_EQ(edge.report.separated_edges, 1u);
    EXPECT_EQ(edge.report.cut_edges, 0u);
    EXPECT_EQ(edge.report.split_vertices, 2u);
    EXPECT_EQ(edge.topology.components, 2u);
    EXPECT_EQ(edge.topology.border_edges, 0u);
    const Cleaned vertex = clean(voxel_body({{0, 0, 0}, {1, 1, 1}}, false));
    EXPECT_EQ(vertex.report.split_vertices, 1u);
    EXPECT_EQ(vertex.topology.components, 2u);
}

TEST(MakeManifold, VoxelBodiesAreClosedAndKeepTheirVolume) {
    for (unsigned seed = 0; seed < 60; ++seed) {
        const auto cells = random_cells(seed, 5, 0.1 + 0.012 * seed);
        const Cleaned bare = clean(voxel_body(cells, false)), walled = clean(voxel_body(cells, true));
        for (const Cleaned* cleaned : {&bare, &walled}) {
            ASSERT_EQ(cleaned->topology.border_edges, 0u) << seed;
            ASSERT_EQ(cleaned->report.cut_edges, 0u) << seed;
            ASSERT_NEAR(volume(cleaned->surface), double(cells.size()), 1e-9);
        }
        ASSERT_EQ(bare.surface.triangles.size(), walled.surface.triangles.size());
        ASSERT_EQ(bare.report.duplicate_faces, 0u);
    }
}

TEST(MakeManifold, ThirdTriangleOfAnEdgeIsCutOff) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}};
    for (const Index apex : {2u, 3u, 4u}) add_triangle(mesh, 0, 1, apex);
    const Cleaned cleaned = clean(mesh);
    EXPECT_EQ(cleaned.report.cut_edges, 1u);
    EXPECT_EQ(cleaned.surface.triangles.size(), 3u);
}

TEST(MakeManifold, RandomSoupsBecomeManifolds) {
    std::mt19937 random(11);
    for (int round = 0; round < 3000; ++round) {
        Mesh mesh;
        const Index vertices = 4 + static_cast<Index>(random() % 8);
        for (Index v = 0; v < vertices; ++v)
            mesh.positions.emplace_back(float(random() % 5), float(random() % 5), float(random() % 5));
        for (std::size_t f = 0; f < 2 + random() % 40; ++f)
            add_triangle(mesh, Index(random() % vertices), Index(random() % vertices), Index(random() % vertices));
        CleanReport report;
        if (!make_manifold(mesh, report, RunContext(1)).ok()) continue;
        clean(mesh);
        if (::testing::Test::HasFailure()) FAIL() << "round " << round;
    }
}

TEST(MakeManifold, DuplicatesGo) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}};
    add_triangle(mesh, 0, 1, 2);
    add_triangle(mesh, 2, 1, 0); // back to back
    add_triangle(mesh, 1, 2, 0);
    const Cleaned cleaned = clean(mesh);
    EXPECT_EQ(cleaned.report.duplicate_faces, 2u);
    EXPECT_EQ(cleaned.report.unused_vertices, 1u);
    EXPECT_EQ(cleaned.surface.triangles, (std::vector<Triangle>{{0, 1, 2}}));
}

TEST(MakeManifold, SheetsThereTwiceStayOnce) {
    const Mesh sheet = make_wavy_plane({.resolution = 6}), ball = make_ball({0, 0, 0}, 1);
    for (const Mesh& mesh : {sheet, ball}) {
        Mesh twice = mesh;
        twice.uvs = {};
        append(twice, reversed(mesh, [](std::size_t) { return true; }));
        const Cleaned once = clean(mesh), cleaned = clean(twice);
        // the diagonals of squares that are there twice are others
        EXPECT_EQ(cleaned.surface.triangles.size(), once.surface.triangles.size());
        EXPECT_EQ(cleaned.surface.positions, once.surface.positions);
        EXPECT_EQ(cleaned.topology.euler, once.topology.euler);
        EXPECT_EQ(cleaned.topology.border_edges, once.topology.border_edges);
        EXPECT_EQ(cleaned.report.duplicate_faces, once.surface.triangles.size());
    }
}

TEST(MakeManifold, FinsComeOffClosedBodies) {
    for (int angle = 0; angle < 360; angle += 30) { // outwards, inwards and along the sides
        Mesh mesh = voxel_body({{0, 0, 0}}, false);
        const auto vertex = [&](float x, float y, float z) {
            return Index(std::ranges::find(mesh.positions, Vec3f(x, y, z)) - mesh.positions.begin());
        };
        const Index low = vertex(0, 0, 0), high = vertex(0, 0, 1), tip = Index(mesh.vertex_count());
        const double radians = angle * std::numbers::pi / 180;
        mesh.positions.emplace_back(float(std::cos(radians)), float(std::sin(radians)), 0.5f);
        add_triangle(mesh, low, high, tip);
        add_triangle(mesh, high, low, tip);
        const Cleaned cleaned = clean(mesh);
        EXPECT_EQ(cleaned.topology.components, 2u) << angle;
        EXPECT_EQ(cleaned.topology.border_edges, 3u) << angle;
        EXPECT_EQ(cleaned.report.cut_edges, 1u) << angle;
    }
}

TEST(MakeManifold, TrianglesWithoutAreaKeepNeighboursTogether) {
    // a square whose lower half meets the upper in a T: the flat triangle (0, 4, 1) joins them
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {2, 0, 0}, {1, 1, 0}, {1, -1, 0}, {1, 0, 0}};
    add_triangle(mesh, 0, 1, 2);
    add_triangle(mesh, 0, 4, 1);
    add_triangle(mesh, 0, 3, 4);
    add_triangle(mesh, 4, 3, 1);
    const Cleaned cleaned = clean(mesh);
    EXPECT_EQ(cleaned.surface.triangles.size(), 4u);
    EXPECT_EQ(cleaned.topology.components, 1u);
    EXPECT_EQ(cleaned.topology.border_edges, 4u);
}

TEST(MakeManifold, FacesThatRepeatAVertexNameTheRightCorners) {
    // a square with a square hole, cut open from corner 0 to the hole's corner 4; the bridge is walked both ways
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 0}, {3, 3, 0}, {3, 6, 0}, {6, 6, 0}, {6, 3, 0}};
    mesh.add_face(std::array<Index, 10>{0, 1, 2, 3, 0, 4, 5, 6, 7, 4});
    const Cleaned cleaned = clean(mesh);
    EXPECT_EQ(cleaned.topology.border_loops, 2u);
    EXPECT_EQ(cleaned.topology.components, 1u);
    // an outline of n corners: n - 2 triangles, whose borders by corner number are the outline's sides
    std::map<std::pair<Index, Index>, int> sides;
    for (const auto& t : cleaned.surface.source_corners)
        for (std::size_t i = 0; i < 3; ++i) {
            const Index a = t[i], b = t[(i + 1) % 3];
            sides[std::minmax(a, b)] += a < b ? 1 : -1;
        }
    for (const auto& [side, count] : sides) {
        const bool is_side = side.second - side.first == 1 || (side.first == 0 && side.second == 9);
        EXPECT_EQ(count, !is_side ? 0 : side.second - side.first == 1 ? 1 : -1) << side.first << " " << side.second;
    }
}

TEST(MakeManifold, NothingWithAnAreaIsUnsuitable) {
    Mesh line, point;
    line.positions = {{0, 0, 0}, {0.1f, 0.1f, 0.1f}, {0.3f, 0.3f, 0.3f}};
    point.positions = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
    for (Mesh* mesh : {&line, &point}) add_triangle(*mesh, 0, 1, 2);
    for (const Mesh& mesh : {Mesh{}, line, point}) {
        CleanReport report;
        const auto surface = make_manifold(mesh, report, RunContext(1));
        ASSERT_FALSE(surface.ok());
        EXPECT_EQ(surface.error().code, ErrorCode::unsuitable);
    }
}

TEST(MakeManifold, ScaleDoesNotMatter) {
    for (const float scale : {1e-30f, 1e-6f, 1e12f}) {
        Mesh mesh = voxel_body({{0, 0, 0}, {1, 1, 0}, {2, 1, 0}}, true);
        for (Vec3f& p : mesh.positions) p *= scale;
        EXPECT_EQ(clean(mesh).topology.components, 2u) << scale;
        EXPECT_EQ(clean(mesh).topology.border_edges, 0u) << scale;
    }
}

TEST(MakeManifold, CancelAndThreads) {
    const Mesh mesh = make_wavy_sphere({.resolution = 100});
    RunContext context(1);
    context.cancel();
    CleanReport report;
    const auto cancelled = make_manifold(mesh, report, context);
    ASSERT_FALSE(cancelled.ok());
    EXPECT_EQ(cancelled.error().code, ErrorCode::cancelled);
    FILIGREE_NEEDS_TWO_THREADS();
    const Cleaned one = clean(mesh, RunContext(1)), two = clean(mesh, RunContext(2));
    EXPECT_EQ(one.surface.triangles, two.surface.triangles);
    EXPECT_EQ(one.surface.positions, two.surface.positions);
}

TEST(MakeManifold, WholeCorpus) {
    const std::vector<CorpusRow> rows = read_corpus();
    if (rows.empty()) GTEST_SKIP() << "no corpus at " << corpus_folder();
    std::size_t cleaned = 0;
    for (const CorpusRow& row : rows) {
        const auto file = read_mesh(row.path, RunContext());
        if (!file.ok() || file->mesh.corner_count() > 400'000) continue; // the maps of the check are slow
        CleanReport report;
        const auto surface = make_manifold(file->mesh, report, RunContext());
        if (!surface.ok()) {
            EXPECT_EQ(surface.error().code, ErrorCode::unsuitable) << row.file;
            continue;
        }
        SCOPED_TRACE(row.file);
        clean(file->mesh);
        ++cleaned;
    }
    EXPECT_GT(cleaned, 50u);
}

TEST(SurfaceTopology, ClosedForms) {
    EXPECT_EQ(surface_topology({}).euler, 0);
    EXPECT_EQ(surface_topology({}).genus(), 0);
    // a plate with holes: each is a handle, or a border loop once the plate is a sheet
    std::set<std::array<int, 3>> cells;
    for (int i = 0; i < 7 * 7; ++i)
        if (!(i % 7 % 2 && i / 7 % 2)) cells.insert({i % 7, i / 7, 0});
    const Mesh plate = voxel_body(cells, false);
    EXPECT_EQ(clean(plate).topology.genus(), 9);
    Mesh sheet;
    sheet.positions = plate.positions;
    for (std::size_t f = 0; f < plate.face_count(); ++f)
        if (std::ranges::all_of(plate.face(f), [&](Index v) { return plate.positions[v].z() == 0; }))
            sheet.add_face(plate.face(f));
    const SurfaceTopology topology = clean(sheet).topology;
    EXPECT_EQ(topology.border_loops, 10u);
    EXPECT_EQ(topology.border_edges, 9u * 4 + 28);
    EXPECT_EQ(topology.genus(), 0);
    EXPECT_EQ(topology.euler, 1 - 9);
}

TEST(RemoveSmallComponents, KeepsTheLargestAndThoseOfSize) {
    Mesh mesh;
    for (const float size : {0.1f, 3.0f, 1.0f, 0.2f})
        append(mesh, make_box({0, 0, 0}, {size, size, size}), {10 * size, 0, 0});
    const double diagonal = std::sqrt(3.0);
    const Cleaned all = clean(mesh);
    for (const auto& [smallest, left] : {std::pair(0.0, 4u), {0.15 * diagonal, 3u}, {0.5 * diagonal, 2u}, {99.0, 1u}}) {
        Cleaned cleaned = all;
        remove_small_components(cleaned.surface, smallest, cleaned.report);
        expect_manifold(cleaned.surface);
        expect_sources(cleaned.surface, mesh);
        EXPECT_EQ(surface_topology(cleaned.surface).components, left);
        EXPECT_EQ(cleaned.report.removed_components, 4 - left);
        const double gone[] = {0, 0.01 / 10.05, 0.05 / 10.05, 1.05 / 10.05}; // of 9 + 1 + 0.04 + 0.01 cube sides
        EXPECT_NEAR(cleaned.report.removed_area, gone[4 - left], 1e-6);
        const double volumes[] = {27, 28, 28.008, 28.009};
        EXPECT_NEAR(volume(cleaned.surface), volumes[left - 1], 1e-4);
    }
    ManifoldSurface nothing;
    CleanReport report;
    remove_small_components(nothing, 1, report);
    EXPECT_EQ(report.removed_components, 0u);
}

} // namespace
} // namespace filigree_test
