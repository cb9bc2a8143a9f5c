#include "film_export.h"

#include "filigree/present/film_frames.h"
#include "filigree/present/headless_renderer.h"

#include <algorithm>

namespace filigree::studio {

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
double ground_level(const FilmJob& job) {
    const Mesh& mesh = job.state.model->mesh;
    const Vec3d up = up_vector(job.view.up);
    double level = std::numeric_limits<double>::infinity();
    if (job.has_surroundings && job.surroundings.has_ground)
        level = job.surroundings.ground_level;
    else if (!job.poses.empty())
        for (const Pose& pose : job.poses.frames) level = std::min(level, lowest(pose.positions, up));
    else
        level = lowest(job.pose.positions.empty() ? mesh.positions : job.pose.positions, up);
    return mesh.origin.dot(up) + level - 1e-4 * bounds(mesh.positions).diagonal();
}

} // namespace

Result<std::size_t> export_film(const FilmJob& job, const std::string& path, const RunContext& context) {
    const bool turns = job.poses.empty();
    const std::size_t frames = turns ? kTurntableFrames : job.poses.frames.size();
    Result<FilmWriter> writer =
        FilmWriter::create(path, job.film.width, job.film.height, turns ? kTurntableRate : job.poses.frames_per_second);
    if (!writer) return writer.error();
    Result<HeadlessRenderer> renderer = HeadlessRenderer::create();
    if (!renderer) return renderer.error();
    RunContext quiet = context; // the progress is that of the frames
    quiet.progress = nullptr;

    SurfaceOptions surface;
    surface.materials = job.state.source->materials.materials;
    Result<Drawable> model = Drawable::model(*job.state.model, job.state.restore, surface, quiet);
    if (!model) return model.error();
    if (!job.pose.positions.empty())
        if (const Status posed = model->set_pose(job.pose, quiet); !posed) return posed.error();
    std::vector<Drawable> obstacles;
    for (Mesh mesh : job.surroundings.obstacles) {
        mesh.origin = job.state.model->mesh.origin;
        Result<Drawable> obstacle = Drawable::surface(mesh, {}, quiet);
        if (!obstacle) return obstacle.error();
        obstacles.push_back(std::move(*obstacle));
    }

    Scene scene;
    Appearance look;
    look.edges = job.view.style != SurfaceStyle::shaded;
    look.surface = job.view.style != SurfaceStyle::wireframe;
    scene.objects.push_back({&*model, look});
    for (const Drawable& obstacle : obstacles) {
        Appearance plain;
        plain.color = kObstacleColor;
        plain.gloss = 0.1f;
        scene.objects.push_back({&obstacle, plain});
    }
    scene.up = job.view.up;
    scene.ground = job.has_surroundings ? job.surroundings.has_ground : job.view.ground; // as on the stage
    scene.fixed_ground = true;
    scene.ground_level = ground_level(job);
    Camera camera = job.camera;
    camera.up = up_vector(job.view.up);

    const auto draw = [&](std::size_t frame, const RunContext&) -> Result<Picture> {
        if (!turns)
            if (const Status posed = model->set_pose(job.poses.frames[frame], quiet); !posed) return posed.error();
        return renderer->picture(scene, turns ? turned(camera, 360.0 * double(frame) / double(frames)) : camera,
                                 {.width = job.film.width, .height = job.film.height, .passes = job.film.passes},
                                 quiet);
    };
    if (const Status drawn = film_frames(frames, draw, std::span(&*writer, 1), "drawing the film", context); !drawn)
        return drawn.error();
    if (context.is_cancelled()) return cancelled_error();
    if (const Status finished = writer->finish(); !finished) return finished.error();
    return frames;
}

} // namespace filigree::studio
