#include "animation_output.h"
#include "chunks.h"
#include "commands.h"
#include "drawing.h"
#include "reference.h"
#include "restore_options.h"

#include "filigree/blend/blend_code.h"
#include "filigree/io/animation/point_cache.h"
#include "filigree/io/animation/pose_match.h"
#include "filigree/io/system/file.h"
#include "filigree/levels/vertex_order.h"
#include "filigree/mesh/surfels.h"

#include <filesystem>

#include <fmt/format.h>

namespace filigree::cli {

OptionList restore_options(RestoreOptions& options) {
    return {Option("--level", options.level, "Restore up to this level (default: the finest)")};
}

namespace {

/// What makes a pose that is too curved come out better.
std::string advice_for(const Model& model, const Pose& pose) {
    constexpr double kMany = 0.02; // of the vertices in loose parts: then these are what is off
    const std::size_t loose = model.detail.across_gap.size();
    if (!pose.gradients.empty() || double(loose) < kMany * double(model.vertex_count()))
        return "Strip with a finer driver (--base, or --fidelity).";
    return fmt::format("{} vertices are of parts that the driver has no vertex of, and positions alone do not say how "
                       "such parts turn: give the pose with gradients, or strip with a driver "
                       "so fine that it has vertices of them (--base, or --fidelity).",
                       with_commas(loose));
}

} // namespace

void note_expected_error(const PoseError::Estimate& estimate, const Model& model, const Pose& pose, Report& report,
                         Session& session) {
    if (!(estimate.diagonal > 0)) return;
    report.set("expected_error", estimate.share());
    if (estimate.is_too_curved())
        session.warn(fmt::format("The pose is more curved than the driver can follow: the mesh is off by about {:.2g} "
                                 "of the diagonal. {}",
                                 estimate.share(), advice_for(model, pose)));
}

const Pose& own_pose(const PoseSequence& poses, std::size_t frame, const std::string& path) {
    if (poses.empty())
        refuse(ErrorCode::unsuitable,
               path + ": has no poses of its own; 'filigree simulate' makes them, --pose FILE names another.");
    if (frame < 1 || frame > poses.frames.size())
        refuse(fmt::format("{}: has frames 1 to {}; there is no frame {}.", path, poses.frames.size(), frame));
    return poses.frames[frame - 1];
}

namespace {

struct RestoreArguments {
    std::string model, pose, poses, output, picture, chunk;
    std::optional<UpAxis> up;
    std::size_t frame = 0; ///< of the model's own, from 1; 0: none
    bool all_frames = false, as_surfels = false, in_input_order = false;
    PoseFileOptions poses_file;
    RestoreOptions restore;
    std::optional<HeightLaw> law; ///< reference code
    AnimationOutput animation;

