#include "drawn_objects.h"

#include "quads.h"
#include "theme.h"

#include "filigree/deform/carried_points.h"
#include "filigree/mesh/ray_hit.h"
#include "filigree/mesh/triangulate.h"
#include "filigree/present/textured_look.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace filigree::studio {

namespace {

const Vec3f kDriverEdges(0.85f, 0.33f, 0.10f), kObstacles(0.62f, 0.65f, 0.70f), kParticles(0.88f, 0.55f, 0.25f),
    kInsidePoints(0.20f, 0.45f, 0.78f);

constexpr float kSeenThrough = 0.4f; // of a surface whose inside is shown uncut

/// The finest mesh with its vertices elsewhere, and nothing that would no longer be true.
Mesh moved_mesh(const Mesh& mesh, std::span<const Vec3f> positions) {
    Mesh moved = mesh;
    moved.positions.assign(positions.begin(), positions.end());
    moved.normals = {};
    return moved;
}

} // namespace

DrawnObjects::DrawnObjects(Workbench& workbench, WithOpenGl with_opengl)
    : workbench_(workbench), with_opengl_(std::move(with_opengl)) {
    settings_ = workbench.view().settings();
    connect(&background_, &Jobs::failed, this, [this](const Error& error) {
        problem_ = error.message;
        Q_EMIT changed(false);
    });
    connect(&workbench.document(), &Document::changed, this, [this] { follow_document(); });
    connect(&workbench, &Workbench::opened, this, [this] { follow_document(); });
    connect(&workbench, &Workbench::pose_changed, this, [this] { follow_pose(); });
    connect(&workbench, &Workbench::full_changed, this, [this] {
        follow_full();
        follow_colors();
    });
    connect(&workbench, &Workbench::error_measured, this, [this] { follow_colors(); });
    connect(&workbench, &Workbench::inside_points_ready, this, [this] {
        inside_points_stale_ = true;
        follow_inside_points();
    });
    connect(&workbench, &Workbench::mode_changed, this, [this] { follow_view(); });
    connect(&workbench.playback(), &Playback::state_changed, this, [this] { follow_view(); });
    connect(&workbench.playback(), &Playback::moved, this, [this] {
        follow_particles();
        if (settings_.coloring == Coloring::heat) follow_colors();
    });
    connect(&workbench.expected_error(), &ExpectedError::changed, this, [this] {
        if (settings_.coloring == Coloring::expected_error) follow_colors();
    });
    connect(&workbench.view(), &ViewState::changed, this, [this] { follow_view(); });
}

DrawnObjects::~DrawnObjects() = default;

void DrawnObjects::start(RestoreOn where) {
    where_ = where;
    is_started_ = true;
    follow_document();
    follow_view();
}

void DrawnObjects::stop() {
    background_.drop_all();
    is_started_ = false;
    shown_.reset();
    next_.reset();
    particles_.reset();
    inside_.reset();
    drop_posed_extras();
    melt_.reset();
    set_melt(nullptr);
    obstacles_.clear();
    particles_of_ = surroundings_of_ = nullptr;
    defects_of_ = nullptr;
}

void DrawnObjects::follow_document() {
    if (!is_started_) return;
    const State& state = workbench_.state();
    if (!state.model) return;
    if (shown_ && shown_->is_of(state)) {
        if (next_) {
            next_.reset();
            background_.drop_all();
            shown_->forget_unready();
        }
        ask_for_levels(state.level(), false);
        Q_EMIT changed(false);
        return;
    }
    if (!next_ || !next_->is_of(state)) {
        background_.drop_all();
        if (shown_) shown_->forget_unready();
        next_ = std::make_unique<ShownModel>(state, where_);
    }
    next_->ask(state.level(), true, background_, with_opengl_, [this](const std::optional<Error>& error) {
        problem_ = error ? error->message : "";
        adopt();
    });
    Q_EMIT changed(false);
}

void DrawnObjects::adopt() {
    if (!next_) return;
    with_opengl_([this] {
        shown_ = std::move(next_);
        drop_posed_extras();
    });
    color_stamp_ = 0;
    colors_ = {};
    follow_pose();
    follow_view();
    Q_EMIT changed(false);
}

