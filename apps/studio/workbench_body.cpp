// The body, what it does, and the recording of that.
#include "workbench_impl.h"

#include "pins.h"
#include "softness.h"
#include "words.h"

#include "filigree/scene/body_driver.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace filigree::studio {

namespace {

QString warning_of(const DroppedBody& made) {
    QString text = QString::fromStdString(made.report.warning);
    if (!made.coarse_driver) return text;
    if (!text.isEmpty()) text += ' ';
    return text + QString::fromStdString(made.coarse_driver->sentence()) + ".";
}

} // namespace

void Workbench::set_body(const BodySettings& settings, const std::string& merge) {
    if (settings == state().body) return;
    if (is_same_body(settings, state().body)) // the air changes around it
        return document_.edit(
            name_of_change(state().body, settings), [&](State& next) { next.body = settings; }, merge);
    const bool had_body = playback_.has_body(), was_playing = is_playing();
    if (had_body) pause();
    if (had_body) impl_->body_of = {state().model, settings, nullptr}; // it stays until the new one is there
    document_.edit(
        name_of_change(state().body, settings),
        [&](State& next) {
            next.body = settings;
            if (had_body) next.recording = nullptr; // of another body
        },
        merge);
    if (had_body)
        make_body_then(was_playing ? After::play : After::nothing);
    else if (jobs_.is_pending(kBodyTopic))
        make_body_then(impl_->then);
}

void Workbench::make_body() { make_body_then(After::nothing); }

void Workbench::paint_softness(Index vertex, double radius, bool takes_away) {
    const Mesh& mesh = state().source->mesh;
    if (vertex >= mesh.vertex_count()) return;
    const auto before = softness_of(state());
    std::vector<float> values =
        painted(mesh, before ? *before : std::vector<float>(mesh.vertex_count()), vertex, radius, takes_away);
    if (before && values == *before) return;
    document_.edit(
        "Paint softness",
        [&](State& next) { next.softness = std::make_shared<const std::vector<float>>(std::move(values)); },
        "softness");
}

void Workbench::set_softness(std::shared_ptr<const std::vector<float>> softness) {
    document_.edit(
        "Softness", [&](State& next) { next.softness = std::move(softness); }, "softness");
}

void Workbench::end_painting() {
    document_.end_merge();
    if (playback_.has_body()) Q_EMIT told("The body is so soft once it is made again.", false, "body.make");
}

namespace {

constexpr double kBeyond = 60; // K that air is warmer than the melt, or colder than what it freezes to

} // namespace

bool Workbench::can_melt() const {
    const Material& material = state().body.material;
    return material.model == MaterialModel::mpm && material.melts();
}

void Workbench::set_air(double kelvins) {
    BodySettings body = state().body;
    body.air_temperature = std::max(kelvins, 1.0);
    set_body(body);
    if (!is_playing()) play();
}

void Workbench::melt() { set_air(state().body.material.melting_to + kBeyond); }
void Workbench::freeze() { set_air(state().body.material.melting_from - kBeyond); }

void Workbench::hold_torch(const Vec3d& at, bool cools) {
    const auto made = playback_.made();
    const bool is_there = mode_ == Mode::body && made && filigree::can_melt(*made);
    if (!is_there) {
        if (!std::exchange(impl_->told_of_torch, true))
            Q_EMIT told("The torch is for a body that melts, such as one of wax, chocolate, butter, ice or lava.",
                        false, "body.wax");
        return;
    }
    impl_->replay.stop();
    show_last_frame();
    playback_.hold_torch(at - made->model->mesh.origin, view_.torch(cools));
}

void Workbench::put_out_torch() {
    impl_->told_of_torch = false;
    playback_.put_out_torch();
}

std::shared_ptr<const Mesh> Workbench::melt_surface() const {
    if (mode_ != Mode::body) return nullptr;
    if (shows_original()) return original_surface();
    if (!playback_.has_body()) return state().recording ? state().recording->surface(frame_) : nullptr;
    return playback_.surface(std::min(frame_, playback_.recording().frames.size() - 1));
}

