#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/mesh/edges.h"
#include "filigree/remesh/manifold_surface.h"
#include "remesh/manifold_check.h"
#include "threads.h"

#include <cmath>
#include <numbers>
#include <queue>

namespace filigree_test {
namespace {

constexpr double kEverything = 1e30; // a loop limit

/// Closes handles and checks what must be true whatever the surface and the limit.
CleanReport close(ManifoldSurface& surface, double longest_loop, const RunContext& context = RunContext(1)) {
    const ManifoldSurface before = surface;
    const SurfaceTopology old = surface_topology(before);
    CleanReport report;
    EXPECT_TRUE(close_handles(surface, longest_loop, report, context).ok());
    expect_manifold(surface);
    const SurfaceTopology now = surface_topology(surface);
    EXPECT_EQ(now.genus(), old.genus() - std::int64_t(report.closed_handles));
    EXPECT_EQ(now.euler, old.euler + 2 * std::int64_t(report.closed_handles));
    EXPECT_EQ(now.components, old.components);
    EXPECT_EQ(now.border_edges, old.border_edges);
    EXPECT_EQ(now.border_loops, old.border_loops);
    EXPECT_EQ(surface.triangles.size(), before.triangles.size() + report.filled_triangles);
    EXPECT_EQ(surface.source_corners.empty(), before.source_corners.empty());
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        const bool is_old = t < before.triangles.size();
        if (!before.source_corners.empty()) {
            EXPECT_EQ(surface.source_corners[t],
                      is_old ? before.source_corners[t] : (Triangle{kNoIndex, kNoIndex, kNoIndex}));
        }
        if (!is_old) continue;
        for (std::size_t i = 0; i < 3; ++i)
            EXPECT_EQ(surface.positions[surface.triangles[t][i]], before.positions[before.triangles[t][i]]);
    }
    return report;
}

/// Whether cutting along the edges of the walk leaves its component in one piece. half_edges: of the walk.
bool keeps_together(std::vector<Index> opposite, const std::vector<Index>& half_edges) {
    const std::size_t before = components(opposite).count;
    for (const Index h : half_edges) opposite[h] = opposite[opposite[h]] = kNoIndex;
    return components(opposite).count == before;
}

/// The plain way, for surfaces without borders: for each vertex the tree of shortest ways, and each edge that closes a
/// short walk over it is tried by cutting. Infinity if there is no loop up to `longest`.
double shortest_handle_loop(const ManifoldSurface& surface, double longest) {
    const std::size_t count = surface.positions.size();
    const std::vector<Index> opposite = opposite_half_edges(surface.triangles, count);
    std::vector<std::vector<Index>> leaving(count);
    for (Index h = 0; h < opposite.size(); ++h) leaving[half_edge_start(surface.triangles, h)].push_back(h);
    const auto end = [&](Index h) { return half_edge_end(surface.triangles, h); };
    const auto length = [&](Index h) {
        return (surface.positions[end(h)] - surface.positions[half_edge_start(surface.triangles, h)]).norm();
    };
    double best = std::numeric_limits<double>::infinity();
    for (Index root = 0; root < count; ++root) {
        std::vector<double> distance(count, std::numeric_limits<double>::infinity());
        std::vector<Index> arrival(count, kNoIndex);
        std::priority_queue<std::pair<double, Index>> queue;
        distance[root] = 0;
        queue.emplace(0, root);
        while (!queue.empty()) {
            const auto [negative, v] = queue.top();
            queue.pop();
            if (-negative > distance[v] || -2 * negative > longest) continue;
            for (const Index h : leaving[v]) {
                if (distance[v] + length(h) >= distance[end(h)]) continue;
                distance[end(h)] = distance[v] + length(h);
                arrival[end(h)] = h;
                queue.emplace(-distance[end(h)], end(h));
            }
        }
        for (Index h = 0; h < opposite.size(); ++h) {
            const Index a = half_edge_start(surface.triangles, h), b = end(h);
            const double walk = distance[a] + length(h) + distance[b];
            if (h > opposite[h] || !(walk <= longest) || walk >= best || arrival[b] == h || arrival[a] == opposite[h])
                continue;
            std::set<Index> loop = {h}; // ways that both ends share cancel
            for (const Index from : {a, b})
                for (Index v = from; arrival[v] != kNoIndex; v = half_edge_start(surface.triangles, arrival[v]))
                    if (!loop.erase(arrival[v])) loop.insert(arrival[v]);
            if (keeps_together(opposite, {loop.begin(), loop.end()})) best = walk;
        }
    }
    return best;
}

/// A slab of cells, `n` by `n` by 1, with holes through it at the given distance from each other: a handle each.
std::set<std::array<int, 3>> slab(int n, int distance) {
    std::set<std::array<int, 3>> cells;
    for (int i = 0; i < n * n; ++i) {
        const int x = i % n, y = i / n;
        if (!(x % distance == distance / 2 && y % distance == distance / 2)) cells.insert({x, y, 0});
    }
    return cells;
}

TEST(CloseHandles, NothingToClose) {
    ManifoldSurface nothing;
    CleanReport report;
    EXPECT_TRUE(close_handles(nothing, 1, report, RunContext(1)).ok());
    for (const std::string_view name : {"bar", "wavy-plane", "wavy-sphere"}) {
        ManifoldSurface surface = manifold(*make_shape(name, {.resolution = 8}));
        const ManifoldSurface before = surface;
        EXPECT_EQ(close(surface, kEverything).closed_handles, 0u);
        EXPECT_EQ(surface.triangles, before.triangles);
    }
    ManifoldSurface one;
    one.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    one.triangles = {{0, 1, 2}};
    EXPECT_EQ(close(one, kEverything).closed_handles, 0u);
}

TEST(CloseHandles, TorusIsCutAcrossItsTubeOrItsHole) {
    // around a thin tube, 2 pi r, or around the hole of a thick one, 2 pi (1 - r); polygons of n corners are shorter
    constexpr unsigned n = 24;
    const double ring = n * std::sin(std::numbers::pi / n) * 2, hole = 2 * n * std::sin(std::numbers::pi / (2 * n)) * 2;
    for (const double tube : {0.2, 0.8}) {
        const Mesh mesh = make_torus({.resolution = n, .amplitude = 0, .size = 1, .thickness = tube});
        double outer = 0;
        for (const Vec3f& p : mesh.positions) outer = std::max(outer, double(p.head<2>().norm()));
        const double radius = outer / (1 + tube);
        const double shortest = radius * std::min(tube * ring, (1 - tube) * hole);
        ManifoldSurface kept = manifold(mesh), closed = kept;
        EXPECT_EQ(close(kept, 0.999 * shortest).closed_handles, 0u);
        const CleanReport report = close(closed, 1.001 * shortest);
        EXPECT_EQ(report.closed_handles, 1u);
        EXPECT_EQ(report.filled_triangles, 2 * (tube < 0.5 ? n : 2 * n));
    }
}

TEST(CloseHandles, LoopsOfThreeGetATriangle) {
    // a triangular tube bent to a ring of three joints: nine vertices, the smallest rings there are
    Mesh mesh;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const double around = 2 * std::numbers::pi * i / 3, tube = 2 * std::numbers::pi * j / 3;
            const double r = 3 + std::cos(tube);
            mesh.positions.push_back(Vec3d(r * std::cos(around), r * std::sin(around), std::sin(tube)).cast<float>());
        }
    const auto at = [](Index i, Index j) { return 3 * (i % 3) + j % 3; };
    for (Index i = 0; i < 3; ++i)
        for (Index j = 0; j < 3; ++j) {
            add_triangle(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1));
            add_triangle(mesh, at(i, j), at(i + 1, j + 1), at(i, j + 1));
        }
    ManifoldSurface surface = manifold(mesh);
    ASSERT_EQ(surface_topology(surface).genus(), 1);
    const CleanReport report = close(surface, 6);
    EXPECT_EQ(report.closed_handles, 1u);
    EXPECT_EQ(report.filled_triangles, 2u);
    EXPECT_EQ(surface.positions.size(), 12u);
}

