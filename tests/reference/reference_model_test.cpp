// A mesh stripped by the report's method as a model: its levels, its restoring, what is refused.
#include "filigree/reference.h"

#include "broken_meshes.h"
#include "filigree/mesh.h"
#include "filigree/mesh/normals.h"
#include "hierarchy/stripping.h"

namespace {

using namespace filigree_test;

const Mesh kPlane = make_wavy_plane({.resolution = 8});

ReferenceModel reference_of(const Mesh& mesh, const ReferenceOptions& options = {}) {
    Result<ReferenceModel> model = strip_to_reference(mesh, options, kOneThread);
    EXPECT_TRUE(model.ok()) << model.error().message;
    EXPECT_EQ(check_model(*model), "");
    return std::move(*model);
}

std::vector<Vec3f> bent(std::span<const Vec3f> positions) {
    std::vector<Vec3f> moved;
    for (const Vec3f& p : positions) moved.emplace_back(p.x(), p.y() + 0.3f * p.x() * p.x(), p.z() * (1 + p.x()));
    return moved;
}

} // namespace

TEST(ReferenceModel, AtRestTheMeshComesBack) {
    Mesh mesh = make_wavy_cube({.resolution = 16});
    mesh.normals.values = vertex_normals(mesh, mesh.positions, kOneThread);
    mesh.colors.assign(mesh.vertex_count(), Vec4f(1, 0.5f, 0, 1));
    const ReferenceModel model = reference_of(mesh);
    EXPECT_EQ(driver_positions(model), level_mesh(model, 0).positions);
    const Mesh back = restore_reference(model, driver_positions(model), {}, kOneThread).value();
    EXPECT_LT(distance(back.positions, mesh.positions).max, 1e-6);
    EXPECT_EQ(back.corners, mesh.corners);
    EXPECT_EQ(back.colors, mesh.colors);
    ASSERT_EQ(back.normals.values.size(), mesh.normals.values.size());
    for (std::size_t i = 0; i < back.normals.values.size(); ++i)
        EXPECT_LT((back.normals.values[i] - mesh.normals.values[i]).norm(), 1e-4f);
}

TEST(ReferenceModel, EveryLevelIsTheFinestAtItsVertices) {
    const ReferenceModel model = reference_of(make_wavy_cube({.resolution = 32}), {.max_levels = 3});
    ASSERT_EQ(model.finest_level(), 3u);
    const std::vector<Vec3f> driver = bent(driver_positions(model));
    const Mesh finest = restore_reference(model, driver, {}, kOneThread).value();
    for (unsigned k = 0; k < 3; ++k) {
        const Mesh level = restore_reference(model, driver, {.level = k}, kOneThread).value();
        const std::vector<Index>& vertices = model.levels[k].vertices;
        ASSERT_EQ(level.vertex_count(), vertices.size());
        EXPECT_EQ(level.corners, level_mesh(model, k).corners);
        for (std::size_t i = 0; i < vertices.size(); ++i) ASSERT_EQ(level.positions[i], finest.positions[vertices[i]]);
    }
    for (std::size_t i = 0; i < driver.size(); ++i) // the driver goes where it is put
        ASSERT_LT((finest.positions[model.driver().vertices[i]] - driver[i]).norm(), 2e-6f);
}

TEST(ReferenceModel, BaseIsTheClosestNumberOfLevels) {
    const Mesh mesh = make_wavy_cube({.resolution = 32}); // 6,146 vertices, then 1,538, 386, 98, 26, 8
    for (const auto& [base, driver] : {std::pair<std::size_t, std::size_t>{1500, 1538}, {400, 386}, {60, 98}, {3, 8}})
        EXPECT_EQ(reference_of(mesh, {.base = base}).driver().vertices.size(), driver) << base;
    EXPECT_EQ(reference_of(mesh, {.base = 1'000'000}).finest_level(), 1u) << "one level at least is removed";
}

