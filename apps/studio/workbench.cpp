#include "workbench_content.h"

#include "restored_error.h"
#include "words.h"

#include "filigree/physics/named_materials.h"
#include "filigree/sample/sample_inside.h"

#include <QCoreApplication>
#include <QEventLoop>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace filigree::studio {

namespace {

/// Pulls of every vertex of larger meshes take minutes: they are only done when the error is asked for.
constexpr std::size_t kMostPulledUnasked = 50'000;

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

/// What a person would call the difference.
QString name_of_change(const Warps& before, const Warps& after) {
    std::vector<QString> names;
    if (before.axis != after.axis) names.push_back("Axis");
    if (before.stretch != after.stretch) names.push_back("Stretch");
    if (before.squeeze != after.squeeze) names.push_back("Squeeze");
    if (before.bend != after.bend) names.push_back("Bend");
    if (before.twist != after.twist) names.push_back("Twist");
    if (before.taper != after.taper) names.push_back("Taper");
    return names.size() == 1 ? names[0] : QString("Deform");
}

QString name_of_change(const Shape& before, const Shape& after) {
    const ShapeOptions &a = before.options, &b = after.options;
    if (before.name != after.name) return shape_title(after.name);
    std::vector<QString> names;
    if (a.frequency != b.frequency) names.push_back(QString("Frequency %1").arg(b.frequency));
    if (a.resolution != b.resolution) names.push_back(QString("Resolution %1").arg(b.resolution));
    if (a.amplitude != b.amplitude) names.push_back(QString("Amplitude %1").arg(b.amplitude));
    return names.size() == 1 ? names[0] : shape_title(after.name);
}

QString name_of_change(const StripOptions& before, const StripOptions& after) {
    if (before.code != after.code)
        return after.code == DetailCode::blend ? "Blend code" : "Reference code of the report";
    if (before.precision != after.precision)
        return after.precision == Precision::float32 ? "Full precision" : "Half-size precision";
    if (before.references != after.references) return QString("%1 references").arg(after.references);
    if (after.base) return "Driver of " + counted(*after.base, "vertex", "vertices");
    if (after.levels) return counted(*after.levels, "level", "levels") + " of detail";
    if (after.error) return QString("Driver within %1 % of the mesh").arg(100 * *after.error);
    return "Driver of the usual size";
}

QString name_of_change(const BodySettings& before, const BodySettings& after) {
    std::vector<QString> names;
    if (before.preset != after.preset && after.preset != "custom")
        return "Material: " + QString::fromStdString(after.preset);
    BodySettings same_but_material = before;
    same_but_material.preset = after.preset;
    same_but_material.material = after.material;
    if (same_but_material == after) return "Material";
    if (before.particles != after.particles) names.push_back(counted(after.particles, "particle", "particles"));
    if (before.size != after.size) names.push_back("Size of the body");
    if (before.drop != after.drop) names.push_back("Height of the drop");
    if (before.gravity != after.gravity) names.push_back(after.gravity ? "Gravity on" : "Gravity off");
    if (before.ground != after.ground) names.push_back(after.ground ? "Ground on" : "Ground off");
    if (before.obstacle != after.obstacle) names.push_back("Obstacle");
    if (before.friction != after.friction) names.push_back("Friction");
    if (before.restitution != after.restitution) names.push_back("Bounce");
    return names.size() == 1 ? names[0] : QString("Body");
}

/// Numbers that the library's functions take, whatever a control came up with.
Warps within_range(Warps warps, const Warps& otherwise) {
    const auto is_factor = [](double value) { return std::isfinite(value) && value > 0; };
    if (!is_factor(warps.stretch)) warps.stretch = otherwise.stretch;
    if (!is_factor(warps.squeeze)) warps.squeeze = otherwise.squeeze;
    if (!is_factor(warps.taper)) warps.taper = otherwise.taper;
    if (!std::isfinite(warps.bend)) warps.bend = otherwise.bend;
    if (!std::isfinite(warps.twist)) warps.twist = otherwise.twist;
    return warps;
}

Material material_of(std::string_view preset) {
    for (const NamedMaterial& named : named_materials())
        if (named.name == preset) return named.material;
    return {};
}

bool same_options(const StripOptions& a, const StripOptions& b) {
    return a.code == b.code && a.base == b.base && a.levels == b.levels && a.error == b.error &&
           a.precision == b.precision && a.references == b.references;
}

/// Where the user pinned the driver.
std::vector<Index> pinned_vertices(const State& state) {
    std::vector<Index> result;
    for (const Handle& handle : state.handles)
        if (handle.pinned) result.insert(result.end(), handle.vertices.begin(), handle.vertices.end());
    std::sort(result.begin(), result.end());
    return result;
}

/// What handles and recordings refer to is another driver now.
void drop_what_refers_to_driver(State& state) {
    state.handles.clear();
    state.handle_pose = nullptr;
    state.pose_from_file = false;
    state.recording = nullptr;
}

} // namespace