TEST(CloseHandles, EachComponentIsClosedAndNoneIsTakenApart) {
    Mesh mesh;
    for (int i = 0; i < 3; ++i) append(mesh, make_torus({.resolution = 12}), {3.0f * float(i), 0, 0});
    append(mesh, make_ball({0, 5, 0}, 1));
    ManifoldSurface surface = manifold(mesh);
    EXPECT_EQ(close(surface, kEverything).closed_handles, 3u);
    EXPECT_EQ(surface_topology(surface).components, 4u);
}

TEST(CloseHandles, OnlyHolesBelowTheLimit) {
    // holes of one cell have loops of 4; between them and around the slab they are longer
    for (const int distance : {2, 3, 5}) {
        const ManifoldSurface drilled = manifold(voxel_body(slab(21, distance), false));
        const std::int64_t genus = surface_topology(drilled).genus();
        ASSERT_GE(genus, 16);
        ManifoldSurface kept = drilled, closed = drilled;
        EXPECT_EQ(close(kept, 3.99).closed_handles, 0u);
        EXPECT_EQ(close(closed, 4).closed_handles, std::size_t(genus));
    }
}

TEST(CloseHandles, ThousandsAtOnce) {
    ManifoldSurface surface = manifold(voxel_body(slab(121, 2), false));
    CleanReport report;
    ASSERT_EQ(surface_topology(surface).genus(), 3600);
    ASSERT_TRUE(close_handles(surface, 4, report, RunContext(1)).ok());
    EXPECT_EQ(report.closed_handles, 3600u);
    EXPECT_EQ(surface_topology(surface).genus(), 0);
}