TEST(ReferenceModel, WhatItCannotDoIsRefused) {
    const auto code = [](const Mesh& mesh, const ReferenceOptions& options) {
        const Result<ReferenceModel> model = strip_to_reference(mesh, options, kOneThread);
        return model.ok() ? std::optional<ErrorCode>() : model.error().code;
    };
    EXPECT_EQ(code(kPlane, {.references = 5}), ErrorCode::usage);
    EXPECT_EQ(code(kPlane, {.max_levels = 0}), ErrorCode::usage);
    EXPECT_EQ(code(kPlane, {.max_levels = 17}), ErrorCode::usage);
    EXPECT_EQ(code(kPlane, {.base = 2}), ErrorCode::usage);
    EXPECT_EQ(code(soup(kPlane), {}), ErrorCode::unsuitable);
    EXPECT_EQ(code(Mesh(), {}), ErrorCode::unsuitable);
    FILIGREE_EXPECT_BROKEN_MESHES_ARE_REFUSED([](const Mesh& m) { return strip_to_reference(m, {}, kOneThread); });

    const ReferenceModel model = reference_of(kPlane);
    const std::vector<Vec3f> driver = driver_positions(model);
    const std::span<const Vec3f> few = std::span(driver).first(driver.size() - 1);
    EXPECT_EQ(restore_reference(model, few, {}, kOneThread).error().code, ErrorCode::mismatch);
    EXPECT_EQ(restore_reference(model, driver, {.level = model.finest_level() + 1}, kOneThread).error().code,
              ErrorCode::usage);
    const RunContext cancelled(1);
    cancelled.cancel();
    EXPECT_EQ(restore_reference(model, driver, {}, cancelled).error().code, ErrorCode::cancelled);
}

TEST(ReferenceModel, DamageIsSeen) {
    using Damage = std::function<void(ReferenceModel&)>;
    const auto detail = [](ReferenceModel& m) -> ReferenceDetail& { return m.detail; };
    const ReferenceModel sound = reference_of(kPlane);
    const std::vector<Damage> damages = {
        [](ReferenceModel& m) { m.mesh.positions[3].x() = NAN; },
        [](ReferenceModel& m) { m.levels.clear(); },
        [](ReferenceModel& m) { m.levels.pop_back(); },
        [](ReferenceModel& m) { m.levels[0].vertices.back() = 81; },
        [&](ReferenceModel& m) { detail(m).references = 5; },
        [&](ReferenceModel& m) { detail(m).patches.levels = 0; },
        [&](ReferenceModel& m) { detail(m).patches.levels = 40; },
        [&](ReferenceModel& m) { detail(m).patches.base.clear(); },
        [&](ReferenceModel& m) { detail(m).patches.base[0][0] ^= 1; },
        [&](ReferenceModel& m) { detail(m).patches.grid.pop_back(); },
        [&](ReferenceModel& m) { detail(m).patches.grid[4] = 81; },
        [&](ReferenceModel& m) { detail(m).patches.grid[10] = detail(m).patches.grid[11]; },
        [&](ReferenceModel& m) { detail(m).rest_driver.pop_back(); },
        [&](ReferenceModel& m) { detail(m).rest_driver[0].z() = NAN; },
        [&](ReferenceModel& m) { detail(m).records.pop_back(); },
        [&](ReferenceModel& m) { detail(m).records[2].x() = INFINITY; },
        [&](ReferenceModel& m) { detail(m).extent = NAN; },
        [&](ReferenceModel& m) { detail(m).loose = {1000}; },
        [&](ReferenceModel& m) {
            detail(m).loose = {2, 1};
        }};
    for (std::size_t i = 0; i < damages.size(); ++i) {
        ReferenceModel model = sound;
        damages[i](model);
        EXPECT_NE(check_model(model), "") << "damage " << i;
    }
}

static_assert(!std::is_constructible_v<ReferenceRestorer, ReferenceDetail, HeightLaw, const RunContext&>,
              "it keeps a reference");
static_assert(std::is_constructible_v<ReferenceRestorer, const ReferenceDetail&, HeightLaw, const RunContext&>);