Result<State> stripped_state(State state, const RunContext& context) {
    const bool was_finest = !state.model || state.level() == state.model->finest_level();
    Result<Stripped> stripped = strip(state.source->mesh, state.strip, context);
    if (!stripped) return stripped.error();
    state.strip_report = stripped->report;
    state.model = std::make_shared<const Model>(std::move(stripped->model));
    const unsigned finest = state.model->finest_level();
    state.restore.level = was_finest ? finest : std::min(state.level(), finest);
    drop_what_refers_to_driver(state);
    return state;
}

Result<State> state_of_shape(State state, const Shape& shape, const RunContext& context) {
    Result<Mesh> mesh = filigree::make_shape(shape.name, shape.options);
    if (!mesh) return mesh.error();
    auto source = std::make_shared<Source>();
    source->mesh = std::move(*mesh);
    source->name = shape_title(shape.name).toStdString();
    source->topology = analyse_topology(source->mesh, context);
    state.source = std::move(source);
    state.shape = shape;
    return stripped_state(std::move(state), context);
}

Workbench::Workbench(QObject* parent) : QObject(parent), content_(std::make_unique<Content>()) {
    connect(&document_, &Document::changed, this, &Workbench::follow_document);
    connect(&playback_, &Playback::moved, this, &Workbench::follow_playback);
    connect(&playback_, &Playback::state_changed, this, [this] {
        if (!playback_.has_body()) {
            content_->measures_next = content_->commits_steps = false;
            if (content_->pulls_body) is_pulling_ = false;
        }
        if (mode_ == Mode::body && !recording() && !content_->keeps_body) set_mode(Mode::deform);
        Q_EMIT timeline_changed();
    });
    const auto tell = [this](const Error& error) { Q_EMIT told(QString::fromStdString(error.message), true); };
    connect(&playback_, &Playback::failed, this, tell);
    connect(&playback_, &Playback::failed, this, [this] {
        content_->measures_next = false;
        commit_recording(); // what there was before
    });
    connect(&jobs_, &Jobs::failed, this, tell);
    connect(&jobs_, &Jobs::failed, this, [this] { content_->then = After::nothing; });
    connect(&jobs_, &Jobs::cancelled, this, [this](const QString& title) {
        content_->then = After::nothing;
        Q_EMIT told(title + ": cancelled.", false);
    });
    connect(&drag_, &HandleDrag::solved, this, &Workbench::show_drag);
    connect(&drag_, &HandleDrag::failed, this, [this, tell](const Error& error) {
        is_pulling_ = false;
        show_pose();
        tell(error);
    });
    connect(&content_->replay, &QTimer::timeout, this, &Workbench::replay_frame);

    State state;
    state.body.material = material_of(state.body.preset);
    document_.replace(state_of_shape(std::move(state), Shape{}, RunContext()).value());
}

Workbench::~Workbench() = default;

// ------------------------------------------------------------------------------------------- what follows from a step

