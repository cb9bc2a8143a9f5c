#include "cases.h"
#include "filigree/remesh.h"
#include "filigree/remesh/manifold_surface.h"

#include "filigree/mesh.h"
#include "filigree/reference.h"
#include "grids.h"
#include "hierarchy/stripping.h"
#include "manifold_check.h"

namespace filigree {
namespace {

using namespace filigree_test;

/// Corners of `mesh` are known to be on the face that `source` says, and the point there is p.
void expect_sources(const QuadRemeshed& quads, const Mesh& input, std::size_t allowed_off) {
    ASSERT_EQ(quads.source.size(), quads.mesh.vertex_count());
    std::size_t off = 0;
    for (Index v = 0; v < quads.source.size(); ++v) {
        const CornerPoint& source = quads.source[v];
        std::set<std::ptrdiff_t> faces;
        Vec3d place = Vec3d::Zero();
        for (int k = 0; k < 3; ++k) {
            ASSERT_LT(source.corners[k], input.corner_count());
            faces.insert(std::ranges::upper_bound(input.face_offsets, source.corners[k]) - input.face_offsets.begin());
            place += double(source.barycentric[k]) * input.positions[input.corners[source.corners[k]]].cast<double>();
        }
        ASSERT_EQ(faces.size(), 1u) << "corners of several faces";
        ASSERT_NEAR(source.barycentric.sum(), 1, 1e-5);
        ASSERT_GE(source.barycentric.minCoeff(), -1e-6);
        off += (place - quads.mesh.positions[v].cast<double>()).norm() > 1e-5 * quads.report.diagonal;
    }
    EXPECT_LE(off, allowed_off) << "vertices are not where their sources are";
}

/// All that the header promises of a success, measured anew.
void expect_promises(const QuadRemeshed& quads, const Mesh& input, const QuadRemeshOptions& options) {
    const QuadRemeshReport& report = quads.report;
    ASSERT_EQ(check_mesh(quads.mesh), "");
    const TopologyReport topology = analyse_topology(quads.mesh, kOneThread);
    EXPECT_EQ(topology.quads, topology.faces);
    EXPECT_EQ(topology.unused_vertices.count, 0u);
    EXPECT_TRUE(topology.is_manifold());
    EXPECT_TRUE(topology.is_oriented());

    const QuadQuality quality = measure_quads(quads.mesh, kOneThread);
    EXPECT_EQ(quality.inverted, 0u);
    EXPECT_GT(quality.min_scaled_jacobian, 0);
    EXPECT_EQ(quality.quads, report.quality.quads);
    EXPECT_EQ(quality.min_scaled_jacobian, report.quality.min_scaled_jacobian);

    EXPECT_EQ(topology.euler, report.input.euler) << "against the surface that was remeshed";
    EXPECT_EQ(topology.components, report.input.components);
    EXPECT_EQ(topology.is_closed(), report.input.border_edges == 0);
    EXPECT_EQ(topology_of_quads(quads.mesh).border_loops, report.input.border_loops);
    if (!report.wrapped) {
        CleanReport clean; // what the clean-up alone makes of it
        auto surface = make_manifold(input, clean, kOneThread);
        ASSERT_TRUE(surface.ok());
        const SurfaceTopology before = surface_topology(*surface);
        EXPECT_EQ(report.input.components + report.clean.removed_components, before.components);
        if (options.small_parts == SmallParts::keep) {
            EXPECT_EQ(report.input.euler, before.euler);
        }
        if (report.clean.removed_components == 0) {
            EXPECT_EQ(report.input.euler, before.euler + 2 * std::int64_t(report.clean.closed_handles));
        }
    }

    EXPECT_EQ(report.patches, quads.patches.patch_count());
    EXPECT_EQ(report.levels, quads.patches.levels);
    EXPECT_EQ(topology.faces, report.patches << (2 * report.levels));
    const auto found = find_regular_patches(quads.mesh, 8, kOneThread);
    ASSERT_TRUE(found.ok());
    EXPECT_GE(found->levels, report.levels);
    EXPECT_EQ(quads.patches.grid.size(), report.patches * (quads.patches.side() + 1) * (quads.patches.side() + 1));
    const Mesh base = base_mesh(quads);
    EXPECT_EQ(check_mesh(base), "");
    EXPECT_EQ(base.face_count(), report.patches);

    EXPECT_LE(report.to_input.max, report.max_distance);
    EXPECT_LE(report.from_input.max, report.max_distance_from_input);
    const auto distance = mesh_distance(quads.mesh, input, 20'000, kOneThread);
    ASSERT_TRUE(distance.ok());
    // input->quads only where no part of the input was taken away; the samples are others than the gate's
    EXPECT_LE(distance->relative(distance->surfaces->max_a_to_b), 1.1 * report.max_distance + 1e-6);
    if (!report.wrapped && report.clean.removed_components == 0 && report.clean.closed_handles == 0) {
        EXPECT_LE(distance->relative(distance->surfaces->max_b_to_a), 1.1 * report.max_distance_from_input + 1e-6);
    }
    EXPECT_EQ(quads.mesh.origin, input.origin);
    if (!report.wrapped) {
        // some have left the surface to mend their quads; those on fillings have the closest place
        const std::size_t few = quads.mesh.vertex_count() / 100 + 8;
        expect_sources(quads, input, report.clean.closed_handles == 0 ? few : 10 * few);
    }
}

/// Remeshes, and checks all promises.
QuadRemeshed remeshed(const Mesh& mesh, const QuadRemeshOptions& options, const RunContext& context = RunContext()) {
    auto quads = quad_remesh(mesh, options, context);
    EXPECT_TRUE(quads.ok()) << (quads.ok() ? "" : quads.error().message);
    if (!quads.ok()) return {};
    expect_promises(*quads, mesh, options);
    return std::move(*quads);
}

/// A mesh with the promises, or a refusal with a reason: nothing else may come back.
void expect_promises_or_reason(const Mesh& mesh, const QuadRemeshOptions& options) {
    const auto quads = quad_remesh(mesh, options, RunContext());
    if (quads.ok()) {
        expect_promises(*quads, mesh, options);
    } else {
        EXPECT_EQ(quads.error().code, ErrorCode::unsuitable);
        EXPECT_FALSE(quads.error().message.empty());
    }
}

Mesh many_balls(int count) {
    const Mesh ball = make_wavy_sphere({.resolution = 4, .amplitude = 0});
    Mesh mesh;
    for (int i = 0; i < count; ++i) append(mesh, ball, Vec3f(float(i % 10), float(i / 10 % 10), float(i / 100)) * 1.5f);
    return mesh;
}

/// A sphere with small tunnels through its wall, at three places around it.
Mesh ball_with_handles() {
    Mesh ball = make_wavy_sphere({.resolution = 32, .amplitude = 0});
    // a handle: two faces a few apart go, and a tube of quads joins their rims outside
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (const std::size_t side : {0u, 1u, 2u})
        pairs.push_back({side * 1024 + 10 * 32 + 10, side * 1024 + 10 * 32 + 12});
    Mesh mesh;
    mesh.positions = ball.positions;
    for (std::size_t f = 0; f < ball.face_count(); ++f)
        if (std::ranges::none_of(pairs, [&](const auto& p) { return p.first == f || p.second == f; }))
            mesh.add_face(ball.face(f));
    for (const auto& [a, b] : pairs) {
        std::array<Index, 4> rim_a, rim_b;
        std::copy_n(ball.face(a).begin(), 4, rim_a.begin());
        std::copy_n(ball.face(b).begin(), 4, rim_b.begin());
        // b's rim runs the other way seen from the tube; start where the tube is shortest
        std::array<Index, 4> turned;
        double best = std::numeric_limits<double>::infinity();
        for (std::size_t shift = 0; shift < 4; ++shift) {
            std::array<Index, 4> candidate;
            double length = 0;
            for (std::size_t k = 0; k < 4; ++k) {
                candidate[k] = rim_b[(shift + 4 - k) % 4];
                length += (mesh.positions[rim_a[k]] - mesh.positions[candidate[k]]).norm();
            }
            if (length < best) best = length, turned = candidate;
        }
        std::array<Index, 4> middle; // the tube bends outwards
        for (std::size_t k = 0; k < 4; ++k) {
            middle[k] = static_cast<Index>(mesh.positions.size());
            mesh.positions.push_back(0.53f * (mesh.positions[rim_a[k]] + mesh.positions[turned[k]]));
        }
        for (std::size_t k = 0; k < 4; ++k) {
            const std::size_t l = (k + 1) % 4;
            mesh.add_face(std::array<Index, 4>{rim_a[k], rim_a[l], middle[l], middle[k]});
            mesh.add_face(std::array<Index, 4>{middle[k], middle[l], turned[l], turned[k]});
        }
    }
    return mesh;
}

TEST(QuadRemesh, KeepsItsPromisesOnTheGoodCorpus) {
    const std::vector<CorpusRow> rows = read_corpus();
    if (rows.empty()) GTEST_SKIP() << "no corpus";
    std::size_t remeshed_files = 0;
    for (const CorpusRow& row : rows) {
        if (!row.file.starts_with("good/")) continue;
        const auto input = read_mesh(row.path, kOneThread);
        if (!input.ok() || input->mesh.face_count() == 0) continue;
        if (!all_cases() && input->mesh.face_count() > 40'000) continue;
        SCOPED_TRACE(row.file);
        const QuadRemeshOptions options{.quads = 5000};
        auto quads = quad_remesh(input->mesh, options, RunContext());
        if (!quads.ok()) {
            ADD_FAILURE() << quads.error().message;
            continue;
        }
        expect_promises(*quads, input->mesh, options);
        ++remeshed_files;
        if (quads->report.tries == 1) {
            EXPECT_LE(double(quads->report.quality.quads), 1.3 * 5000 + 24);
        }
    }
    EXPECT_GT(remeshed_files, 5u);
}

/// A ball with thin spikes, the way claws stand on a paw.
Mesh ball_with_spikes() {
    Mesh mesh = make_wavy_sphere({.resolution = 96, .amplitude = 0});
    const std::array<Vec3f, 6> spikes = {{{1, 0.3f, 0.2f},
                                          {-0.4f, 1, 0.1f},
                                          {0.2f, -0.5f, 1},
                                          {-0.6f, -0.6f, -0.5f},
                                          {0.55f, -0.2f, 0.8f},
                                          {-0.1f, 0.7f, -0.7f}}};
    for (Vec3f& p : mesh.positions) {
        float height = 1;
        for (const Vec3f& spike : spikes) {
            const float angle = std::acos(std::clamp(p.normalized().dot(spike.normalized()), -1.0f, 1.0f));
            height += 0.7f * std::exp(-(angle / 0.06f) * (angle / 0.06f));
        }
        p *= height;
    }
    return mesh;
}

TEST(QuadRemesh, KeepsThinSpikes) {
    for (const std::size_t quads : {20'000, 50'000}) {
        const QuadRemeshed result = remeshed(ball_with_spikes(), {.quads = quads});
        EXPECT_LE(result.report.from_input.max, 6e-3) << quads << " quads";
        EXPECT_EQ(result.report.tries, 1u);
    }
}

TEST(QuadRemesh, KeepsWhatSticksOutOfScans) {
    const std::vector<CorpusRow> rows = read_corpus();
    if (rows.empty()) GTEST_SKIP() << "no corpus";
    std::size_t scans = 0;
    for (const CorpusRow& row : rows) {
        if (row.file != "good/fish.obj" && row.file != "good/koala_100k.obj" && row.file != "good/penguin.obj")
            continue;
        SCOPED_TRACE(row.file);
        const auto input = read_mesh(row.path, kOneThread);
        ASSERT_TRUE(input.ok());
        const QuadRemeshed result = remeshed(input->mesh, {.quads = 20'000});
        EXPECT_LE(result.report.from_input.max, 4e-3); // the fish lost 6.1e-3 of its fins
        ++scans;
    }
    EXPECT_EQ(scans, 3u);
}

TEST(QuadRemesh, TheDistanceFromTheInputHasALimitOfItsOwn) {
    const Mesh ball = make_wavy_sphere({.resolution = 24, .amplitude = 0});
    const auto limits = [&](const QuadRemeshOptions& options) {
        const QuadRemeshReport report = remeshed(ball, options).report;
        return std::pair(report.max_distance, report.max_distance_from_input);
    };
    const auto [both, from_input] = limits({.quads = 20'000});
    EXPECT_EQ(from_input, 6e-3);
    EXPECT_GT(both, from_input);
    EXPECT_EQ(limits({.quads = 20'000, .max_distance = 0.02}), std::pair(0.02, 0.02)) << "as asked";
    for (const QuadRemeshOptions& options : {QuadRemeshOptions{.quads = 19'999},
                                             {.quads = 20'000, .levels = 4},
                                             {.quads = 20'000, .wrap = WrapUse::always}}) {
        const auto [all, second] = limits(options);
        EXPECT_EQ(all, second);
    }
}

TEST(QuadRemesh, MeetsTheCountOfSmoothSurfaces) {
    for (const Mesh& mesh :
         {make_wavy_sphere({.resolution = 48, .frequency = 2}), make_torus({.resolution = 32, .amplitude = 0})})
        for (const std::size_t quads : {2000, 12'000, 50'000}) {
            const QuadRemeshed result = remeshed(mesh, {.quads = quads});
            EXPECT_NEAR(double(result.report.quality.quads), double(quads), 0.02 * double(quads));
            EXPECT_GT(result.report.quality.mean_scaled_jacobian, 0.85) << quads;
        }
}

TEST(QuadRemesh, HasTheLevelsAskedFor) {
    for (const unsigned levels : {1u, 2u, 4u, 5u}) {
        const QuadRemeshed quads = remeshed(make_ball({0, 0, 0}, 1), {.quads = 20'000, .levels = levels});
        EXPECT_EQ(quads.report.levels, levels);
    }
}

TEST(QuadRemesh, KeepsTheCornersAndEdgesOfACube) {
    const Mesh cube = plain_cube();
    const QuadRemeshed quads = remeshed(cube, {.quads = 5000});
    for (const Vec3f& corner : cube.positions)
        EXPECT_TRUE(std::ranges::find(quads.mesh.positions, corner) != quads.mesh.positions.end());
    EXPECT_EQ(quads.report.feature_edges, 12u);
    EXPECT_LT(quads.report.to_input.max, 1e-6);
    EXPECT_LT(quads.report.from_input.max, 1e-6);
    EXPECT_NEAR(analyse_topology(quads.mesh, kOneThread).area, 6, 1e-4);
}

TEST(QuadRemesh, KeepsTheEdgesOfAMachinedPart) {
    for (const double waist : {0.0, 0.15}) {
        const Mesh part = machined_part(24, 12, waist);
        const QuadRemeshed quads = remeshed(part, {.quads = 5000});
        EXPECT_LE(quads.report.to_input.max, 1e-3);
        EXPECT_LE(quads.report.from_input.max, 1e-3);
        const Prepared on(part, quads.report.patches);
        for (Index v = 0; v < on.kinds.size(); ++v) {
            if (on.kinds[v] != VertexKind::corner) continue;
            const Vec3f corner = on.surface.positions[v].cast<float>();
            EXPECT_TRUE(std::ranges::find(quads.mesh.positions, corner) != quads.mesh.positions.end()) << v;
        }
        // without features the edges are cut off
        QuadRemeshOptions rounded{.quads = 5000, .feature_angle_deg = 180, .max_distance = 0.1};
        const QuadRemeshed without = remeshed(part, rounded);
        EXPECT_EQ(without.report.feature_edges, 0u);
        EXPECT_GT(without.report.from_input.max, 2 * quads.report.from_input.max);
    }
}

TEST(QuadRemesh, KeepsOpenBorders) {
    const Mesh sheet = ridged_sheet();
    const QuadRemeshed quads = remeshed(sheet, {.quads = 4000});
    EXPECT_EQ(quads.report.output.border_loops, 1u);
    const Prepared on(sheet, quads.report.patches);
    // vertices of open edges lie on the sheet's border
    std::map<std::pair<Index, Index>, int> uses;
    for (std::size_t f = 0; f < quads.mesh.face_count(); ++f) {
        const auto face = quads.mesh.face(f);
        for (std::size_t k = 0; k < 4; ++k) ++uses[std::minmax(face[k], face[(k + 1) % 4])];
    }
    for (const auto& [edge, count] : uses)
        if (count == 1) {
            EXPECT_LT(on.distance_to_curves(quads.mesh.positions[edge.first].cast<double>()), 1e-5);
        }
    for (const float x : {-0.5f, 0.5f})
        for (const float y : {-0.5f, 0.5f})
            EXPECT_TRUE(
                std::ranges::any_of(quads.mesh.positions, [&](const Vec3f& p) { return p.x() == x && p.y() == y; }));
}

TEST(QuadRemesh, OfAMoebiusStripCutsItOpenOrSaysWhy) {
    const Mesh strip = moebius_strip();
    for (const WrapUse wrap : {WrapUse::automatic, WrapUse::never})
        expect_promises_or_reason(strip, {.quads = 2000, .wrap = wrap});
}

TEST(QuadRemesh, TinyMeshes) {
    const Mesh one = triangle_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
    const Mesh two = triangle_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}, {1, 3, 2}});
    const Mesh tetrahedron =
        triangle_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}});
    for (const Mesh& mesh : {one, two, tetrahedron, plain_cube()})
        for (const std::size_t quads : {6, 24, 500}) {
            SCOPED_TRACE(std::to_string(mesh.face_count()) + " faces, " + std::to_string(quads) + " quads");
            expect_promises_or_reason(mesh, {.quads = quads});
        }
    for (const Mesh& mesh : {one, two, tetrahedron, plain_cube()}) {
        const QuadRemeshed quads = remeshed(mesh, {.quads = 1000});
        EXPECT_LT(quads.report.from_input.max, 1e-3);
    }
}

TEST(QuadRemesh, NothingWithAnAreaIsUnsuitable) {
    for (const Mesh& mesh : {Mesh{}, triangle_mesh({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}),
                             triangle_mesh({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, {{0, 1, 2}})}) {
        const auto quads = quad_remesh(mesh, {}, kOneThread);
        ASSERT_FALSE(quads.ok());
        EXPECT_EQ(quads.error().code, ErrorCode::unsuitable);
        EXPECT_FALSE(quads.error().message.empty());
    }
}

TEST(QuadRemesh, DegenerateTrianglesAmongGoodOnes) {
    // each face of a ball with a needle and a cap of no area beside it
    Mesh mesh = make_wavy_sphere({.resolution = 8, .amplitude = 0});
    const std::size_t faces = mesh.face_count();
    for (std::size_t f = 0; f < faces; f += 3) {
        const Index a = mesh.face(f)[0], b = mesh.face(f)[1], middle = static_cast<Index>(mesh.vertex_count());
        mesh.positions.push_back(0.5f * (mesh.positions[a] + mesh.positions[b]));
        mesh.add_face(Triangle{a, middle, b});
        mesh.add_face(Triangle{a, a, b});
    }
    // the needles are parts of their own, on cut edges; without an area they are no reason to refuse
    const auto quads = quad_remesh(mesh, {.quads = 1000}, kOneThread);
    ASSERT_TRUE(quads.ok()) << quads.error().message;
    EXPECT_EQ(quads->report.output.components, 1u);
    EXPECT_EQ(quads->report.quality.inverted, 0u);
    EXPECT_LT(quads->report.clean.removed_area, 1e-5);
}

TEST(QuadRemesh, OptionsOutOfRangeAreUsage) {
    const Mesh cube = plain_cube();
    const auto is_usage = [&](const QuadRemeshOptions& options) {
        const auto quads = quad_remesh(cube, options, kOneThread);
        return !quads.ok() && quads.error().code == ErrorCode::usage && !quads.error().message.empty();
    };
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(is_usage({.quads = 0}));
    EXPECT_TRUE(is_usage({.quads = 1}));
    EXPECT_TRUE(is_usage({.quads = 1'000'000'000}));
    EXPECT_TRUE(is_usage({.quads = std::numeric_limits<std::size_t>::max()}));
    EXPECT_TRUE(is_usage({.levels = 0}));
    EXPECT_TRUE(is_usage({.levels = 9}));
    for (const double angle : {-1.0, 181.0, kNan}) EXPECT_TRUE(is_usage({.feature_angle_deg = angle}));
    for (const double distance : {0.0, -1.0, kNan}) EXPECT_TRUE(is_usage({.max_distance = distance}));
}

TEST(QuadRemesh, LevelsAndAnglesAtTheirEnds) {
    const Mesh ball = make_wavy_sphere({.resolution = 16, .frequency = 3, .amplitude = 0.1});
    // 8 levels on six patches are far more than six quads
    const auto refused = quad_remesh(ball, {.quads = 6, .levels = 8}, kOneThread);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::unsuitable);
    EXPECT_EQ(remeshed(plain_cube(), {.quads = 24, .levels = 1}).report.levels, 1u);
    for (const double angle : {0.0, 1.0, 179.9, 180.0})
        expect_promises_or_reason(ball, {.quads = 2000, .feature_angle_deg = angle});
}

TEST(QuadRemesh, KeepsTheOrigin) {
    Mesh mesh = bumpy_torus();
    const QuadRemeshed here = remeshed(mesh, {.quads = 2000});
    mesh.origin = Vec3d(1e6, -2e6, 3);
    const QuadRemeshed far = remeshed(mesh, {.quads = 2000});
    EXPECT_EQ(far.mesh.origin, mesh.origin);
    EXPECT_TRUE(same_bytes(far.mesh.positions, here.mesh.positions));
}

TEST(QuadRemesh, ManyComponents) {
    const Mesh balls = many_balls(120);
    const QuadRemeshed quads = remeshed(balls, {.quads = 12'000});
    EXPECT_EQ(quads.report.output.components, 120u);
    EXPECT_EQ(quads.report.output.euler, 240);
    // fewer quads than they need: a reason that says how many are
    const auto refused = quad_remesh(balls, {.quads = 500, .levels = 2, .small_parts = SmallParts::keep}, kOneThread);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::unsuitable);
    EXPECT_NE(refused.error().message.find("120 separate parts"), std::string::npos);
    const auto one = quad_remesh(plain_cube(), {.quads = 6}, kOneThread);
    ASSERT_FALSE(one.ok());
    EXPECT_EQ(one.error().message.find("parts"), std::string::npos);
}

TEST(QuadRemesh, SmallPartsGoOrStay) {
    Mesh mesh = make_wavy_sphere({.resolution = 24, .amplitude = 0});
    Mesh crumb = make_wavy_sphere({.resolution = 3, .amplitude = 0, .size = 0.01});
    append(mesh, crumb, Vec3f(2, 0, 0));
    const QuadRemeshed removed = remeshed(mesh, {.quads = 2000});
    EXPECT_EQ(removed.report.clean.removed_components, 1u);
    EXPECT_EQ(removed.report.output.components, 1u);
    const QuadRemeshed kept = remeshed(mesh, {.quads = 2000, .small_parts = SmallParts::keep});
    EXPECT_EQ(kept.report.clean.removed_components, 0u);
    EXPECT_EQ(kept.report.output.components, 2u);
}

TEST(QuadRemesh, TinyHandlesGoOrStay) {
    const Mesh mesh = ball_with_handles();
    ASSERT_EQ(analyse_topology(mesh, kOneThread).euler, 2 - 2 * 3);
    ASSERT_TRUE(analyse_topology(mesh, kOneThread).is_closed());
    const QuadRemeshed removed = remeshed(mesh, {.quads = 3000});
    EXPECT_EQ(removed.report.clean.closed_handles, 3u);
    EXPECT_EQ(removed.report.output.euler, 2);
    const auto kept =
        quad_remesh(mesh, {.quads = 20'000, .small_parts = SmallParts::keep, .wrap = WrapUse::never}, kOneThread);
    ASSERT_TRUE(kept.ok()) << kept.error().message;
    EXPECT_EQ(kept->report.clean.closed_handles, 0u);
    EXPECT_EQ(kept->report.output.euler, -4);
    EXPECT_EQ(kept->report.quality.inverted, 0u);
}

TEST(QuadRemesh, WrapsWhenAskedTo) {
    const Mesh torus = bumpy_torus();
    const QuadRemeshed quads = remeshed(torus, {.quads = 3000, .wrap = WrapUse::always, .max_distance = 0.05});
    EXPECT_TRUE(quads.report.wrapped);
    EXPECT_EQ(quads.report.output.euler, 0);
    EXPECT_TRUE(analyse_topology(quads.mesh, kOneThread).is_closed());
    ASSERT_EQ(quads.source.size(), quads.mesh.vertex_count());
    for (const CornerPoint& source : quads.source)
        for (const Index corner : source.corners) ASSERT_LT(corner, torus.corner_count());
}

TEST(QuadRemesh, RefusesWhatIsTooFarAway) {
    const auto quads =
        quad_remesh(bumpy_torus(), {.quads = 1000, .wrap = WrapUse::never, .max_distance = 1e-9}, kOneThread);
    ASSERT_FALSE(quads.ok());
    EXPECT_EQ(quads.error().code, ErrorCode::unsuitable);
    EXPECT_NE(quads.error().message.find("diagonal"), std::string::npos);
}

TEST(QuadRemesh, SaysHowItGoesAndStopsWhenCancelled) {
    const Mesh mesh = make_wavy_sphere({.resolution = 64});
    std::set<std::string> phases;
    RunContext watching(1);
    watching.progress = [&](std::string_view phase, double fraction) {
        phases.emplace(phase);
        EXPECT_GE(fraction, 0);
        EXPECT_LE(fraction, 1);
    };
    ASSERT_TRUE(quad_remesh(mesh, {.quads = 5000}, watching).ok());
    EXPECT_GE(phases.size(), 4u);
    for (const std::string& phase : phases) {
        RunContext context(1);
        bool asked = false;
        std::set<std::string> later;
        context.progress = [&](std::string_view now, double) {
            if (asked && now != phase) later.emplace(now);
            if (now == phase && !asked) {
                asked = true;
                context.cancel();
            }
        };
        const auto quads = quad_remesh(mesh, {.quads = 5000}, context);
        ASSERT_FALSE(quads.ok()) << "cancelled while " << phase;
        EXPECT_EQ(quads.error().code, ErrorCode::cancelled) << phase;
        EXPECT_LE(later.size(), 2u) << "went on after " << phase;
    }
}

TEST(QuadRemesh, SameBytesForAnyNumberOfThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    for (const Mesh& mesh : {bumpy_torus(), machined_part(), ridged_sheet()}) {
        const auto one = quad_remesh(mesh, {.quads = 5000}, RunContext(1));
        const auto two = quad_remesh(mesh, {.quads = 5000}, RunContext(2));
        ASSERT_TRUE(one.ok() && two.ok());
        EXPECT_TRUE(same_bytes(one->mesh.positions, two->mesh.positions));
        EXPECT_EQ(one->mesh.corners, two->mesh.corners);
        EXPECT_EQ(one->patches.grid, two->patches.grid);
        for (std::size_t v = 0; v < one->source.size(); ++v) {
            ASSERT_EQ(one->source[v].corners, two->source[v].corners);
            ASSERT_EQ(one->source[v].barycentric, two->source[v].barycentric);
        }
    }
}

TEST(QuadRemesh, StripsToItsBaseAndComesBack) {
    for (const Mesh& mesh : {bumpy_torus(), machined_part(), ridged_sheet()}) {
        const QuadRemeshed quads = remeshed(mesh, {.quads = 6000, .levels = 3});
        const ReferenceModel model = strip_to_reference(quads.mesh, {}, kOneThread).value();
        EXPECT_GE(model.levels.size(), 3u);
        // levels are subsets, to the bit; the records on them are floats
        std::vector<Vec3f> driver = driver_positions(model);
        for (const Vec3f& p : driver)
            EXPECT_TRUE(std::ranges::find(quads.mesh.positions, p) != quads.mesh.positions.end());
        if (model.levels.size() == 3) {
            EXPECT_TRUE(same_bytes(driver, base_mesh(quads).positions));
        }
        const Mesh back = restore_reference(model, driver, {}, kOneThread).value();
        EXPECT_LT(filigree_test::distance(back.positions, quads.mesh.positions).max, 1e-6);
    }
}

TEST(QuadRemesh, CarriesAttributes) {
    const Mesh plane = make_wavy_plane({.resolution = 24, .frequency = 1});
    ASSERT_FALSE(plane.uvs.empty());
    const QuadRemeshed quads = remeshed(plane, {.quads = 3000});
    EXPECT_FALSE(quads.mesh.uvs.empty());
    EXPECT_TRUE(remeshed(plane, {.quads = 3000, .attributes = false}).mesh.uvs.empty());
}

TEST(QuadRemesh, MovesWithTheInput) {
    // scaled by a power of two, the same in every bit but for the scale
    Mesh mesh = machined_part(), twice = mesh;
    for (Vec3f& p : twice.positions) p *= 2;
    const QuadRemeshed a = remeshed(mesh, {.quads = 3000}), b = remeshed(twice, {.quads = 3000});
    ASSERT_EQ(a.mesh.corners, b.mesh.corners);
    for (std::size_t v = 0; v < a.mesh.vertex_count(); ++v) ASSERT_EQ(2 * a.mesh.positions[v], b.mesh.positions[v]);
}

} // namespace
} // namespace filigree
