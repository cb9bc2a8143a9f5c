// Animations of other programs, and drivers that are fitted to them.
#include "workbench_impl.h"

#include "fitting.h"
#include "fleshing.h"
#include "motion_file.h"
#include "words.h"

namespace filigree::studio {

const FitSettings& Workbench::fit_settings() const { return impl_->fit_settings; }

void Workbench::set_fit_settings(const FitSettings& settings) {
    if (settings == impl_->fit_settings) return;
    const bool is_another_rate = settings.frames_per_second != impl_->fit_settings.frames_per_second;
    impl_->fit_settings = settings;
    Q_EMIT fit_settings_changed();
    if (!can_fit()) return;
    const MovingMesh& original = *state().recording->original;
    if (is_another_rate && original.frames_per_second != settings.frames_per_second)
        open_motion(original.path, original.clip);
    else if (!is_another_rate && (state().recording->fitted || jobs_.is_pending(kFitTopic)))
        fit(); // the newest error replaces the one in progress
}

bool Workbench::shows_original() const {
    const auto& recording = state().recording;
    if (mode_ != Mode::body || playback_.has_body() || !recording || !recording->original) return false;
    return !recording->fitted || view_.settings().original;
}

bool Workbench::is_compared_with_original() const {
    const auto& recording = state().recording;
    return mode_ == Mode::body && !playback_.has_body() && recording && recording->original && recording->fitted;
}

std::shared_ptr<const Mesh> Workbench::original_surface() const {
    const auto& of = state().recording->original;
    auto& kept = impl_->original;
    if (kept.of == of && kept.frame == frame_ && kept.mesh) return kept.mesh;
    auto mesh = std::make_shared<Mesh>(state().source->mesh);
    mesh->positions = of->frames[std::min(frame_, of->frames.size() - 1)];
    mesh->normals = {}; // of the shape at rest
    kept = {of, frame_, std::move(mesh)};
    return kept.mesh;
}

/// Tells why a recording cannot leave.
bool Workbench::is_refused_without_poses() {
    if (!state().recording) {
        Q_EMIT told("There is nothing recorded yet.", true, "body.play");
        return true;
    }
    if (state().recording->has_poses()) return false;
    Q_EMIT told("The animation moves its mesh alone: fit a driver to it first.", true, "fit.make");
    return true;
}

void Workbench::open_motion(const std::string& path, std::size_t clip) {
    pause();
    forget_measuring();
    for (const std::string& topic : {kModelTopic, kSourceTopic, kFitTopic}) jobs_.drop(topic);
    struct Opened {
        State state;
        std::vector<std::string> warnings;
    };
    const bool is_cache = is_point_cache(path);
    jobs_.start<Opened>(
        "Opening " + file_name(path), kOpenTopic,
        [path, clip, is_cache, now = state(),
         rate = impl_->fit_settings.frames_per_second](const RunContext& context) -> Result<Opened> {
            const auto about = [&](const Error& error) {
                return error.code == ErrorCode::cancelled ? error : Error{error.code, about_file(path, error.message)};
            };
            Opened opened;
            if (is_cache) {
                auto recording = cache_recording(path, now, rate, opened.warnings, context);
                if (!recording) return about(recording.error());
                opened.state = now;
                opened.state.recording = std::move(*recording);
                return opened;
            }
            const Error still = {ErrorCode::unsuitable, "has no animation: open an animated glTF (.glb, .gltf), a "
                                                        "point cache (.pc2, .mdd), or one of several numbered meshes."};
            if (!is_numbered(path) && !is_gltf_file(path)) return about(still);
            Result<State> state =
                is_numbered(path) ? numbered_state(path, rate, context) : gltf_state(path, clip, rate, context);
            if (!state) return about(state.error());
            if (!state->recording) return about(still);
            state->body = now.body;
            opened.state = std::move(*state);
            opened.warnings = opened.state.source->warnings;
            return opened;
        },
        [this, path, is_cache, id = document_.state_id()](Opened opened) {
            if (document_.state_id() != id)
                return Q_EMIT told("The document was changed while " + file_name(path) + " was read; open it again.",
                                   true, "fit.open");
            const Recording& recording = *opened.state.recording;
            QString text = QString("%1: %2 of %3, %4 a second.")
                               .arg(file_name(path), counted(recording.frames.size(), "frame", "frames"),
                                    counted(opened.state.source->mesh.vertex_count(), "vertex", "vertices"),
                                    number_text(recording.frames_per_second));
            for (const std::string& warning : opened.warnings) text += ' ' + QString::fromStdString(warning);
            frame_ = 0;
            if (is_cache) {
                document_.change("Open " + file_name(path), std::move(opened.state));
                Q_EMIT opened_motion();
            } else {
                replace_document(std::move(opened.state));
            }
            set_mode(Mode::body);
            show_pose();
            Q_EMIT timeline_changed();
            Q_EMIT told(text, false, "fit.make");
        });
}

bool Workbench::can_fit() const {
    const auto& recording = state().recording;
    return recording && recording->original && !(recording->fitted && recording->fitted->flesh);
}

bool Workbench::can_make_flesh() const {
    const auto& recording = state().recording;
    return recording && recording->original && !recording->original->joints.empty();
}

const FleshSettings& Workbench::flesh_settings() const { return impl_->flesh_settings; }

void Workbench::set_flesh_settings(const FleshSettings& settings) {
    if (settings == impl_->flesh_settings) return;
    impl_->flesh_settings = settings;
    Q_EMIT flesh_settings_changed();
}

void Workbench::fit() {
    if (!can_fit()) return Q_EMIT told("There is no animation to follow.", true, "fit.open");
    change_motion(
        "Fitting", "Fit",
        [error = impl_->fit_settings.error](State state, const RunContext& context) {
            return fitted_state(std::move(state), error, context);
        },
        fit_summary);
}

void Workbench::make_flesh() {
    if (!can_make_flesh()) return Q_EMIT told("There is no skin with joints to make flesh of.", true, "fit.open");
    change_motion(
        "Making flesh", "Make flesh",
        [settings = impl_->flesh_settings](State state, const RunContext& context) {
            return fleshed_state(std::move(state), settings, context);
        },
        flesh_summary);
}

void Workbench::show_clip(std::size_t clip) {
    const auto recording = state().recording;
    if (!recording || !recording->original || recording->original->clip == clip) return;
    if (!recording->clips) return open_motion(recording->original->path, clip);
    if (is_refused(kOpenTopic, "A file is being opened: go on once it is there, or cancel.")) return;
    pause();
    const auto other = recording_of_clip(recording->clips, clip);
    const QString name = QString::fromStdString(recording->original->clips[clip]);
    if (!other) {
        Q_EMIT flesh_settings_changed(); // the choice shows the clip that stays
        return Q_EMIT told(QString("Clip '%1' is a single pose and has no flesh.").arg(name), true);
    }
    document_.edit("Clip " + name, [&](State& state) { state.recording = other; });
    frame_ = 0;
    show_pose();
    Q_EMIT timeline_changed();
}

/// A driver and its poses in place of the recording there is, in the background.
void Workbench::change_motion(const QString& title, const QString& name,
                              std::function<Result<State>(State, const RunContext&)> make,
                              std::function<QString(const Recording&)> summary) {
    if (is_refused(kOpenTopic, "A file is being opened: go on once it is there, or cancel.")) return;
    pause();
    jobs_.start<State>(
        title, kFitTopic,
        [state = state(), make = std::move(make)](const RunContext& context) { return make(state, context); },
        [this, name, recording = state().recording, summary = std::move(summary)](const State& made) {
            if (state().recording != recording) return; // of another animation
            State next = state();
            next.source = made.source;
            next.model = made.model;
            next.strip = made.strip;
            next.restore.level = made.model->finest_level();
            next.handles.clear();
            next.handle_pose = nullptr;
            next.pose_from_file = false;
            next.recording = made.recording;
            const std::size_t frame = frame_;
            document_.change(name, std::move(next));
            view_.edit([](ViewSettings& settings) { settings.original = false; });
            frame_ = std::min(frame, frame_count() - 1);
            set_mode(Mode::body);
            show_pose();
            Q_EMIT timeline_changed();
            Q_EMIT told(summary(*state().recording), false);
        });
}

void Workbench::save_packed(const std::string& path) {
    if (!state().recording || !state().recording->fitted)
        return Q_EMIT told("Nothing is fitted yet.", true, "fit.make");
    save("Saving " + file_name(path), path,
         [path, fitted = state().recording->fitted](const RunContext&) -> Result<QString> {
             if (const Status written = write_file(path_of(path), fitted->packed); !written) return written.error();
             return QString("Saved %1: packed, %2 of the diagonal off (rms).")
                 .arg(file_name(path), number_text(fitted->packed_rms, 2));
         });
}

} // namespace filigree::studio