void Workbench::follow_document(const State& before) {
    const State& now = state();
    const bool is_same_motion =
        now.model == before.model && now.recording == before.recording && now.body == before.body;
    if (!is_same_motion && !content_->keeps_body) {
        content_->replay.stop();
        playback_.remove();
    }
    if (now.source != before.source) {
        inside_points_.clear();
        jobs_.drop(kQuadsTopic); // of the mesh before
    }
    if (now.model != before.model) jobs_.drop(kModelTopic); // what is being made was meant for the one before
    if (is_pulling_ && drag_.is_active()) {
        drag_.stop(); // something else has changed meanwhile, an undo say
        is_pulling_ = false;
    }
    if (!is_same_motion) frame_ = std::min(frame_, frame_count() > 0 ? frame_count() - 1 : 0);
    if (mode_ == Mode::body && !recording() && !content_->keeps_body) {
        mode_ = Mode::deform;
        Q_EMIT mode_changed();
    }
    const bool is_same_shape = now.model == before.model && now.warps == before.warps &&
                               now.handle_pose == before.handle_pose &&
                               (mode_ == Mode::deform || now.recording == before.recording || content_->keeps_body);
    const bool is_same_detail = now.level() == before.level() && now.restore.law == before.restore.law &&
                                now.restore.thin_shell == before.restore.thin_shell;
    if (!is_same_shape || !is_same_detail) show_pose();
    if (!is_same_motion) Q_EMIT timeline_changed();
    if (content_->is_opening || (now.source != before.source && content_->is_another_shape)) Q_EMIT opened();
}

void Workbench::show_pose() {
    const auto begin = std::chrono::steady_clock::now();
    if (std::exchange(content_->measures_next, false) && !wants_full_) playback_.want_full(false);
    pose_ = {};
    if (mode_ == Mode::deform) {
        pose_ = deformed_pose(state(), content_->context);
    } else if (const PoseSequence* poses = recording()) {
        pose_ = poses->frames[std::min(frame_, poses->frames.size() - 1)];
    }
    driver_milliseconds_ = milliseconds_since(begin);
    pose_is_new();
}

void Workbench::pose_is_new() {
    ++content_->pose_number;
    error_.reset();
    full_.clear();
    forget_measuring();
    if (wants_full_) find_full();
    Q_EMIT pose_changed();
}

/// Long work about a pose that will not be shown much longer.
void Workbench::forget_measuring() {
    jobs_.drop("error");
    jobs_.drop("full");
}

void Workbench::find_full() {
    if (mode_ == Mode::body) {
        if (is_live_frame()) full_ = playback_.moment()->full;
        full_is_new();
        return;
    }
    if (is_pulling_ || state().pose_from_file ||
        (state().handle_pose && state().model->mesh.vertex_count() > kMostPulledUnasked))
        return;
    const std::uint64_t number = content_->pose_number;
    jobs_.start<std::vector<Vec3f>>(
        "Deforming every vertex", "full",
        [state = state()](const RunContext& context) { return full_deformation(state, context); },
        [this, number](std::vector<Vec3f> positions) {
            if (number != content_->pose_number) return;
            full_ = std::move(positions);
            full_is_new();
        });
}

void Workbench::full_is_new() {
    Q_EMIT full_changed();
    if (!full_.empty() && view_.settings().coloring == Coloring::error && !is_playing()) measure_error();
}

void Workbench::want_full(bool wanted) {
    if (wants_full_ == wanted) return;
    wants_full_ = wanted;
    playback_.want_full(wanted);
    if (wanted)
        find_full();
    else
        full_.clear();
}

void Workbench::measure_error() {
    if (mode_ == Mode::body && (!is_live_frame() || playback_.moment()->full.empty())) {
        if (is_live_frame()) {
            content_->measures_next = true;
            playback_.want_full(true); // another look at this moment, with every vertex
        } else {
            Q_EMIT told("The error of a recorded moment is only known while its body is there: press Play, then pause.",
                        false);
        }
        return;
    }
    const std::uint64_t number = content_->pose_number;
    std::vector<Vec3f> full = mode_ == Mode::body ? playback_.moment()->full : full_;
    struct Measured {
        VertexDistance distance;
        std::vector<Vec3f> full;
    };
    jobs_.start<Measured>(
        "Measuring the error", "error",
        [state = state(), pose = pose_, full = std::move(full)](const RunContext& context) mutable -> Result<Measured> {
            if (full.empty()) {
                Result<std::vector<Vec3f>> deformed = full_deformation(state, context);
                if (!deformed) return deformed.error();
                full = std::move(*deformed);
            }
            Result<VertexDistance> distance = restored_error(state, pose, full, context);
            if (!distance) return distance.error();
            return Measured{std::move(*distance), std::move(full)};
        },
        [this, number](Measured measured) {
            if (number != content_->pose_number) return; // of a pose that is not shown any more
            error_ = std::move(measured.distance);
            if (wants_full_ && full_.empty()) {
                full_ = std::move(measured.full);
                Q_EMIT full_changed();
            }
            Q_EMIT error_measured();
        });
}

