#include "workbench_impl.h"

#include "coloring.h"

#include "filigree/deform/restored_error.h"

#include "filigree/physics/material.h"
#include "filigree/sample.h"

#include <QCoreApplication>
#include <QEventLoop>

namespace filigree::studio {

namespace {

/// Pulls of every vertex of larger meshes take minutes: they are only done when the error is asked for.
constexpr std::size_t kMostPulledUnasked = 50'000;

Material material_of(std::string_view preset) {
    for (const NamedMaterial& named : named_materials())
        if (named.name == preset) return named.material;
    return {};
}

} // namespace

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

State first_state() {
    State state;
    state.body.material = material_of(state.body.preset);
    return state_of_shape(std::move(state), Shape{}, RunContext()).value();
}

Workbench::Workbench(State start) : impl_(std::make_unique<Impl>()) {
    connect(&document_, &Document::changed, this, &Workbench::follow_document);
    connect(&playback_, &Playback::moved, this, &Workbench::follow_playback);
    connect(&playback_, &Playback::state_changed, this, [this] {
        if (!playback_.has_body()) impl_->measured_pose = 0;
        if (mode_ == Mode::body && frame_count() == 0) set_mode(Mode::deform);
        Q_EMIT timeline_changed();
    });
    connect(&playback_, &Playback::stepped, this, [this] {
        if (!playback_.is_playing()) commit_recording("Simulate step by step", "step");
    });
    const auto tell = [this](const Error& error) { Q_EMIT told(QString::fromStdString(error.message), true); };
    connect(&playback_, &Playback::failed, this, tell);
    connect(&playback_, &Playback::failed, this, [this] {
        impl_->measured_pose = 0;
        commit_recording(); // what there was before
    });
    connect(&jobs_, &Jobs::failed, this, tell);
    const auto forget_plans = [this] {
        impl_->then = After::nothing;
        impl_->fits_driver.reset();
    };
    connect(&jobs_, &Jobs::failed, this, forget_plans);
    connect(&jobs_, &Jobs::cancelled, this, [this, forget_plans](const QString& title) {
        forget_plans();
        Q_EMIT told(title + ": cancelled.", false);
    });
    connect(&drag_, &HandleDrag::solved, this, &Workbench::show_drag);
    connect(&drag_, &HandleDrag::failed, this, [this, tell](const Error& error) {
        show_pose();
        tell(error);
    });
    connect(&view_, &ViewState::changed, this, [this] {
        const bool is_apart_anew =
            mode_ == Mode::deform && impl_->shown_apart != view_.settings().apart && state().source->pieces;
        if (is_apart_anew || std::exchange(impl_->shown_original, shows_original()) != shows_original()) show_pose();
    });
    connect(&impl_->replay, &QTimer::timeout, this, &Workbench::replay_frame);
    document_.replace(std::move(start));
}

Workbench::~Workbench() = default;

void Workbench::follow_document(const State& before) {
    const State& now = state();
    const bool is_same_motion =
        now.model == before.model && now.recording == before.recording && is_same_body(now.body, before.body);
    if (now.body.air_temperature != before.body.air_temperature)
        playback_.set_air_temperature(now.body.air_temperature);
    const bool keeps_motion = is_same_motion || is_of_body(now);
    if (!keeps_motion) {
        impl_->replay.stop();
        playback_.remove();
    }
    if (now.source != before.source) {
        inside_points_.clear();
        jobs_.drop(kSourceTopic); // of the mesh before
    }
    if (now.model != before.model) jobs_.drop(kModelTopic); // what is being made was meant for the one before
    drag_.stop();                                           // something else has changed meanwhile, an undo say
    if (!is_same_motion) frame_ = std::min(frame_, frame_count() > 0 ? frame_count() - 1 : 0);
    const bool leaves_body = mode_ == Mode::body && frame_count() == 0;
    if (leaves_body) {
        mode_ = Mode::deform;
        Q_EMIT mode_changed();
    }
    const bool is_same_shape = !leaves_body && now.model == before.model && now.warps == before.warps &&
                               now.handle_pose == before.handle_pose &&
                               (mode_ == Mode::deform || now.recording == before.recording || keeps_motion);
    if (!is_same_shape || now.restore != before.restore) show_pose();
    if (!is_same_motion) Q_EMIT timeline_changed();
    if (now.model != before.model && std::exchange(impl_->fits_driver, std::nullopt) == now.strip) make_body();
}

bool Workbench::is_of_body(const State& state) const {
    const auto& of = impl_->body_of;
    return playback_.has_body() && state.model == of.model && state.recording == of.recording &&
           is_same_body(state.body, of.settings);
}

void Workbench::show_pose() {
    const auto begin = std::chrono::steady_clock::now();
    pose_ = {};
    if (mode_ == Mode::deform) {
        pose_ = deformed_pose(state(), impl_->context);
        impl_->shown_apart = view_.settings().apart;
        if (is_apart()) {
            if (pose_.positions.empty()) pose_ = rest_pose(*state().model);
            // A gradient from positions would see the gaps.
            if (pose_.gradients.empty()) pose_.gradients.assign(pose_.positions.size(), Mat3f::Identity());
            move_apart(*state().source->pieces, impl_->shown_apart, pose_);
        }
    } else if (frame_count() > 0) {
        pose_ = recorded_pose(std::min(frame_, frame_count() - 1));
    }
    driver_milliseconds_ = milliseconds_since(begin);
    pose_is_new();
}

bool Workbench::is_apart() const { return mode_ == Mode::deform && impl_->shown_apart > 0 && state().source->pieces; }

void Workbench::pose_is_new() {
    const bool was_to_measure = is_to_measure();
    ++impl_->pose_number;
    if (was_to_measure && !wants_full_) ask_for_every_vertex(); // no more
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
        if (is_live_frame())
            full_ = playback_.moment()->full;
        else if (is_compared_with_original())
            full_ = state().recording->original->frames[frame_];
        return full_is_new();
    }
    if (is_pulling() || is_apart() || state().pose_from_file ||
        (state().handle_pose && state().model->vertex_count() > kMostPulledUnasked))
        return;
    const std::uint64_t number = impl_->pose_number;
    jobs_.start<std::vector<Vec3f>>(
        "Deforming every vertex", "full",
        [state = state()](const RunContext& context) { return full_deformation(state, context); },
        [this, number](std::vector<Vec3f> positions) {
            if (number != impl_->pose_number) return;
            full_ = std::move(positions);
            full_is_new();
        });
}