TEST(CloseHandles, RandomBodiesLoseAllTheirHandles) {
    for (unsigned seed = 0; seed < 40; ++seed) {
        ManifoldSurface surface = manifold(voxel_body(random_cells(seed, 5, 0.35 + 0.01 * seed), false));
        const auto genus = surface_topology(surface).genus();
        EXPECT_EQ(close(surface, kEverything).closed_handles, std::size_t(genus));
        if (::testing::Test::HasFailure()) FAIL() << "seed " << seed;
    }
}

TEST(CloseHandles, OpenSurfacesKeepTheirBorders) {
    std::mt19937 random(5);
    for (unsigned seed = 0; seed < 60; ++seed) { // loops beside, along and between borders
        Mesh body = voxel_body(random_cells(seed, 4, 0.7), false), open;
        open.positions = body.positions;
        for (std::size_t f = 0; f < body.face_count(); ++f)
            if (random() % 8) open.add_face(body.face(f));
        ManifoldSurface surface = manifold(open);
        for (const double limit : {4.0, 6.0, kEverything}) close(surface, limit);
        if (::testing::Test::HasFailure()) FAIL() << "seed " << seed;
    }
    // a torus with a hole in its side is a handle still; a tube is none
    Mesh torus = make_torus({.resolution = 12});
    torus.corners.resize(4 * (torus.face_count() - 1));
    torus.face_offsets.pop_back();
    ManifoldSurface holed = manifold(torus);
    EXPECT_EQ(close(holed, kEverything).closed_handles, 1u);
    EXPECT_EQ(surface_topology(holed).border_loops, 1u);
    torus.corners.resize(4 * 12 * 20);
    torus.face_offsets.resize(12 * 20 + 1);
    ManifoldSurface tube = manifold(torus);
    EXPECT_EQ(surface_topology(tube).border_loops, 2u);
    EXPECT_EQ(close(tube, kEverything).closed_handles, 0u);
}