void Workbench::sample_inside_points(std::size_t count) {
    jobs_.start<std::vector<Vec3f>>(
        "Sampling points inside", "inside",
        [source = state().source, count](const RunContext& context) -> Result<std::vector<Vec3f>> {
            const Mesh& mesh = source->mesh;
            const Result<double> spacing = spacing_for_count(mesh, std::max<std::size_t>(count, 1), {}, context);
            if (!spacing) return spacing.error();
            const Result<Lattice> lattice = make_lattice(bounds(mesh.positions), {.spacing = *spacing});
            if (!lattice) return lattice.error();
            const Result<Occupancy> occupancy = sample_inside(mesh, *lattice, {}, context);
            if (!occupancy) return occupancy.error();
            return points_inside(*lattice, *occupancy).positions;
        },
        [this, source = state().source](std::vector<Vec3f> points) {
            if (source != state().source) return;
            inside_points_ = std::move(points);
            Q_EMIT inside_points_ready();
        });
}

void Workbench::wait_until_idle() {
    jobs_.wait_until_idle();
    while (content_->measures_next || jobs_.is_busy() || drag_.is_busy())
        QCoreApplication::processEvents(QEventLoop::WaitForMoreEvents);
}

// ------------------------------------------------------------------------------------------------- model and detail

const std::optional<Shape>& Workbench::wanted_shape() const {
    return jobs_.is_pending(kModelTopic) ? content_->wanted_shape : state().shape;
}

const StripOptions& Workbench::wanted_strip() const {
    return jobs_.is_pending(kModelTopic) ? content_->wanted_strip : state().strip;
}

void Workbench::make_shape(const Shape& shape, const std::string& merge) {
    if (wanted_shape() == shape) return;
    const bool is_another = !wanted_shape() || wanted_shape()->name != shape.name;
    const StripOptions strip = is_another ? StripOptions() : wanted_strip();
    if (state().shape == shape && same_options(strip, state().strip)) return jobs_.drop(kModelTopic); // back again
    make_model("Making the " + shape_title(shape.name).toLower(), shape, strip, merge);
}

void Workbench::set_strip(const StripOptions& options, const std::string& merge) {
    make_model("Taking the detail off", wanted_shape(), options, merge);
}

/// In the background. Shape and options go together, so that a change of one does not lose one of the other that is
/// still being made.
void Workbench::make_model(const QString& title, std::optional<Shape> shape, const StripOptions& strip,
                           const std::string& merge) {
    if (jobs_.is_pending(kOpenTopic)) {
        Q_EMIT told("A file is being opened: change the model once it is there, or cancel.", true);
        return;
    }
    if (jobs_.is_pending(kQuadsTopic)) {
        Q_EMIT told("Quads are being made: change the model once they are there, or cancel.", true);
        return;
    }
    State next = state();
    next.strip = strip;
    const bool is_new_shape = shape != next.shape;
    content_->wanted_shape = shape;
    content_->wanted_strip = strip;
    forget_measuring();
    jobs_.start<State>(
        title, kModelTopic,
        [next = std::move(next), shape = std::move(shape), is_new_shape](const RunContext& context) {
            return is_new_shape ? state_of_shape(next, *shape, context) : stripped_state(next, context);
        },
        [this, is_new_shape, key = document_.merge_key(merge)](const State& made) {
            State now = state(); // warps and settings may have changed meanwhile
            const Shape before = now.shape.value_or(Shape{.name = "", .options = {}});
            const QString name =
                is_new_shape ? name_of_change(before, *made.shape) : name_of_change(now.strip, made.strip);
            content_->is_another_shape = is_new_shape && before.name != made.shape->name;
            now.source = made.source;
            now.shape = made.shape;
            take_model(now, made);
            document_.change(name, std::move(now), key);
            content_->is_another_shape = false;
        });
}

