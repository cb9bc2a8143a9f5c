#include "filigree/present/level_shape.h"

#include "filigree/mesh.h"
#include "filigree/strip.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

std::shared_ptr<const Model> cube_model() {
    Mesh cube = make_wavy_cube({.resolution = 16});
    cube.origin = Vec3d(100, 0, 0);
    return std::make_shared<const Model>(strip(cube, {.base = 100}, kAllThreads).value().model);
}

TEST(LevelFacts, CountWhatALevelHas) {
    const auto model = cube_model();
    const LevelFacts finest = level_facts(*model, model->finest_level()), driver = level_facts(*model, 0);
    EXPECT_EQ(finest.vertices, model->mesh.vertex_count());
    EXPECT_EQ(finest.triangles, 2 * model->mesh.face_count()); // quads
    EXPECT_EQ(finest.deviation, 0.0);
    EXPECT_EQ(driver.vertices, model->driver().vertices.size());
    EXPECT_LT(driver.triangles, finest.triangles);
    EXPECT_FALSE(driver.deviation);
}

TEST(LevelDeviations, ShrinkTowardsTheFinest) {
    const Mesh ball = make_wavy_sphere({.resolution = 24, .amplitude = 0});
    const Model model = strip(ball, {.base = 60}, kAllThreads).value().model;
    const auto deviations = level_deviations(model, kAllThreads).value();
    ASSERT_EQ(deviations.size(), model.finest_level());
    ASSERT_GE(deviations.size(), 2u);
    for (std::size_t level = 0; level < deviations.size(); ++level) {
        ASSERT_TRUE(deviations[level]);
        EXPECT_GT(*deviations[level], 0);
        EXPECT_TRUE(level == 0 || *deviations[level] < *deviations[level - 1]);
    }
    const RunContext cancelled;
    cancelled.cancel();
    EXPECT_EQ(level_deviations(model, cancelled).error().code, ErrorCode::cancelled);
}

TEST(LevelShape, KnowsWhichOfItsVerticesAFinestOneIs) {
    const auto model = cube_model();
    for (unsigned level = 0; level <= model->finest_level(); ++level) {
        const auto shape = LevelShape::make(model, {}, level, kAllThreads).value();
        std::size_t found = 0;
        for (Index v = 0; v < model->mesh.vertex_count(); ++v)
            if (const std::optional<Index> local = shape->vertex_of(v)) {
                EXPECT_EQ(shape->finest_vertex(*local), v);
                ++found;
            }
        EXPECT_EQ(found, shape->vertex_count());
        EXPECT_FALSE(shape->vertex_of(static_cast<Index>(model->mesh.vertex_count())));
    }
}

TEST(LevelShape, IsPickedWhereTheRayMeetsIt) {
    const auto model = cube_model();
    const auto shape = LevelShape::make(model, {}, 0, kAllThreads).value();
    const std::vector<Vec3f> positions = shape->positions({driver_positions(*model), {}}, kAllThreads);
    ASSERT_EQ(positions.size(), shape->vertex_count());
    const Camera::Ray ray{Vec3d(100, 0, 9), Vec3d(0, 0, -1)};
    const std::optional<Picked> front = shape->pick(positions, ray, {});
    ASSERT_TRUE(front);
    EXPECT_NEAR(front->at.x(), 100, 1e-9);
    EXPECT_GT(front->at.z(), 0.3);
    EXPECT_GT(model->mesh.positions[front->vertex].z(), 0.2f); // a vertex of the finest mesh, on that side
    const std::optional<Picked> behind = shape->pick(positions, ray, ClipPlane{Vec3d::UnitZ(), 0});
    ASSERT_TRUE(behind);
    EXPECT_LT(behind->at.z(), -0.3);
    EXPECT_FALSE(shape->pick(positions, {Vec3d(100, 5, 9), Vec3d(0, 0, -1)}, {}));
    EXPECT_FALSE(shape->pick({}, ray, {}));
}

} // namespace
} // namespace filigree
