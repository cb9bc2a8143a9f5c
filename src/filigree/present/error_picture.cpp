#include "filigree/present/error_picture.h"

#include "filigree/file.h"
#include "filigree/present/headless_renderer.h"
#include "filigree/present/page.h"

#include <algorithm>

namespace filigree {

HeatMap expected_error_map(const Model& model, const PoseError::Estimate& estimate) {
    constexpr float kLeastRange = 1e-4f;
    HeatMap map = heat_map(vertex_errors(model, estimate.local), estimate.diagonal);
    const bool is_nothing = std::ranges::all_of(map.values, [](float value) { return value == 0; });
    if (is_nothing || !(map.range.most >= kLeastRange)) map.range = {0, kLeastRange};
    return map;
}

Status write_error_picture(const Mesh& mesh, const HeatMap& errors, const std::string& legend,
                           const std::string& caption, UpAxis up, const std::string& path, const RunContext& context) {
    Result<HeadlessRenderer> renderer = HeadlessRenderer::create();
    if (!renderer) return renderer.error();
    const ScalarColors scalars{errors.values, ColorMap::sequential, errors.range};
    const Result<Drawable> drawable =
        mesh.face_count() ? Drawable::surface(mesh, {.scalars = scalars}, context)
                          : Drawable::points(mesh.positions, mesh.origin, {.scalars = scalars}, context);
    if (!drawable) return drawable.error();
    constexpr unsigned kWidth = 1120, kHeight = 840;
    std::vector<Vec3f> room;
    const CameraPoints points = points_of_faces(mesh, room, drawable->point_radius());
    const Camera camera =
        fit_camera(std::span(&points, 1), view_direction(View::iso, up), up_vector(up), double(kWidth) / kHeight);
    Scene scene;
    scene.objects.push_back({&*drawable, {.gloss = 0.15f}});
    scene.up = up;
    const Result<Picture> picture = renderer->picture(scene, camera, {.width = kWidth, .height = kHeight}, context);
    if (!picture) return picture.error();
    Page page(kWidth + 130, kHeight + 40);
    page.picture(*picture, {0, 0}, kWidth, kHeight);
    page.legend(ColorMap::sequential, errors.range, legend, {kWidth + 14, 24}, 420);
    page.text(caption, {kWidth / 2.0, kHeight + 26}, {.size = 15, .align = Align::centre});
    if (context.is_cancelled()) return cancelled_error();
    return page.write(path_of(path), 1);
}

} // namespace filigree