void Workbench::take_model(State& now, const State& made) const {
    const bool is_finest = now.level() == now.model->finest_level();
    now.strip = made.strip;
    now.strip_report = made.strip_report;
    now.model = made.model;
    const unsigned finest = now.model->finest_level();
    now.restore.level = is_finest ? finest : std::min(now.level(), finest);
    drop_what_refers_to_driver(now);
}

void Workbench::change_level(unsigned level, const QString& name, const std::string& merge) {
    level = std::min(level, state().model->finest_level());
    if (level == state().level()) return;
    State next = state();
    next.restore.level = level;
    document_.change(name, std::move(next), merge);
}

void Workbench::set_level(unsigned level, const std::string& merge) {
    change_level(level, QString("Level %1").arg(std::min(level, state().model->finest_level())), merge);
}
void Workbench::remove_detail() {
    if (state().level() > 0) change_level(state().level() - 1, "Remove detail", {});
}
void Workbench::add_detail() { change_level(state().level() + 1, "Add detail", {}); }

void Workbench::set_law(std::optional<HeightLaw> law) {
    if (law == state().restore.law) return;
    State next = state();
    next.restore.law = law;
    const std::string_view name = law ? height_law_name(*law) : "as usual";
    document_.change("Law: " + QString::fromUtf8(name.data(), qsizetype(name.size())), std::move(next));
}

void Workbench::set_thin_shell(bool thin) {
    if (thin == state().restore.thin_shell) return;
    State next = state();
    next.restore.thin_shell = thin;
    document_.change(thin ? "Thin shell" : "Solid", std::move(next));
}

// ----------------------------------------------------------------------------------------------------------- deform

void Workbench::set_warps(const Warps& wanted, const std::string& merge) {
    const Warps warps = within_range(wanted, state().warps);
    set_mode(Mode::deform);
    if (warps == state().warps) return;
    State next = state();
    next.warps = warps;
    document_.change(name_of_change(state().warps, warps), std::move(next), merge);
}

void Workbench::reset_deformation() {
    const Warps none{.axis = state().warps.axis};
    set_mode(Mode::deform);
    if (state().warps == none && state().handles.empty() && !state().handle_pose) return;
    State next = state();
    next.warps = none;
    next.handles.clear();
    next.handle_pose = nullptr;
    next.pose_from_file = false;
    document_.change("Reset the deformation", std::move(next));
}

void Workbench::pin(std::span<const Index> driver_vertices) {
    State next = state();
    std::vector<char> is_pinned(next.model->driver().vertices.size());
    for (const Handle& handle : next.handles)
        if (handle.pinned)
            for (const Index v : handle.vertices) is_pinned[v] = 1;
    Handle pins;
    pins.pinned = true;
    const std::vector<Vec3f> places = next.handle_pose ? next.handle_pose->positions : driver_positions(*next.model);
    for (const Index v : driver_vertices)
        if (v < is_pinned.size() && !std::exchange(is_pinned[v], 1)) pins.vertices.push_back(v);
    if (pins.vertices.empty()) return;
    std::sort(pins.vertices.begin(), pins.vertices.end());
    for (const Index v : pins.vertices) pins.targets.push_back(places[v]);
    const QString name = "Pin " + counted(pins.vertices.size(), "vertex", "vertices");
    next.handles.push_back(std::move(pins));
    document_.change(name, std::move(next));
    if (playback_.has_body()) Q_EMIT told("Make the body again for new pins to hold it.", false);
}

void Workbench::unpin(std::span<const Index> driver_vertices) {
    State next = state();
    std::size_t count = 0;
    for (Handle& handle : next.handles) {
        if (!handle.pinned) continue;
        Handle left;
        for (std::size_t i = 0; i < handle.vertices.size(); ++i) {
            if (std::find(driver_vertices.begin(), driver_vertices.end(), handle.vertices[i]) !=
                driver_vertices.end()) {
                ++count;
                continue;
            }
            left.vertices.push_back(handle.vertices[i]);
            left.targets.push_back(handle.targets[i]);
        }
        handle.vertices = std::move(left.vertices);
        handle.targets = std::move(left.targets);
    }
    if (count == 0) return;
    std::erase_if(next.handles, [](const Handle& handle) { return handle.vertices.empty(); });
    document_.change("Unpin " + counted(count, "vertex", "vertices"), std::move(next));
    if (playback_.has_body()) Q_EMIT told("Make the body again for it to be free there.", false);
}

