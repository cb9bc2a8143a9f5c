#include "stage.h"

#include "theme.h"

#include <QElapsedTimer>

#include <algorithm>
#include <utility>

namespace filigree::studio {

namespace {

const Vec3f kDriverEdges(0.85f, 0.33f, 0.10f), kObstacles(0.62f, 0.65f, 0.70f), kParticles(0.88f, 0.55f, 0.25f),
    kInsidePoints(0.20f, 0.45f, 0.78f);

double milliseconds(const QElapsedTimer& timer) { return 1e-6 * static_cast<double>(timer.nsecsElapsed()); }

/// The finest mesh with its vertices elsewhere, and nothing that would no longer be true.
Mesh moved_mesh(const Mesh& mesh, std::span<const Vec3f> positions) {
    Mesh moved = mesh;
    moved.positions.assign(positions.begin(), positions.end());
    moved.normals = {};
    return moved;
}

VertexColors error_colors(std::span<const Vec3f> restored, std::span<const Vec3f> full) {
    VertexColors colors;
    colors.values.resize(full.size());
    for (std::size_t v = 0; v < full.size(); ++v) colors.values[v] = (restored[v] - full[v]).norm();
    colors.range = legend_range(colors.values, true);
    return colors;
}

} // namespace

std::vector<DefectEdge> defect_edges(const Mesh& mesh) {
    std::vector<std::pair<Index, Index>> edges;
    edges.reserve(mesh.corner_count());
    for (std::size_t face = 0; face < mesh.face_count(); ++face) {
        const std::span<const Index> corners = mesh.face(face);
        for (std::size_t k = 0; k < corners.size(); ++k) {
            const Index a = corners[k], b = corners[(k + 1) % corners.size()];
            if (a != b) edges.emplace_back(std::min(a, b), std::max(a, b));
        }
    }
    std::sort(edges.begin(), edges.end());
    std::vector<DefectEdge> defects;
    for (std::size_t i = 0, j = 0; i < edges.size(); i = j) {
        while (j < edges.size() && edges[j] == edges[i]) ++j;
        if (j - i != 2) defects.push_back({edges[i].first, edges[i].second, j - i == 1});
    }
    return defects;
}

Stage::Stage(Workbench& workbench, WithOpenGl with_opengl)
    : workbench_(workbench), with_opengl_(std::move(with_opengl)) {
    settings_ = workbench.view().settings();
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
    connect(&workbench.playback(), &Playback::moved, this, [this] { follow_particles(); });
    connect(&workbench.view(), &ViewState::changed, this, [this] { follow_view(); });
}

Stage::~Stage() = default;

void Stage::start(RestoreOn where) {
    where_ = where;
    is_started_ = true;
    follow_document();
    follow_view();
}

void Stage::stop() {
    background_.cancel_all();
    is_started_ = false;
    shown_.reset();
    next_.reset();
    particles_.reset();
    inside_.reset();
    full_.reset();
    obstacles_.clear();
    particles_of_ = surroundings_of_ = nullptr;
    defects_of_ = nullptr;
}

void Stage::follow_document() {
    if (!is_started_) return;
    const State& state = workbench_.state();
    if (!state.model) return;
    if (shown_ && shown_->is_of(state)) {
        if (next_) {
            next_.reset();
            background_.cancel_all();
            shown_->forget_unready();
        }
        ask_for_levels(state.level(), false);
        Q_EMIT changed(false);
        return;
    }
    if (!next_ || !next_->is_of(state)) {
        background_.cancel_all();
        if (shown_) shown_->forget_unready();
        next_ = std::make_unique<ShownModel>(state, where_);
    }
    next_->ask(state.level(), true, background_, with_opengl_, [this](unsigned, const std::optional<Error>& error) {
        problem_ = error ? error->message : "";
        adopt();
    });
    Q_EMIT changed(false);
}

void Stage::adopt() {
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

void Stage::drop_posed_extras() {
    full_.reset();
    positions_.clear();
}

void Stage::follow_pose() {
    if (!shown_) return;
    const Pose* pose = shows_inside_points() ? nullptr : workbench_.pose();
    if (pose && pose->positions.size() != shown_->rest_pose().positions.size()) return; // of a model not shown yet
    pose_ = pose ? *pose : shown_->rest_pose();
    pose_stamp_ = pose ? ++last_stamp_ : 0;
    if (!pose) with_opengl_([this] { full_.reset(); });
    follow_particles();
    follow_colors();
    Q_EMIT changed(true);
}

void Stage::follow_view() {
    if (!is_started_) return;
    const ViewSettings before = std::exchange(settings_, workbench_.view().settings());
    const bool wants_full = settings_.split || settings_.coloring == Coloring::error;
    workbench_.want_full(wants_full);
    if (settings_.inside_points != before.inside_points) follow_pose();
    follow_surroundings();
    follow_particles();
    follow_inside_points();
    follow_defects();
    follow_full();
    follow_colors();
    if (shown_ && (settings_.driver || settings_.split))
        shown_->ask(0, true, background_, with_opengl_, [this](unsigned, const auto&) { Q_EMIT changed(false); });
    Q_EMIT changed(false);
}

bool Stage::shows_particles() const {
    return settings_.particles && workbench_.mode() == Mode::body && workbench_.playback().has_body();
}
bool Stage::shows_inside_points() const { return workbench_.view().settings().inside_points; }

void Stage::follow_particles() {
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

void Stage::follow_surroundings() {
    const std::shared_ptr<const MadeBody> made =
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

void Stage::follow_inside_points() {
    if (!is_started_ || !shown_) return;
    if (!settings_.inside_points) {
        if (inside_) with_opengl_([this] { inside_.reset(); });
        inside_points_of_ = nullptr;
        return;
    }
    const std::shared_ptr<const Source> source = workbench_.state().source;
    if (source != inside_points_of_ || settings_.inside_count != inside_points_asked_) {
        inside_points_of_ = source;
        inside_points_asked_ = settings_.inside_count;
        workbench_.sample_inside_points(inside_points_asked_);
    }
    if (!inside_points_stale_) return;
    inside_points_stale_ = false;
    with_opengl_([this] {
        inside_.reset();
        Result<Drawable> made = Drawable::points(workbench_.inside_points(), origin(), {}, RunContext());
        if (made) inside_ = std::move(made).value();
    });
    Q_EMIT changed(false);
}

void Stage::follow_full() {
    if (!shown_ || !settings_.split || workbench_.full().size() != shown_->model().mesh.vertex_count()) return;
    const std::vector<Vec3f> positions(workbench_.full().begin(), workbench_.full().end());
    background_.start("full",
                      [this, positions, model = shown_->shared_model(),
                       source = workbench_.state().source](const RunContext& context) -> Background::Delivery {
                          SurfaceOptions options;
                          options.materials = source->materials.materials;
                          Result<DrawData> made =
                              DrawData::surface(moved_mesh(model->mesh, positions), options, context);
                          if (!made) return nullptr;
                          return [this, source, data = std::make_shared<DrawData>(std::move(made).value())] {
                              with_opengl_([&] {
                                  Result<Drawable> drawable = Drawable::upload(std::move(*data));
                                  if (drawable) full_ = std::move(drawable).value();
                              });
                              Q_EMIT changed(true);
                          };
                      });
}

void Stage::follow_colors() {
    if (!shown_) return;
    const auto put = [this](VertexColors colors) {
        colors_ = std::move(colors);
        color_stamp_ = ++last_stamp_;
        Q_EMIT changed(false);
    };
    if (settings_.coloring == Coloring::own) {
        if (color_stamp_ != 0) put({});
        color_stamp_ = 0;
        return;
    }
    const std::size_t count = shown_->model().mesh.vertex_count();
    if (settings_.coloring == Coloring::levels) {
        if (color_stamp_ != 0 && colors_.values == shown_->arrival()) return;
        const ValueRange levels = {0, static_cast<float>(std::max(1u, shown_->finest_level()))};
        return put({shown_->arrival(), ColorMap::sequential, levels});
    }
    if (!workbench_.pose()) return put({std::vector<float>(count), ColorMap::sequential, {0, 1}});
    if (workbench_.full().size() == count) {
        std::vector<Vec3f> full(workbench_.full().begin(), workbench_.full().end());
        background_.start("error colors",
                          [put, this, full = std::move(full), pose = pose_, model = shown_->shared_model(),
                           restore = workbench_.state().restore](const RunContext& context) -> Background::Delivery {
                              RestoreOptions finest = restore;
                              finest.level.reset();
                              const Result<Restorer> restorer = Restorer::create(*model, finest, context);
                              if (!restorer) return nullptr;
                              const Result<std::vector<Vec3f>> restored = restorer->positions(pose, context);
                              if (!restored || restored->size() != full.size()) return nullptr;
                              return [this, put, model, colors = error_colors(*restored, full)] {
                                  if (shown_ && shown_->shared_model() == model &&
                                      settings_.coloring == Coloring::error)
                                      put(colors);
                              };
                          });
        return;
    }
    const std::optional<VertexDistance>& error = workbench_.error();
    if (error && error->per_vertex.size() == count)
        put({error->per_vertex, ColorMap::sequential, legend_range(error->per_vertex, true)});
}

void Stage::follow_defects() {
    if (!shown_ || !settings_.defects || defects_of_ == shown_->shared_model()) return;
    defects_of_ = shown_->shared_model();
    defects_.clear();
    background_.start("defects", [this, model = defects_of_](const RunContext&) -> Background::Delivery {
        return [this, model, defects = defect_edges(model->mesh)] {
            if (defects_of_ != model) return;
            defects_ = defects;
            Q_EMIT changed(false);
        };
    });
}

unsigned Stage::calm_level(double pixels_a_unit) {
    const unsigned most = std::min(workbench_.state().level(), shown_->finest_level());
    if (!settings_.level_by_distance) return most;
    shown_->measure(background_, [this] { Q_EMIT changed(false); });
    by_size_ = level_by_size(shown_->facts(), most, std::min(by_size_, most), pixels_a_unit);
    return by_size_;
}

void Stage::ask_for_levels(unsigned calm, bool all) {
    constexpr std::size_t kSmall = 5'000; // triangles: drawn at once anywhere
    const auto ready = [this](unsigned, const std::optional<Error>& error) {
        if (error) problem_ = error->message;
        Q_EMIT changed(false);
    };
    if (!shown_) return;
    calm = std::min(calm, shown_->finest_level());
    shown_->ask(calm, true, background_, with_opengl_, ready);
    for (unsigned level = calm; all && level-- > 0;) {
        shown_->ask(level, false, background_, with_opengl_, ready);
        if (shown_->facts()[level].triangles < kSmall) break;
    }
}

double Stage::prepare(std::span<const unsigned> levels) {
    const RunContext context;
    double spent = 0;
    for (const unsigned number : levels) {
        ShownLevel* level = shown_->level(number);
        if (!level) continue;
        QElapsedTimer timer;
        timer.start();
        shown_->set_pose(*level, pose_, pose_stamp_, context);
        spent += milliseconds(timer);
        shown_->set_colors(*level, colors_, color_stamp_);
    }
    return spent;
}

Scene Stage::scene(Content content, unsigned level, std::optional<unsigned> from, double part,
                   const QPalette& palette) {
    const bool dark = is_dark(palette);
    Scene scene;
    scene.up = settings_.up;
    scene.ground = settings_.ground;
    scene.background.top = dark ? Vec3f(0.235f, 0.245f, 0.265f) : Vec3f(0.965f, 0.970f, 0.975f);
    scene.background.bottom = dark ? Vec3f(0.125f, 0.130f, 0.145f) : Vec3f(0.820f, 0.835f, 0.855f);

    Appearance look;
    look.edges = settings_.style != SurfaceStyle::shaded;
    look.surface = settings_.style != SurfaceStyle::wireframe;
    if (!look.surface && dark) look.edge_color = {0.80f, 0.82f, 0.85f};
    if (look.surface) look.edge_width = 1;
    look.clip = clip();
    const auto add = [&](unsigned number, Appearance appearance) {
        ShownLevel* shown = shown_ ? shown_->level(number) : nullptr;
        if (shown) scene.objects.push_back({&shown->drawable, appearance});
    };

    if (content == Content::driver) {
        Appearance driver = look;
        driver.edges = true;
        driver.edge_color = look.surface ? Vec3f(0.16f, 0.17f, 0.20f) : look.edge_color;
        add(0, driver);
    } else if (content == Content::full && full_) {
        Appearance full = look;
        full.own_colors = settings_.coloring == Coloring::own;
        scene.objects.push_back({&*full_, full});
    } else if (content == Content::full && workbench_.pose()) {
        // nothing yet: the caption says so
    } else if (shows_particles() && particles_) {
        Appearance balls;
        balls.color = kParticles;
        scene.objects.push_back({&*particles_, balls});
    } else {
        Appearance coming = look, going = look;
        if (from) {
            coming.coverage = static_cast<float>(part);
            going.coverage = static_cast<float>(-part);
            add(*from, going);
        }
        add(level, coming);
        if (settings_.driver && level > 0) {
            Appearance driver;
            driver.surface = false;
            driver.edges = true;
            driver.edge_color = kDriverEdges;
            driver.edge_width = 1.6f;
            driver.own_colors = false;
            driver.clip = look.clip;
            add(0, driver);
        }
        if (inside_) {
            Appearance balls;
            balls.color = kInsidePoints;
            scene.objects.push_back({&*inside_, balls});
        }
    }
    if (surroundings_of_) {
        Appearance stone;
        stone.color = kObstacles;
        stone.gloss = 0.15f;
        for (const Drawable& obstacle : obstacles_) scene.objects.push_back({&obstacle, stone});
        const Surroundings& around = surroundings_of_->surroundings;
        scene.ground = around.has_ground;
        scene.fixed_ground = true;
        scene.ground_level = around.ground_level + up_vector(scene.up).dot(origin());
    }
    return scene;
}

Vec3d Stage::origin() const { return shown_ ? shown_->model().mesh.origin : Vec3d(Vec3d::Zero()); }

std::span<const Vec3f> Stage::positions(unsigned level) {
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

Box Stage::box() {
    const std::optional<unsigned> ready =
        shown_ ? shown_->nearest_ready(workbench_.state().level()) : std::optional<unsigned>();
    Box box;
    if (ready) {
        box = bounds(positions(*ready));
        box.min += origin();
        box.max += origin();
    } else if (workbench_.state().source) {
        box = world_bounds(workbench_.state().source->mesh);
    }
    return box;
}

std::optional<ClipPlane> Stage::clip() {
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
