#include "drawn_objects.h"

#include "quads.h"
#include "theme.h"

#include "filigree/deform/carried_points.h"
#include "filigree/mesh.h"
#include "filigree/mesh/ray_hit.h"
#include "filigree/present/patch_surface.h"
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

using BodyShown = std::shared_ptr<const DroppedBody>;

struct Particles {
    BodyShown body;
    Drawable drawable;
};

struct InsidePoints {
    Drawable drawable;
    std::uint64_t pose = 0; ///< which pose they have; 0: at rest
};

struct Melt {
    Drawable drawable;
    std::vector<Index> copied; ///< vertices that are drawn twice
    std::uint64_t colors = 0;  ///< which colours it has; 0: none
};

using Stamp = std::uint64_t; ///< of a pose, a model ...: another number with each of them
using ParticlesKey = std::pair<BodyShown, Stamp>;
using InsideKey = std::pair<Stamp, Stamp>; ///< of the samples, the model
using ColorsKey = std::tuple<const Coloring*, Stamp, ColorKey>;
using NetKey = std::tuple<Stamp, Stamp, std::array<double, 3>, double>; ///< of the model, the pose; the eye; the offset
using PlacesKey = std::pair<std::shared_ptr<const LevelShape>, Stamp>;

} // namespace

struct DrawnObjects::Things {
    Things(Workshop& shop, RestoreOn on)
        : where(on), particles(shop), inside(shop), melt(shop), obstacles(shop), full(shop, "full"),
          patches(shop, "patches"), defects(shop, "defects"), colors(shop, "colors") {}

    RestoreOn where;
    std::unique_ptr<ShownModel> model, next;
    Shown<ParticlesKey, Particles> particles;
    std::pair<std::shared_ptr<const Source>, std::size_t> sampled; ///< of what points inside were asked for, how many
    Shown<InsideKey, InsidePoints> inside;
    Shown<std::shared_ptr<const Mesh>, Melt> melt;
    Shown<std::shared_ptr<const Mesh>, std::vector<Triangle>> melt_triangles;
    Shown<BodyShown, std::vector<Drawable>> obstacles;
    Shown<Stamp, Drawable> full;        ///< of a pose
    Shown<Stamp, PatchSurface> patches; ///< of a model
    Shown<std::shared_ptr<const Model>, std::vector<DefectEdge>> defects;
    Shown<ColorsKey, VertexColors> colors;
    Shown<NetKey, Pose> net;
    std::vector<Shown<PlacesKey, std::vector<Vec3f>>> places; ///< of levels
};

DrawnObjects::DrawnObjects(Workbench& workbench, Workshop::WithOpenGl with_opengl)
    : workbench_(workbench), shop_{std::move(with_opengl), [this] { follow_and_draw(); }},
      settings_(workbench.view().settings()) {
    connect(&shop_.background, &Jobs::failed, this, [this](const Error& error) {
        problem_ = error.message;
        Q_EMIT changed(false);
    });
    connect(&workbench.document(), &Document::changed, this, &DrawnObjects::follow_document);
    connect(&workbench, &Workbench::opened, this, &DrawnObjects::follow_document);
    connect(&workbench, &Workbench::pose_changed, this, &DrawnObjects::follow_pose);
    connect(&workbench, &Workbench::full_changed, this, &DrawnObjects::follow);
    connect(&workbench, &Workbench::error_measured, this, &DrawnObjects::follow);
    connect(&workbench, &Workbench::inside_points_ready, this, [this] {
        samples_stamp_ = next_stamp();
        follow();
    });
    connect(&workbench, &Workbench::mode_changed, this, &DrawnObjects::follow_and_draw);
    connect(&workbench.playback(), &Playback::state_changed, this, &DrawnObjects::follow_and_draw);
    connect(&workbench.playback(), &Playback::moved, this, [this] {
        moment_stamp_ = next_stamp();
        follow();
    });
    connect(&workbench.expected_error(), &ExpectedError::changed, this, &DrawnObjects::follow);
    connect(&workbench.view(), &ViewState::changed, this, &DrawnObjects::follow_and_draw);
}

DrawnObjects::~DrawnObjects() = default;