    bool is_animation() const { return all_frames || !poses.empty(); }
};

/// A model takes the poses in; nothing has to be restored for that.
bool is_model_name(const std::string& path) { return lower_extension(path_of(path)) == ".fil"; }

/// A name without an ending is a folder to come.
std::string animation_place(const std::string& output) {
    const bool is_plain = !path_of(output).has_extension() && !is_animation_path(output) && output != "-";
    return is_plain ? output + "/" : output;
}

void check(const RestoreArguments& options, const Session& session) {
    if (!options.pose.empty() + !options.poses.empty() + (options.frame > 0) + options.all_frames != 1)
        refuse("Say what moved the driver: --pose FILE for a mesh, --poses FILE for an animation, or for a model that "
               "holds poses --frame N or --frames.");
    if (options.poses.empty() && !options.poses_file.animation.empty()) refuse("--animation belongs to --poses.");
    if (!options.is_animation() && options.poses_file.frames_per_second)
        refuse("--frame-rate belongs to --poses or --frames.");
    if (options.pose.empty() && options.poses.empty() && options.poses_file.up)
        refuse("--pose-up belongs to --pose or --poses.");
    if (options.is_animation() && !options.picture.empty()) refuse("--picture belongs to --pose or --frame.");
    if (!options.picture.empty() && options.restore.level)
        refuse("--picture draws the finest level; leave out --level.");
    if (!options.picture.empty()) check_picture_path(options.picture);
    if (options.as_surfels && (options.is_animation() || options.restore.level))
        refuse("--surfels writes one moment of the finest level: give --pose or --frame, and no --level.");
    if (options.in_input_order && (options.is_animation() || options.restore.level || options.as_surfels))
        refuse("--input-order writes one mesh, the finest: give --pose or --frame, and neither --level nor --surfels.");
    if (!options.chunk.empty() && !options.is_animation()) refuse("--chunk belongs to --poses or --frames.");
    if (!options.chunk.empty()) (void)chunk_of(options.chunk);
    if (!options.chunk.empty() && animation_format(path_of(options.output)).value() != AnimationFormat::pc2)
        refuse(options.output + ": chunks are written of .pc2 alone, whose frames all have one size.");
    const std::string given = given_animation_option(session);
    if (!options.is_animation() && !given.empty()) refuse(given + " belongs to --poses or --frames.");
    if (!options.is_animation()) return;
    if (is_model_name(options.output)) {
        if (!given.empty() || options.restore.level || !options.chunk.empty())
            refuse(options.output + ": a model keeps its poses, with all levels; leave out " +
                   (!given.empty()          ? given
                    : options.restore.level ? "--level"
                                            : "--chunk") +
                   ".");
        return check_folder_of(options.output);
    }
    const std::string place = animation_place(options.output);
    if (!is_animation_path(place) && mesh_format(path_of(place)))
        refuse(place + ": is the name of one mesh, and there are many; put #### where their numbers go, or give -o a "
                       "folder (NAME/), .pc2, .mdd, .usda or .glb.");
    check_animation_path(place);
    check_animation_options({place}, session);
    check_not_input(place, {options.model, options.poses});
}

const char* source_of(const Pose& pose) { return pose.gradients.empty() ? "positions" : "positions and gradients"; }

void report_expected_error(const Model& model, const Pose& pose, const PoseError::Estimate& estimate, const Mesh& mesh,
                           const RestoreArguments& options, Session& session, Report& report) {
    if (!(estimate.diagonal > 0)) return;
    report.say(fmt::format("Expected error: {:.2g} of the diagonal (rms).\n", estimate.share()));
    note_expected_error(estimate, model, pose, report, session);
    if (options.picture.empty()) return;
    const UpAxis up = up_of(options.up, model.mesh, options.model);
    draw_expected_error(model, estimate, mesh, file_name(options.output), up, options.picture, session);
    report.say(fmt::format("{}: where it is expected\n", options.picture));
    report_picture(options.picture, up, report);
}

/// The mesh's surfels, made at rest and carried to where it is now.
Mesh surfels_of(const Model& model, const Mesh& restored, std::span<const Mat3f> gradients,
                const RestoreArguments& options, Session& session) {
    const Surfels rest = require(make_surfels(model.mesh, session.context()));
    if (rest.size() == 0) refuse(ErrorCode::unsuitable, options.model + ": has no faces to make surfels of.");
    return surfel_points(
        require(split_surfels(carried_surfels(rest, restored.positions, vertex_gradients(model.detail, gradients)))));
}

/// The driver as another program moved it. Vertices that it split for normals or UVs are made one again.
Pose moved_pose(const Model& model, const std::string& path, const RestoreArguments& options, Session& session) {
    const Mesh moved = session.read_mesh(path);
    Pose pose = pose_of_mesh(moved, model.mesh.origin);
    const Mesh driver = driver_mesh(model);
    if (moved.vertex_count() > driver.vertex_count())
        if (const std::optional<VertexMatch> match = match_by_faces(driver, moved)) {
            std::vector<Vec3f> positions(driver.vertex_count());
            require(match->apply(pose.positions, positions, path_of(path)));
            pose = {std::move(positions), {}};
            session.warn(fmt::format("{}: its {} vertices were split for their normals or UVs; those at one place are "
                                     "one again, which makes the driver's {}.",
                                     path, with_commas(moved.vertex_count()), with_commas(driver.vertex_count())));
        }
    if (options.poses_file.up) {
        turn_up(pose.positions, model.mesh.origin, *options.poses_file.up);
        const Mat3f turn = turn_of(*options.poses_file.up).cast<float>();
        for (Mat3f& gradient : pose.gradients) gradient = turn * gradient * turn.transpose();
    }
    return pose;
}

void restore_one(const FileReader& file, const RestoreArguments& options, Session& session) {
    PoseSequence own;
    const Model model = session.read_model(file, options.model, options.frame ? &own : nullptr);
    const Pose pose =
        options.frame ? own_pose(own, options.frame, options.model) : moved_pose(model, options.pose, options, session);
    const Restorer restorer = require(Restorer::create(model, options.restore, session.context()));
    const double start = now_seconds();
    const std::vector<Mat3f> gradients =
        require(with_hint(restorer.gradients(pose, session.context()), ErrorCode::mismatch,
                          "'filigree level MODEL 0' writes the driver as it is."));
    const Mesh mesh = require(restorer.mesh(pose, gradients, session.context()));
    const double seconds = now_seconds() - start;
    if (options.as_surfels)
        session.write_mesh(surfels_of(model, mesh, gradients, options, session), options.output, options.model);
    else if (options.in_input_order && !model.source_order.empty())
        session.write_mesh(with_vertex_order(mesh, inverse_order(model.source_order), session.context()),
                           options.output, options.model);
    else
        session.write_mesh(mesh, options.output, options.model);
    const char* from = source_of(pose);
    Report report;
    report.say(fmt::format("{}: {} vertices restored from {} in {}\n", options.output, with_commas(mesh.vertex_count()),
                           from, seconds_text(seconds)));
    report.set("output", options.output);
    report.set("vertices", mesh.vertex_count());
    report.set("from", from);
    report.set("seconds", seconds);
    const PoseError judge(model, session.context());
    report_expected_error(model, pose, require(judge.estimate(pose, gradients)), mesh, options, session, report);
    session.print(report);
}

/// A mesh from one pose, by the report's method.
void restore_reference_code(const FileReader& file, const RestoreArguments& options, Session& session) {
    const std::string given = session.first_given(
        {"--poses", "--frame", "--frames", "--surfels", "--input-order", "--picture", "--chunk", "--pose-up"});
    if (!given.empty())
        refuse(ErrorCode::unsuitable, options.model +
                                          ": has the reference code, which takes --pose, --law and --level, "
                                          "and no " +
                                          given + ".");
    const ReferenceModel model = read_reference(file, options.model, session);
    const Pose pose = pose_of_mesh(session.read_mesh(options.pose), model.mesh.origin);
    const double start = now_seconds();
    const Mesh mesh = require(
        with_hint(restore_reference(model, pose.positions,
                                    {.law = options.law.value_or(HeightLaw::inverse), .level = options.restore.level},
                                    session.context()),
                  ErrorCode::mismatch, "'filigree level MODEL 0' writes the driver as it is."));
    const double seconds = now_seconds() - start;
    session.write_mesh(mesh, options.output, options.model);
    Report report;
    report.say(fmt::format("{}: {} vertices restored from positions in {}\n", options.output,
                           with_commas(mesh.vertex_count()), seconds_text(seconds)));
    report.set("output", options.output);
    report.set("vertices", mesh.vertex_count());
    report.set("from", "positions");
    report.set("seconds", seconds);
    session.print(report);
}

/// What the frames are made of: the bytes of the inputs, and the settings.
std::string job_of(const RestoreArguments& options) {
    std::vector<std::filesystem::path> inputs{path_of(options.model)};
    if (!options.poses.empty())
        for (const std::filesystem::path& path : animation_files(path_of(options.poses))) inputs.push_back(path);
    const RestoreOptions& restore = options.restore;
    const PoseFileOptions& file = options.poses_file;
    return fmt::format("{} level {} rate {} animation {} up {}", require(hash_of_files(inputs)),
                       restore.level ? std::to_string(*restore.level) : "finest", file.frames_per_second.value_or(0),
                       file.animation, file.up ? std::to_string(int(*file.up)) : "own");
}

/// The model where it can stay in its file: restored to its finest level, into a .pc2, from a file that can be read
/// here and there.
std::optional<ModelChunks> chunks_in_file(const RestoreArguments& options, Session& session) {
    if (options.model == "-" || options.restore.level ||
        animation_format(path_of(animation_place(options.output))).value() != AnimationFormat::pc2)
        return {};
    Result<ModelChunks> chunks = ModelChunks::open(session.open_model(options.model), options.model, session.context());
    if (!chunks && chunks.error().code == ErrorCode::unsuitable) return {};
    return require(std::move(chunks));
}

/// A model to restore frames of: in its file, or in memory.
struct AnimatedModel {
    PoseSequence own;
    std::optional<ModelChunks> in_file;
    std::optional<Model> in_memory;
    FrameSource<Pose> poses;