void Workbench::full_is_new() {
    Q_EMIT full_changed();
    if (!full_.empty() && view_.settings().coloring == &kErrorColors && !is_playing()) measure_error();
}

void Workbench::want_full(bool wanted) {
    if (wants_full_ == wanted) return;
    wants_full_ = wanted;
    ask_for_every_vertex();
    if (wanted)
        find_full();
    else
        full_.clear();
}

/// Each moment of the body tells every vertex while somebody needs them, the last one once more.
void Workbench::ask_for_every_vertex() {
    MomentWishes wishes = playback_.wishes();
    wishes.full = wants_full_ || is_to_measure();
    playback_.want(wishes);
}

bool Workbench::is_to_measure() const {
    return impl_->measured_pose != 0 && impl_->measured_pose == impl_->pose_number;
}

void Workbench::measure_error() {
    if (shows_original()) {
        if (!state().recording->fitted)
            return Q_EMIT told("This is the animation itself, which has no error.", false, "fit.make");
        view_.edit([](ViewSettings& settings) { settings.original = false; });
    }
    if (melt_surface())
        return Q_EMIT told("What has melted has no error: its surface is made of the particles. filigree simulate "
                           "--check measures the parts that are left.",
                           false);
    if (mode_ == Mode::body && !is_compared_with_original() && (!is_live_frame() || playback_.moment()->full.empty())) {
        if (!is_live_frame())
            return Q_EMIT told("The error of a recorded moment is only known while its body is there.", false,
                               "body.play");
        impl_->measured_pose = impl_->pose_number;
        return ask_for_every_vertex();
    }
    if (is_apart()) { // only pieces that are together have an error
        view_.edit([](ViewSettings& settings) { settings.apart = 0; });
        Q_EMIT told("The pieces were moved together, to be measured.", false);
    }
    const std::uint64_t number = impl_->pose_number;
    std::vector<Vec3f> full = mode_ == Mode::deform         ? full_
                              : is_compared_with_original() ? state().recording->original->frames[frame_]
                                                            : playback_.moment()->full;
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
            Result<VertexDistance> distance = restored_error(*state.model, state.restore, pose, full, context);
            if (!distance) return distance.error();
            return Measured{std::move(*distance), std::move(full)};
        },
        [this, number](Measured measured) {
            if (number != impl_->pose_number) return; // of a pose that is not shown any more
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
            const Result<Lattice> lattice = make_lattice(bounds(mesh), {.spacing = *spacing});
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
    const auto is_judging = [&] { return expected_error_.is_pending() && !is_playing(); };
    while (is_to_measure() || jobs_.is_busy() || drag_.is_busy() || is_judging())
        QCoreApplication::processEvents(QEventLoop::WaitForMoreEvents);
}

} // namespace filigree::studio