void Workbench::want_temperatures(bool wanted) {
    MomentWishes wishes = playback_.wishes();
    if (std::exchange(wishes.temperatures, wanted) != wanted) playback_.want(wishes);
}

void Workbench::fit_driver() {
    if (!playback_.has_body()) return;
    pause();
    impl_->fits_driver = body_driver_options(state().model->mesh, *playback_.made()->body);
    set_strip(*impl_->fits_driver);
}

QString Workbench::body_warning() const { return playback_.has_body() ? impl_->body_warning : QString(); }

void Workbench::make_body_then(After then) {
    impl_->then = then;
    const auto up_axis = view_.settings().up;
    using Made =
        Result<std::shared_ptr<const DroppedBody>>; // an error is delivered too: no body fits the settings then
    jobs_.start<Made>(
        "Making the body", kBodyTopic,
        [state = state(), up_axis](const RunContext& context) -> Result<Made> {
            Made made = make_body_of(state, up_vector(up_axis), context);
            if (!made && made.error().code == ErrorCode::cancelled) return made.error();
            return Result<Made>(std::move(made));
        },
        [this, model = state().model, settings = state().body, pinned = pinned_vertices(state().handles),
         up_axis](const Made& made) {
            if (model != state().model || !(settings == state().body) || pinned != pinned_vertices(state().handles) ||
                up_axis != view_.settings().up) {
                impl_->then = After::nothing;
                Q_EMIT told("The body was not made: what it is made of was changed meanwhile.", false);
                return;
            }
            if (made) return put_body(*made);
            impl_->then = After::nothing;
            playback_.remove();
            if (mode_ == Mode::body && frame_count() == 0) set_mode(Mode::deform);
            Q_EMIT told("No body can be made of this: " + QString::fromStdString(made.error().message), true);
        });
}

void Workbench::put_body(std::shared_ptr<const DroppedBody> made) {
    const After then = std::exchange(impl_->then, After::nothing);
    impl_->replay.stop();
    const QString warned = std::exchange(impl_->body_warning, warning_of(*made));
    if (!warned.isEmpty() && warned != impl_->body_warning) Q_EMIT withdrawn(warned);
    frame_ = 0;
    impl_->body_of = {state().model, state().body, nullptr};
    playback_.put(made);
    document_.edit("Make a body", [](State& next) { next.recording = nullptr; });
    set_mode(Mode::body);
    show_pose();
    Q_EMIT timeline_changed();
    if (!body_warning().isEmpty()) Q_EMIT told(body_warning(), false, made->coarse_driver ? "body.fit_driver" : "");
    const bool is_deformed = !state().warps.none() || state().handle_pose;
    if (is_deformed && !std::exchange(impl_->told_of_rest, true))
        Q_EMIT told("A body is made of the shape at rest, without its deformation.", false);
    if (then == After::play) play();
    if (then == After::step) step();
}

void Workbench::set_mode(Mode mode) {
    if (mode == mode_) return;
    if (is_pulling()) end_pull();
    if (mode == Mode::deform) pause();
    mode_ = mode;
    Q_EMIT mode_changed();
    show_pose();
    Q_EMIT timeline_changed();
}