void DrawnObjects::drop_posed_extras() {
    full_.reset();
    full_asked_ = 0;
    patches_.reset();
    patches_of_ = nullptr;
    positions_.clear();
}

void DrawnObjects::follow_pose() {
    if (!shown_) return;
    const Pose* pose = workbench_.pose();
    if (pose && pose->positions.size() != shown_->rest_pose().positions.size()) return; // of a model not shown yet
    pose_ = pose ? *pose : shown_->rest_pose();
    pose_stamp_ = pose ? ++last_stamp_ : 0;
    follow_particles();
    follow_inside_points();
    follow_full();
    follow_melt();
    follow_colors();
    Q_EMIT changed(true);
}

void DrawnObjects::follow_view() {
    if (!is_started_) return;
    settings_ = workbench_.view().settings();
    const bool wants_full = settings_.split || settings_.coloring == Coloring::error;
    workbench_.want_full(wants_full);
    workbench_.want_temperatures(settings_.coloring == Coloring::heat);
    workbench_.expected_error().want_colors(settings_.coloring == Coloring::expected_error);
    follow_surroundings();
    follow_particles();
    follow_inside_points();
    follow_defects();
    follow_full();
    follow_melt();
    follow_colors();
    follow_patches();
    if (shown_ && settings_.driver) shown_->measure(background_, [this] { Q_EMIT changed(false); });
    if (shown_ && (settings_.driver || settings_.split)) ask_for(0, true);
    Q_EMIT changed(false);
}

bool DrawnObjects::shows_particles() const {
    return settings_.particles && workbench_.mode() == Mode::body && workbench_.playback().has_body();
}

void DrawnObjects::follow_particles() {
    const Moment* moment = workbench_.playback().moment();
    if (!is_started_ || !shows_particles() || !moment || moment->particles.empty()) {
        if (particles_) with_opengl_([this] { particles_.reset(); });
        return;
    }
    with_opengl_([&] {
        if (particles_ && particles_of_ == workbench_.playback().made() && particles_->set_positions(moment->particles))
            return;
        particles_of_ = workbench_.playback().made();
        particles_.reset();
        Result<Drawable> made = Drawable::points(moment->particles, origin(), {}, RunContext());
        if (made) particles_ = std::move(made).value();
    });
    Q_EMIT changed(true);
}

void DrawnObjects::follow_surroundings() {
    const std::shared_ptr<const DroppedBody> made =
        workbench_.mode() == Mode::body ? workbench_.playback().made() : nullptr;
    if (made == surroundings_of_) return;
    surroundings_of_ = made;
    with_opengl_([this] {
        obstacles_.clear();
        if (!surroundings_of_) return;
        for (Mesh mesh : surroundings_of_->surroundings.obstacles) {
            mesh.origin += surroundings_of_->model->mesh.origin;
            Result<Drawable> drawable = Drawable::surface(mesh, {}, RunContext());
            if (drawable) obstacles_.push_back(std::move(drawable).value());
        }
    });
}

void DrawnObjects::follow_inside_points() {
    if (!is_started_ || !shown_) return;
    if (!settings_.inside_points) {
        if (inside_) with_opengl_([this] { inside_.reset(); });
        inside_points_of_ = nullptr;
        return;
    }
    const std::shared_ptr<const Source> source = workbench_.state().source;
    if (source != inside_points_of_ || settings_.inside_count != inside_points_asked_) {
        if (source != inside_points_of_) with_opengl_([this] { inside_.reset(); });
        inside_points_of_ = source;
        inside_points_asked_ = settings_.inside_count;
        workbench_.sample_inside_points(inside_points_asked_);
    }
    if (std::exchange(inside_points_stale_, false))
        with_opengl_([this] {
            constexpr float kRadius = 0.6f; // of balls that nearly touch: what is behind them is seen too
            inside_.reset();
            inside_pose_ = 0;
            const std::span<const Vec3f> points = workbench_.inside_points();
            Result<Drawable> made = Drawable::points(points, origin(), {}, RunContext());
            if (!made) return;
            made = Drawable::points(points, origin(), {.radius = kRadius * made->point_radius()}, RunContext());
            if (made) inside_ = std::move(made).value();
        });
    if (!inside_ || inside_pose_ == pose_stamp_) return;
    with_opengl_([this] {
        inside_pose_ = pose_stamp_;
        const std::span<const Vec3f> rest = workbench_.inside_points();
        const Status is_there =
            pose_stamp_ == 0
                ? inside_->set_positions(rest)
                : inside_->set_positions(carried_points(rest, shown_->rest_pose().positions, pose_, RunContext()));
        if (!is_there) inside_.reset(); // of a mesh not shown yet
    });
    Q_EMIT changed(false);
}

