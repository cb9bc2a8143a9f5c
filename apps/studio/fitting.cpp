#include "fitting.h"

#include "words.h"

#include "filigree/fit/packed_error.h"
#include "filigree/io/system/file.h"
#include "filigree/pack.h"

#include <QTemporaryDir>

#include <algorithm>

namespace filigree::studio {

namespace {

std::size_t cache_bytes(const FitReport& report) { return report.frames * report.vertices * sizeof(Vec3f); }

QString times_smaller(const Recording& recording) {
    const double times = double(cache_bytes(recording.fitted->report)) /
                         double(std::max<std::size_t>(1, recording.fitted->packed.size()));
    return times >= 100 ? with_commas(std::size_t(times)) : number_text(times);
}

} // namespace

Status pack_motion(const Model& model, const PoseSequence& poses, const MeshAnimation& animation, double error,
                   FittedMotion& fitted, const RunContext& context) {
    context.report("packing", 0);
    const QTemporaryDir folder;
    const std::filesystem::path path = path_of(folder.filePath("fitted.fil").toStdString());
    PackOptions options;
    options.bits = bits_of_positions(error, model.mesh);
    options.clip_error = error_of_poses(error);
    const Result<PackReport> packed = pack_model(model, poses, options, path, context);
    if (!packed) return packed.error();
    Result<std::string> bytes = read_file(path);
    if (!bytes) return bytes.error();
    const Result<Model> read = read_model(*bytes, "the packed model", context);
    if (!read) return read.error();
    const Result<PoseSequence> read_back = read_poses(*bytes, "the packed model", context);
    if (!read_back) return read_back.error();
    const Result<AnimationError> measured =
        animation_error(*read, *read_back, animation, packed->vertex_order, context);
    if (!measured) return measured.error();
    fitted.packed_rms = measured->rms / fitted.report.diagonal;
    fitted.packed_max = measured->max / fitted.report.diagonal;
    fitted.packed = std::move(*bytes);
    return Success{};
}

Result<FittedMotion> fit_to(const MeshAnimation& animation, const FitOptions& options, double packed_error,
                            State& state, const RunContext& context) {
    Result<Fitted> made = fit_animation(animation, options, context);
    if (!made) return made.error();
    FittedMotion fitted;
    fitted.report = made->report;
    if (const Status packed = pack_motion(made->model, made->poses, animation, packed_error, fitted, context); !packed)
        return packed.error();
    auto recording = std::make_shared<Recording>();
    recording->frames_per_second = animation.frames_per_second;
    for (Pose& pose : made->poses.frames) recording->frames.push_back(std::make_shared<const Pose>(std::move(pose)));
    state.strip.base = made->report.driver_vertices;
    state.model = std::make_shared<const Model>(std::move(made->model));
    state.recording = std::move(recording);
    return fitted;
}

Result<State> fitted_state(State state, double error, const RunContext& context) {
    const auto original = state.recording->original;
    const auto source = state.source;
    const MeshAnimation animation = {&source->mesh, original->frames.size(), original->frames_per_second,
                                     [&](std::size_t frame, std::span<Vec3f> positions) -> Status {
                                         std::ranges::copy(original->frames[frame], positions.begin());
                                         return Success{};
                                     }};
    Result<FittedMotion> fitted = fit_to(animation, {.error = error_of_fit(error)}, error, state, context);
    if (!fitted) return fitted.error();
    auto recording = std::make_shared<Recording>(*state.recording);
    recording->original = original;
    recording->fitted = std::make_shared<const FittedMotion>(std::move(*fitted));
    state.recording = std::move(recording);
    return state;
}

QString fit_summary(const Recording& recording) {
    const FitReport& report = recording.fitted->report;
    return QString("A driver of %1 follows the animation to %2 of the diagonal (rms), %3 at most. Packed it is %4, %5 "
                   "times smaller.")
        .arg(counted(report.driver_vertices, "vertex", "vertices"), number_text(report.rms, 2),
             number_text(report.max, 2), size_text(recording.fitted->packed.size()), times_smaller(recording));
}

QString fit_table(const Recording& recording) {
    const FittedMotion& fitted = *recording.fitted;
    const FitReport& report = fitted.report;
    const auto percent = [](double share) { return number_text(100 * share, 2) + " %"; };
    return rich_table({{"Driver", counted(report.driver_vertices, "vertex", "vertices")},
                       {"Chosen by", report.choice == DriverChoice::rest ? "the rest shape" : "the motion"},
                       {"Error, rms of the diagonal", percent(report.rms)},
                       {"… at most", percent(report.max)},
                       {"… in frame", with_commas(report.max_frame + 1)},
                       {"Normals, mean", number_text(report.normal_mean_deg, 2) + "°"},
                       {"… 95 % are below", number_text(report.normal_p95_deg, 2) + "°"},
                       {"Positions of all frames", size_text(cache_bytes(report))},
                       {"Packed model", size_text(fitted.packed.size())},
                       {"… times smaller", times_smaller(recording)},
                       {"… error, rms", percent(fitted.packed_rms)},
                       {"… at most", percent(fitted.packed_max)}});
}

} // namespace filigree::studio