void DrawnObjects::start(RestoreOn where) {
    things_ = std::make_unique<Things>(shop_, where);
    follow_document();
    follow_and_draw();
}

void DrawnObjects::stop() {
    shop_.background.drop_all();
    things_.reset();
}

ShownModel* DrawnObjects::shown() const { return things_ ? things_->model.get() : nullptr; }
bool DrawnObjects::is_preparing() const { return things_ && things_->next; }

void DrawnObjects::follow_document() {
    const State& state = workbench_.state();
    if (!things_ || !state.model) return;
    std::unique_ptr<ShownModel>&model = things_->model, &next = things_->next;
    if (model && model->is_of(state)) {
        if (next) {
            next.reset();
            shop_.background.drop_all();
            model->forget_unready();
        }
        ask_for_levels(state.level(), false);
    } else {
        if (!next || !next->is_of(state)) {
            shop_.background.drop_all();
            if (model) model->forget_unready();
            next = std::make_unique<ShownModel>(state, things_->where);
        }
        next->ask(state.level(), true, shop_.background, shop_.with_opengl, [this](const std::optional<Error>& error) {
            problem_ = error ? error->message : "";
            adopt();
        });
    }
    follow_and_draw();
}

/// The model that was prepared is drawn from now on.
void DrawnObjects::adopt() {
    if (!is_preparing()) return;
    shop_.with_opengl([this] { things_->model = std::move(things_->next); });
    if (is_preparing()) return;
    things_->places.clear();
    model_stamp_ = next_stamp();
    pose_ = things_->model->rest_pose();
    pose_stamp_ = 0;
    follow_pose();
    follow_and_draw(); // where the pose is not of this model
}

void DrawnObjects::follow_pose() {
    const ShownModel* const model = shown();
    if (!model) return;
    const Pose* pose = workbench_.pose();
    if (pose && pose->positions.size() != model->rest_pose().positions.size()) return; // of a model not shown yet
    pose_ = pose ? *pose : model->rest_pose();
    pose_stamp_ = pose ? next_stamp() : 0;
    follow();
    Q_EMIT changed(true);
}

/// Everything but the model: what is made of other things than before is made again, whatever has changed.
void DrawnObjects::follow() {
    if (!things_) return;
    settings_ = workbench_.view().settings();
    const ColoringNeeds& needs = settings_.coloring->needs;
    workbench_.want_full(settings_.split || needs.full);
    workbench_.want_temperatures(needs.temperatures);
    workbench_.expected_error().want_colors(needs.expected_error);
    const bool moves = show_particles();
    bool is_other = show_obstacles();
    if (ShownModel* const model = things_->model.get()) {
        is_other |= show_melt(); // before what colours it
        is_other |= show_inside_points();
        is_other |= show_full();
        is_other |= show_patches();
        is_other |= show_defects();
        is_other |= show_colors();
        if (settings_.driver) model->measure(shop_.background, [this] { Q_EMIT changed(false); });
        if (settings_.driver || settings_.split) ask_for(0, true);
    }
    if (moves || is_other) Q_EMIT changed(moves);
}

void DrawnObjects::follow_and_draw() {
    follow();
    Q_EMIT changed(false);
}

bool DrawnObjects::show_particles() {
    const Moment* moment = workbench_.playback().moment();
    const bool are_there =
        settings_.particles && workbench_.mode() == Mode::body && moment && !moment->particles.empty();
    const ParticlesKey key = are_there ? ParticlesKey{workbench_.playback().made(), moment_stamp_} : ParticlesKey();
    return things_->particles.update(key, [&](std::optional<Particles> before) -> Result<Particles> {
        if (before && before->body == key.first && before->drawable.set_positions(moment->particles))
            return std::move(*before);
        Result<Drawable> made = Drawable::points(moment->particles, origin(), {}, RunContext());
        if (!made) return made.error();
        return Particles{key.first, std::move(made).value()};
    });
}

