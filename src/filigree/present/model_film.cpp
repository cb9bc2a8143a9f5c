#include "filigree/present/model_film.h"

#include "filigree/file.h"
#include "filigree/present/film_frames.h"
#include "filigree/present/headless_renderer.h"
#include "filigree/present/textured_look.h"

#include <algorithm>
#include <limits>

namespace filigree {

namespace {

constexpr std::size_t kTurntableFrames = 90;
constexpr double kTurntableRate = 30;
const Vec3f kObstacleColor{0.62f, 0.63f, 0.65f};

double lowest(std::span<const Vec3f> positions, const Vec3d& up) {
    double level = std::numeric_limits<double>::infinity();
    for (const Vec3f& p : positions) level = std::min(level, p.cast<double>().dot(up));
    return level;
}

/// Where the ground is drawn: the body's, a little lower, so that what rests on it is not cut off by rounding; else the
/// lowest place of the motion.
double ground_below(const ModelFilm& film) {
    const Mesh& mesh = film.model->mesh;
    const Vec3d up = up_vector(film.up);
    double level = std::numeric_limits<double>::infinity();
    if (film.surroundings && film.surroundings->has_ground)
        level = film.surroundings->ground_level;
    else if (!film.poses.empty())
        for (const Pose& pose : film.poses.frames) level = std::min(level, lowest(pose.positions, up));
    else
        level = lowest(film.pose.positions.empty() ? mesh.positions : film.pose.positions, up);
    return mesh.origin.dot(up) + level - 1e-4 * bounds(mesh).diagonal();
}

Result<std::vector<Drawable>> obstacle_drawables(const ModelFilm& film, const RunContext& context) {
    std::vector<Drawable> obstacles;
    if (!film.surroundings) return obstacles;
    for (Mesh mesh : film.surroundings->obstacles) {
        mesh.origin = film.model->mesh.origin;
        Result<Drawable> obstacle = Drawable::surface(mesh, {}, context);
        if (!obstacle) return obstacle.error();
        obstacles.push_back(std::move(*obstacle));
    }
    return obstacles;
}

Scene scene_of(const ModelFilm& film, const Drawable& model, std::span<const Drawable> obstacles) {
    Scene scene;
    scene.objects.push_back({&model, film.look});
    for (const Drawable& obstacle : obstacles)
        scene.objects.push_back({&obstacle, {.color = kObstacleColor, .gloss = 0.1f}});
    scene.up = film.up;
    scene.ground = film.surroundings ? film.surroundings->has_ground : film.ground;
    scene.fixed_ground = true;
    scene.ground_level = ground_below(film);
    return scene;
}

} // namespace

Result<std::size_t> film_model(const ModelFilm& film, const std::string& path, const RunContext& context) {
    const bool turns = film.poses.empty();
    const std::size_t frames = turns ? kTurntableFrames : film.poses.frames.size();
    Result<FilmWriter> writer = FilmWriter::create(path_of(path), film.width, film.height,
                                                   turns ? kTurntableRate : film.poses.frames_per_second);
    if (!writer) return writer.error();
    Result<HeadlessRenderer> renderer = HeadlessRenderer::create();
    if (!renderer) return renderer.error();
    RunContext quiet = context; // the progress is that of the frames
    quiet.progress = nullptr;
    Result<Drawable> model = Drawable::model(*film.model, film.restore, film.surface, quiet);
    if (!model) return model.error();
    if (!film.pose.positions.empty())
        if (const Status posed = model->set_pose(film.pose, quiet); !posed) return posed.error();
    const Result<std::vector<Drawable>> obstacles = obstacle_drawables(film, quiet);
    if (!obstacles) return obstacles.error();

    Scene scene = scene_of(film, *model, *obstacles);
    std::optional<Drawable> melt;
    Camera camera = film.camera;
    camera.up = up_vector(film.up);
    const auto seen_from = [&](std::size_t frame) {
        if (turns) return turned(camera, 360.0 * double(frame) / double(frames));
        return film.cameras.empty() ? camera : film.cameras[std::min(frame, film.cameras.size() - 1)];
    };
    const auto draw = [&](std::size_t frame, const RunContext&) -> Result<Picture> {
        scene.objects[0].drawable = &*model;
        if (!turns && frame < film.surfaces.size() && film.surfaces[frame]) {
            SurfaceOptions options;
            options.materials = film.surface.materials;
            Result<Drawable> drawable =
                Drawable::surface(melt_as_drawn(*film.surfaces[frame], options.materials).mesh, options, quiet);
            if (!drawable) return drawable.error();
            melt = std::move(*drawable);
            scene.objects[0].drawable = &*melt;
        } else if (!turns) {
            if (const Status posed = model->set_pose(film.poses.frames[frame], quiet); !posed) return posed.error();
        }
        return renderer->picture(scene, seen_from(frame),
                                 {.width = film.width, .height = film.height, .passes = film.passes}, quiet);
    };
    if (const Status drawn = film_frames(frames, draw, std::span(&*writer, 1), "drawing the film", context); !drawn)
        return drawn.error();
    if (context.is_cancelled()) return cancelled_error();
    if (const Status finished = writer->finish(); !finished) return finished.error();
    return frames;
}

} // namespace filigree
