#include "drawing.h"
#include "commands.h"
#include "demo_pictures.h"
#include "picture_files.h"

#include "filigree/io/system/file.h"
#include "filigree/present/error_picture.h"
#include "filigree/present/film_frames.h"
#include "filigree/present/page.h"
#include "filigree/present/patch_drawing.h"
#include "filigree/present/scene_film.h"
#include "filigree/present/textured_look.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace filigree::cli {

std::vector<Command> drawing_commands() { return {render_command(), figures_command()}; }

void check_picture_path(const std::string& path) {
    const std::string ending = lower_extension(path_of(path));
    if (ending != ".png" && ending != ".svg" && ending != ".pdf")
        refuse(ErrorCode::unsupported, path + ": is no picture's name; let it end in .png, .svg or .pdf.");
    check_folder_of(path);
}

void check_png_path(const std::string& path) {
    if (lower_extension(path_of(path)) != ".png")
        refuse(ErrorCode::unsupported, path + ": the picture is a PNG; let its name end in .png.");
    check_picture_path(path);
}

Camera camera_for(const Mesh& mesh, View view, UpAxis up, double aspect, double point_radius) {
    std::vector<Vec3f> room;
    const CameraPoints points = points_of_faces(mesh, room, point_radius);
    return fit_camera(std::span(&points, 1), view_direction(view, up), up_vector(up), aspect);
}

void write_picture(const Picture& picture, const std::string& path, Session& session) {
    if (session.context().is_cancelled()) throw Failure{cancelled_error()};
    require(write_file(path_of(path), encode_png(picture)));
}

void write_picture_of(const Scene& scene, const Camera& camera, const PictureOptions& options, const std::string& path,
                      HeadlessRenderer& renderer, Session& session) {
    const Picture picture = require(renderer.picture(scene, camera, options, session.context()));
    session.begin_writing(path);
    write_picture(picture, path, session);
}

void draw_distances(const Mesh& a, const Mesh& b, const std::array<std::string, 2>& names, const MeshDistance& distance,
                    UpAxis up, const std::string& path, Session& session) {
    const RunContext& context = session.context();
    const HeatMap errors =
        heat_map(distance.vertices ? distance.vertices->per_vertex : require(distances_to_surface(a, b, context)),
                 distance.diagonal);
    double sum = 0, most = 0;
    for (float value : errors.values) {
        sum += double(value) * value;
        most = std::max(most, double(value));
    }
    const std::string caption =
        fmt::format("{} against {}: rms {:.2e}, max {:.2e} of the diagonal", Page::plain(names[0]),
                    Page::plain(names[1]), std::sqrt(sum / std::max<double>(1, double(errors.values.size()))), most);
    require(write_error_picture(a, errors, "distance / diagonal", caption, up, path, context));
}

void draw_expected_error(const Model& model, const PoseError::Estimate& estimate, const Mesh& mesh,
                         const std::string& name, UpAxis up, const std::string& path, Session& session) {
    const std::string caption =
        fmt::format("{}: expected error {:.2e} of the diagonal (rms)", Page::plain(name), estimate.share());
    require(write_error_picture(mesh, expected_error_map(model, estimate), "expected / diagonal", caption, up, path,
                                session.context()));
}

void draw_quads(const QuadRemeshed& result, View view, UpAxis up, const std::string& path, Session& session) {
    const RunContext& context = session.context();
    HeadlessRenderer renderer = require(HeadlessRenderer::create());
    const PatchDrawing drawing = require(PatchDrawing::create(result.mesh, result.patches, 0.8f, context));
    Scene scene;
    drawing.add_to(scene);
    scene.up = up;
    write_picture_of(scene, camera_for(result.mesh, view, up, 4.0 / 3), {.width = 1600, .height = 1200}, path, renderer,
                     session);
}

void draw_points_inside(const Mesh& mesh, const std::vector<Vec3f>& points, double spacing, UpAxis up,
                        const std::string& path, Session& session) {
    const RunContext& context = session.context();
    HeadlessRenderer renderer = require(HeadlessRenderer::create());
    const Drawable surface = require(Drawable::surface(mesh, {}, context));
    const Vec3d direction = view_direction(View::iso, up), axis = up_vector(up);
    const Vec3d towards = (direction - axis * axis.dot(direction)).normalized();
    Scene scene{.objects = {{&surface,
                             {.color = {0.80f, 0.22f, 0.18f},
                              .own_colors = false,
                              .clip = ClipPlane{towards, towards.dot(surface.box().centre())}}}},
                .up = up};
    std::optional<Drawable> balls;
    if (!points.empty()) {
        balls = require(Drawable::points(points, mesh.origin, {.radius = static_cast<float>(0.32 * spacing)}, context));
        scene.objects.push_back({&*balls, {.color = {0.20f, 0.42f, 0.80f}}});
    }
    write_picture_of(scene, camera_for(mesh, View::iso, up, 4.0 / 3), {.width = 1280, .height = 960}, path, renderer,
                     session);
}

void check_png(const std::string& bytes, const std::string& path) { require(decode_picture(bytes, path)); }

