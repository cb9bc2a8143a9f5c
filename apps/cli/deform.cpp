#include "animation_output.h"
#include "commands.h"
#include "pictures.h"
#include "reference.h"
#include "restore_options.h"

#include "filigree/deform/warp_steps.h"
#include "filigree/io/animation/handles_file.h"
#include "filigree/io/system/extension.h"
#include "filigree/io/system/file.h"

#include <fmt/format.h>

namespace filigree::cli {

namespace {

struct DeformArguments {
    std::string input, output, handles, pose_output;
    std::vector<WarpStep> steps; ///< in the order in which they were given
    std::optional<Axis> axis = {};
    std::size_t seed = 1;
    RestoreOptions restore;
    std::optional<HeightLaw> law; ///< reference code
    std::size_t frames = 0;       ///< of an animation; 0: the full deformation alone
    double frames_per_second = 60;
    AnimationOutput animation;

    double fraction(std::size_t frame) const { return double(frame) / double(frames - 1); }
};

/// What is done to the file, wholly or a part of the way there.
class Deformation {
public:
    explicit Deformation(const DeformArguments& options) : options_(options) {
        if (!options.handles.empty()) handles_ = require(read_handles(path_of(options.handles)));
    }

    Mesh mesh(Mesh mesh, double fraction, const RunContext& context) const {
        if (!handles_.empty()) return moved(move_by_handles(std::move(mesh), handles_at(fraction), context));
        warp_mesh(*warp_at(fraction, world_bounds(mesh)), mesh, context);
        return mesh;
    }
    Pose driver(const Model& model, double fraction, const RunContext& context) const {
        if (!handles_.empty()) return moved(pose_by_handles(model, handles_at(fraction), context));
        return warp_pose(*warp_at(fraction, world_bounds(model.mesh)), model, context);
    }
    std::vector<Vec3f> driver(const ReferenceModel& model, double fraction, const RunContext& context) const {
        return warp_positions(*warp_at(fraction, world_bounds(model.mesh)), driver_positions(model), model.mesh.origin,
                              context);
    }

private:
    /// All over the box of the undeformed mesh.
    std::unique_ptr<SpaceWarp> warp_at(double fraction, const Box& box) const {
        std::vector<WarpStep> steps;
        for (const WarpStep& step : options_.steps) steps.push_back(step.part(fraction));
        return make_warp(steps, box, options_.axis.value_or(longest_axis(box)), options_.seed);
    }
    std::vector<HandleRegion> handles_at(double fraction) const {
        std::vector<HandleRegion> handles;
        for (const HandleRegion& handle : handles_) handles.push_back(handle.part(fraction));
        return handles;
    }
    /// What a handle has against its place is said of the file.
    template <class T>
    T moved(Result<T> result) const {
        if (!result && result.error().code == ErrorCode::usage)
            refuse(options_.handles + ": " + result.error().message);
        return require(std::move(result));
    }