/// Nothing that is known of the surface before is left; its drawing goes where OpenGL is current.
void DrawnObjects::set_melt(std::shared_ptr<const Mesh> surface) {
    melt_of_ = std::move(surface);
    melt_triangles_.reset();
    melt_copies_.clear();
    melt_is_colored_ = false;
}

/// The surface of what has melted, in place of the restored mesh.
void DrawnObjects::follow_melt() {
    const std::shared_ptr<const Mesh> surface = is_started_ && shown_ ? workbench_.melt_surface() : nullptr;
    if (surface == melt_of_) return;
    set_melt(surface);
    with_opengl_([this] {
        melt_.reset();
        if (!melt_of_) return;
        DrawnSurface drawn = melt_as_drawn(*melt_of_, workbench_.state().source->materials.materials);
        Result<Drawable> drawable =
            Drawable::surface(drawn.mesh, {.materials = workbench_.state().source->materials.materials}, RunContext());
        if (drawable) melt_ = std::move(*drawable);
        melt_copies_ = std::move(drawn.copied);
    });
    Q_EMIT changed(true);
}

std::span<const Triangle> DrawnObjects::melt_triangles() {
    if (!melt_of_) return {};
    if (!melt_triangles_) melt_triangles_ = triangulate(*melt_of_).triangles;
    return *melt_triangles_;
}

std::optional<Picked> DrawnObjects::pick_melt(const Camera::Ray& ray) {
    if (!melt_of_) return std::nullopt;
    const std::optional<RayHit> hit =
        first_hit(melt_of_->positions, melt_triangles(), ray.origin - origin(), ray.direction, RunContext());
    if (!hit) return std::nullopt;
    return Picked{ray.origin + hit->distance * ray.direction, 0};
}

bool DrawnObjects::has_full_vertices() const {
    return shown_ && pose_stamp_ != 0 && workbench_.full().size() == shown_->model().vertex_count();
}

/// The full deformation is drawn for the pose shown, or not at all.
void DrawnObjects::follow_full() {
    const bool is_wanted = is_started_ && settings_.split && has_full_vertices();
    if (is_wanted && full_asked_ == pose_stamp_) return;
    if (full_) {
        with_opengl_([this] { full_.reset(); });
        Q_EMIT changed(false);
    }
    full_asked_ = is_wanted ? pose_stamp_ : 0;
    full_error_.clear();
    if (!is_wanted) return;
    const auto fail = [this, stamp = pose_stamp_](const Error& error) {
        if (stamp != full_asked_) return;
        full_error_ = error.message;
        Q_EMIT changed(false);
    };
    background_.start<DrawData>(
        "The picture", "full",
        [model = shown_->shared_model(), source = workbench_.state().source,
         positions = std::vector(workbench_.full().begin(), workbench_.full().end())](const RunContext& context) {
            return DrawData::surface(moved_mesh(level_mesh(*model, model->finest_level()), positions),
                                     {.materials = source->materials.materials}, context);
        },
        [this, fail, stamp = pose_stamp_](DrawData data) {
            if (stamp != full_asked_) return; // of another moment
            with_opengl_([&] {
                Result<Drawable> drawable = Drawable::upload(std::move(data));
                if (!drawable) return fail(drawable.error());
                full_ = std::move(drawable).value();
            });
            Q_EMIT changed(true);
        },
        {.failed = fail});
}

std::string DrawnObjects::full_problem() const {
    if (full_ || pose_stamp_ == 0) return "";
    if (!full_error_.empty()) return full_error_;
    if (has_full_vertices() || workbench_.jobs().is_pending("full") || workbench_.jobs().is_pending("error"))
        return "being computed";
    if (workbench_.is_pulling()) return "computed when you let go";
    if (workbench_.mode() == Mode::body)
        return workbench_.is_playing() ? "being computed" : "known only where the simulation is, not for a recording";
    if (workbench_.state().pose_from_file) return "not known for a pose that came from a file";
    return "computed when the error is measured: pulls of so many vertices take long";
}

