// What surfels cover of a surface's own picture.
#include "filigree/mesh/surfels.h"

#include "filigree/deform/space_warp.h"
#include "filigree/io/mesh_file.h"
#include "render/rendered.h"

#include <filesystem>

using namespace filigree_test;

namespace {

class SurfelPictures : public Rendered {
protected:
    /// The share of the pixels of `mesh`, from four sides, that its surfels leave open.
    double open_share(const Mesh& mesh, const Surfels& surfels) {
        std::size_t open = 0, all = 0;
        const Mesh polygons = surfel_polygons(surfels);
        const Drawable whole = surface(mesh);
        const Drawable discs = surface(polygons);
        for (const View view : {View::front, View::side, View::top, View::iso}) {
            const Camera camera = camera_on(mesh, view);
            const auto picture = [&](const Drawable& drawn) {
                Scene scene = scene_of(drawn);
                scene.background.transparent = true;
                scene.ground = false;
                return draw(scene, camera, {.width = 400, .height = 300, .passes = 1});
            };
            const Picture full = picture(whole), covered = picture(discs);
            for (unsigned y = 0; y < full.height; ++y)
                for (unsigned x = 0; x < full.width; ++x) {
                    all += full.pixel(x, y)[3] == 255;
                    open += full.pixel(x, y)[3] == 255 && covered.pixel(x, y)[3] == 0;
                }
        }
        EXPECT_GT(all, 10'000u);
        return double(open) / double(all);
    }
};

} // namespace

TEST_F(SurfelPictures, CoverRestAndBentShapes) {
    for (const Mesh& mesh : {make_wavy_sphere({.resolution = 40}), make_wavy_cube({.resolution = 40})}) {
        EXPECT_LT(open_share(mesh, make_surfels(mesh, kOneThread).value()), 1e-3);
        const Model model = stripped(mesh, {.base = 400}).model;
        const auto warp = make_bend(world_bounds(mesh), Axis::z, 120);
        const Pose pose = warp_pose(*warp, model, kOneThread);
        Mesh bent = mesh;
        bent.positions = restored(model, pose);
        const std::vector<Mat3f> gradients = vertex_gradients(std::get<BlendDetail>(model.detail), pose.gradients);
        const Surfels carried = carried_surfels(make_surfels(mesh, kOneThread).value(), bent.positions, gradients);
        EXPECT_LT(open_share(bent, split_surfels(carried)), 1e-3);
    }
}

TEST_F(SurfelPictures, CoverAScan) {
    const std::string path = std::string(FILIGREE_ROOT) + "/../shared/corpus/good/koala_100k.obj";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no corpus at " << path;
    const Mesh mesh = read_mesh(path, kOneThread).value().mesh;
    EXPECT_LT(open_share(mesh, make_surfels(mesh, kOneThread).value()), 1e-3);
}
