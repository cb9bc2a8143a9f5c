#include "output_folder.h"
#include "restore_options.h"

namespace filigree::cli {

namespace {

/// Name of the gradient's entry in row r and column c, as the PLY property is called.
std::string gradient_name(int r, int c) { return fmt::format("f{}{}", r, c); }

const std::vector<float>* find_scalar(const Mesh& mesh, const std::string& name) {
    for (const VertexScalar& scalar : mesh.scalars)
        if (scalar.name == name) return &scalar.values;
    return nullptr;
}

std::vector<Vec3f> positions_for(const Mesh& mesh, const Model& model) {
    std::vector<Vec3f> positions(mesh.vertex_count());
    for (std::size_t v = 0; v < positions.size(); ++v)
        positions[v] = (mesh.world_position(v) - model.mesh.origin).cast<float>();
    return positions;
}

} // namespace

void add_restore_options(CLI::App& command, RestoreOptions& options) {
    std::map<std::string, Law> laws;
    for (std::string_view name : kLawNames) laws[std::string(name)] = *law_from_name(name);
    add_choice<Law>(
        command, "--law", laws, [&options](Law law) { options.law = law; },
        "How high detail is when its surroundings grow (unset: proportional, or inverse for a reference model)");
    command.add_option("--level", options.level, "Restore up to this level (unset: the finest)");
    command.add_flag("--thin-shell", options.thin_shell, "Bumps keep their shape, as on cloth and skin");
}

Pose pose_from_mesh(const Mesh& mesh, const Model& model) {
    Pose pose;
    pose.positions = positions_for(mesh, model);
    std::array<const std::vector<float>*, 9> entries;
    for (int k = 0; k < 9; ++k)
        if (!(entries[k] = find_scalar(mesh, gradient_name(k / 3, k % 3)))) return pose;
    pose.gradients.resize(pose.positions.size());
    for (std::size_t v = 0; v < pose.gradients.size(); ++v)
        for (int k = 0; k < 9; ++k) pose.gradients[v](k / 3, k % 3) = (*entries[k])[v];
    return pose;
}

const Pose& own_pose(const PoseSequence& poses, std::size_t frame, const std::string& path) {
    if (poses.empty())
        throw Failure{{ErrorCode::unsuitable,
                       path + ": has no poses of its own; 'filigree simulate' makes them, --pose FILE names another."}};
    if (frame < 1 || frame > poses.frames.size())
        throw Failure{{ErrorCode::usage,
                       fmt::format("{}: has frames 1 to {}; there is no frame {}.", path, poses.frames.size(), frame)}};
    return poses.frames[frame - 1];
}

Mesh driver_mesh(const Model& model) {
    Mesh driver = level_mesh(model, 0);
    std::erase_if(driver.scalars, [](const VertexScalar& scalar) { return is_gradient_name(scalar.name); });
    return driver;
}

Mesh posed_driver(const Model& model, const Pose& pose) {
    Mesh driver = driver_mesh(model);
    driver.positions = pose.positions;
    driver.normals = {};
    for (int k = 0; k < 9 && !pose.gradients.empty(); ++k) {
        VertexScalar& scalar = driver.scalars.emplace_back(VertexScalar{gradient_name(k / 3, k % 3), {}});
        for (const Mat3f& gradient : pose.gradients) scalar.values.push_back(gradient(k / 3, k % 3));
    }
    return driver;
}

namespace {

struct Options {
    std::string model, pose, ghosts, output;
    std::size_t frame = 0; ///< of the model's own, from 1; 0: none
    bool all_frames = false;
    RestoreOptions restore;
};

void check(const Options& options) {
    const auto refuse = [](const std::string& sentence) { throw Failure{{ErrorCode::usage, sentence}}; };
    if (!options.pose.empty() + (options.frame > 0) + options.all_frames != 1)
        refuse("Say what moved the driver: --pose FILE, or for a model that holds poses --frame N or --frames.");
    if (options.pose.empty() && !options.ghosts.empty()) refuse("--ghosts belongs to --pose.");
    if (options.all_frames && options.output == "-") refuse("--frames writes many meshes; give -o a folder.");
}

const char* source_of(const Model& model, const Pose& pose) {
    if (model.code() == DetailCode::reference) return "positions";
    if (!pose.gradients.empty()) return "positions and gradients";
    return pose.ghosts.empty() ? "positions" : "positions and ghost points";
}

void restore_one(const Options& options, Session& session) {
    PoseSequence own;
    const Model model = session.read_model(options.model, options.frame ? &own : nullptr);
    Pose pose = options.frame ? own_pose(own, options.frame, options.model)
                              : pose_from_mesh(session.read_mesh(options.pose), model);
    if (!options.ghosts.empty()) pose.ghosts = positions_for(session.read_mesh(options.ghosts), model);
    const Restorer restorer = require(Restorer::create(model, options.restore, session.context()));
    const double start = now_seconds();
    const Mesh mesh = require(restorer.mesh(pose, session.context()));
    const double seconds = now_seconds() - start;
    session.write_mesh(mesh, options.output);
    const char* from = source_of(model, pose);
    session.print(
        fmt::format("{}: {} vertices restored from {} in {}\n", options.output, with_commas(mesh.vertex_count()), from,
                    seconds_text(seconds)),
        {{"output", options.output}, {"vertices", mesh.vertex_count()}, {"from", from}, {"seconds", seconds}});
}

/// A mesh a frame, one in memory at a time.
void restore_all(const Options& options, Session& session) {
    PoseSequence poses;
    const Model model = session.read_model(options.model, &poses);
    own_pose(poses, 1, options.model);
    const Restorer restorer = require(Restorer::create(model, options.restore, session.context()));
    OutputFolder folder(options.output, options.model);
    const std::string name = std::filesystem::path(options.model).stem().string();
    std::vector<std::string> files;
    for (std::size_t frame = 1; frame <= poses.frames.size(); ++frame)
        files.push_back(folder.file(fmt::format("{}_{:04}.ply", name, frame)));
    RunContext without_bar = session.context(); // the bar tells of frames
    without_bar.progress = nullptr;
    double seconds = 0;
    for (std::size_t frame = 0; frame < files.size(); ++frame) {
        session.context().report("restoring", double(frame) / double(files.size()));
        const double start = now_seconds();
        const Mesh mesh = require(restorer.mesh(poses.frames[frame], without_bar));
        seconds += now_seconds() - start;
        session.write_mesh(mesh, files[frame]);
    }
    session.context().report("restoring", 1);
    folder.keep();
    session.print(fmt::format("{}: {} meshes of {} vertices, restored in {} each\n", options.output,
                              with_commas(files.size()), with_commas(restorer.vertex_count()),
                              seconds_text(seconds / double(files.size()))),
                  {{"output", options.output},
                   {"frames", files.size()},
                   {"frames_per_second", poses.frames_per_second},
                   {"vertices", restorer.vertex_count()},
                   {"from", source_of(model, poses.frames[0])},
                   {"seconds", seconds}});
}

} // namespace

void add_restore(CLI::App& app, Session& session) {
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("restore", "Put the detail back onto a moved driver");
    command->add_option("model", options->model, "Model file")->required();
    command->add_option(
        "--pose", options->pose,
        "The moved driver: level 0 with the same vertex order; a PLY with vertex properties f00 .. f22 gives "
        "gradients too");
    command->add_option("--ghosts", options->ghosts, "The moved ghost points (see level --ghosts)");
    command->add_option("--frame", options->frame, "Or one of the poses that the model holds, from 1")
        ->check(whole_number(1));
    command->add_flag("--frames", options->all_frames, "Or all of them: -o is a folder for NAME_0001.ply and so on");
    command->add_option("-o,--output", options->output, "Mesh file to write, or a folder")->required();
    add_restore_options(*command, options->restore);
    session.add_common_options(*command,
                               "  filigree restore scan.fil --pose moved.obj -o restored.ply\n"
                               "  filigree restore scan.fil --pose moved.obj -o skin.ply --thin-shell --law keep\n"
                               "  filigree restore bounce.fil --frame 30 -o half_a_second.ply\n"
                               "  filigree restore bounce.fil --frames -o frames/");
    command->callback([options, &session] {
        session.begin();
        check(*options);
        if (options->all_frames)
            restore_all(*options, session);
        else
            restore_one(*options, session);
    });
}

} // namespace filigree::cli