void Workbench::unpin_all() {
    std::vector<Index> all(state().model->driver().vertices.size());
    for (Index v = 0; v < all.size(); ++v) all[v] = v;
    unpin(all);
}

void Workbench::begin_pull(Index vertex, const Vec3d& at) {
    if (is_pulling_) end_pull();
    const Mesh& mesh = state().model->mesh;
    if (vertex >= mesh.vertex_count() || !at.allFinite()) return;
    const Vec3f rest = mesh.positions[vertex];
    if (mode_ == Mode::body) {
        if (!playback_.has_body()) {
            Q_EMIT told("A recording cannot be pulled: make the body first.", false);
            return;
        }
        content_->replay.stop();
        show_last_frame();
        is_pulling_ = true;
        content_->pulls_body = true;
        playback_.grab(rest, at - mesh.origin);
        return;
    }
    const double diagonal = bounds(mesh.positions).diagonal();
    Handle pull;
    pull.centre = rest;
    pull.grip = view_.settings().grip * diagonal;
    pull.reach = std::max(view_.settings().reach, view_.settings().grip) * diagonal;
    PullRegion region = pull_region(state(), rest, pull.grip, pull.reach, vertex);
    if (region.grip.empty()) {
        Q_EMIT told("Everything here is pinned: unpin something to pull it.", false);
        return;
    }
    pull.vertices = std::move(region.grip);
    pull.held = std::move(region.held);
    content_->warp = make_warp(state().warps, world_bounds(mesh));
    content_->grabbed = content_->warp ? unwarped(*content_->warp, at, mesh.world_position(vertex)) : at;
    content_->pull = pull;
    content_->pulls_body = false;
    is_pulling_ = true;
    drag_.begin(state().model, state().handle_pose, std::move(pull), vertex);
}

void Workbench::pull_to(const Vec3d& target) {
    if (!is_pulling_ || !target.allFinite()) return;
    if (content_->pulls_body) return playback_.pull(target - state().model->mesh.origin);
    const Vec3d place = content_->warp
                            ? unwarped(*content_->warp, target, content_->grabbed + content_->pull.move.cast<double>())
                            : target;
    content_->pull.move = (place - content_->grabbed).cast<float>();
    drag_.move(content_->pull.move);
}

/// The driver as it is dragged, before it becomes a step.
void Workbench::show_drag(const std::shared_ptr<const Pose>& pose, double milliseconds) {
    if (!is_pulling_ || mode_ != Mode::deform) return;
    const auto begin = std::chrono::steady_clock::now();
    State dragged = state();
    dragged.handle_pose = pose;
    pose_ = deformed_pose(dragged, content_->context);
    driver_milliseconds_ = milliseconds + milliseconds_since(begin);
    pose_is_new();
}

void Workbench::end_pull() {
    if (!is_pulling_) return;
    if (content_->pulls_body) {
        is_pulling_ = false;
        playback_.let_go();
        return;
    }
    std::shared_ptr<const Pose> pose = drag_.finish();
    if (!std::exchange(is_pulling_, false)) return; // it failed, and that was told
    if (!pose) Q_EMIT told("The driver is large: hold it until it follows, then let go.", false);
    Handle& pull = content_->pull;
    if (!pose || pull.move.isZero(0)) return show_pose();
    pull.move = drag_.applied();
    State next = state();
    for (const Index v : pull.vertices) pull.targets.push_back(pose->positions[v]);
    next.handles.push_back(std::move(pull));
    next.handle_pose = std::move(pose);
    document_.change("Pull", std::move(next));
}

void Workbench::cancel_pull() {
    if (!is_pulling_) return;
    if (content_->pulls_body) return end_pull();
    drag_.stop();
    is_pulling_ = false;
    show_pose();
}

// ------------------------------------------------------------------------------------------------------------- body

void Workbench::set_body(const BodySettings& settings, const std::string& merge) {
    if (settings == state().body) return;
    const bool had_body = playback_.has_body(), was_playing = is_playing();
    if (had_body) pause();
    State next = state();
    next.body = settings;
    next.recording = nullptr; // of another body
    if (!had_body) next.recording = state().recording;
    content_->keeps_body = had_body; // until the new one is there
    document_.change(name_of_change(state().body, settings), std::move(next), merge);
    content_->keeps_body = false;
    if (had_body)
        make_body_then(was_playing ? After::play : After::nothing);
    else if (jobs_.is_pending(kBodyTopic))
        make_body_then(content_->then);
}