TEST(CloseHandles, NoLoopIsLeftThatThePlainSearchFinds) {
    std::size_t closed = 0, kept = 0;
    for (unsigned seed = 0; seed < 8; ++seed) {
        Mesh body = voxel_body(random_cells(seed, 5, 0.6 + 0.02 * seed), false);
        std::mt19937 random(seed);
        for (Vec3f& p : body.positions) // narrow cells and wide ones, and no two loops alike
            for (int k = 0; k < 3; ++k) p[k] = 0.3f * p[k] * p[k] + 0.5f * p[k] + 0.1f * float(random() % 1000) / 1000;
        const ManifoldSurface surface = manifold(body);
        for (const double limit : {3.0, 5.0, 8.0}) {
            ManifoldSurface now = surface;
            const CleanReport report = close(now, limit);
            const double shortest = shortest_handle_loop(surface, limit);
            EXPECT_EQ(report.closed_handles > 0, shortest <= limit) << seed << " " << shortest;
            EXPECT_GT(shortest_handle_loop(now, limit), limit) << seed;
            closed += report.closed_handles;
            kept += std::size_t(surface_topology(now).genus());
        }
    }
    EXPECT_GT(closed, 15u); // both happen
    EXPECT_GT(kept, 20u);
}

TEST(CloseHandles, WithoutSourceCorners) {
    ManifoldSurface surface = manifold(make_torus({.resolution = 12}));
    surface.source_corners.clear(); // as a wrap is
    EXPECT_EQ(close(surface, kEverything).closed_handles, 1u);
}

TEST(CloseHandles, AddsToTheReport) {
    CleanReport report;
    report.closed_handles = 7;
    report.filled_triangles = 5;
    ManifoldSurface surface = manifold(make_torus({.resolution = 12}));
    ASSERT_TRUE(close_handles(surface, kEverything, report, RunContext(1)).ok());
    EXPECT_EQ(report.closed_handles, 8u);
    EXPECT_GT(report.filled_triangles, 5u);
}

TEST(CloseHandles, CancelAndThreads) {
    const ManifoldSurface surface = manifold(voxel_body(slab(21, 2), false));
    ManifoldSurface one = surface;
    RunContext context(1);
    context.cancel();
    CleanReport report;
    const Status status = close_handles(one, 4, report, context);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::cancelled);
    EXPECT_EQ(report.closed_handles, 0u);
    FILIGREE_NEEDS_TWO_THREADS();
    ManifoldSurface two = surface;
    close(one, 4, RunContext(1));
    close(two, 4, RunContext(2));
    EXPECT_EQ(one.triangles, two.triangles);
    EXPECT_EQ(one.positions, two.positions);
}

TEST(CloseHandles, TheDragonsHandlesAreNoise) {
    const std::filesystem::path dragon = std::filesystem::path(FILIGREE_ROOT) / "build/scans/dragon.ply";
    if (!std::filesystem::exists(dragon)) GTEST_SKIP() << "no dragon; scripts/fetch-scans fetches it";
    const RunContext context;
    const auto file = read_mesh(dragon, context);
    ASSERT_TRUE(file.ok());
    const ManifoldSurface surface = manifold(file->mesh);
    ASSERT_EQ(surface_topology(surface).genus(), 55);
    const double diagonal = world_bounds(file->mesh).diagonal();
    for (const auto& [limit, closed] : {std::pair(0.01, 53u), {0.04, 54u}}) {
        ManifoldSurface now = surface;
        CleanReport report;
        ASSERT_TRUE(close_handles(now, limit * diagonal, report, context).ok());
        EXPECT_EQ(report.closed_handles, closed); // the one left at 4 % is the dragon's own
        EXPECT_LT(report.filled_triangles, 1000u);
        const SurfaceTopology topology = surface_topology(now);
        EXPECT_EQ(topology.genus(), 55 - std::int64_t(closed));
        EXPECT_EQ(topology.components, 1u);
        EXPECT_EQ(topology.border_edges, 0u);
    }
}

} // namespace
} // namespace filigree_test
