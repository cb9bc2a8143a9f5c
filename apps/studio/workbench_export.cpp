// The recording as an animation for other programs.
#include "workbench_impl.h"

#include "words.h"

#include "filigree/file.h"

#include <algorithm>
#include <filesystem>

namespace filigree::studio {

namespace {

constexpr double kMoltenKeys = 10; ///< a second, where nothing else is asked for: each is a whole mesh

FrameSource<Pose> poses_of(const Recording& recording) {
    return {recording.frames.size(), recording.frames_per_second,
            [&recording](std::size_t frame) -> Result<Pose> { return *recording.frames[frame]; }};
}

/// The mesh as it stands in the file's own words.
QString skin_text(const ExportReport& report) {
    QString text = QString("%1 joints, %2 in %3 s, %4 of the diagonal off at most at keys")
                       .arg(with_commas(report.joints), counted(report.keys, "key", "keys"),
                            number_text(report.seconds), number_text(report.error_at_keys, 2));
    if (report.error_between_keys > 0)
        text += QString(" and %1 between them").arg(number_text(report.error_between_keys, 2));
    return text + '.';
}

QString with_warnings(QString text, const std::vector<std::string>& warnings) {
    for (const std::string& warning : warnings) text += ' ' + QString::fromStdString(warning);
    return text;
}

Result<QString> write_skin(const State& state, const GlbSettings& settings, const std::string& path,
                           const RunContext& context) {
    SkinOptions options;
    options.restore = state.restore;
    if (settings.keys > 0) options.key_rate = std::min(settings.keys, state.recording->frames_per_second);
    options.compress = settings.compress;
    options.all_levels = settings.all_levels;
    options.influences = settings.six_joints ? 6 : 3;
    options.normals = settings.normals ? ExportNormals::keep : ExportNormals::leave;
    options.materials_beside = path_of(state.source->path);
    auto clips = state.recording->clips;
    if (clips && state.model.get() != &clips->fitted.model) clips = nullptr; // the driver was made anew
    const Result<ExportReport> report =
        clips ? write_skin_glb(clips->fitted.model, clips->fitted.animations(), clips->fitted.morphs, options,
                               path_of(path), context)
              : write_skin_glb(*state.model, poses_of(*state.recording), options, path_of(path), context);
    if (!report) return report.error();
    const QString count = clips ? counted(clips->clips.size(), "clip", "clips") + ", " : QString();
    return with_warnings(QString("Saved %1: %2%3").arg(file_name(path), count, skin_text(*report)), report->warnings);
}

/// What melts has other faces in every frame: key frames, each a mesh of its own.
Result<QString> write_melt(const State& state, const GlbSettings& settings, const std::string& path,
                           const RunContext& context) {
    const Result<Restorer> restorer = Restorer::create(*state.model, state.restore, context);
    if (!restorer) return restorer.error();
    const Recording& recording = *state.recording;
    RunContext quiet = context; // the progress is that of the keys
    quiet.progress = nullptr;
    const auto moment = [&](std::size_t frame) -> Result<MeshMoment> {
        if (const auto surface = recording.surface(frame)) return MeshMoment{*surface, {}};
        Result<Mesh> mesh = restorer->mesh(*recording.frames[frame], quiet);
        if (!mesh) return mesh.error();
        return MeshMoment{std::move(*mesh), {}};
    };
    const double keys = settings.keys > 0 ? std::min(settings.keys, kMoltenKeys) : kMoltenKeys;
    const Status written =
        write_glb_moments({recording.frames.size(), recording.frames_per_second, moment}, keys, path_of(path), context);
    if (!written) return written.error();
    return QString("Saved %1: what melts is a mesh a key, %2 keys a second.").arg(file_name(path), number_text(keys));
}

Result<QString> write_positions(const State& state, const std::string& path, const RunContext& context) {
    const Result<Restorer> restorer = Restorer::create(*state.model, state.restore, context);
    if (!restorer) return restorer.error();
    const Recording& recording = *state.recording;
    RunContext quiet = context; // the progress is that of the frames
    quiet.progress = nullptr;
    const Mesh rest = level_mesh(*state.model, state.level());
    const MeshAnimation animation = {&rest, recording.frames.size(), recording.frames_per_second,
                                     [&](std::size_t frame, std::span<Vec3f> positions) {
                                         return restorer->positions(*recording.frames[frame], positions, quiet);
                                     }};
    const auto warnings = write_animation(animation, path_of(path), context);
    if (!warnings) return warnings.error();
    return with_warnings(QString("Saved %1: %2 of %3, as they are shown, in 32-bit floats.")
                             .arg(file_name(path), counted(recording.frames.size(), "frame", "frames"),
                                  counted(rest.vertex_count(), "vertex", "vertices")),
                         *warnings);
}

Result<QString> write_recording(const State& state, const GlbSettings& settings, AnimationFormat format,
                                const std::string& path, const RunContext& context) {
    const bool melts = std::ranges::any_of(state.recording->surfaces, [](const auto& one) { return one != nullptr; });
    if (format != AnimationFormat::glb && melts)
        return Error{ErrorCode::unsuitable, file_name(path).toStdString() +
                                                ": what melts has other faces in each frame, and this format holds "
                                                "positions alone; export a GLB, or a mesh a frame."};
    if (format != AnimationFormat::glb) return write_positions(state, path, context);
    return melts ? write_melt(state, settings, path, context) : write_skin(state, settings, path, context);
}

} // namespace

const GlbSettings& Workbench::glb_settings() const { return impl_->glb_settings; }

void Workbench::set_glb_settings(const GlbSettings& settings) { impl_->glb_settings = settings; }

void Workbench::export_animation(const std::string& path) {
    commit_recording();
    if (is_refused_without_poses()) return;
    const Result<AnimationFormat> format = animation_format(path_of(path));
    if (!format) return Q_EMIT told(QString::fromStdString(about_file(path, format.error().message)), true);
    if (*format == AnimationFormat::numbered) return export_meshes(path);
    save("Exporting " + file_name(path), path,
         [state = state(), settings = impl_->glb_settings, format = *format, path](const RunContext& context) {
             return write_recording(state, settings, format, path, context);
         });
}

} // namespace filigree::studio
