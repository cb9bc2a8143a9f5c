#include "rendering.h"
#include "animation_output.h"
#include "filigree/blend/blend_code.h"
#include "filigree/io/system/file.h"

#include <utility>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

Background parse_background(const std::string& text) {
    if (text.empty()) return {};
    if (text == "transparent") return {.transparent = true};
    const std::size_t comma = text.find(',');
    const Vec3f top = parse_color(text.substr(0, comma), "--background");
    if (comma == std::string::npos) return {.top = top, .bottom = top};
    return {.top = top, .bottom = parse_color(text.substr(comma + 1), "--background")};
}

} // namespace

/// The file's own surfels, or some made of its surface.
void Rendering::choose_surfels(Subject& subject, const std::string& path) {
    subject.surfels = surfels_of_points(subject.mesh);
    if (!subject.surfels) subject.surfels = require(make_surfels(subject.mesh, context()));
    if (subject.surfels->size() == 0)
        refuse(ErrorCode::unsuitable,
               path + ": has neither faces to make surfels of nor surfels of its own (ux uy uz vx vy vz).");
}

std::unique_ptr<Subject> Rendering::read(const std::string& path) {
    auto subject = std::make_unique<Subject>();
    const FileReader file = session_.open(path);
    if (is_level_at_rest(file, path)) {
        subject->mesh = session_.read_level(file, *options_.restore.level, path);
        finish(*subject, path);
        return subject;
    }
    Session::Content content = session_.read_any(file, path);
    if (auto* model = std::get_if<Model>(&content.value)) {
        subject->model = std::move(*model);
        subject->poses = std::move(content.poses);
        if (!options_.motion.empty()) subject->poses = read_motion(*subject->model, path);
        if (options_.frame > 0) own_pose(subject->poses, options_.frame, path);
        const unsigned level = options_.restore.level.value_or(subject->model->finest_level());
        if (level > subject->model->finest_level())
            refuse(fmt::format("{}: has levels 0 to {}; there is no level {}.", path, subject->model->finest_level(),
                               level));
        subject->mesh = level_mesh(*subject->model, level);
    } else {
        if (!options_.poses.empty() || !options_.motion.empty() || options_.frame > 0)
            refuse(path + ": is a mesh, and --poses and --frame move a model; 'filigree strip' makes one of it.");
        subject->mesh = std::move(std::get<Mesh>(content.value));
    }
    finish(*subject, path);
    return subject;
}

PoseSequence Rendering::read_motion(const Model& model, const std::string& path) {
    const FrameSource<Pose> source = poses_of(options_.motion, {}, model, {}, path, session_);
    PoseSequence poses{source.frames_per_second, {}};
    for (std::size_t frame = 0; frame < source.frames; ++frame) poses.frames.push_back(require(source.frame(frame)));
    return poses;
}

bool Rendering::is_level_at_rest(const FileReader& file, const std::string& path) const {
    return options_.restore.level && options_.poses.empty() && options_.motion.empty() && options_.frame == 0 &&
           options_.scalar != "level" && options_.as == DrawnAs::polygons && is_model_file(file) &&
           session_.outline(file, path).frames == 0;
}

void Rendering::finish(Subject& subject, const std::string& path) {
    subject.materials = load_surface_materials(subject.mesh, path_of(path));
    session_.warn(subject.materials.warnings);
    if (subject.mesh.vertex_count() == 0)
        refuse(ErrorCode::unsuitable, path + ": has no vertices, so there is nothing to draw.");
    if (!std::exchange(up_known_, true)) up_ = up_of(options_.up, subject.mesh, path);
    choose_scalars(subject, path);
    if (options_.as == DrawnAs::surfels) choose_surfels(subject, path);
}

void Rendering::choose_scalars(Subject& subject, const std::string& path) {
    const std::string& name = options_.scalar;
    if (name.empty()) return;
    subject.scalar_title = options_.unit.empty() ? name : name + " (" + options_.unit + ")";
    if (name == "level") {
        if (!subject.model)
            refuse("--scalar level shows at which level of a model each vertex comes in, and " + path + " is a mesh.");
        subject.scalars = vertex_levels(*subject.model, options_.restore.level.value_or(subject.model->finest_level()));
    } else if (name == "error" || name == "strain") {
        if (!against_) refuse("--scalar " + name + " is against another mesh; name it with --against MESH.");
        if (name == "strain") {
            subject.scalars = require(edge_strains(subject.mesh, *against_));
        } else {
            std::vector<float> values;
            const MeshDistance distance = require(mesh_distance(subject.mesh, *against_, 0, context()));
            values = distance.vertices ? distance.vertices->per_vertex
                                       : require(distances_to_surface(subject.mesh, *against_, context()));
            const bool in_units = !options_.unit.empty(); // else as fractions of the diagonal
            subject.scalars = heat_map(std::move(values), in_units ? 1 : distance.diagonal).values;
            if (!in_units) subject.scalar_title = "error / diagonal";
        }
    } else {
        for (const VertexScalar& scalar : subject.mesh.scalars)
            if (scalar.name == name) subject.scalars = scalar.values;
        if (subject.scalars.empty()) {
            std::string names = "error, strain, level";
            for (const VertexScalar& scalar : subject.mesh.scalars) names += ", " + scalar.name;
            refuse(ErrorCode::unsuitable,
                   fmt::format("{}: has no vertex scalar '{}'; there are: {}.", path, name, names));
        }
    }
}

ValueRange Rendering::range_of(std::span<const float> values) const {
    if (!options_.range.empty()) return {static_cast<float>(options_.range[0]), static_cast<float>(options_.range[1])};
    if (options_.scalar == "error" || options_.scalar == "strain")
        return heat_map(std::vector<float>(values.begin(), values.end()), 1).range;
    return legend_range(values, false);
}