void Workbench::make_body() { make_body_then(After::nothing); }

void Workbench::make_body_then(After then) {
    content_->then = then;
    const auto up_axis = view_.settings().up;
    using Made = Result<std::shared_ptr<const MadeBody>>; // an error is delivered too: no body fits the settings then
    jobs_.start<Made>(
        "Making the body", kBodyTopic,
        [state = state(), up_axis](const RunContext& context) -> Result<Made> {
            Made made = make_body_of(state, up_vector(up_axis), context);
            if (!made && made.error().code == ErrorCode::cancelled) return made.error();
            return Result<Made>(std::move(made));
        },
        [this, model = state().model, settings = state().body, pinned = pinned_vertices(state()),
         up_axis](const Made& made) {
            if (model != state().model || !(settings == state().body) || pinned != pinned_vertices(state()) ||
                up_axis != view_.settings().up) {
                content_->then = After::nothing;
                Q_EMIT told("The body was not made: what it is made of was changed meanwhile.", false);
                return;
            }
            if (made) return put_body(*made);
            content_->then = After::nothing;
            playback_.remove();
            if (mode_ == Mode::body && !recording()) set_mode(Mode::deform);
            Q_EMIT told("No body can be made of this: " + QString::fromStdString(made.error().message), true);
        });
}

void Workbench::put_body(std::shared_ptr<const MadeBody> made) {
    const After then = std::exchange(content_->then, After::nothing);
    content_->replay.stop();
    content_->keeps_body = true;
    if (state().recording) {
        State next = state();
        next.recording = nullptr;
        document_.change("Make a body", std::move(next));
    }
    playback_.put(made);
    content_->keeps_body = false;
    content_->committed = 1;
    frame_ = 0;
    set_mode(Mode::body);
    show_pose();
    Q_EMIT timeline_changed();
    if (!made->report.warning.empty()) Q_EMIT told(QString::fromStdString(made->report.warning), false);
    const bool is_deformed = !state().warps.none() || state().handle_pose;
    if (is_deformed && !std::exchange(content_->told_of_rest, true))
        Q_EMIT told("A body is made of the shape at rest, without its deformation.", false);
    if (then == After::play) play();
    if (then == After::step) step();
}

void Workbench::set_mode(Mode mode) {
    if (mode == mode_) return;
    if (is_pulling_) end_pull();
    if (mode == Mode::deform) pause();
    mode_ = mode;
    Q_EMIT mode_changed();
    show_pose();
    Q_EMIT timeline_changed();
}

const PoseSequence* Workbench::recording() const {
    if (playback_.has_body()) return &playback_.recording();
    return state().recording && !state().recording->empty() ? state().recording.get() : nullptr;
}
std::size_t Workbench::frame_count() const { return recording() ? recording()->frames.size() : 0; }
std::size_t Workbench::frame() const { return frame_; }
bool Workbench::is_playing() const { return playback_.is_playing() || content_->replay.isActive(); }
bool Workbench::is_live_frame() const {
    return mode_ == Mode::body && playback_.has_body() && frame_ + 1 == frame_count();
}

