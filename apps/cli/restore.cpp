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

void add_restore(CLI::App& app, Session& session) {
    struct Options {
        std::string model, pose, ghosts, output;
        RestoreOptions restore;
    };
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("restore", "Put the detail back onto a moved driver");
    command->add_option("model", options->model, "Model file")->required();
    command
        ->add_option(
            "--pose", options->pose,
            "The moved driver: level 0 with the same vertex order; a PLY with vertex properties f00 .. f22 gives "
            "gradients too")
        ->required();
    command->add_option("--ghosts", options->ghosts, "The moved ghost points (see level --ghosts)");
    command->add_option("-o,--output", options->output, "Mesh file to write")->required();
    add_restore_options(*command, options->restore);
    session.add_common_options(*command,
                               "  filigree restore scan.fil --pose moved.obj -o restored.ply\n"
                               "  filigree restore scan.fil --pose moved.obj -o skin.ply --thin-shell --law keep");
    command->callback([options, &session] {
        session.begin();
        const Model model = session.read_model(options->model);
        const Mesh moved = session.read_mesh(options->pose);
        Pose pose = pose_from_mesh(moved, model);
        if (!options->ghosts.empty()) pose.ghosts = positions_for(session.read_mesh(options->ghosts), model);
        const Restorer restorer = require(Restorer::create(model, options->restore, session.context()));
        const double start = now_seconds();
        const Mesh mesh = require(restorer.mesh(pose, session.context()));
        const double seconds = now_seconds() - start;
        session.write_mesh(mesh, options->output);
        const char* from = model.code() == DetailCode::reference ? "positions"
                           : !pose.gradients.empty()             ? "positions and gradients"
                           : !pose.ghosts.empty()                ? "positions and ghost points"
                                                                 : "positions";
        session.print(
            fmt::format("{}: {} vertices restored from {} in {}\n", options->output, with_commas(mesh.vertex_count()),
                        from, seconds_text(seconds)),
            {{"output", options->output}, {"vertices", mesh.vertex_count()}, {"from", from}, {"seconds", seconds}});
    });
}

} // namespace filigree::cli