/// What a body falls on.
bool DrawnObjects::show_obstacles() {
    const BodyShown body = workbench_.mode() == Mode::body ? workbench_.playback().made() : nullptr;
    return things_->obstacles.update(body, [&](const auto&) -> Result<std::vector<Drawable>> {
        std::vector<Drawable> obstacles;
        for (Mesh mesh : body->surroundings.obstacles) {
            mesh.origin += body->model->mesh.origin;
            Result<Drawable> drawable = Drawable::surface(mesh, {}, RunContext());
            if (drawable) obstacles.push_back(std::move(drawable).value());
        }
        return obstacles;
    });
}

/// Sampled by the workbench; the pose carries them along.
bool DrawnObjects::show_inside_points() {
    std::pair<std::shared_ptr<const Source>, std::size_t> wanted;
    if (settings_.inside_points) wanted = {workbench_.state().source, settings_.inside_count};
    if (std::exchange(things_->sampled, wanted) != wanted && wanted.first)
        workbench_.sample_inside_points(wanted.second);
    const std::span<const Vec3f> points = workbench_.inside_points();
    const bool are_there = wanted.first && !points.empty();
    const InsideKey key = are_there ? InsideKey{samples_stamp_, model_stamp_} : InsideKey();
    return things_->inside.update(key, [&](const auto&) -> Result<InsidePoints> {
        constexpr float kRadius = 0.6f; // of balls that nearly touch: what is behind them is seen too
        Result<Drawable> made = Drawable::points(points, origin(), {}, RunContext());
        if (made) made = Drawable::points(points, origin(), {.radius = kRadius * made->point_radius()}, RunContext());
        if (!made) return made.error();
        return InsidePoints{std::move(made).value()};
    });
}

/// The surface of what has melted, in place of the restored mesh.
bool DrawnObjects::show_melt() {
    const std::shared_ptr<const Mesh> surface = workbench_.melt_surface();
    return things_->melt.update(surface, [&](const auto&) -> Result<Melt> {
        const auto& materials = workbench_.state().source->materials.materials;
        DrawnSurface drawn = melt_as_drawn(*surface, materials);
        Result<Drawable> drawable = Drawable::surface(drawn.mesh, {.materials = materials}, RunContext());
        if (!drawable) return drawable.error();
        return Melt{std::move(drawable).value(), std::move(drawn.copied)};
    });
}

std::shared_ptr<const Mesh> DrawnObjects::melt() const { return things_ ? things_->melt.made_of() : nullptr; }

std::span<const Triangle> DrawnObjects::melt_triangles() {
    const std::shared_ptr<const Mesh> surface = melt();
    if (!surface) return {};
    things_->melt_triangles.update(
        surface, [&](const auto&) -> Result<std::vector<Triangle>> { return triangulate(*surface).triangles; });
    return *things_->melt_triangles.get();
}

std::optional<Picked> DrawnObjects::pick_melt(const Camera::Ray& ray) {
    const std::shared_ptr<const Mesh> surface = melt();
    if (!surface) return std::nullopt;
    const std::optional<RayHit> hit =
        first_hit(surface->positions, melt_triangles(), ray.origin - origin(), ray.direction, RunContext());
    if (!hit) return std::nullopt;
    return Picked{ray.origin + hit->distance * ray.direction, 0};
}

bool DrawnObjects::has_full_vertices() const {
    return pose_stamp_ != 0 && shown() && workbench_.full().size() == shown()->model().vertex_count();
}

/// The full deformation is drawn for the pose shown, or not at all.
bool DrawnObjects::show_full() {
    const Stamp key = settings_.split && has_full_vertices() ? pose_stamp_ : 0;
    const auto plan = [this] {
        const std::span<const Vec3f> full = workbench_.full();
        return [model = shown()->shared_model(), source = workbench_.state().source,
                positions = std::vector(full.begin(), full.end())](const RunContext& context) {
            return DrawData::surface(moved_mesh(level_mesh(*model, model->finest_level()), positions),
                                     {.materials = source->materials.materials}, context);
        };
    };
    return things_->full.update_later(key, plan, Drawable::upload);
}

