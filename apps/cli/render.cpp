#include "commands.h"
#include "page.h"
#include "restore_options.h"
#include "stage.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <numbers>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

struct Size {
    unsigned width = 0, height = 0;
};

struct ClipOption {
    int axis = 2;
    bool keeps_far_side = false; ///< cuts away what is below, not above
    double fraction = 0.5;       ///< of the object's box
};

struct Options {
    std::vector<std::string> files, poses, captions;
    std::string output;
    Size size;
    View view = View::iso;
    UpAxis up = UpAxis::y;
    std::vector<double> camera;
    double field_of_view = 30;
    bool shared_camera = false;
    std::string background, color, edge_color;
    Shading shading = Shading::automatic;
    bool edges = false, wireframe = false, points = false, no_ground = false, no_captions = false;
    double point_radius = 0;
    std::optional<ClipOption> clip;
    std::string scalar, against, unit;
    std::vector<double> range;
    ColorMap map = ColorMap::sequential;
    unsigned passes = 0;
    bool turntable = false;
    unsigned frames = 90;
    std::size_t frame = 0;                   ///< of the model's own poses, from 1; 0: all in a film, else none
    std::optional<double> frames_per_second; ///< unset: the poses' own, or 30
    RestoreOptions restore;
};

constexpr double kCaptionHeight = 34, kLegendWidth = 120, kGap = 10; // pixels

constexpr const char* kPosesWithoutScalars = "With poses (--poses, --frame or the model's own) only --scalar level can "
                                             "be shown: they are restored where nothing "
                                             "is measured.";

[[noreturn]] void refuse(const std::string& sentence) { throw Failure{{ErrorCode::usage, sentence}}; }

Size parse_size(const std::string& text) {
    Size size;
    const char* end = text.data() + text.size();
    const auto [x, first] = std::from_chars(text.data(), end, size.width);
    if (first == std::errc() && x < end && *x == 'x') {
        const auto [rest, second] = std::from_chars(x + 1, end, size.height);
        if (second == std::errc() && rest == end && size.width > 0 && size.height > 0) return size;
    }
    refuse("--size: '" + text + "' is no size; write width and height in pixels, such as 1920x1080.");
}

/// "z=0.5": what is above the middle along z is cut away; "-z=0.5": what is below.
ClipOption parse_clip(const std::string& text) {
    ClipOption clip;
    std::string_view rest = text;
    clip.keeps_far_side = rest.starts_with('-');
    if (clip.keeps_far_side) rest.remove_prefix(1);
    const std::size_t axis = rest.empty() ? std::string::npos : std::string_view("xyz").find(rest[0]);
    if (axis != std::string::npos && rest.size() > 2 && rest[1] == '=') {
        clip.axis = static_cast<int>(axis);
        const auto [end, error] = std::from_chars(rest.data() + 2, rest.data() + rest.size(), clip.fraction);
        if (error == std::errc() && end == rest.data() + rest.size() && std::isfinite(clip.fraction)) return clip;
    }
    refuse("--clip: '" + text +
           "' is no clip plane; write z=0.5 to cut away what is above the middle along z, -z=0.5 "
           "for what is below.");
}

Background parse_background(const std::string& text) {
    Background background;
    if (text.empty()) return background;
    if (text == "transparent") {
        background.transparent = true;
        return background;
    }
    const std::size_t comma = text.find(',');
    background.top = parse_color(text.substr(0, comma), "--background");
    background.bottom =
        comma == std::string::npos ? background.top : parse_color(text.substr(comma + 1), "--background");
    return background;
}

/// Something to draw, and where the camera has to look.
struct Subject {
    std::optional<Model> model; ///< the drawable refers to it
    PoseSequence poses;         ///< of the model's file
    Mesh mesh;                  ///< as it is drawn; for a model the rest shape of its level
    SurfaceMaterials materials;
    std::vector<float> scalars; ///< one a vertex, or empty
    std::string scalar_title;
    std::optional<Restorer> restorer; ///< of the level, where there are poses
    std::optional<Drawable> drawable;
};

class Rendering {
public:
    Rendering(const Options& options, Session& session) : options_(options), session_(session), stage_(session) {
        if (!options.against.empty()) against_ = session.read_mesh(options.against);
    }