    const DeformArguments& options_;
    std::vector<HandleRegion> handles_; ///< of the file; none: warps
};

bool is_model_path(const std::string& path) { return lower_extension(path_of(path)) == ".fil"; }

void check(const DeformArguments& options, const Session& session) {
    check_second_output("--pose", options.pose_output, options.output);
    if (options.steps.empty() == options.handles.empty())
        refuse("Say how to deform: one or more of --stretch, --squeeze, --bend, --twist, --taper and --random, or "
               "--handles FILE.");
    if (options.frames == 0) {
        const std::string given = given_animation_option(session);
        if (!given.empty()) refuse(given + " belongs to --frames.");
        return;
    }
    if (!options.pose_output.empty()) refuse("--pose writes one pose; with --frames give -o a .fil for all of them.");
    check_not_input(options.output, {options.input, options.handles});
    if (!is_model_path(options.output)) check_animation_path(options.output);
    check_animation_options({options.output}, session);
}

/// A model's poses are all in memory until they are written.
void check_poses_fit(std::size_t frames, std::size_t driver_vertices, const std::string& output) {
    constexpr std::size_t kVertexBytes = sizeof(Vec3f) + sizeof(Mat3f);
    constexpr std::uint64_t kMost = std::uint64_t{4} << 30;
    const double bytes = double(frames) * double(driver_vertices * kVertexBytes);
    if (bytes > double(kMost))
        refuse(fmt::format("{}: {} poses of {} vertices are {:.3g} GB, and a model's poses may be {:.3g}; ask "
                           "for fewer --frames, or write a .pc2.",
                           output, with_commas(frames), with_commas(driver_vertices), bytes / 1e9,
                           double(kMost) / 1e9));
}

/// The model itself, with the poses.
void write_posed_model(const Model& model, const FrameSource<Pose>& poses, const std::string& output, Session& session,
                       Report& report) {
    check_poses_fit(poses.frames, model.driver().vertices.size(), output);
    PoseSequence sequence{poses.frames_per_second, {}};
    for (std::size_t frame = 0; frame < poses.frames; ++frame) {
        session.context().report("deforming", double(frame) / double(poses.frames));
        sequence.frames.push_back(require(poses.frame(frame)));
    }
    session.context().report("deforming", 1);
    session.write_model(model, output, sequence);
    report.row("model", fmt::format("{} with {} poses at {:.6g} a second", output, with_commas(poses.frames),
                                    poses.frames_per_second));
}

void animate_model(const Model& model, const DeformArguments& options, Session& session, Report& report) {
    const Deformation deformation(options);
    const RunContext silent = session.silent_context(); // the bar tells of frames
    const FrameSource<Pose> poses{options.frames, options.frames_per_second, [&](std::size_t frame) -> Result<Pose> {
                                      return deformation.driver(model, options.fraction(frame), silent);
                                  }};
    if (is_model_path(options.output)) return write_posed_model(model, poses, options.output, session, report);
    write_animation_output(model, poses, options.restore, options.animation, options.output, options.input, session,
                           report);
}

void animate_mesh(const Mesh& rest, const DeformArguments& options, Session& session, Report& report) {
    if (is_model_path(options.output))
        refuse(options.output + ": a model with poses comes from a model, and " + options.input +
               " is a mesh; 'filigree strip' makes one of it.");
    const Deformation deformation(options);
    const RunContext silent = session.silent_context();
    const MeshAnimation animation{&rest, options.frames, options.frames_per_second,
                                  [&](std::size_t frame, std::span<Vec3f> positions) -> Status {
                                      const Mesh moved = deformation.mesh(rest, options.fraction(frame), silent);
                                      std::copy(moved.positions.begin(), moved.positions.end(), positions.begin());
                                      return Success{};
                                  }};
    write_animation_output(animation, options.animation, options.output, options.input, session, report);
}

void report_frames_made(const DeformArguments& options, bool through_driver, double start, Report& report) {
    report.set("output", options.output);
    report.set("frames", options.frames);
    report.set("frames_per_second", options.frames_per_second);
    report.set("through_driver", through_driver);
    report.set("seconds", now_seconds() - start);
}

void deform_animation(const DeformArguments& options, const Session::Content& content, Session& session) {
    Report report;
    const double start = now_seconds();
    const auto* model = std::get_if<Model>(&content.value);
    if (model)
        animate_model(*model, options, session, report);
    else
        animate_mesh(std::get<Mesh>(content.value), options, session, report);
    report_frames_made(options, model != nullptr, start, report);
    session.print(report);
}

void report_deformed(const Mesh& mesh, bool through_driver, double seconds, const DeformArguments& options,
                     Report& report) {
    report.say(fmt::format("{}: {} vertices deformed {} in {}\n", options.output, with_commas(mesh.vertex_count()),
                           through_driver ? "through the driver" : "one by one", seconds_text(seconds)));
    report.set("output", options.output);
    report.set("vertices", mesh.vertex_count());
    report.set("through_driver", through_driver);
    report.set("seconds", seconds);
}

void deform_model(const Model& model, const DeformArguments& options, Session& session) {
    const RunContext& context = session.context();
    const Deformation deformation(options);
    const double start = now_seconds();
    const Pose pose = deformation.driver(model, 1, context);
    const Restorer restorer = require(Restorer::create(model, options.restore, context));
    const std::vector<Mat3f> gradients = require(restorer.gradients(pose, context));
    const Mesh mesh = require(restorer.mesh(pose, gradients, context));
    const double seconds = now_seconds() - start;
    session.write_mesh(mesh, options.output, options.input);
    if (!options.pose_output.empty()) session.write_mesh(posed_driver(model, pose), options.pose_output);
    Report report;
    report_deformed(mesh, true, seconds, options, report);
    note_expected_error(require(PoseError(model, context).estimate(pose, gradients)), model, pose, report, session);
    session.print(report);
}

void animate_reference_code(const ReferenceModel& model, const DeformArguments& options, Session& session) {
    if (is_model_path(options.output) || options.restore.level)
        refuse(ErrorCode::unsuitable,
               options.input + ": has the reference code, of which frames are whole meshes; give -o another animation "
                               "than .fil, and no --level.");
    const Deformation deformation(options);
    const RunContext silent = session.silent_context();
    const double start = now_seconds();
    const ReferenceRestorer restorer(model.detail, options.law.value_or(HeightLaw::inverse), session.context());
    const MeshAnimation animation{&model.mesh, options.frames, options.frames_per_second,
                                  [&](std::size_t frame, std::span<Vec3f> positions) -> Status {
                                      restorer.restore(deformation.driver(model, options.fraction(frame), silent),
                                                       model.finest_level(), positions, silent);
                                      return Success{};
                                  }};
    Report report;
    write_animation_output(animation, options.animation, options.output, options.input, session, report);
    report_frames_made(options, true, start, report);
    session.print(report);
}

void deform_reference_code(const ReferenceModel& model, const DeformArguments& options, Session& session) {
    if (!options.handles.empty())
        refuse(ErrorCode::unsuitable, options.input + ": has the reference code, which takes no --handles.");
    if (options.frames > 0) return animate_reference_code(model, options, session);
    const RunContext& context = session.context();
    const double start = now_seconds();
    const std::vector<Vec3f> driver = Deformation(options).driver(model, 1, context);
    const Mesh mesh = require(restore_reference(
        model, driver, {.law = options.law.value_or(HeightLaw::inverse), .level = options.restore.level}, context));
    const double seconds = now_seconds() - start;
    session.write_mesh(mesh, options.output, options.input);
    if (!options.pose_output.empty()) {
        Mesh moved = driver_mesh(level_mesh(model, 0));
        moved.positions = driver;
        moved.normals = {}; // those at rest
        session.write_mesh(moved, options.pose_output);
    }
    Report report;
    report_deformed(mesh, true, seconds, options, report);
    session.print(report);
}

void deform_mesh(const Mesh& rest, const DeformArguments& options, Session& session) {
    if (!options.pose_output.empty()) refuse("--pose writes a model's driver, and " + options.input + " is a mesh.");
    const Deformation deformation(options);
    const double start = now_seconds();
    const Mesh mesh = deformation.mesh(rest, 1, session.context());
    const double seconds = now_seconds() - start;
    session.write_mesh(mesh, options.output, options.input);
    Report report;
    report_deformed(mesh, false, seconds, options, report);
    session.print(report);
}

/// A warp of its own each time that it is given, in the order of the command line.
OptionList warp_options(std::vector<WarpStep>& steps) {
    OptionList options;
    for (const WarpInfo& info : warp_infos()) {
        const auto add_step = [&steps, kind = info.kind](double amount) { steps.push_back({kind, amount}); };
        Option option("--" + std::string(info.name), Option::EachNumber(add_step), std::string(info.action));
        options = std::move(options) + OptionList{info.is_factor ? option.above_zero() : option.finite()};
    }
    return options;
}

} // namespace

Command deform_command() {
    const auto options = std::make_shared<DeformArguments>();
    return {
        .name = "deform",
        .text =
            "Deform a mesh (every vertex) or a model (its driver, then restore); deformations apply in the order given",
        .options =
            OptionList{
                Option("file", options->input, "Mesh or model").is_read().required(),
                output_option(options->output,
                              "Mesh file to write. With --frames an animation: .glb, .pc2, .mdd, .usda, a folder "
                              "(NAME/), NAME_####.ply; for a model also .fil, the model with these poses")} +
            warp_options(options->steps) +
            OptionList{
                Option("--seed", options->seed, "Seed of --random").whole_from(0).with_default(),
                choice<Axis>("--axis", options->axis, {{"x", Axis::x}, {"y", Axis::y}, {"z", Axis::z}},
                             "Axis of the deformations (default: the longest side of the box)"),
                Option("--handles", options->handles,
                       "Move parts of the mesh, and let the rest follow as rigidly as possible: a JSON file, see "
                       "docs/handles.md")
                    .is_read(),
                Option("--pose", options->pose_output, "Models: also write the moved driver, with its gradients")
                    .is_written(),
                Option("--frames", options->frames,
                       "Write an animation of this many frames, from rest to the full deformation")
                    .whole_from(2),
                Option("--frame-rate", options->frames_per_second, "Frames per second").above_zero().with_default()} +
            restore_options(options->restore) + OptionList{law_option(options->law)} +
            animation_options(options->animation),
        .examples = "  filigree deform scan.fil -o bent.ply --bend 90 --twist 45\n"
                    "  filigree deform scan.ply -o full.ply --bend 90 --twist 45\n"
                    "  filigree deform scan.fil -o pulled.ply --handles pull.json\n"
                    "  filigree deform scan.fil -o bent.glb --bend 90 --frames 60",
        .run = [options](Session& session) {
            check(*options, session);
            const FileReader file = session.open(options->input);
            if (is_reference_model(file, options->input, session))
                return deform_reference_code(read_reference(file, options->input, session), *options, session);
            refuse_law(options->input, session);
            const Session::Content content = session.read_any(file, options->input);
            if (options->frames > 0)
                deform_animation(*options, content, session);
            else if (const auto* model = std::get_if<Model>(&content.value))
                deform_model(*model, *options, session);
            else
                deform_mesh(std::get<Mesh>(content.value), *options, session);
        }};
}

} // namespace filigree::cli