std::string DrawnObjects::full_problem() const {
    if (!things_ || things_->full || pose_stamp_ == 0) return "";
    if (things_->full.problem()) return things_->full.problem()->message;
    if (has_full_vertices() || workbench_.jobs().is_pending("full") || workbench_.jobs().is_pending("error"))
        return "being computed";
    if (workbench_.is_pulling()) return "computed when you let go";
    if (workbench_.mode() == Mode::body)
        return workbench_.is_playing() ? "being computed" : "known only where the simulation is, not for a recording";
    if (workbench_.state().pose_from_file) return "not known for a pose that came from a file";
    return "computed when the error is measured: pulls of so many vertices take long";
}

/// The finest level in the colours of its patches.
bool DrawnObjects::show_patches() {
    const Stamp key = settings_.coloring->needs.patches ? model_stamp_ : 0;
    const auto plan = [this] {
        const auto& quads = workbench_.state().source->quads;
        const unsigned most_levels = quads ? quads->report.levels : std::numeric_limits<unsigned>::max();
        return [model = shown()->shared_model(), most_levels, restore = workbench_.state().restore,
                where = things_->where](const RunContext& context) {
            return PatchData::make(*model, restore, most_levels, where, context);
        };
    };
    const auto upload = [](PatchData patches) -> Result<PatchSurface> {
        Result<Drawable> drawable = Drawable::upload(std::move(patches.data));
        if (!drawable) return drawable.error();
        return PatchSurface{patches.model, std::move(drawable).value()};
    };
    return things_->patches.update_later(key, plan, upload);
}

std::string DrawnObjects::patches_problem() const {
    if (!shown()) return "";
    if (const std::optional<Error>& problem = things_->patches.problem())
        return problem->code == ErrorCode::unsuitable
                   ? "This mesh is not made of patches: Make quads (the Quads panel) gives it some."
                   : problem->message;
    const bool is_coarser = things_->patches && workbench_.state().level() < shown()->finest_level();
    return is_coarser ? "Patches are coloured at the finest level alone." : "";
}

PatchSurface* DrawnObjects::patches_at(unsigned level) {
    return shown() && level == shown()->finest_level() ? things_->patches.get() : nullptr;
}

bool DrawnObjects::show_defects() {
    const std::shared_ptr<const Model> key = settings_.defects ? shown()->shared_model() : nullptr;
    using Defects = std::vector<DefectEdge>;
    const auto plan = [&] {
        return [model = key](const RunContext&) -> Result<Defects> { return defect_edges(model->mesh); };
    };
    if (key) ask_for(shown()->finest_level(), false); // they are marked there
    return things_->defects.update_later(key, plan, [](Defects found) -> Result<Defects> { return found; });
}

std::span<const DefectEdge> DrawnObjects::defects() const {
    const std::vector<DefectEdge>* const found = things_ ? things_->defects.get() : nullptr;
    return found ? std::span<const DefectEdge>(*found) : std::span<const DefectEdge>();
}

Seen DrawnObjects::seen() const {
    return {workbench_,    shown()->shared_model(), melt(),           pose_, pose_stamp_,
            moment_stamp_, has_full_vertices(),     patches_problem()};
}

/// What is slow to find out stays as it was for a pose just before, until then.
bool DrawnObjects::show_colors() {
    const Coloring& coloring = *settings_.coloring;
    const Seen seen = this->seen();
    const std::optional<ColorKey> of = coloring.key ? coloring.key(seen) : std::nullopt;
    const ColorsKey key = of ? ColorsKey{&coloring, model_stamp_, *of} : ColorsKey();
    Shown<ColorsKey, VertexColors>& colors = things_->colors;
    if (!colors.wants(key)) return false;
    ColorWork work = of ? coloring.work(seen) : ColorWork();
    if (!work.is_slow) return colors.update(key, [&](const auto&) { return work.work(RunContext()); });
    const ColorsKey& before = colors.made_of();
    return colors.update_later(
        key, [&] { return std::move(work.work); }, [](VertexColors made) -> Result<VertexColors> { return made; },
        std::get<0>(before) == std::get<0>(key) && std::get<1>(before) == std::get<1>(key));
}

const VertexColors& DrawnObjects::colors() const {
    static const VertexColors none;
    const VertexColors* const colors = things_ ? things_->colors.get() : nullptr;
    return colors ? *colors : none;
}