const Pose& Workbench::recorded_pose(std::size_t frame) const {
    return playback_.has_body() ? playback_.recording().frames[frame] : *state().recording->frames[frame];
}
std::size_t Workbench::frame_count() const {
    if (playback_.has_body()) return playback_.recording().frames.size();
    return state().recording ? state().recording->frames.size() : 0;
}
double Workbench::frames_per_second() const {
    if (playback_.has_body()) return playback_.recording().frames_per_second;
    return state().recording ? state().recording->frames_per_second : 60;
}
std::size_t Workbench::frame() const { return frame_; }
bool Workbench::is_playing() const { return playback_.is_playing() || impl_->replay.isActive(); }
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
    impl_->replay.start(int(std::lround(std::clamp(1000 / frames_per_second(), 1.0, 10'000.0))));
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
    impl_->replay.stop();
    playback_.play();
    Q_EMIT timeline_changed();
}

void Workbench::pause() {
    const bool was_playing = is_playing();
    impl_->replay.stop();
    playback_.pause();
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
    playback_.step();
}

void Workbench::reset() {
    impl_->replay.stop();
    playback_.pause();
    commit_recording();
    frame_ = 0;
    impl_->body_of.recording = nullptr;
    playback_.reset();
    document_.edit("Reset the body", [](State& next) { next.recording = nullptr; });
    if (mode_ == Mode::body && frame_count() == 0) return set_mode(Mode::deform);
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
    if (body != state().body)
        document_.edit("Animate", [&](State& next) {
            next.body = body;
            next.recording = nullptr;
        });
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

Box Workbench::motion_box(std::size_t frame) const {
    const Vec3d origin = state().model->mesh.origin;
    const auto surface = playback_.has_body() ? playback_.surface(frame) : state().recording->surface(frame);
    const bool moves_itself = !playback_.has_body() && !state().recording->has_poses();
    Box box = bounds(moves_itself ? state().recording->original->frames[frame]
                     : surface    ? surface->positions
                                  : recorded_pose(frame).positions);
    if (!surface && !moves_itself) {
        const Box rest = bounds(state().model->mesh.positions), driver = bounds(driver_positions(*state().model));
        const double margin = std::max((driver.min - rest.min).maxCoeff(), (rest.max - driver.max).maxCoeff());
        box.min -= Vec3d::Constant(std::max(margin, 0.0));
        box.max += Vec3d::Constant(std::max(margin, 0.0));
    }
    box.min += origin;
    box.max += origin;
    return box;
}

void Workbench::show_last_frame() {
    if (frame_ + 1 == frame_count()) return;
    frame_ = frame_count() - 1;
    show_pose();
    Q_EMIT timeline_changed();
}

void Workbench::follow_playback() {
    const Moment& moment = *playback_.moment();
    const bool is_another = std::exchange(impl_->looked_at, moment.frame) != moment.frame;
    if (mode_ != Mode::body) return;
    if (!is_another && frame_ != moment.frame) return; // looked at once more, for its vertices, and not shown
    frame_ = std::min(moment.frame, frame_count() - 1);
    if (is_another || pose_.positions != moment.pose.positions || pose_.gradients != moment.pose.gradients) {
        pose_ = moment.pose;
        driver_milliseconds_ = moment.milliseconds;
        pose_is_new();
        Q_EMIT timeline_changed();
    } else if (wants_full_ && !moment.full.empty()) { // the same once more, now with every vertex
        full_ = moment.full;
        full_is_new();
    }
    if (is_to_measure() && !moment.full.empty()) {
        impl_->measured_pose = 0;
        if (!wants_full_) ask_for_every_vertex(); // no more
        measure_error();
    }
}

/// What was simulated becomes part of the document. The frames that the document has already are shared.
void Workbench::commit_recording(const QString& name, const std::string& merge) {
    if (!playback_.has_body()) return;
    const std::size_t count = playback_.recording().frames.size();
    if (count <= (state().recording ? state().recording->frames.size() : 1)) return;
    auto recording =
        state().recording ? std::make_shared<Recording>(*state().recording) : std::make_shared<Recording>();
    recording->follow(playback_.recording(), playback_.surfaces());
    State next = state();
    next.recording = impl_->body_of.recording = std::move(recording);
    if (name.isEmpty()) // play and pause over and over are one step
        document_.change("Simulate " + counted(count - 1, "frame", "frames"), std::move(next), "play");
    else
        document_.change(name, std::move(next), merge);
}

} // namespace filigree::studio