/// The patches of the model shown, when they are wanted.
void DrawnObjects::follow_patches() {
    const std::shared_ptr<const Model> model =
        shown_ && settings_.coloring == Coloring::patches ? shown_->shared_model() : nullptr;
    const bool is_there = patches_ || !patches_problem_.empty() || background_.is_pending("patches");
    if (model == patches_of_ && (is_there || !model)) return;
    if (patches_) with_opengl_([this] { patches_.reset(); });
    patches_problem_.clear();
    patches_of_ = model;
    Q_EMIT changed(false);
    if (!model) return;
    const auto& source = workbench_.state().source;
    const unsigned most_levels =
        source && source->quads ? source->quads->report.levels : std::numeric_limits<unsigned>::max();
    const auto fail = [this, model](const Error& error) {
        if (patches_of_ != model) return;
        patches_problem_ = error.code == ErrorCode::unsuitable
                               ? "This mesh is not made of patches: Make quads (the Quads panel) gives it some."
                               : error.message;
        Q_EMIT changed(false);
    };
    background_.start<PatchData>(
        "The picture", "patches",
        [model, most_levels, restore = workbench_.state().restore, where = where_](const RunContext& context) {
            return PatchData::make(*model, restore, most_levels, where, context);
        },
        [this, model, fail](PatchData patches) {
            if (patches_of_ != model) return;
            with_opengl_([&] {
                Result<Drawable> drawable = Drawable::upload(std::move(patches.data));
                if (!drawable) return fail(drawable.error());
                patches_.emplace(PatchSurface{patches.model, std::move(*drawable)});
            });
            Q_EMIT changed(false);
        },
        {.failed = fail});
}

std::string DrawnObjects::patches_problem() const {
    if (!patches_problem_.empty() || !patches_ || !shown_) return patches_problem_;
    return workbench_.state().level() < shown_->finest_level() ? "Patches are coloured at the finest level alone." : "";
}

PatchSurface* DrawnObjects::patches_at(unsigned level) {
    return patches_ && shown_ && level == shown_->finest_level() ? &*patches_ : nullptr;
}

void DrawnObjects::follow_defects() {
    if (!shown_ || !settings_.defects || defects_of_ == shown_->shared_model()) return;
    defects_of_ = shown_->shared_model();
    defects_.clear();
    background_.start<std::vector<DefectEdge>>(
        "The picture", "defects",
        [model = defects_of_](const RunContext&) -> Result<std::vector<DefectEdge>> {
            return defect_edges(model->mesh);
        },
        [this, model = defects_of_](std::vector<DefectEdge> defects) {
            if (defects_of_ != model) return;
            defects_ = std::move(defects);
            Q_EMIT changed(false);
        });
    ask_for(shown_->finest_level(), false); // they are marked there
}

void DrawnObjects::ask_for(unsigned level, bool is_urgent) {
    shown_->ask(level, is_urgent, background_, with_opengl_, [this](const std::optional<Error>& error) {
        if (error) problem_ = error->message;
        Q_EMIT changed(false);
    });
}

unsigned DrawnObjects::calm_level(double pixels_a_unit) {
    const unsigned most = std::min(workbench_.state().level(), shown_->finest_level());
    if (!settings_.level_by_distance) return most;
    shown_->measure(background_, [this] { Q_EMIT changed(false); });
    by_size_ = level_by_size(shown_->facts(), most, std::min(by_size_, most), pixels_a_unit);
    return by_size_;
}

void DrawnObjects::ask_for_levels(unsigned calm, bool all) {
    constexpr std::size_t kSmall = 5'000; // triangles: drawn at once anywhere
    if (!shown_) return;
    calm = std::min(calm, shown_->finest_level());
    ask_for(calm, true);
    for (unsigned level = calm; all && level-- > 0;) {
        ask_for(level, false);
        if (shown_->facts()[level].triangles < kSmall) break;
    }
}

