// A mesh in levels: what a reader has is what was written; every beginning of the streams is a closed map; each level
// is nearer; damage is named.
#include "filigree/coding/coarsening.h"
#include "filigree/coding/mesh_code.h"
#include "filigree/coding/mesh_levels.h"
#include "filigree/mesh.h"
#include "threads.h"

#include <array>
#include <gtest/gtest.h>
#include <random>

using namespace filigree;

namespace {

PackedMesh frames_of(const Mesh& mesh, bool surface = false) {
    return pack_mesh(mesh, {.surface = surface, .levels = true}, nullptr, kTwoThreads).value();
}

LevelReader reader_of(const PackedMesh& code) {
    const LevelCodeOptions options = level_options(code.options);
    return {options.steps, options.is_refined, std::size_t{1} << 24};
}

void expect_closed(const ClosedMap& map) {
    ASSERT_EQ(map.opposite.size(), 3 * map.triangles.size());
    for (Index h = 0; h < map.opposite.size(); ++h) {
        ASSERT_LT(map.opposite[h], map.opposite.size());
        ASSERT_EQ(map.opposite[map.opposite[h]], h);
        ASSERT_EQ(map.origin(map.opposite[h]), map.origin(next_half_edge(h)));
    }
}

Mesh bumpy_sheet() { // a border, and two holes in it
    Mesh mesh;
    constexpr Index n = 60;
    for (Index j = 0; j <= n; ++j)
        for (Index i = 0; i <= n; ++i)
            mesh.positions.emplace_back(float(i), float(j), 2 * std::sin(0.4f * float(i)) * std::cos(0.3f * float(j)));
    for (Index j = 0; j < n; ++j)
        for (Index i = 0; i < n; ++i) {
            if ((i > 10 && i < 15 && j > 20 && j < 30) || (i == 40 && j == 40)) continue;
            const Index a = j * (n + 1) + i;
            mesh.add_face(std::array{a, a + 1, a + n + 2});
            mesh.add_face(std::array{a, a + n + 2, a + n + 1});
        }
    return mesh;
}

} // namespace

TEST(LevelCode, EveryLevelIsNearer) {
    for (const Mesh& mesh : {make_wavy_sphere({.resolution = 48}), bumpy_sheet()}) {
        const PackedMesh code = frames_of(mesh);
        LevelReader reader = reader_of(code);
        ASSERT_TRUE(reader.read_coarsest(code.levels.connectivity, code.levels.places));
        EXPECT_LE(reader.map().vertex_count(), 520u);
        const auto error = [&] {
            return mesh_distance(mesh_of_levels(reader, code), mesh, 20'000, kTwoThreads)->surfaces->rms_distance;
        };
        double before = error();
        ASSERT_GE(code.levels.levels.size(), 2u);
        for (const PackedLevel& level : code.levels.levels) {
            ASSERT_TRUE(reader.read_level(level.splits, level.batches));
            EXPECT_EQ(reader.map().vertex_count(), level.vertices);
            EXPECT_EQ(reader.map().triangles.size(), level.triangles);
            expect_closed(reader.map());
            const double now = error();
            EXPECT_LT(now, 1.05 * before);
            before = now;
        }
        for (const PackedLevel& level : code.levels.levels) ASSERT_TRUE(reader.refine_level(level.refinement));
        EXPECT_LT(error(), code.step); // quads may be cut along their other diagonal
        EXPECT_FALSE(reader.refine_level("")) << "all of them are refined";
    }
}

TEST(LevelCode, BordersStayWhereTheyAre) {
    const Mesh mesh = bumpy_sheet();
    const PackedMesh code = frames_of(mesh);
    LevelReader reader = reader_of(code);
    ASSERT_TRUE(reader.read_coarsest(code.levels.connectivity, code.levels.places));
    const Box box = bounds(mesh_of_levels(reader, code).positions);
    for (int k = 0; k < 2; ++k) {
        EXPECT_NEAR(box.min[k], 0, 0.1);
        EXPECT_NEAR(box.max[k], 60, 0.1);
    }
    EXPECT_EQ(std::ranges::count(reader.map().closes_hole, true), 3);
}

TEST(LevelCode, ABatchCanBeTakenBackInAnyOrder) {
    const Mesh mesh = make_wavy_sphere({.resolution = 24});
    std::vector<Triangle> triangles;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const auto face = mesh.face(f);
        for (std::size_t k = 1; k + 1 < face.size(); ++k) triangles.push_back({face[0], face[k], face[k + 1]});
    }
    const ClosedSurface surface = make_closed_surface(triangles);
    std::vector<FinePlace> places;
    for (const Index v : surface.source) {
        const Vec3f p = mesh.positions[v] * 1000;
        places.push_back({int(p[0]), int(p[1]), int(p[2])});
    }
    const Coarsening coarsening = coarsen(surface.map, places, {}, 100, kTwoThreads);
    std::size_t vertices = coarsening.vertex.size();
    for (const auto& batch : coarsening.batches) {
        std::vector<bool> went(surface.source.size()), took(surface.source.size());
        for (const VertexCollapse& c : batch) {
            EXPECT_FALSE(went[c.vertex] || took[c.onto]);
            went[c.vertex] = took[c.onto] = true;
        }
        for (const VertexCollapse& c : batch) EXPECT_FALSE(went[c.onto] || went[c.left] || went[c.right]);
        vertices += batch.size();
    }
    EXPECT_EQ(vertices, surface.source.size());
    expect_closed(coarsening.base);
    EXPECT_LT(coarsening.vertex.size(), 140u);
}

TEST(LevelCode, OneThreadOrMany) {
    const Mesh mesh = make_wavy_sphere({.resolution = 40});
    const PackedMesh one = pack_mesh(mesh, {.levels = true}, nullptr, RunContext(1)).value(), many = frames_of(mesh);
    ASSERT_EQ(one.levels.levels.size(), many.levels.levels.size());
    for (std::size_t k = 0; k < one.levels.levels.size(); ++k)
        EXPECT_EQ(one.levels.levels[k].splits, many.levels.levels[k].splits);
}

TEST(LevelCode, DamageIsNamedOrHarmless) {
    const Mesh mesh = make_wavy_sphere({.resolution = 16});
    const PackedMesh code = frames_of(mesh);
    std::mt19937 random(3);
    const auto try_it = [&](const PackedMesh& damaged) {
        const Result<Mesh> read = unpack_mesh(damaged, kTwoThreads);
        if (read)
            EXPECT_EQ(check_mesh(*read), "");
        else
            EXPECT_EQ(read.error().code, ErrorCode::bad_file);
    };
    for (std::size_t k = 0; k < code.levels.levels.size(); ++k)
        for (std::string PackedLevel::*part : {&PackedLevel::splits, &PackedLevel::refinement}) {
            const std::string& bytes = code.levels.levels[k].*part;
            for (std::size_t at = 0; at < bytes.size(); at += 1 + bytes.size() / 100) {
                PackedMesh damaged = code;
                (damaged.levels.levels[k].*part)[at] = char(bytes[at] ^ char(1 + random() % 255));
                try_it(damaged);
            }
            PackedMesh cut = code;
            (cut.levels.levels[k].*part).resize(bytes.size() / 2);
            EXPECT_FALSE(unpack_mesh(cut, kTwoThreads).ok());
        }
    PackedMesh longer = code;
    longer.levels.levels[0].batches = 1u << 30;
    EXPECT_FALSE(unpack_mesh(longer, kTwoThreads).ok());
}
