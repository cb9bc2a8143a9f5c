#include "demo_pictures.h"

#include "filigree/present/film_extent.h"
#include "filigree/present/film_frames.h"
#include "filigree/present/page.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

constexpr unsigned kPanelWidth = 240, kPanelHeight = 240, kPixels = 2; // kPixels for each unit of the page: captions
                                                                       // stay readable where the picture is scaled down
constexpr unsigned kFilmWidth = 640, kFilmHeight = 480, kFilmFrames = 30, kFilmPasses = 8;
constexpr std::size_t kMostFilmTriangles = 150'000;

/// From where a lean is seen from the side: bends go from an axis towards the next.
Camera camera_around(std::span<const CameraPoints> points, UpAxis up, double aspect) {
    const Vec3d direction =
        view_direction(View::side, up) + 0.45 * view_direction(View::front, up) + 0.5 * up_vector(up);
    return fit_camera(points, direction, up_vector(up), aspect, 30, 0.08);
}

} // namespace

void draw_demo_panels(const DemoScene& scene, HeadlessRenderer& renderer, const std::string& path, Session& session) {
    const RunContext& context = session.context();
    const double aspect = double(kPanelWidth) / kPanelHeight;
    const CameraPoints before{scene.mesh.positions, scene.mesh.origin},
        after{scene.restored.positions, scene.restored.origin};
    const Camera at_rest = camera_around(std::span(&before, 1), scene.up, aspect),
                 moved = camera_around(std::span(&after, 1), scene.up, aspect);
    const HeatMap errors = heat_map(scene.error.vertices->per_vertex, scene.error.diagonal);

    constexpr double kGap = 5, kCaption = 28, kLegend = 110;
    Page page(4 * kPanelWidth + 3 * kGap + kLegend, kPanelHeight + kCaption);
    unsigned panel = 0;
    const auto add = [&](const Drawable& drawable, const Camera& camera, bool edges, const std::string& caption) {
        const Scene shown{.objects = {{&drawable, {.edges = edges}}}, .up = scene.up};
        const PictureOptions size{.width = kPixels * kPanelWidth, .height = kPixels * kPanelHeight, .passes = 16};
        const Picture picture = require(renderer.picture(shown, camera, size, context));
        const Point corner(panel++ * (kPanelWidth + kGap), 0);
        page.picture(picture, corner, kPanelWidth, kPanelHeight);
        page.text(caption, corner + Point(kPanelWidth / 2.0, kPanelHeight + 18), {.size = 14, .align = Align::centre});
    };
    {
        const Drawable mesh = require(Drawable::surface(scene.mesh, {}, context));
        add(mesh, at_rest, false, fmt::format("mesh: {} vertices", with_commas(scene.mesh.vertex_count())));
    }
    {
        Drawable drawable = require(Drawable::model(scene.model, {.level = 0}, {}, context));
        require(drawable.set_pose(scene.pose, context));
        add(drawable, moved, true, fmt::format("driver: {}, moved", with_commas(scene.model.driver().vertices.size())));
    }
    Drawable restored = require(Drawable::model(scene.model, {}, {}, context));
    require(restored.set_pose(scene.pose, context));
    add(restored, moved, false, "detail restored");
    const ScalarColors scalars{errors.values, ColorMap::sequential, errors.range};
    restored = require(Drawable::model(scene.model, {}, {.scalars = scalars}, context));
    require(restored.set_pose(scene.pose, context));
    add(restored, moved, false, "error");
    page.legend(ColorMap::sequential, errors.range, "distance / diagonal", {page.width() - kLegend + 14, 20},
                kPanelHeight - 30.0);
    if (context.is_cancelled()) throw Failure{cancelled_error()};
    require(page.write(path_of(path), kPixels));
}

void film_demo(const DemoScene& scene, const std::function<Pose(double)>& pose_at, HeadlessRenderer& renderer,
               const std::string& path, Session& session) {
    const RunContext& context = session.context();
    FilmWriter writer = require(FilmWriter::create(path_of(path), kFilmWidth, kFilmHeight, 30));
    const RestoreOptions restore{.level = level_within(scene.model, kMostFilmTriangles)};
    Drawable drawable = require(Drawable::model(scene.model, restore, {}, context));

    // One camera and one ground for the whole way: a few moments say where it leads.
    const Restorer restorer = require(Restorer::create(scene.model, restore, context));
    FilmExtent extent;
    for (int k = 0; k <= 4; ++k) extent.add(require(restorer.positions(pose_at(k / 4.0), context)), scene.mesh.origin);
    const CameraPoints points = extent.points();
    const Camera camera = camera_around(std::span(&points, 1), scene.up, double(kFilmWidth) / kFilmHeight);

    std::vector<Picture> frames; // the way there; back it is the same
    const auto draw = [&](std::size_t f, const RunContext& quiet) -> Result<Picture> {
        if (f >= kFilmFrames) return frames[2 * (kFilmFrames - 1) - f];
        const double t =
            0.5 - 0.5 * std::cos(std::numbers::pi * double(f) / (kFilmFrames - 1)); // starts and ends slowly
        require(drawable.set_pose(pose_at(t), context));
        const Scene shown{.objects = {{&drawable}},
                          .up = scene.up,
                          .ground_level = extent.ground_level(scene.up),
                          .fixed_ground = true};
        frames.push_back(require(renderer.picture(
            shown, camera, {.width = kFilmWidth, .height = kFilmHeight, .passes = kFilmPasses}, quiet)));
        return frames.back();
    };
    require(film_frames(2 * (kFilmFrames - 1), draw, std::span(&writer, 1), "filming", context));
    require(writer.finish());
}

} // namespace filigree::cli
