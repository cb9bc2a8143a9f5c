// check_model sees every way a model can be wrong.
#include "filigree/strip.h"

#include "blend/stripping.h"
#include "filigree/mesh.h"

using namespace filigree_test;

namespace {

using Damage = std::function<void(Model&)>;

void expect_all_seen(const Model& sound, const std::vector<Damage>& damages) {
    ASSERT_EQ(check_model(sound), "");
    for (std::size_t i = 0; i < damages.size(); ++i) {
        Model model = sound;
        damages[i](model);
        EXPECT_NE(check_model(model), "") << "damage " << i;
    }
}

BlendDetail& blend(Model& model) { return model.detail; }

const Mesh kPlane = make_wavy_plane({.resolution = 8});

} // namespace

TEST(Model, CountsWhatItsLevelsHave) {
    const Model model = stripped(kPlane, {.levels = 2}).model;
    for (unsigned level = 0; level <= model.finest_level(); ++level) {
        const Mesh mesh = level_mesh(model, level);
        const LevelCounts counts = level_counts(model, level);
        EXPECT_EQ(counts.vertices, mesh.vertex_count()) << level;
        EXPECT_EQ(counts.faces, mesh.face_count()) << level;
        EXPECT_EQ(counts.corners, mesh.corner_count()) << level;
        EXPECT_EQ(counts.triangles(), triangulate(mesh).triangles.size()) << level;
    }
}

TEST(Model, DamageOfMeshAndLevelsIsSeen) {
    expect_all_seen(stripped(kPlane, {.levels = 2}).model,
                    {[](Model& m) { m.mesh.positions[3].x() = NAN; }, [](Model& m) { m.mesh.corners[0] = 81; },
                     [](Model& m) { m.mesh.face_offsets[1] = 1000; }, [](Model& m) { m.levels.clear(); },
                     [](Model& m) { m.levels[0].vertices.clear(); }, [](Model& m) { m.levels[0].vertices.back() = 81; },
                     [](Model& m) { m.levels[1].vertices[1] = m.levels[1].vertices[0]; },
                     [](Model& m) { m.levels[1].corners[0] = static_cast<Index>(m.levels[1].vertices.size()); },
                     [](Model& m) { m.levels[1].face_offsets.back() += 3; },
                     [](Model& m) { m.levels[0].face_offsets.erase(m.levels[0].face_offsets.begin() + 1); }});
}

TEST(Model, DamageOfTheBlendCodeIsSeen) {
    expect_all_seen(stripped(kPlane, {.base = 12}).model,
                    {[](Model& m) { blend(m).cells.clear(); }, [](Model& m) { blend(m).cells[0][2] = 1000; },
                     [](Model& m) { blend(m).cell_offsets.pop_back(); },
                     [](Model& m) { blend(m).cell_offsets.front() = 1; },
                     [](Model& m) { blend(m).cell_offsets.back() = 80; },
                     [](Model& m) { blend(m).cell_offsets[1] = 82; }, [](Model& m) { blend(m).order.pop_back(); },
                     [](Model& m) { blend(m).order[0] = 81; }, [](Model& m) { blend(m).order[0] = blend(m).order[1]; },
                     [](Model& m) { blend(m).u.pop_back(); }, [](Model& m) { blend(m).v.push_back(0); },
                     [](Model& m) { blend(m).u[5] = NAN; }, [](Model& m) { blend(m).v[5] = -1.5f; },
                     [](Model& m) {
                         blend(m).across_gap = {3, 3};
                     },
                     [](Model& m) { blend(m).facing_away = {81}; }});
}

TEST(Model, LevelMeshesCarryWhatVerticesHave) {
    Mesh mesh = kPlane;
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        mesh.colors.emplace_back(static_cast<float>(v) / 81, 0, 0, 1);
        mesh.normals.values.emplace_back(0, 0, 1);
    }
    mesh.scalars = {{"id", {}}};
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) mesh.scalars[0].values.push_back(static_cast<float>(v));
    mesh.origin = {1e6, 0, 0};
    const Model model = stripped(mesh, {.levels = 2}).model;
    for (unsigned k = 0; k <= 2; ++k) {
        const Mesh level = level_mesh(model, k);
        EXPECT_EQ(check_mesh(level), "");
        EXPECT_EQ(level.origin, mesh.origin);
        for (std::size_t i = 0; i < level.vertex_count(); ++i) {
            const auto v = static_cast<std::size_t>(level.scalars[0].values[i]);
            EXPECT_EQ(level.positions[i], mesh.positions[v]);
            EXPECT_EQ(level.colors[i], mesh.colors[v]);
            EXPECT_EQ(level.uvs.values[i], mesh.uvs.values[v]);
        }
    }
    EXPECT_EQ(driver_positions(model), level_mesh(model, 0).positions);
}
