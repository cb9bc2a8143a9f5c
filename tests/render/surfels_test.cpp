// What surfels cover of a surface, as seen from four sides.
#include "filigree/file.h"
#include "filigree/hierarchy/blend_code.h"
#include "filigree/pose.h"
#include "render/rendered.h"
#include "render/surfel_coverage.h"

#include <filesystem>

using namespace filigree_test;

namespace {

double most_open(const Mesh& mesh, const Surfels& surfels) {
    double worst = 0;
    for (const View view : {View::front, View::side, View::top, View::iso})
        worst = std::max(worst, open_share(mesh, surfels, camera_on(mesh, view), 800, 600));
    return worst;
}

Surfels of(const Mesh& mesh) { return make_surfels(mesh, kOneThread).value(); }

} // namespace

TEST(SurfelCoverage, AHoleIsSeenAlsoWhereTheFarSideShows) {
    const Mesh ball = make_wavy_sphere({.resolution = 40});
    Surfels surfels = of(ball);
    Surfels holed;
    for (std::size_t i = 0; i < surfels.size(); ++i) {
        if (i % 7 == 0) continue;
        holed.positions.push_back(surfels.positions[i]);
        holed.u.push_back(0.5f * surfels.u[i]);
        holed.v.push_back(0.5f * surfels.v[i]);
        holed.rest_radius.push_back(surfels.rest_radius[i]);
        holed.corners.push_back(surfels.corners[i]);
        holed.weights.push_back(surfels.weights[i]);
    }
    EXPECT_GT(most_open(ball, holed), 0.1);
}

TEST(SurfelCoverage, RestAndBentShapesAreCovered) {
    for (const Mesh& mesh : {make_wavy_sphere({.resolution = 40}), make_wavy_cube({.resolution = 40})}) {
        EXPECT_LT(most_open(mesh, of(mesh)), 1e-3);
        const Model model = stripped(mesh, {.base = 400}).model;
        const auto warp = make_bend(world_bounds(mesh), Axis::z, 120);
        const Pose pose = warp_pose(*warp, model, kOneThread);
        Mesh bent = mesh;
        bent.positions = restored(model, pose);
        const std::vector<Mat3f> gradients = vertex_gradients(model.detail, pose.gradients);
        EXPECT_LT(most_open(bent, split_surfels(carried_surfels(of(mesh), bent.positions, gradients)).value()), 1e-3);
    }
}

TEST(SurfelCoverage, AScanIsCovered) {
    const std::string path = std::string(FILIGREE_ROOT) + "/../shared/corpus/good/koala_100k.obj";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no corpus at " << path;
    const Mesh mesh = read_mesh(path, kOneThread).value().mesh;
    EXPECT_LT(most_open(mesh, of(mesh)), 1e-3);
}
