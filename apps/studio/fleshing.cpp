#include "fleshing.h"

#include "fitting.h"
#include "softness.h"
#include "words.h"

#include <algorithm>
#include <numeric>

namespace filigree::studio {

namespace {

constexpr double kPackedError = 1e-4; ///< of the diagonal: what is packed, beside what it is packed of

/// Where plain skinning has the vertices in each frame of the flesh.
Result<std::vector<std::vector<Vec3f>>> skin_frames(const SkinnedMesh& skin, const FleshClip& clip,
                                                    const RunContext& context) {
    std::vector<std::vector<Vec3f>> frames(clip.frames.size());
    std::vector<Eigen::Affine3d> transforms(skin.joints.size());
    for (std::size_t frame = 0; frame < frames.size(); ++frame) {
        if (context.is_cancelled()) return cancelled_error();
        frames[frame].resize(skin.mesh.vertex_count());
        skin.transforms(clip.clip, double(frame) / clip.frames_per_second, transforms);
        skin_positions(skin, transforms, frames[frame]);
    }
    return frames;
}

FleshOptions options_of(const FleshSettings& settings) {
    FleshOptions options;
    options.particles = settings.particles;
    options.material.young_modulus = settings.stiffness;
    options.core = settings.core;
    options.damping = settings.damping;
    for (const std::string& joint : settings.soft) options.soft.push_back({joint, settings.strength});
    return options;
}

FleshedMotion motion_of(const Flesh& flesh, const FleshClip& clip, const FleshMeasure& measure) {
    FleshedMotion motion;
    motion.made = flesh.report();
    motion.measure = measure;
    motion.particles = flesh.body()->particle_count();
    motion.spacing = flesh.body()->spacing();
    motion.step_seconds = clip.step_seconds + clip.target_seconds;
    motion.most_substeps = clip.most_substeps;
    motion.is_loop = clip.is_loop;
    motion.loop_rms = clip.loop_rms;
    motion.is_sound = clip.clamped_particles == 0 && clip.unstable_substeps == 0;
    if (measure.furthest_joint != kNoIndex) motion.furthest_joint = flesh.skin().joints[measure.furthest_joint].name;
    return motion;
}

} // namespace

std::shared_ptr<const Recording> recording_of_clip(const std::shared_ptr<const FleshedClips>& clips,
                                                   std::size_t number) {
    const auto found = std::ranges::find(clips->clips, number, [](const auto& clip) { return clip.original->clip; });
    if (found == clips->clips.end()) return nullptr;
    const PoseSequence& poses = clips->fitted.poses[std::size_t(found - clips->clips.begin())];
    auto recording = std::make_shared<Recording>();
    recording->frames_per_second = poses.frames_per_second;
    for (const Pose& pose : poses.frames) recording->frames.emplace_back(clips, &pose); // lives as long as the clips
    recording->original = found->original;
    recording->fitted = found->fitted;
    recording->clips = clips;
    return recording;
}

namespace {

Result<std::vector<FleshClip>> simulated_clips(const Flesh& flesh, const std::vector<std::size_t>& numbers,
                                               const FleshSettings& settings, const RunContext& context) {
    FleshClipOptions how;
    how.loop = settings.loop;
    how.ground = settings.ground;
    std::vector<FleshClip> clips;
    for (const std::size_t number : numbers) {
        Result<FleshClip> clip = simulate_flesh(flesh, number, how, context);
        if (!clip) return clip.error();
        clips.push_back(std::move(*clip));
    }
    return clips;
}

Result<FleshedClips::Clip> fleshed_clip(const Flesh& flesh, const FleshClip& clip, const FittedFlesh& fitted,
                                        const PoseSequence& poses, const MovingMesh& before,
                                        const RunContext& context) {
    context.report("measuring the flesh", 0);
    const Result<FleshMeasure> measure = measure_flesh(flesh, clip, 0, context);
    if (!measure) return measure.error();
    const Mesh& mesh = flesh.skin().mesh;
    std::vector<Index> all(mesh.vertex_count());
    std::iota(all.begin(), all.end(), Index{0});
    RunContext silent = context;
    silent.progress = nullptr;
    Result<FleshCarrier> carrier = FleshCarrier::create(flesh, all, silent);
    if (!carrier) return carrier.error();
    const MeshAnimation animation = {&mesh, clip.frames.size(), clip.frames_per_second,
                                     [&](std::size_t frame, std::span<Vec3f> positions) -> Status {
                                         carrier->at(clip, frame, positions, {}, silent);
                                         return Success{};
                                     }};
    FittedMotion motion;
    motion.report = fitted.report;
    if (Status packed = pack_motion(fitted.model, poses, animation, kPackedError, motion, context); !packed)
        return packed.error();
    motion.flesh = motion_of(flesh, clip, *measure);
    MovingMesh original = {before.path, before.clips, clip.clip, before.joints, clip.frames_per_second};
    Result<std::vector<std::vector<Vec3f>>> skinned = skin_frames(flesh.skin(), clip, context);
    if (!skinned) return skinned.error();
    original.frames = std::move(*skinned);
    return FleshedClips::Clip{std::make_shared<const MovingMesh>(std::move(original)),
                              std::make_shared<const FittedMotion>(std::move(motion))};
}

} // namespace

Result<State> fleshed_state(State state, const FleshSettings& settings, const RunContext& context) {
    const auto before = state.recording->original;
    Result<SkinnedMesh> read = read_skin(path_of(before->path), context);
    if (!read) return read.error();
    if (before->clip >= read->clips.size())
        return Error{ErrorCode::mismatch, "The file has changed since it was opened; open it again."};
    if (!(read->clips[before->clip].seconds > 0))
        return Error{ErrorCode::unsuitable,
                     "Clip '" + read->clips[before->clip].name + "' is a single pose; show one that moves."};
    std::vector<std::size_t> numbers;
    for (std::size_t c = 0; c < read->clips.size(); ++c)
        if (read->clips[c].seconds > 0) numbers.push_back(c);
    FleshOptions options = options_of(settings);
    if (const auto softness = softness_of(state); softness && softness->size() == read->mesh.vertex_count())
        options.loose = *softness;
    const Result<Flesh> flesh = Flesh::create(std::move(*read), options, numbers, context);
    if (!flesh) return flesh.error();
    const Result<std::vector<FleshClip>> clips = simulated_clips(*flesh, numbers, settings, context);
    if (!clips) return clips.error();
    auto made = std::make_shared<FleshedClips>();
    Result<FittedFlesh> fitted = fit_flesh(*flesh, *clips, settings.joints, context);
    if (!fitted) return fitted.error();
    made->fitted = std::move(*fitted);
    for (std::size_t c = 0; c < clips->size(); ++c) {
        Result<FleshedClips::Clip> clip =
            fleshed_clip(*flesh, (*clips)[c], made->fitted, made->fitted.poses[c], *before, context);
        if (!clip) return clip.error();
        made->clips.push_back(std::move(*clip));
    }
    auto source = source_of(flesh->skin().mesh, before->path, state.source->name, context);
    source->contents = state.source->contents;
    source->warnings = state.source->warnings;
    state.source = std::move(source);
    state.strip.base = made->fitted.report.driver_vertices;
    state.model = std::shared_ptr<const Model>(made, &made->fitted.model);
    state.recording = recording_of_clip(made, before->clip);
    return state;
}

QString flesh_summary(const Recording& recording) {
    const FleshedMotion& flesh = *recording.fitted->flesh;
    QString text = QString("Flesh of %1 keeps %2 to %3 of its volume; plain skinning %4 to %5.")
                       .arg(counted(flesh.particles, "particle", "particles"), number_text(flesh.measure.least_volume),
                            number_text(flesh.measure.most_volume), number_text(flesh.measure.skin_least_volume),
                            number_text(flesh.measure.skin_most_volume));
    if (const std::size_t count = recording.clips->clips.size(); count > 1)
        text += QString(" All %1 clips are flesh: choose one to play.").arg(count);
    if (!flesh.is_sound)
        text += " It cannot be trusted: the motion was not finite somewhere, or substeps were too long. Lower the "
                "stiffness.";
    return text;
}

QString flesh_table(const Recording& recording) {
    const FittedMotion& fitted = *recording.fitted;
    const FleshedMotion& flesh = *fitted.flesh;
    const auto range = [](double least, double most) {
        return QString::number(least, 'f', 3) + " .. " + QString::number(most, 'f', 3);
    };
    std::vector<std::vector<QString>> rows = {
        {"Particles", with_commas(flesh.particles)},
        {"… apart", number_text(100 * flesh.spacing, 2) + " cm"},
        {"… held by bones", with_commas(flesh.made.held)},
        {"Volume", range(flesh.measure.least_volume, flesh.measure.most_volume)},
        {"… of the skin alone", range(flesh.measure.skin_least_volume, flesh.measure.skin_most_volume)},
        {"Farthest from the skin", number_text(100 * flesh.measure.furthest, 2) + " % of the diagonal"},
        {"… at", QString::fromStdString(flesh.furthest_joint)},
        {"Substeps, at most", with_commas(flesh.most_substeps)},
        {"A frame took", number_text(1000 * flesh.step_seconds, 2) + " ms"},
        {"Joints", with_commas(fitted.report.driver_vertices)},
        {"… off the flesh, rms", number_text(100 * fitted.report.rms, 2) + " %"},
        {"Packed model", size_text(fitted.packed.size())}};
    if (flesh.is_loop)
        rows.insert(rows.begin() + 7, {"Between cycles, faded", number_text(100 * flesh.loop_rms, 2) + " %"});
    return rich_table(rows);
}

QString flesh_advice(const Recording& recording) {
    constexpr double kFarFromSkin = 0.1, kMuchVolumeLost = 0.95, kRestlessLoop = 5e-3;
    const FleshedMotion& flesh = *recording.fitted->flesh;
    QStringList lines;
    for (const std::string& warning : flesh.made.warnings) lines << QString::fromStdString(warning);
    if (flesh.measure.furthest > kFarFromSkin)
        lines << "The flesh is far from its skin; raise Stiffness, or Core, to hold it.";
    if (flesh.is_loop && flesh.loop_rms > kRestlessLoop)
        lines << "The flesh does not settle into a cycle; raise Damping.";
    if (flesh.measure.is_closed && flesh.measure.least_volume < kMuchVolumeLost && flesh.made.scaled.empty())
        lines << "The body loses volume; a smaller Core lets the joints keep it.";
    return lines.join('\n');
}

} // namespace filigree::studio