/// The surfels as polygons, each corner with its vertex's scalar.
void Rendering::upload_surfels(Subject& subject) {
    Surfels surfels = *subject.surfels;
    if (!subject.gradients.empty())
        surfels = require(split_surfels(carried_surfels(surfels, subject.mesh.positions, subject.gradients)));
    const Mesh polygons = surfel_polygons(surfels);
    std::vector<float> scalars;
    for (std::size_t f = 0; f < polygons.face_count() && !subject.scalars.empty(); ++f)
        scalars.insert(scalars.end(), polygons.face_size(f), subject.scalars[surfels.corners[f][0]]);
    subject.drawable = require(Drawable::surface(polygons, {.scalars = {scalars, options_.map, range_}}, context()));
}

void Rendering::upload(Subject& subject) {
    ScalarColors scalars{subject.scalars, options_.map, range_};
    if (subject.surfels) {
        upload_surfels(subject);
    } else if (options_.points || subject.mesh.face_count() == 0) {
        const float radius = film_radius_ > 0 ? film_radius_ : static_cast<float>(options_.point_radius);
        PointOptions points{radius, scalars, subject.mesh.colors};
        subject.drawable = require(Drawable::points(subject.mesh.positions, subject.mesh.origin, points, context()));
    } else {
        const SurfaceOptions surface{
            .shading = options_.shading, .scalars = scalars, .materials = subject.materials.materials};
        subject.drawable = subject.model
                               ? require(Drawable::model(*subject.model, options_.restore, surface, context()))
                               : require(Drawable::surface(subject.mesh, surface, context()));
    }
    triangles_ += subject.drawable->triangle_count();
    points_ += subject.drawable->point_count();
}

void Rendering::set_pose(Subject& subject, const Pose& pose, bool on_screen) {
    if (!subject.restorer) subject.restorer = require(Restorer::create(*subject.model, options_.restore, context()));
    require(subject.restorer->positions(pose, subject.mesh.positions, context()));
    if (subject.surfels) {
        subject.gradients =
            vertex_gradients(subject.model->detail, require(subject.restorer->gradients(pose, context())));
    }
    if (!on_screen) return;
    if (subject.surfels) {
        triangles_ -= subject.drawable->triangle_count();
        upload(subject);
    } else if (const std::size_t points = subject.drawable->point_count()) { // which are not restored on the GPU
        points_ -= points;
        upload(subject);
    } else {
        require(subject.drawable->set_pose(pose, context()));
    }
}

Scene Rendering::scene_of(const Subject& subject) const {
    Scene scene;
    Appearance& look = scene.objects.emplace_back(SceneObject{&*subject.drawable, {}}).appearance;
    if (!options_.color.empty()) {
        look.color = parse_color(options_.color, "--color");
        look.own_colors = has_scalars();
    } else if (!subject.surfels && (subject.mesh.face_count() == 0 || options_.points)) {
        look.color = {0.30f, 0.50f, 0.78f};
    }
    if (!options_.edge_color.empty()) look.edge_color = parse_color(options_.edge_color, "--edge-color");
    look.edges = options_.edges;
    look.surface = !options_.wireframe;
    if (has_scalars()) look.gloss = 0.15f; // colours are to be read
    if (options_.clip) {
        const ClipOption& clip = *options_.clip;
        const Box box = clip_box_.empty() ? world_bounds(subject.mesh) : clip_box_; // where the vertices are
        const double sign = clip.keeps_far_side ? -1 : 1;
        look.clip = ClipPlane{sign * Vec3d::Unit(clip.axis),
                              sign * (box.min[clip.axis] + clip.fraction * box.size()[clip.axis])};
    }
    scene.background = parse_background(options_.background);
    scene.up = up_;
    scene.ground = !options_.no_ground;
    return scene;
}

CameraPoints Rendering::shown_points(const Subject& subject, std::vector<Vec3f>& room, double radius) const {
    if (options_.points) return {subject.mesh.positions, subject.mesh.origin, radius};
    return points_of_faces(subject.mesh, room, radius);
}

Camera Rendering::camera_for(std::span<const CameraPoints> points, double aspect) const {
    if (options_.camera.empty())
        return fit_camera(points, view_direction(options_.view, up_), up_vector(up_), aspect, options_.field_of_view);
    const std::vector<double>& n = options_.camera;
    Camera camera;
    camera.eye = {n[0], n[1], n[2]};
    camera.target = {n[3], n[4], n[5]};
    camera.up = n.size() == 9 ? Vec3d(n[6], n[7], n[8]) : up_vector(up_);
    camera.field_of_view_deg = options_.field_of_view;
    const double distance = (camera.eye - camera.target).norm();
    if (!(distance > 0)) refuse("--camera: eye and target are the same point; the camera looks nowhere.");
    if (!(camera.up.norm() > 0)) refuse("--camera: the direction that is up has no length.");
    camera.height = distance;
    return camera;
}

void Rendering::report(const std::string& frames, const PictureSize& size, std::size_t frame_count,
                       double seconds) const {
    session_.print(fmt::format("{}: {}{} by {} pixels in {} ({})\n", options_.output, frames, size.width, size.height,
                               seconds_text(seconds), renderer_.name()),
                   {{"output", options_.output},
                    {"width", size.width},
                    {"height", size.height},
                    {"frames", frame_count},
                    {"triangles", triangles_},
                    {"points", points_},
                    {"renderer", renderer_.name()},
                    {"seconds", seconds}});
}

} // namespace filigree::cli