void DrawnObjects::ask_for(unsigned level, bool is_urgent) {
    shown()->ask(level, is_urgent, shop_.background, shop_.with_opengl, [this](const std::optional<Error>& error) {
        if (error) problem_ = error->message;
        Q_EMIT changed(false);
    });
}

unsigned DrawnObjects::calm_level(double pixels_a_unit) {
    ShownModel& model = *shown();
    const unsigned most = std::min(workbench_.state().level(), model.finest_level());
    if (!settings_.level_by_distance) return most;
    model.measure(shop_.background, [this] { Q_EMIT changed(false); });
    by_size_ = level_by_size(model.facts(), most, std::min(by_size_, most), pixels_a_unit);
    return by_size_;
}

void DrawnObjects::ask_for_levels(unsigned calm, bool all) {
    constexpr std::size_t kSmall = 5'000; // triangles: drawn at once anywhere
    const ShownModel* const model = shown();
    if (!model) return;
    calm = std::min(calm, model->finest_level());
    ask_for(calm, true);
    for (unsigned level = calm; all && level-- > 0;) {
        ask_for(level, false);
        if (model->facts()[level].triangles < kSmall) break;
    }
}

double DrawnObjects::prepare(std::span<const unsigned> levels) {
    const RunContext context;
    double spent = 0;
    drawn_level_ = levels[0];
    color_melt();
    pose_inside_points();
    static const VertexColors none;
    const bool are_of_model = !colors().melt;
    for (const unsigned number : levels) {
        ShownLevel* level = shown()->level(number);
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
            shown()->set_pose(*level, pose_, pose_stamp_, context);
        }
        spent += milliseconds(timer);
        shown()->set_colors(*level, are_of_model ? colors() : none, are_of_model ? things_->colors.stamp() : 0);
    }
    return spent;
}

void DrawnObjects::color_melt() {
    Melt* const melt = things_->melt.get();
    const bool has_colors = colors().melt && colors().melt == this->melt();
    const std::uint64_t wanted = has_colors ? things_->colors.stamp() : 0;
    if (!melt || melt->colors == wanted) return;
    std::vector<float> values;
    if (has_colors) values = colors().values;
    for (const Index v : melt->copied)
        if (has_colors) values.push_back(values[v]);
    const bool are_set = bool(melt->drawable.set_scalars({values, colors().map, colors().range}));
    melt->colors = are_set ? wanted : 0;
}

void DrawnObjects::pose_inside_points() {
    InsidePoints* const inside = things_->inside.get();
    if (!inside || inside->pose == pose_stamp_) return;
    const std::span<const Vec3f> rest = workbench_.inside_points();
    const Status is_there =
        pose_stamp_ == 0
            ? inside->drawable.set_positions(rest)
            : inside->drawable.set_positions(carried_points(rest, shown()->rest_pose().positions, pose_, RunContext()));
    if (is_there) inside->pose = pose_stamp_; // else they are of a mesh not shown yet
}

/// The driver's vertices go towards the eye by as much as the detail may hide them: that changes nothing but what is in
/// front, so its edges are one net over the shape.
void DrawnObjects::pose_net() {
    ShownModel& model = *shown();
    const Camera& camera = workbench_.view().camera();
    constexpr double kUnmeasured = 0.01, kMost = 0.05; // of the diagonal
    const double diagonal = bounds(model.rest_pose().positions).diagonal();
    const double offset = std::min(2 * model.facts()[0].deviation.value_or(kUnmeasured * diagonal), kMost * diagonal);
    const NetKey key{model_stamp_, pose_stamp_, {camera.eye.x(), camera.eye.y(), camera.eye.z()}, offset};
    things_->net.update(key, [&](const auto&) -> Result<Pose> {
        const Vec3f eye = (camera.eye - origin()).cast<float>(), back = camera.basis().col(2).cast<float>();
        Pose near = pose_;
        if (near.gradients.empty()) near.gradients.assign(near.positions.size(), Mat3f::Identity());
        for (Vec3f& p : near.positions)
            p += float(offset) * (camera.field_of_view_deg > 0 ? Vec3f((eye - p).normalized()) : back);
        return near;
    });
    model.set_pose(*model.level(0), *things_->net.get(), things_->net.stamp(), RunContext());
}