    void still();
    void film();

private:
    const RunContext& context() const { return session_.context(); }
    std::unique_ptr<Subject> read(const std::string& path);
    void choose_scalars(Subject& subject, const std::string& path);
    void upload(Subject& subject);
    Pose read_pose(const Subject& subject, const std::string& path) const {
        return pose_from_mesh(session_.read_mesh(path), *subject.model);
    }
    /// Poses a model; its vertices' places are left in subject.mesh.
    void set_pose(Subject& subject, const Pose& pose, bool on_screen);
    Scene scene_of(const Subject& subject) const;
    Camera camera_for(std::span<const CameraPoints> points, double aspect) const;
    PictureOptions picture_options(unsigned width, unsigned height) const {
        return {.width = width, .height = height, .passes = options_.passes};
    }
    bool has_scalars() const { return !options_.scalar.empty(); }
    ValueRange range_of(std::span<const float> values) const;
    Json summary(const Size& size, std::size_t frames) const;

    const Options& options_;
    Session& session_;
    Stage stage_;
    std::optional<Mesh> against_;
    Box clip_box_;          ///< films: of all moments, so that the plane stands still
    float film_radius_ = 0; ///< films: of the balls, as in the first frame
    ValueRange range_;      ///< of the scalars shown; fixed by --range or by what is drawn first
    bool range_known_ = false;
    std::size_t triangles_ = 0, points_ = 0;
};

std::unique_ptr<Subject> Rendering::read(const std::string& path) {
    auto subject = std::make_unique<Subject>();
    Session::Content content = session_.read_any(path);
    if (auto* model = std::get_if<Model>(&content.value)) {
        subject->model = std::move(*model);
        subject->poses = std::move(content.poses);
        if (options_.frame > 0) own_pose(subject->poses, options_.frame, path);
        const unsigned level = options_.restore.level.value_or(subject->model->finest_level());
        if (level > subject->model->finest_level())
            refuse(fmt::format("{}: has levels 0 to {}; there is no level {}.", path, subject->model->finest_level(),
                               level));
        subject->mesh = level_mesh(*subject->model, level);
    } else {
        if (!options_.poses.empty() || options_.frame > 0)
            refuse(path + ": is a mesh, and --poses and --frame move a model; 'filigree strip' makes one of it.");
        subject->mesh = std::move(std::get<Mesh>(content.value));
    }
    subject->materials = load_materials(subject->mesh, path, session_);
    if (subject->mesh.vertex_count() == 0)
        throw Failure{{ErrorCode::unsuitable, path + ": has no vertices, so there is nothing to draw."}};
    choose_scalars(*subject, path);
    return subject;
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
            throw Failure{{ErrorCode::unsuitable,
                           fmt::format("{}: has no vertex scalar '{}'; there are: {}.", path, name, names)}};
        }
    }
}

ValueRange Rendering::range_of(std::span<const float> values) const {
    if (!options_.range.empty()) return {static_cast<float>(options_.range[0]), static_cast<float>(options_.range[1])};
    if (options_.scalar == "error" || options_.scalar == "strain")
        return heat_map(std::vector<float>(values.begin(), values.end()), 1).range;
    return legend_range(values, false);
}