void Workbench::play() {
    if (is_playing()) return;
    if (frame_count() == 0) return make_body_then(After::play);
    set_mode(Mode::body);
    const bool is_at_end = frame_ + 1 >= frame_count();
    if (is_at_end && playback_.has_body()) return playback_.play();
    if (is_at_end) {
        frame_ = 0;
        show_pose();
    }
    if (frame_count() < 2) return make_body_then(After::play);
    // Rates come from files too.
    content_->replay.start(int(std::lround(std::clamp(1000 / recording()->frames_per_second, 1.0, 10'000.0))));
    Q_EMIT timeline_changed();
}

/// The next recorded frame; after the last one the body goes on, where there is one.
void Workbench::replay_frame() {
    if (frame_ + 1 < frame_count()) {
        ++frame_;
        show_pose();
        Q_EMIT timeline_changed();
    }
    if (frame_ + 1 < frame_count()) return;
    content_->replay.stop();
    playback_.play();
    Q_EMIT timeline_changed();
}

void Workbench::pause() {
    const bool was_playing = is_playing();
    content_->replay.stop();
    playback_.pause();
    if (is_pulling_ && content_->pulls_body) is_pulling_ = false;
    commit_recording();
    if (was_playing) Q_EMIT timeline_changed();
    if (was_playing && wants_full_ && is_live_frame()) full_is_new();
}

void Workbench::step() {
    if (is_playing()) pause();
    if (frame_count() == 0) return make_body_then(After::step);
    set_mode(Mode::body);
    if (frame_ + 1 < frame_count()) return go_to_frame(frame_ + 1);
    if (!playback_.has_body()) return;
    content_->commits_steps = true;
    playback_.step();
}

void Workbench::reset() {
    content_->replay.stop();
    playback_.pause();
    if (is_pulling_ && content_->pulls_body) is_pulling_ = false;
    commit_recording();
    frame_ = 0;
    content_->keeps_body = true;
    playback_.reset();
    content_->committed = 1;
    if (state().recording) {
        State next = state();
        next.recording = nullptr;
        document_.change("Reset the body", std::move(next));
    }
    content_->keeps_body = false;
    if (mode_ == Mode::body && !recording()) return set_mode(Mode::deform);
    if (mode_ == Mode::body) show_pose();
    Q_EMIT timeline_changed();
}

void Workbench::animate() {
    pause();
    BodySettings body = state().body;
    body.gravity = body.ground = true;
    if (body == state().body && playback_.has_body()) {
        reset();
        return play();
    }
    if (!(body == state().body)) {
        State next = state();
        next.body = body;
        next.recording = nullptr;
        document_.change("Animate", std::move(next));
    }
    make_body_then(After::play);
}

void Workbench::go_to_frame(std::size_t frame) {
    if (frame_count() == 0) return;
    if (is_playing()) pause();
    frame = std::min(frame, frame_count() - 1);
    if (mode_ == Mode::body && frame == frame_) return;
    frame_ = frame;
    if (mode_ == Mode::body)
        show_pose();
    else
        set_mode(Mode::body);
    Q_EMIT timeline_changed();
}

void Workbench::show_last_frame() {
    if (frame_ + 1 == frame_count()) return;
    frame_ = frame_count() - 1;
    show_pose();
    Q_EMIT timeline_changed();
}

void Workbench::follow_playback() {
    const Moment& moment = *playback_.moment();
    const bool is_another = std::exchange(content_->looked_at, moment.frame) != moment.frame;
    if (mode_ != Mode::body || content_->keeps_body) return;
    if (!is_another && frame_ != moment.frame) return; // looked at once more, for its vertices, and not shown
    frame_ = std::min(moment.frame, frame_count() - 1);
    if (pose_.positions != moment.pose.positions || pose_.gradients != moment.pose.gradients) {
        pose_ = moment.pose;
        driver_milliseconds_ = moment.milliseconds;
        pose_is_new();
        Q_EMIT timeline_changed();
    } else if (wants_full_ && !moment.full.empty()) { // the same once more, now with every vertex
        full_ = moment.full;
        full_is_new();
    }
    if (content_->measures_next && !moment.full.empty()) {
        content_->measures_next = false;
        if (!wants_full_) playback_.want_full(false);
        measure_error();
    }
    if (content_->commits_steps && !playback_.is_playing() && !playback_.is_stepping()) {
        content_->commits_steps = false;
        commit_recording("Simulate step by step", "step");
    }
}

/// What was simulated becomes part of the document.
void Workbench::commit_recording(const QString& name, const std::string& merge) {
    if (!playback_.has_body()) return;
    const std::size_t count = playback_.recording().frames.size();
    if (count <= content_->committed && (state().recording || count < 2)) return;
    State next = state();
    next.recording = std::make_shared<const PoseSequence>(playback_.recording());
    content_->committed = count;
    content_->keeps_body = true;
    // Play and pause over and over are one step, which holds one copy.
    if (name.isEmpty())
        document_.change("Simulate " + counted(count - 1, "frame", "frames"), std::move(next), "play");
    else
        document_.change(name, std::move(next), merge);
    content_->keeps_body = false;
}

} // namespace filigree::studio