double DrawnObjects::prepare(std::span<const unsigned> levels) {
    const RunContext context;
    double spent = 0;
    drawn_level_ = levels[0];
    for (const unsigned number : levels) {
        ShownLevel* level = shown_->level(number);
        if (!level) continue;
        if (number == 0 && levels[0] != 0 && settings_.driver && !settings_.split) {
            pose_net();
            continue;
        }
        QElapsedTimer timer;
        timer.start();
        if (PatchSurface* patches = patches_at(number)) {
            if (patches->pose != pose_stamp_ && patches->drawable.set_pose(pose_, context)) patches->pose = pose_stamp_;
        } else {
            shown_->set_pose(*level, pose_, pose_stamp_, context);
        }
        spent += milliseconds(timer);
        shown_->set_colors(*level, colors_, color_stamp_);
    }
    return spent;
}

/// The driver's vertices go towards the eye by as much as the detail may hide them: that changes nothing but what is in
/// front, so its edges are one net over the shape.
void DrawnObjects::pose_net() {
    ShownLevel& net = *shown_->level(0);
    const Camera& camera = workbench_.view().camera();
    constexpr double kUnmeasured = 0.01, kMost = 0.05; // of the diagonal
    const double diagonal = bounds(shown_->rest_pose().positions).diagonal();
    const double offset = std::min(2 * shown_->facts()[0].deviation.value_or(kUnmeasured * diagonal), kMost * diagonal);
    if (net.pose == net_stamp_ && net_pose_ == pose_stamp_ && net_eye_ == camera.eye && net_offset_ == offset) return;
    net_pose_ = pose_stamp_;
    net_eye_ = camera.eye;
    net_offset_ = offset;
    net_stamp_ = ++last_stamp_;
    const Vec3f eye = (camera.eye - origin()).cast<float>(), back = camera.basis().col(2).cast<float>();
    Pose near = pose_;
    if (near.gradients.empty()) near.gradients.assign(near.positions.size(), Mat3f::Identity());
    for (Vec3f& p : near.positions)
        p += float(offset) * (camera.field_of_view_deg > 0 ? Vec3f((eye - p).normalized()) : back);
    shown_->set_pose(net, near, net_stamp_, RunContext());
}

/// As the view's settings have the surface.
Appearance DrawnObjects::surface_look(bool is_dark) {
    Appearance look;
    look.edges = settings_.style != SurfaceStyle::shaded;
    look.surface = settings_.style != SurfaceStyle::wireframe;
    if (!look.surface && is_dark) look.edge_color = {0.80f, 0.82f, 0.85f};
    if (look.surface) look.edge_width = 1;
    look.clip = clip();
    look.own_colors = settings_.coloring == Coloring::own || !colors_.values.empty(); // grey: not known
    return look;
}

void DrawnObjects::add_level(Scene& scene, unsigned level, const Appearance& look, float coverage) {
    ShownLevel* shown = shown_ ? shown_->level(level) : nullptr;
    if (!shown) return;
    PatchSurface* const patches = patches_at(level);
    scene.objects.push_back({patches ? &patches->drawable : &shown->drawable, look});
    scene.objects.back().appearance.coverage = coverage;
    if (patches) scene.objects.back().appearance.own_colors = true;
}

/// The restored mesh, with what is seen in it and over it. `from` melts into `level`, of which `part` is drawn.
void DrawnObjects::add_restored(Scene& scene, unsigned level, std::optional<unsigned> from, double part,
                                const Appearance& look) {
    if (melt_) {
        scene.objects.push_back({&*melt_, look});
        scene.objects.back().appearance.own_colors = settings_.coloring == Coloring::own || melt_is_colored_;
        return;
    }
    const bool sees_inside = inside_ && !settings_.clip;
    if (from) add_level(scene, *from, look, static_cast<float>(-part));
    add_level(scene, level, look, from ? static_cast<float>(part) : sees_inside ? kSeenThrough : 1.0f);
    if (settings_.driver && level > 0)
        add_level(scene, 0,
                  {.own_colors = false,
                   .surface = false,
                   .edges = true,
                   .edge_color = kDriverEdges,
                   .edge_width = 1.6f,
                   .clip = look.clip});
    if (inside_) scene.objects.push_back({&*inside_, {.color = kInsidePoints, .clip = look.clip}});
}