void Rendering::upload(Subject& subject) {
    ScalarColors scalars{subject.scalars, options_.map, range_};
    if (options_.points || subject.mesh.face_count() == 0) {
        const float radius = film_radius_ > 0 ? film_radius_ : static_cast<float>(options_.point_radius);
        PointOptions points{radius, scalars, subject.mesh.colors};
        subject.drawable = require(Drawable::points(subject.mesh.positions, subject.mesh.origin, points, context()));
    } else {
        SurfaceOptions surface;
        surface.shading = options_.shading;
        surface.scalars = scalars;
        surface.materials = subject.materials.materials;
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
    if (!on_screen) return;
    if (const std::size_t points = subject.drawable->point_count()) { // which are not restored on the GPU
        points_ -= points;
        upload(subject);
    } else {
        require(subject.drawable->set_pose(pose, context()));
    }
}

Scene Rendering::scene_of(const Subject& subject) const {
    Scene scene;
    Appearance look;
    if (!options_.color.empty()) {
        look.color = parse_color(options_.color, "--color");
        look.own_colors = has_scalars();
    } else if (subject.mesh.face_count() == 0 || options_.points) {
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
    scene.objects.push_back({&*subject.drawable, look});
    scene.background = parse_background(options_.background);
    scene.up = options_.up;
    scene.ground = !options_.no_ground;
    return scene;
}

Camera Rendering::camera_for(std::span<const CameraPoints> points, double aspect) const {
    if (options_.camera.empty())
        return fit_camera(points, view_direction(options_.view, options_.up), up_vector(options_.up), aspect,
                          options_.field_of_view);
    const std::vector<double>& n = options_.camera;
    Camera camera;
    camera.eye = {n[0], n[1], n[2]};
    camera.target = {n[3], n[4], n[5]};
    camera.up = n.size() == 9 ? Vec3d(n[6], n[7], n[8]) : up_vector(options_.up);
    camera.field_of_view_deg = options_.field_of_view;
    const double distance = (camera.eye - camera.target).norm();
    if (!(distance > 0)) refuse("--camera: eye and target are the same point; the camera looks nowhere.");
    if (!(camera.up.norm() > 0)) refuse("--camera: the direction that is up has no length.");
    camera.height = distance;
    return camera;
}

Json Rendering::summary(const Size& size, std::size_t frames) const {
    return {{"output", options_.output},
            {"width", size.width},
            {"height", size.height},
            {"frames", frames},
            {"triangles", triangles_},
            {"points", points_},
            {"renderer", stage_.renderer_name()}};
}

/// Where the panels of a page stand: rows of equal boxes, a caption below each, the legend at the right.
struct Layout {
    unsigned columns = 1, rows = 1, width = 0, height = 0; ///< of a panel
    double caption = 0, legend = 0;
    Size page;

    Layout(std::size_t count, const Size& wanted, bool captions, bool has_legend)
        : caption(captions ? kCaptionHeight : 0), legend(has_legend ? kLegendWidth : 0) {
        columns = static_cast<unsigned>(count <= 4 ? count : std::size_t(std::ceil(std::sqrt(double(count)))));
        rows = static_cast<unsigned>((count + columns - 1) / columns);
        page = wanted;
        if (page.width == 0)
            page = count == 1 ? Size{1280 + unsigned(legend), 960 + unsigned(caption)}
                              : Size{columns * 720 + unsigned(legend), rows * unsigned(620 + caption)};
        const double w = (page.width - legend - kGap * (columns - 1)) / columns;
        const double h = double(page.height) / rows - caption;
        if (w < 16 || h < 16)
            refuse(fmt::format("--size: {} pictures with their captions do not fit into {}x{} pixels; make it larger.",
                               count, page.width, page.height));
        width = static_cast<unsigned>(w);
        height = static_cast<unsigned>(h);
    }
    Point corner(std::size_t panel) const {
        return {double(panel % columns) * (width + kGap), double(panel / columns) * (height + caption)};
    }
};

void Rendering::still() {
    const double start = now_seconds();
    const std::size_t count = options_.files.size();
    const bool captions = !options_.no_captions && (count > 1 || !options_.captions.empty());
    const Layout layout(count, options_.size, captions, has_scalars());
    const bool is_vector = lower_ending(options_.output) != ".png";
    const double aspect = double(layout.width) / layout.height;

    // With one camera or one range for all, all are read first.
    std::vector<std::unique_ptr<Subject>> subjects(count);
    std::optional<Camera> shared;
    if (options_.shared_camera || (has_scalars() && options_.range.empty() && count > 1)) {
        std::vector<CameraPoints> points;
        std::vector<float> values;
        for (std::size_t i = 0; i < count; ++i) {
            subjects[i] = read(options_.files[i]);
            if (options_.frame > 0) set_pose(*subjects[i], subjects[i]->poses.frames[options_.frame - 1], false);
            points.push_back({subjects[i]->mesh.positions, subjects[i]->mesh.origin});
            values.insert(values.end(), subjects[i]->scalars.begin(), subjects[i]->scalars.end());
        }
        if (options_.shared_camera) shared = camera_for(points, aspect);
        range_ = range_of(values);
        range_known_ = true;
    }
    Page page(layout.page.width, layout.page.height);
    std::string title;
    Picture alone;
    for (std::size_t i = 0; i < count; ++i) {
        if (!subjects[i]) subjects[i] = read(options_.files[i]);
        Subject& subject = *subjects[i];
        if (!range_known_) range_ = range_of(subject.scalars);
        upload(subject);
        if (!options_.poses.empty()) set_pose(subject, read_pose(subject, options_.poses[0]), true);
        if (options_.frame > 0) set_pose(subject, subject.poses.frames[options_.frame - 1], true);
        const CameraPoints points{subject.mesh.positions, subject.mesh.origin, subject.drawable->point_radius()};
        const Camera camera = shared ? *shared : camera_for(std::span(&points, 1), aspect);
        Picture picture = stage_.take(scene_of(subject), camera, picture_options(layout.width, layout.height));
        title = subject.scalar_title;
        subjects[i].reset();
        if (count == 1 && !captions && !has_scalars() && !is_vector) {
            alone = std::move(picture);
            break;
        }
        const Point corner = layout.corner(i);
        page.picture(picture, corner, layout.width, layout.height);
        if (captions)
            page.text(i < options_.captions.size() ? options_.captions[i] : Page::plain(file_name(options_.files[i])),
                      {corner.x() + 0.5 * layout.width, corner.y() + layout.height + 22},
                      {.size = 15, .align = Align::centre});
    }
    if (has_scalars())
        page.legend(options_.map, range_, Page::plain(title), {layout.page.width - kLegendWidth + 14, 24},
                    std::min(420.0, layout.page.height - 60.0));
    session_.begin_writing(options_.output);
    if (alone.width)
        write_picture(alone, options_.output, session_);
    else
        require(page.write(options_.output, 1));
    const double seconds = now_seconds() - start;
    Json json = summary(alone.width ? Size{alone.width, alone.height} : layout.page, 1);
    json["seconds"] = seconds;
    session_.print(fmt::format("{}: {} by {} pixels in {} ({})\n", options_.output, layout.page.width,
                               layout.page.height, seconds_text(seconds), stage_.renderer_name()),
                   json);
}

/// A film of one subject or of a row of files: what changes from frame to frame is the pose, the file or the camera.
void Rendering::film() {
    const double start = now_seconds();
    const bool by_file = options_.poses.empty() && options_.files.size() > 1;
    std::unique_ptr<Subject> subject = read(options_.files[0]);
    // Poses that the model holds play by themselves, unless one of them or others are asked for.
    const bool is_own = !by_file && options_.poses.empty() && !subject->poses.empty();
    const bool by_pose = !options_.poses.empty() || is_own;
    const std::size_t moments = by_file              ? options_.files.size()
                                : !by_pose           ? 1
                                : !is_own            ? options_.poses.size()
                                : options_.frame > 0 ? 1
                                                     : subject->poses.frames.size();
    if (moments == 1 && !options_.turntable && !is_own)
        refuse("A film needs a model with poses, several files or several --poses to show one after the other, or "
               "--turntable.");
    if (is_own && has_scalars() && options_.scalar != "level") refuse(kPosesWithoutScalars);
    const auto pose_at = [&](std::size_t moment) {
        if (!is_own) return read_pose(*subject, options_.poses[moment]);
        return subject->poses.frames[options_.frame > 0 ? options_.frame - 1 : moment];
    };
    const double rate = options_.frames_per_second.value_or(
        is_own && options_.frame == 0 && !options_.turntable ? subject->poses.frames_per_second : 30);
    const std::size_t frames = options_.turntable ? std::max<std::size_t>(options_.frames, moments) : moments;
    const Size size = options_.size.width ? options_.size : Size{960, 720};
    const unsigned legend = has_scalars() ? unsigned(kLegendWidth) : 0;
    if (size.width <= legend + 16 || size.height < 16) refuse("--size: too small for a film.");
    const double aspect = double(size.width - legend) / size.height;
    FilmWriter writer = require(FilmWriter::create(options_.output, size.width, size.height, rate));

    // A first look at every moment, for a camera, a ground and a range of colours that hold for the whole film.
    std::vector<Vec3f> seen_points; // some of every moment's, relative to the first one's centre
    std::optional<Vec3d> centre;
    Box all;
    std::vector<float> values;
    for (std::size_t m = 0; m < moments; ++m) {
        if (context().is_cancelled()) throw Failure{cancelled_error()};
        context().report("looking ahead", double(m) / double(moments));
        if (by_file && m > 0) subject = read(options_.files[m]);
        if (by_pose) set_pose(*subject, pose_at(m), false);
        const Box box = world_bounds(subject->mesh);
        if (!centre) centre = box.centre();
        const std::size_t stride = 1 + subject->mesh.vertex_count() / 20'000; // a film may be long
        for (std::size_t v = 0; v < subject->mesh.vertex_count(); v += stride)
            seen_points.push_back((subject->mesh.world_position(v) - *centre).cast<float>());
        all.extend(box.min);
        all.extend(box.max);
        for (std::size_t v = 0; v < subject->scalars.size(); v += stride) values.push_back(subject->scalars[v]);
    }
    range_ = range_of(values);
    clip_box_ = all;
    CameraPoints points{seen_points, *centre};
    if (by_file && moments > 1) subject = read(options_.files[0]);
    if (by_pose) set_pose(*subject, pose_at(0), false);
    upload(*subject);
    film_radius_ = subject->drawable->point_radius();
    points.radius = film_radius_;
    all.min.array() -= film_radius_;
    all.max.array() += film_radius_;
    std::vector<Vec3f> ring; // a turning object needs room all around
    if (options_.turntable) {
        const Vec3d up = up_vector(options_.up);
        // A lathe's profile says enough: for each height the largest radius.
        std::map<long, std::pair<double, double>> profile;
        for (const Vec3f& point : seen_points) {
            const Vec3d p = point.cast<double>() + *centre - all.centre();
            const double height = p.dot(up), radius = (p - height * up).norm();
            auto& [most, at] = profile[std::lround(height / std::max(all.diagonal(), 1e-300) * 200)];
            if (radius >= most) most = radius, at = height;
        }
        for (const auto& [key, edge] : profile)
            for (int k = 0; k < 48; ++k)
                ring.push_back((Eigen::AngleAxisd(k * std::numbers::pi / 24, up) * (edge.first * up.unitOrthogonal()) +
                                edge.second * up)
                                   .cast<float>());
        points = {ring, all.centre(), points.radius};
    }
    Camera camera = camera_for(std::span(&points, 1), aspect);
    if (options_.turntable && options_.camera.empty()) {
        // Turn about the object's middle, whatever point the fitted camera looks at.
        const Vec3d shift = up_vector(options_.up);
        const Vec3d off = camera.target - all.centre();
        camera.target -= off - off.dot(shift) * shift;
        camera.eye -= off - off.dot(shift) * shift;
    }

    std::size_t shown = by_pose ? moments : 0; // the moment that is uploaded; moments: none
    for (std::size_t f = 0; f < frames; ++f) {
        if (context().is_cancelled()) throw Failure{cancelled_error()};
        context().report("filming", double(f) / double(frames));
        const std::size_t moment = f * moments / frames;
        if (moment != shown) {
            if (by_file) {
                subject = read(options_.files[moment]);
                triangles_ = points_ = 0;
                upload(*subject);
            }
            if (by_pose) set_pose(*subject, pose_at(moment), true);
            shown = moment;
        }
        Scene scene = scene_of(*subject);
        scene.fixed_ground = true;
        const int axis = static_cast<int>(options_.up);
        scene.ground_level = all.min[axis] - 1e-4 * all.diagonal();
        const Camera seen = options_.turntable ? turned(camera, 360.0 * double(f) / double(frames)) : camera;
        PictureOptions picture = picture_options(size.width - legend, size.height);
        if (!picture.passes) picture.passes = 12;
        // The bar tells of frames, not of the passes within each.
        RunContext quiet = context();
        quiet.progress = nullptr;
        Picture frame = require(stage_.renderer().picture(scene, seen, picture, quiet));
        if (has_scalars()) {
            Page page(size.width, size.height);
            page.picture(frame, {0, 0}, picture.width, picture.height);
            page.legend(options_.map, range_, Page::plain(subject->scalar_title), {size.width - kLegendWidth + 14, 24},
                        std::min(420.0, size.height - 60.0));
            frame = page.pixels(1);
        }
        require(writer.add(frame));
    }
    session_.begin_writing(options_.output);
    require(writer.finish());
    const double seconds = now_seconds() - start;
    Json json = summary(size, frames);
    json["seconds"] = seconds;
    session_.print(fmt::format("{}: {} frames of {} by {} pixels in {} ({})\n", options_.output, frames, size.width,
                               size.height, seconds_text(seconds), stage_.renderer_name()),
                   json);
}

void check(const Options& options, bool is_film) {
    if (!is_film) check_picture_path(options.output);
    if (!options.camera.empty() && options.camera.size() != 6 && options.camera.size() != 9)
        refuse("--camera takes 6 numbers (eye and target) or 9 (and the direction that is up).");
    if (!options.range.empty() && !(options.range[0] < options.range[1]))
        refuse("--range: the first number has to be below the second.");
    if (options.captions.size() > options.files.size())
        refuse(fmt::format("There are {} captions for {} files.", options.captions.size(), options.files.size()));
    if (is_film && !options.captions.empty()) refuse("A film has no captions; leave --caption out.");
    if (!options.against.empty() && options.scalar != "error" && options.scalar != "strain")
        refuse("--against is what --scalar error and --scalar strain are measured against; say which.");
    if (options.scalar.empty() && (!options.range.empty() || !options.unit.empty()))
        refuse("--range and --unit belong to --scalar; say which numbers to show.");
    if (options.shared_camera && !options.poses.empty()) refuse("--shared-camera is for several files; leave it out.");
    if (is_film && (std::count(options.files.begin(), options.files.end(), "-") ||
                    std::count(options.poses.begin(), options.poses.end(), "-")))
        refuse("A film reads its files twice, and standard input can be read once; give file names.");
    const bool has_page = is_film ? !options.scalar.empty()
                                  : !options.scalar.empty() || !options.captions.empty() || options.files.size() > 1 ||
                                        lower_ending(options.output) != ".png";
    if (options.background == "transparent" && has_page)
        refuse("--background transparent is for one picture in a .png without captions and legend; a page is white.");
    if (options.turntable && !is_film)
        refuse("--turntable makes a film; give -o a name that ends in .mp4 or .gif, or frame_%04d.png.");
    if (!options.poses.empty() && options.frame > 0) refuse("--poses and --frame both pose the model; give one.");
    if (options.frame > 0 && is_film && !options.turntable)
        refuse("--frame is one moment; let -o end in .png, or add --turntable.");
    if (!options.poses.empty() && options.files.size() != 1) refuse("--poses move one model; give one model file.");
    if (!is_film && options.poses.size() > 1)
        refuse("Several poses make a film; give -o a name that ends in .mp4 or .gif, or frame_%04d.png.");
    if ((!options.poses.empty() || options.frame > 0) && !options.scalar.empty() && options.scalar != "level")
        refuse(kPosesWithoutScalars);
}

OptionList camera_options(Options& options) {
    return {Option("--size", Option::EachText([&](const std::string& text) { options.size = parse_size(text); }),
                   "Width and height in pixels, such as 1920x1080 (unset: by what is drawn)"),
            view_option(options.view, "Where to look from (unset: iso)"),
            up_option(options.up, "Which axis is up (unset: y)"),
            Option("--camera", options.camera, "Eye and target, and up if need be: 6 or 9 numbers in model units")
                .finite()
                .values(6, 9)
                .comma_separated(),
            Option("--field-of-view", options.field_of_view, "Vertical, in degrees; 0 is parallel projection")
                .between(0.0, 150.0)
                .with_default(),
            Option("--shared-camera", options.shared_camera, "Several files: one camera that shows all in place")};
}

OptionList look_options(Options& options) {
    return {Option("--background", options.background,
                   "#rrggbb, two of them from top to bottom (#rrggbb,#rrggbb), or transparent"),
            Option("--color", options.color, "Of the objects, #rrggbb (unset: their own, or clay)"),
            choice<Shading>("--shading", options.shading,
                            {{"auto", Shading::automatic}, {"smooth", Shading::smooth}, {"flat", Shading::flat}},
                            "auto: the file's normals, else smooth up to 45 degrees (unset: auto)"),
            Option("--edges", options.edges, "Draw the polygons' edges over the surface"),
            Option("--edge-color", options.edge_color, "#rrggbb"),
            Option("--wireframe", options.wireframe, "Draw the edges alone"),
            Option("--points", options.points, "Draw the vertices as balls"),
            Option("--point-radius", options.point_radius, "Of the balls, model units (unset: by their spacing)")
                .above_zero(),
            Option("--clip", Option::EachText([&](const std::string& text) { options.clip = parse_clip(text); }),
                   "Cut open: z=0.5 takes away what is above the middle along z, -z=0.5 what is below")};
}

OptionList scalar_options(Options& options) {
    return {Option("--scalar", options.scalar,
                   "Colour by a vertex scalar of the file, or by error, strain (both with --against) or level"),
            Option("--against", options.against, "Mesh that error and strain are measured against").is_read(),
            Option("--range", options.range, "Least and most value of the colours (unset: by the values)")
                .finite()
                .values(2),
            Option("--unit", options.unit, "Unit to write over the legend"),
            choice<ColorMap>("--map", options.map,
                             {{"sequential", ColorMap::sequential}, {"diverging", ColorMap::diverging}},
                             "Colours: for amounts, or for signed amounts (unset: sequential)")};
}

OptionList page_options(Options& options) {
    return {Option("--caption", options.captions,
                   "One a file (unset: the names, where there are several); C_m, 10^{-3}, *italic* and **bold** are "
                   "set so")
                .one_at_a_time(), // else it would take the files behind it
            Option("--no-captions", options.no_captions, "Draw no captions"),
            Option("--no-ground", options.no_ground, "Draw no shadow on the ground")};
}

OptionList film_options(Options& options) {
    return {Option("--poses", options.poses,
                   "Moved drivers of a model, one a frame (PLY with gradients where there are any)")
                .is_read(),
            Option("--turntable", options.turntable, "A film once around the object"),
            Option("--frames", options.frames, "Frames of a turntable").whole_from(1).with_default(),
            Option("--frame", options.frame,
                   "One of the poses that the model holds, from 1 (unset: a film plays them all, a picture shows the "
                   "model at rest)")
                .whole_from(1),
            Option("--fps", options.frames_per_second, "Frames a second (unset: those of the model's poses, or 30)")
                .above_zero(),
            Option("--passes", options.passes,
                   "Light directions and positions within a pixel that are averaged (unset: 12 to 40 by the size of "
                   "the mesh; films 12)")
                .whole_from(1)};
}

void run(const Options& options, Session& session) {
    const bool is_film = is_film_path(options.output);
    check(options, is_film);
    Rendering rendering(options, session);
    is_film ? rendering.film() : rendering.still();
}

} // namespace

Command render_command() {
    const auto options = std::make_shared<Options>();
    return {.name = "render",
            .text = "Draw meshes, point sets and models: a picture or a film",
            .options = OptionList{Option("files", options->files,
                                         "Meshes, point sets or models, before the options; several stand side by "
                                         "side, or one after the other in a film")
                                      .is_read()
                                      .required(),
                                  Option("-o,--output", options->output,
                                         "Picture (.png, .svg, .pdf) or film (.mp4, .gif, frame_%04d.png)")
                                      .is_written()
                                      .required()} +
                       camera_options(*options) + look_options(*options) + scalar_options(*options) +
                       page_options(*options) + film_options(*options) + restore_options(options->restore),
            .examples = "  filigree render scan.ply -o scan.png\n"
                        "  filigree render scan.fil --level 0 --edges -o driver.png --view front --size 1920x1080\n"
                        "  filigree render a.ply b.ply -o both.png --caption before --caption after\n"
                        "  filigree render restored.ply --scalar error --against full.ply -o error.png\n"
                        "  filigree render scan.fil --poses pose_*.ply -o film.mp4\n"
                        "  filigree render bounce.fil -o bounce.mp4\n"
                        "  filigree render bounce.fil --frame 30 -o half_a_second.png\n"
                        "  filigree render scan.ply -o around.gif --turntable --size 480x480",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