/// As the view's settings have the surface.
Appearance DrawnObjects::surface_look(bool is_dark) {
    Appearance look;
    look.edges = settings_.style != SurfaceStyle::shaded;
    look.surface = settings_.style != SurfaceStyle::wireframe;
    if (!look.surface && is_dark) look.edge_color = {0.80f, 0.82f, 0.85f};
    if (look.surface) look.edge_width = 1;
    look.clip = clip();
    look.own_colors = settings_.coloring == &kOwnColors || !colors().values.empty(); // grey: not known
    return look;
}

void DrawnObjects::add_level(Scene& scene, unsigned level, const Appearance& look, float coverage) {
    ShownLevel* const drawn = shown() ? shown()->level(level) : nullptr;
    if (!drawn) return;
    PatchSurface* const patches = patches_at(level);
    scene.objects.push_back({patches ? &patches->drawable : &drawn->drawable, look});
    scene.objects.back().appearance.coverage = coverage;
    if (patches) scene.objects.back().appearance.own_colors = true;
}

/// The restored mesh, with what is seen in it and over it. `from` melts into `level`, of which `part` is drawn.
void DrawnObjects::add_restored(Scene& scene, unsigned level, std::optional<unsigned> from, double part,
                                const Appearance& look) {
    if (const Melt* const melt = things_->melt.get()) {
        scene.objects.push_back({&melt->drawable, look});
        scene.objects.back().appearance.own_colors = settings_.coloring == &kOwnColors || melt->colors != 0;
        return;
    }
    const InsidePoints* const inside = things_->inside.get();
    const bool sees_inside = inside && !settings_.clip;
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
    if (inside && inside->pose == pose_stamp_)
        scene.objects.push_back({&inside->drawable, {.color = kInsidePoints, .clip = look.clip}});
}

void DrawnObjects::add_surroundings(Scene& scene) const {
    const BodyShown& body = things_->obstacles.made_of();
    if (!body) return;
    for (const Drawable& obstacle : *things_->obstacles.get())
        scene.objects.push_back({&obstacle, {.color = kObstacles, .gloss = 0.15f}});
    const Surroundings& around = body->surroundings;
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
    } else if (shows == TileShows::full && things_->full) {
        look.own_colors = settings_.coloring == &kOwnColors;
        scene.objects.push_back({things_->full.get(), look});
    } else if (shows == TileShows::full && workbench_.pose()) {
        // nothing yet: the caption says so
    } else if (things_->particles) {
        scene.objects.push_back({&things_->particles->drawable, {.color = kParticles}});
    } else {
        add_restored(scene, level, from, part, look);
    }
    add_surroundings(scene);
    return scene;
}

Vec3d DrawnObjects::origin() const { return shown() ? shown()->model().mesh.origin : Vec3d(Vec3d::Zero()); }

std::span<const Vec3f> DrawnObjects::positions(unsigned level) {
    const ShownLevel* const drawn = shown() ? shown()->level(level) : nullptr;
    if (!drawn) return {};
    if (level >= things_->places.size()) things_->places.resize(level + 1);
    Shown<PlacesKey, std::vector<Vec3f>>& places = things_->places[level];
    places.update({drawn->shape, pose_stamp_}, [&](const auto&) -> Result<std::vector<Vec3f>> {
        return drawn->shape->positions(pose_, RunContext());
    });
    return *places.get();
}

std::optional<Vec3d> DrawnObjects::place_of_vertex(Index vertex) {
    const std::optional<unsigned> level = shown() ? shown()->nearest_ready(drawn_level_) : std::nullopt;
    if (!level) return std::nullopt;
    const std::span<const Vec3f> places = positions(*level);
    const std::optional<Index> of_level = shown()->level(*level)->shape->vertex_of(vertex);
    if (!of_level || *of_level >= places.size()) return std::nullopt;
    return origin() + places[*of_level].cast<double>();
}

Box DrawnObjects::box() {
    const std::optional<unsigned> ready =
        shown() ? shown()->nearest_ready(workbench_.state().level()) : std::optional<unsigned>();
    Box box;
    if (const Melt* const melt = things_ ? things_->melt.get() : nullptr) {
        box = melt->drawable.box();
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