void DrawnObjects::add_surroundings(Scene& scene) const {
    if (!surroundings_of_) return;
    for (const Drawable& obstacle : obstacles_)
        scene.objects.push_back({&obstacle, {.color = kObstacles, .gloss = 0.15f}});
    const Surroundings& around = surroundings_of_->surroundings;
    scene.ground = around.has_ground;
    scene.fixed_ground = true;
    scene.ground_level = around.ground_level + up_vector(scene.up).dot(origin());
}

Scene DrawnObjects::scene(TileShows shows, unsigned level, std::optional<unsigned> from, double part,
                          const QPalette& palette) {
    const bool dark = is_dark(palette);
    Scene scene;
    scene.up = settings_.up;
    scene.ground = settings_.ground;
    scene.background.top = dark ? Vec3f(0.235f, 0.245f, 0.265f) : Vec3f(0.965f, 0.970f, 0.975f);
    scene.background.bottom = dark ? Vec3f(0.125f, 0.130f, 0.145f) : Vec3f(0.820f, 0.835f, 0.855f);

    Appearance look = surface_look(dark);
    if (shows == TileShows::driver) {
        look.edges = true;
        if (look.surface) look.edge_color = Vec3f(0.16f, 0.17f, 0.20f);
        add_level(scene, 0, look);
    } else if (shows == TileShows::full && full_) {
        look.own_colors = settings_.coloring == Coloring::own;
        scene.objects.push_back({&*full_, look});
    } else if (shows == TileShows::full && workbench_.pose()) {
        // nothing yet: the caption says so
    } else if (shows_particles() && particles_) {
        scene.objects.push_back({&*particles_, {.color = kParticles}});
    } else {
        add_restored(scene, level, from, part, look);
    }
    add_surroundings(scene);
    return scene;
}

Vec3d DrawnObjects::origin() const { return shown_ ? shown_->model().mesh.origin : Vec3d(Vec3d::Zero()); }

std::span<const Vec3f> DrawnObjects::positions(unsigned level) {
    ShownLevel* shown = shown_ ? shown_->level(level) : nullptr;
    if (!shown) return {};
    auto found =
        std::find_if(positions_.begin(), positions_.end(), [&](const Positions& p) { return p.shape == shown->shape; });
    if (found == positions_.end()) {
        positions_.push_back({pose_stamp_, shown->shape, shown->shape->positions(pose_, RunContext())});
        found = positions_.end() - 1;
    } else if (found->stamp != pose_stamp_) {
        found->stamp = pose_stamp_;
        found->values = shown->shape->positions(pose_, RunContext());
    }
    return found->values;
}

std::optional<Vec3d> DrawnObjects::place_of_vertex(Index vertex) {
    const std::optional<unsigned> level = shown_ ? shown_->nearest_ready(drawn_level_) : std::nullopt;
    if (!level) return std::nullopt;
    const std::span<const Vec3f> places = positions(*level);
    const std::optional<Index> of_level = shown_->level(*level)->shape->vertex_of(vertex);
    if (!of_level || *of_level >= places.size()) return std::nullopt;
    return origin() + places[*of_level].cast<double>();
}

Box DrawnObjects::box() {
    const std::optional<unsigned> ready =
        shown_ ? shown_->nearest_ready(workbench_.state().level()) : std::optional<unsigned>();
    Box box;
    if (melt_) {
        box = melt_->box();
    } else if (ready) {
        box = bounds(positions(*ready));
        box.min += origin();
        box.max += origin();
    } else if (workbench_.state().source) {
        box = workbench_.state().source->box;
    }
    return box;
}

std::optional<ClipPlane> DrawnObjects::clip() {
    if (!settings_.clip) return std::nullopt;
    const Box all = box();
    if (all.empty()) return std::nullopt;
    const int axis = std::clamp(settings_.clip_axis, 0, 2);
    // Just beyond the ends, so that 0 cuts away all and 1 nothing.
    const double margin = 1e-4 * all.diagonal();
    const double from = all.min[axis] - margin, to = all.max[axis] + margin;
    return ClipPlane{Vec3d::Unit(axis), from + settings_.clip_at * (to - from)};
}

} // namespace filigree::studio