namespace {

constexpr std::size_t kPosterMoments = 24, kPosterTriangles = 300'000;

/// mesh: the first moment; reached: places of all moments, relative to its origin.
void draw_poster(const Mesh& mesh, const std::vector<Vec3f>& reached, const SurfaceMaterials& materials,
                 const std::string& path, const RunContext& context) {
    // The page's: web/src/stage.js, model.js, filigree.css.
    const Vec3d direction = Vec3d(0.45, 0.32, 1).normalized(), up = Vec3d::UnitY();
    const Background background{.top = {0.965f, 0.969f, 0.976f}, .bottom = {0.867f, 0.882f, 0.906f}};
    const Vec3f clay{0.725f, 0.647f, 0.549f};
    constexpr unsigned kWidth = 1200, kHeight = 630; // as services that show a link ask for

    HeadlessRenderer renderer = require(HeadlessRenderer::create());
    SurfaceOptions options;
    options.materials = materials.materials;
    const Drawable drawable = require(Drawable::surface(mesh, options, context));
    const CameraPoints points{reached, mesh.origin};
    const Camera camera = fit_camera(std::span(&points, 1), direction, up, double(kWidth) / kHeight, 30, 0.09);
    const Scene scene{.objects = {{&drawable, {.color = clay}}}, .background = background};
    const PictureOptions size{.width = kWidth, .height = kHeight, .passes = 10};
    require(write_file(path_of(path), encode_jpeg(require(renderer.picture(scene, camera, size, context)))));
}

/// A page is none the worse without a poster.
void try_poster(Session& session, const std::function<void(const RunContext&)>& draw) {
    try {
        draw(session.silent_context());
    } catch (const Failure& failure) {
        if (failure.error.code == ErrorCode::cancelled) throw;
        session.warn("The page has no poster: " + failure.error.message);
    }
}

/// Vertices of faces that are to be seen: key frames at other times are scaled to nothing.
void add_seen(const Mesh& mesh, std::vector<Vec3f>& points) {
    for (std::size_t face = 0; face < mesh.face_count(); ++face) {
        const std::span<const Index> corners = mesh.face(face);
        const Vec3f& first = mesh.positions[corners[0]];
        if (std::all_of(corners.begin(), corners.end(), [&](Index v) { return mesh.positions[v] == first; })) continue;
        points.push_back(first);
    }
}

} // namespace

void draw_poster(const Model& model, const FrameSource<Pose>& poses, const std::string& materials_beside,
                 const std::string& path, Session& session) {
    try_poster(session, [&](const RunContext& context) {
        const RestoreOptions level{.level = level_within(model, kPosterTriangles)};
        const Restorer restorer = require(Restorer::create(model, level, context));
        const Pose first = poses.frames > 0 ? require(poses.frame(0)) : rest_pose(model);
        const Mesh mesh = require(restorer.mesh(first, context));
        std::vector<Vec3f> reached = mesh.positions;
        for (std::size_t k = 1; k < kPosterMoments && poses.frames > 1; ++k) {
            const Pose pose = require(poses.frame(k * (poses.frames - 1) / (kPosterMoments - 1)));
            reached.insert(reached.end(), pose.positions.begin(), pose.positions.end());
        }
        draw_poster(mesh, reached, load_surface_materials(mesh, path_of(materials_beside)), path, context);
    });
}

void draw_poster(const GltfScene& scene, const std::string& path, Session& session) {
    try_poster(session, [&](const RunContext& context) {
        std::vector<Vec3f> reached;
        Mesh first = scene.mesh();
        if (!scene.animations().empty()) {
            const auto& [name, begin, end] = scene.animations().front();
            first = require(scene.mesh_at(0, begin, context));
            for (std::size_t k = 0; k < kPosterMoments; ++k)
                add_seen(require(scene.mesh_at(0, begin + (end - begin) * double(k) / (kPosterMoments - 1), context)),
                         reached);
        } else {
            add_seen(first, reached);
        }
        draw_poster(first, reached, load_surface_materials(first, {}), path, context);
    });
}

std::vector<std::string> draw_demo(const DemoScene& scene, const std::function<Pose(double)>& pose_at,
                                   const std::string& picture, const std::string& film, Session& session) {
    std::vector<std::string> made;
    try {
        HeadlessRenderer renderer = require(HeadlessRenderer::create());
        draw_demo_panels(scene, renderer, picture, session);
        made.push_back(picture);
        film_demo(scene, pose_at, renderer, film, session);
        made.push_back(film);
    } catch (const Failure& failure) {
        if (failure.error.code == ErrorCode::cancelled) throw;
        session.warn(failure.error.message);
    }
    return made;
}

std::vector<BodyLook> looks_of_bodies(const ReadyScene& ready, Session& session) {
    std::vector<std::string> warnings;
    std::vector<BodyLook> looks = require(looks_of(ready, warnings, session.silent_context()));
    session.warn(warnings);
    return looks;
}

bool is_film(const std::string& path) { return is_film_path(path_of(path)); }

struct SceneFilms::Films {
    std::vector<std::string> paths;
    HeadlessRenderer renderer;
    std::vector<FilmWriter> writers;
};

SceneFilms::SceneFilms(const std::vector<std::string>& paths, const SceneFile& scene)
    : films_(new Films{paths, require(HeadlessRenderer::create()), {}}) {
    const auto& [width, height] = scene.picture.size;
    for (const std::string& path : paths)
        films_->writers.push_back(
            require(FilmWriter::create(path_of(path), width, height, scene.step.frames_per_second)));
}
SceneFilms::~SceneFilms() = default;

void SceneFilms::write(const SceneFile& scene, const ReadyScene& ready, const Recording& recording, Session& session) {
    session.warn(require(film_scene(scene, ready, recording, films_->renderer, films_->writers, session.context())));
    for (const std::string& path : films_->paths) session.begin_writing(path);
    for (FilmWriter& film : films_->writers) require(film.finish());
}

} // namespace filigree::cli
