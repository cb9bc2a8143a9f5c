// Files in and out.
#include "workbench_impl.h"

#include "motion_cameras.h"
#include "motion_file.h"
#include "pins.h"
#include "softness.h"
#include "words.h"

#include "filigree/blend/pose_mesh.h"
#include "filigree/file.h"
#include "filigree/io/animation/point_cache.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/model/model_file.h"
#include "filigree/io/system/file.h"
#include "filigree/io/system/numbered_name.h"
#include "filigree/pack.h"
#include "filigree/present/model_film.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

namespace filigree::studio {

namespace {

namespace fs = std::filesystem;

Error about(const std::string& path, const Error& error) {
    return error.code == ErrorCode::cancelled ? error : Error{error.code, about_file(path, error.message)};
}

/// A whole new state from a file, with settings as at the start.
Result<State> read_state(const std::string& path, const RunContext& context) {
    context.report("reading", 0);
    const Result<std::string> bytes = read_file(path_of(path));
    if (!bytes) return bytes.error();
    State state;
    MeshFile file; // of a model: its mesh alone
    if (is_model_file(*bytes)) {
        Result<Model> model = read_model(*bytes, path, context);
        if (!model) return model.error();
        Result<PoseSequence> poses = read_poses(*bytes, path, context);
        if (!poses) return poses.error();
        state.strip.base = model->driver().vertices.size();
        state.model = std::make_shared<const Model>(std::move(*model));
        if (poses->frames.size() == 1) { // a shape, not a motion
            state.handle_pose = std::make_shared<const Pose>(std::move(poses->frames[0]));
            state.pose_from_file = true;
        } else if (!poses->empty()) {
            auto recording = std::make_shared<Recording>();
            recording->follow(*poses);
            state.recording = std::move(recording);
        }
        file.mesh = level_mesh(*state.model, state.model->finest_level());
    } else if (is_gltf(*bytes)) {
        return gltf_state(path, 0, {}, context);
    } else {
        Result<MeshFile> read = read_mesh(*bytes, path, context);
        if (!read) return read.error();
        file = std::move(*read);
    }
    if (context.is_cancelled()) return cancelled_error();
    auto source = source_of(std::move(file.mesh), path, file_name(path).toStdString(), context);
    source->warnings = std::move(file.warnings);
    source->warnings.insert(source->warnings.end(), source->materials.warnings.begin(),
                            source->materials.warnings.end());
    state.softness = softness_in(source->mesh);
    state.source = std::move(source);
    if (!state.model) return stripped_state(std::move(state), context);
    state.restore.level = state.model->finest_level();
    return state;
}

constexpr std::uint64_t kSmallStream = 1 << 18; ///< bytes: it is read at once
constexpr std::size_t kFirstLook = 30'000;      ///< vertices

/// Feeds the next bytes of a stream; false: there are none, or it is no stream.
bool feed(ModelStream& stream, const FileReader& file, std::uint64_t& offset) {
    std::string bytes(std::min<std::uint64_t>(1 << 16, file.size() - offset), '\0');
    if (bytes.empty() || !file.read(offset, bytes) || !stream.feed(bytes)) return false;
    offset += bytes.size();
    return true;
}

/// Whether a file is a stream that is better looked at before all of it is read.
bool is_large_stream(const std::string& path) {
    const Result<FileReader> file = FileReader::open(path_of(path));
    ModelStream stream(path);
    std::uint64_t offset = 0;
    return file && file->size() > kSmallStream && feed(stream, *file, offset);
}

/// The first levels of a stream, stripped. None: they are damaged, which reading all of it will tell.
Result<std::optional<State>> first_look(const std::string& path, const BodySettings& body, const RunContext& context) {
    context.report("reading", 0);
    const Result<FileReader> file = FileReader::open(path_of(path));
    ModelStream stream(path);
    Mesh mesh;
    std::size_t levels = 0;
    for (std::uint64_t offset = 0; file && mesh.vertex_count() < kFirstLook && feed(stream, *file, offset);) {
        if (context.is_cancelled()) return cancelled_error();
        if (std::exchange(levels, stream.level_count()) != stream.level_count()) mesh = stream.mesh();
    }
    if (mesh.face_count() == 0) return std::optional<State>();
    State state;
    state.body = body;
    state.source = source_of(std::move(mesh), path, file_name(path).toStdString(), context);
    Result<State> stripped = stripped_state(std::move(state), context);
    if (!stripped && stripped.error().code == ErrorCode::cancelled) return stripped.error();
    return stripped ? std::optional<State>(std::move(*stripped)) : std::nullopt;
}

/// What was opened, in a sentence.
QString opened_text(const State& state) {
    const Mesh& mesh = state.source->mesh;
    QString text =
        QString("%1: %2, %3; driver of %4")
            .arg(QString::fromStdString(state.source->name), counted(mesh.vertex_count(), "vertex", "vertices"),
                 counted(mesh.face_count(), "face", "faces"), with_commas(state.model->driver().vertices.size()));
    if (state.recording && state.recording->original)
        text += ", " + counted(state.recording->frames.size(), "frame", "frames");
    else if (state.recording)
        text += ", " + counted(state.recording->frames.size(), "recorded frame", "recorded frames");
    text += '.';
    if (!state.source->contents.empty())
        text += " The file has " + QString::fromStdString(state.source->contents) + '.';
    if (state.recording && state.recording->original)
        text += QString(" Play shows '%1'. Fit makes a small model of it%2.")
                    .arg(QString::fromStdString(state.recording->original->clips[state.recording->original->clip]),
                         state.recording->original->joints.empty() ? "" : "; Flesh makes it soft");
    if (!state.source->warnings.empty()) {
        text += ' ' + QString::fromStdString(state.source->warnings[0]);
        if (const std::size_t more = state.source->warnings.size() - 1; more > 0)
            text += QString(" (and %1)").arg(counted(more, "more warning", "more warnings"));
    }
    return text;
}

/// The level as the pose puts it.
Result<Mesh> posed_mesh(const State& state, const Pose& pose, const RunContext& context) {
    if (pose.positions.empty()) return level_mesh(*state.model, state.level());
    const Result<Restorer> restorer = Restorer::create(*state.model, state.restore, context);
    if (!restorer) return restorer.error();
    return restorer->mesh(pose, context);
}

bool is_deformed(const State& state) { return !state.warps.none() || state.handle_pose; }

/// What of the shape is not there when the model is opened again: a model file holds one motion or one pose. The law
/// and settings are how it is shown.
std::vector<QString> lost_with_model(const State& state) {
    std::vector<QString> result;
    if (state.recording && !state.recording->has_poses()) result.push_back("the animation");
    if (state.recording && state.recording->has_poses() && is_deformed(state)) result.push_back("the deformation");
    if (has_pins(state.handles)) result.push_back("the pins");
    return result;
}

/// Returns what to tell. source: the file that the mesh came from; "" for none.
Result<QString> write_told(const Mesh& mesh, const std::string& path, const RunContext& context,
                           const std::string& source = {}) {
    const Result<std::vector<std::string>> warnings =
        write_mesh(mesh, path_of(path), {.materials_beside = path_of(source)}, context);
    if (!warnings) return warnings.error();
    QString text = QString("Saved %1: %2, %3.")
                       .arg(file_name(path), counted(mesh.vertex_count(), "vertex", "vertices"),
                            counted(mesh.face_count(), "face", "faces"));
    for (const std::string& warning : *warnings) text += ' ' + QString::fromStdString(warning);
    return text;
}

/// Of a file that was written. Numbered files: of all, the folder alone.
QString size_and_folder(const std::string& path) {
    std::error_code none;
    const fs::path whole = fs::absolute(path_of(path), none);
    const std::uintmax_t bytes = fs::file_size(whole, none);
    const QString folder = QString::fromStdString(whole.parent_path().string());
    return none ? QString(" Folder: %1.").arg(folder) : QString(" %1, in %2.").arg(size_text(bytes), folder);
}

/// All or none.
Result<QString> write_frames(const State& state, const Recording& poses, const NumberedName& name,
                             const RunContext& context) {
    const Result<Restorer> restorer = Restorer::create(*state.model, state.restore, context);
    if (!restorer) return restorer.error();
    RunContext quiet = context; // the progress is that of the frames
    quiet.progress = nullptr;
    const auto mesh = [&](std::size_t frame) -> Result<Mesh> {
        if (const auto surface = poses.surface(frame)) return *surface;
        return restorer->mesh(*poses.frames[frame], quiet);
    };
    const NumberedMeshes meshes{name, {poses.frames.size(), poses.frames_per_second, mesh}};
    const auto warnings = write_numbered_meshes(std::span(&meshes, 1), context);
    if (!warnings) return warnings.error();
    QString text = QString("Saved %1 to %2.")
                       .arg(counted(poses.frames.size(), "mesh", "meshes"), file_name(name.file(1).string()));
    for (const std::string& warning : *warnings) text += ' ' + QString::fromStdString(warning);
    return text;
}

} // namespace

std::vector<std::string> existing_outputs(const std::string& pattern, std::size_t frames) {
    std::vector<std::string> result;
    const auto add = [&](const std::string& path) {
        std::error_code ignored;
        if (fs::exists(path_of(path), ignored)) result.push_back(path);
    };
    const std::optional<NumberedName> numbered = printf_numbered_name(path_of(pattern));
    if (!numbered) add(pattern);
    for (std::size_t frame = 1; numbered && frame <= frames; ++frame) add(numbered->file(frame).string());
    return result;
}

void Workbench::open(const std::string& path) {
    if (is_point_cache(path)) return open_motion(path);
    pause();
    forget_measuring();
    jobs_.drop(kModelTopic);
    jobs_.drop(kSourceTopic);
    jobs_.drop(kFitTopic);
    if (!is_large_stream(path)) return open_whole(path, nullptr);
    jobs_.start<std::optional<State>>(
        "Opening " + file_name(path), kOpenTopic,
        [path, body = state().body](const RunContext& context) { return first_look(path, body, context); },
        [this, path, id = document_.state_id()](std::optional<State> look) {
            if (look && document_.state_id() == id) {
                replace_document(std::move(*look));
                set_mode(Mode::deform);
                Q_EMIT told("A first look at " + file_name(path) + "; the rest is being read.", false);
            }
            open_whole(path, look ? state().source : nullptr);
        });
}

void Workbench::open_whole(const std::string& path, std::shared_ptr<const Source> look) {
    jobs_.start<State>(
        "Opening " + file_name(path), kOpenTopic,
        [path, body = state().body](const RunContext& context) -> Result<State> {
            Result<State> state = read_state(path, context);
            if (!state) return about(path, state.error());
            state->body = body;
            return state;
        },
        [this, path, look, id = document_.state_id()](State state) {
            if (is_pulling()) end_pull();
            pause();
            const State& now = this->state();
            const bool is_warped_look = look && now.source == look && now.handles.empty() && !now.recording;
            if (document_.state_id() != id && !is_warped_look)
                return Q_EMIT told("The document was changed while " + file_name(path) + " was read; open it again.",
                                   true, "file.open");
            if (is_warped_look) state.warps = now.warps;
            const QString text = opened_text(state);
            const bool has_motion = state.recording != nullptr;
            if (look)
                document_.replace(std::move(state)); // seen from where the first look was
            else
                replace_document(std::move(state));
            if (!look || has_motion) set_mode(has_motion ? Mode::body : Mode::deform);
            Q_EMIT told(text, false, can_fit() ? "panel.fit" : "");
        },
        {.is_urgent = look != nullptr});
}

void Workbench::replace_document(State state) {
    if (is_pulling()) end_pull();
    pause();
    frame_ = 0;
    document_.replace(std::move(state));
    Q_EMIT opened();
}

void Workbench::save(const QString& title, const std::string& path,
                     std::function<Result<QString>(const RunContext&)> work, std::function<void()> then) {
    jobs_.start<QString>(
        title, {},
        [path, work = std::move(work)](const RunContext& context) -> Result<QString> {
            Result<QString> text = work(context);
            if (!text) return about(path, text.error());
            return text;
        },
        [this, path, then = std::move(then)](const QString& text) {
            if (then) then();
            Q_EMIT told(text + size_and_folder(path), false);
        });
}

std::vector<QString> Workbench::left_out_of_model() const { return lost_with_model(state()); }

void Workbench::save_model(const std::string& path) {
    commit_recording();
    const std::uint64_t id = document_.state_id();
    const bool is_whole = lost_with_model(state()).empty();
    QString sentence = "Saved " + file_name(path);
    if (state().recording && state().recording->has_poses())
        sentence += " with its recording";
    else if (is_deformed(state()))
        sentence += " as it is deformed";
    if (const std::vector<QString> left_out = left_out_of_model(); !left_out.empty())
        sentence += ", without " + listed(left_out);
    sentence += '.';
    save(
        "Saving " + file_name(path), path,
        [path, state = state(), sentence](const RunContext& context) -> Result<QString> {
            PoseSequence poses;
            Pose pose = deformed_pose(state, context);
            if (state.recording && state.recording->has_poses())
                poses = state.recording->poses();
            else if (!pose.positions.empty())
                poses.frames.push_back(std::move(pose));
            std::optional<Model> painted; // that has the softness among its scalars
            if (softness_of(state)) {
                painted = *state.model;
                painted->mesh = with_softness(std::move(painted->mesh), state);
            }
            const Status status = write_model(painted ? *painted : *state.model, poses, path_of(path), context);
            if (!status) return status.error();
            return sentence;
        },
        [this, id, path, is_whole] {
            if (is_whole && document_.state_id() == id) document_.set_saved();
            Q_EMIT saved(path);
        });
}

void Workbench::save_mesh(const std::string& path) {
    save("Saving " + file_name(path), path,
         [path, state = state(), pose = pose_, melt = melt_surface()](const RunContext& context) -> Result<QString> {
             const Result<Mesh> mesh = melt ? Result<Mesh>(*melt) : posed_mesh(state, pose, context);
             if (!mesh) return mesh.error();
             const bool is_whole = !melt && state.level() == state.model->finest_level();
             return write_told(is_whole ? with_softness(*mesh, state) : *mesh, path, context,
                               state.source ? state.source->path : "");
         });
}

void Workbench::save_driver(const std::string& path) {
    save("Saving " + file_name(path), path, [path, model = state().model, pose = pose_](const RunContext& context) {
        return write_told(pose.positions.empty() ? driver_mesh(*model) : posed_driver(*model, pose), path, context);
    });
}

void Workbench::export_meshes(const std::string& pattern) {
    const std::optional<NumberedName> name = printf_numbered_name(path_of(pattern));
    if (!name)
        return Q_EMIT told(QString::fromStdString(pattern) + ": needs one place for the frame's number, such as %04d "
                                                             "in frame_%04d.obj.",
                           true);
    commit_recording();
    if (is_refused_without_poses()) return;
    save("Exporting meshes", pattern, [state = state(), name = *name](const RunContext& context) {
        return write_frames(state, *state.recording, name, context);
    });
}

void Workbench::export_film(const std::string& path, const FilmSettings& settings) {
    commit_recording();
    if (state().recording && is_refused_without_poses()) return;
    const ViewSettings& view = view_.settings();
    auto film = std::make_shared<ModelFilm>();
    film->model = state().model;
    film->restore = state().restore;
    film->surface.materials = state().source->materials.materials;
    film->look.edges = view.style != SurfaceStyle::shaded;
    film->look.surface = view.style != SurfaceStyle::wireframe;
    if (state().recording) film->poses = state().recording->poses();
    film->pose = pose_;
    if (state().recording) film->surfaces = state().recording->surfaces;
    if (playback_.has_body()) film->surroundings = playback_.made()->surroundings;
    film->camera = view_.camera();
    if (view.follow && frame_count() > 1)
        film->cameras =
            motion_cameras(*this, 0, frame_count(), view_.camera(), double(settings.width) / settings.height);
    film->up = view.up;
    film->ground = view.ground;
    film->width = settings.width;
    film->height = settings.height;
    film->passes = settings.passes;
    const auto draw = [path, film, view, source = state().source](const RunContext& context) -> Result<QString> {
        const Result<std::size_t> frames = film_model(*film, path, context);
        if (!frames) return frames.error();
        QString text = QString("Saved %1: %2.").arg(file_name(path), counted(*frames, "picture", "pictures"));
        std::vector<QString> left_out;
        if (view.coloring != &kOwnColors) left_out.push_back("colouring");
        if (view.clip) left_out.push_back("the clip plane");
        if (view.split) left_out.push_back("the split view");
        if (view.particles || view.inside_points) left_out.push_back("points");
        return left_out.empty() ? text : text + " Films are without " + listed(left_out) + '.';
    };
    save("Exporting " + file_name(path), path, draw);
}

} // namespace filigree::studio