    const Model& driver() const { return in_file ? in_file->driver() : *in_memory; } ///< has the driver, or more
};

/// It is where it is made: its stream refers to it.
void read_animated(const FileReader& file, const RestoreArguments& options, Session& session, AnimatedModel& model) {
    model.in_file = chunks_in_file(options, session);
    if (!model.in_file)
        model.in_memory = session.read_model(file, options.model, options.all_frames ? &model.own : nullptr);
    else if (options.all_frames)
        model.own = require(read_poses(file, options.model, session.context()));
    model.poses = poses_of(options.poses, options.poses_file, model.driver(), model.own, options.model, session);
}

void restore_chunk(const FileReader& file, const RestoreArguments& options, Session& session) {
    WorkChunk chunk = chunk_of(options.chunk);
    chunk.job = job_of(options);
    AnimatedModel model;
    read_animated(file, options, session, model);
    const double start = now_seconds();
    session.begin_writing(options.output);
    const ChunkReport written =
        model.in_file
            ? require(write_restored_chunks(*model.in_file, model.poses, options.restore, path_of(options.output),
                                            chunk, session.context()))
            : write_chunk_output(*model.in_memory, model.poses, options.restore, chunk, options.output, session);
    const double seconds = now_seconds() - start;
    Report report;
    const std::string frames = written.frames == 0 ? "no frames"
                                                   : fmt::format("frames {} to {}", written.first_frame + 1,
                                                                 written.first_frame + written.frames);
    report.say(
        fmt::format("{}: chunk {} of {} ({}) {}; {}\n", options.output, chunk.number, chunk.count, frames,
                    written.was_done ? "was done before" : "written in " + seconds_text(seconds),
                    written.is_whole ? "the file is whole" : fmt::format("{} chunks are done", written.chunks_done)));
    report.set("output", options.output);
    report.set("chunk", chunk.number);
    report.set("chunks", chunk.count);
    report.set("first_frame", written.first_frame + 1);
    report.set("frames", written.frames);
    report.set("was_done", written.was_done);
    report.set("chunks_done", written.chunks_done);
    report.set("is_whole", written.is_whole);
    report.set("seconds", seconds);
    session.print(report);
}

/// The model with the poses, for programs that read models.
void keep_poses(const FileReader& file, const RestoreArguments& options, Session& session) {
    PoseSequence own;
    const Model model = session.read_model(file, options.model, options.all_frames ? &own : nullptr);
    const FrameSource<Pose> source = poses_of(options.poses, options.poses_file, model, own, options.model, session);
    PoseSequence poses{source.frames_per_second, {}};
    for (std::size_t frame = 0; frame < source.frames; ++frame) poses.frames.push_back(require(source.frame(frame)));
    session.write_model(model, options.output, poses);
    Report report;
    report.say(fmt::format("{}: the model with {} poses at {:.6g} a second\n", options.output,
                           with_commas(poses.frames.size()), poses.frames_per_second));
    report.set("output", options.output);
    report.set("frames", poses.frames.size());
    report.set("frames_per_second", poses.frames_per_second);
    session.print(report);
}

void restore_all(const FileReader& file, const RestoreArguments& options, Session& session) {
    if (!options.chunk.empty()) return restore_chunk(file, options, session);
    if (is_model_name(options.output)) return keep_poses(file, options, session);
    AnimatedModel model;
    read_animated(file, options, session, model);
    const char* from = source_of(require(model.poses.frame(0)));
    Report report;
    const double start = now_seconds();
    if (model.in_file)
        write_chunks_output(*model.in_file, model.poses, options.restore, options.output, session, report);
    else
        write_animation_output(*model.in_memory, model.poses, options.restore, options.animation,
                               animation_place(options.output), options.model, session, report);
    const double seconds = now_seconds() - start;
    report.set("output", options.output);
    report.add("restored from", fmt::format("{} in {}", from, seconds_text(seconds)), "from", from);
    report.set("seconds", seconds);
    session.print(report);
}

} // namespace

Command restore_command() {
    const auto options = std::make_shared<RestoreArguments>();
    return {.name = "restore",
            .text = "Put the detail back onto a moved driver",
            .options =
                OptionList{
                    Option("model", options->model, "Model file").is_read().required(),
                    Option("--pose", options->pose,
                           "The moved driver: level 0 with the same vertex order. A PLY may have gradients (vertex "
                           "properties f00 to f22)")
                        .is_read(),
                    Option("--frame", options->frame, "Or pose N that the model holds, from 1").whole_from(1),
                    Option("--frames", options->all_frames, "Or all poses that the model holds, as an animation"),
                    Option("--poses", options->poses,
                           "Or an animation of the driver: .pc2, .mdd, a folder of numbered meshes or NAME_####.ply, "
                           "an animated .glb, another .fil's poses")} +
                pose_file_options(options->poses_file) +
                OptionList{output_option(options->output,
                                         "Mesh to write; an animation: .pc2, .mdd, .glb, .usda, a folder for "
                                         "NAME_0001.ply and so on, or NAME_####.obj"),
                           Option("--chunk", options->chunk,
                                  "K/N: restore only the K-th of N parts of the frames, into a .pc2 in which other "
                                  "processes, on any machine, write the other parts"),
                           Option("--surfels", options->as_surfels,
                                  "Write surfels (.ply): points with a normal and the two half axes of a disc"),
                           Option("--input-order", options->in_input_order,
                                  "Write the vertices in the order they had before 'strip --reorder'"),
                           Option("--picture", options->picture,
                                  "Also draw the mesh, coloured by the expected error (.png, .svg, .pdf)")
                               .is_written(),
                           found_up_option(options->up)} +
                restore_options(options->restore) + OptionList{law_option(options->law)} +
                animation_options(options->animation),
            .examples = "  filigree restore scan.fil --pose moved.obj -o restored.ply\n"
                        "  filigree restore scan.fil --pose moved.obj -o restored.ply --picture errors.png\n"
                        "  filigree restore bounce.fil --frame 30 -o half_a_second.ply\n"
                        "  filigree restore bounce.fil --frames -o frames/\n"
                        "  filigree restore scan.fil --poses cloth.pc2 --frame-rate 24 -o detailed.pc2\n"
                        "  filigree restore scan.fil --poses cloth.pc2 -o shot.pc2 --chunk 3/40",
            .run = [options](Session& session) {
                check(*options, session);
                const FileReader file = session.open_model(options->model);
                if (is_reference_model(file, options->model, session))
                    return restore_reference_code(file, *options, session);
                refuse_law(options->model, session);
                options->is_animation() ? restore_all(file, *options, session) : restore_one(file, *options, session);
            }};
}

} // namespace filigree::cli
