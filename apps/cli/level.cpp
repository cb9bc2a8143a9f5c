#include "commands.h"
#include "restore_options.h"

namespace filigree::cli {

namespace {

struct LevelOptions {
    std::string model, output, ghosts;
    unsigned level = 0;
};

Mesh ghost_points(const Model& model, const RunContext& context) {
    Mesh ghosts = driver_mesh(model);
    ghosts.positions = require(Restorer::create(model, {}, context)).rest_ghosts();
    if (ghosts.positions.empty())
        refuse(ErrorCode::unsuitable, "A reference model has no ghost points; strip with --code blend.");
    return ghosts;
}

void run(const LevelOptions& options, Session& session) {
    check_second_output("--ghosts", options.ghosts, options.output);
    const FileReader file = session.open_model(options.model);
    Mesh mesh = session.read_level(file, options.level, options.model);
    if (options.level == 0) mesh = driver_mesh(std::move(mesh));
    const Mesh ghosts =
        options.ghosts.empty() ? Mesh() : ghost_points(session.read_model(file, options.model), session.context());
    session.write_mesh(mesh, options.output, options.model);
    if (!options.ghosts.empty()) session.write_mesh(ghosts, options.ghosts);
    Report report;
    report.set("output", options.output);
    report.set("level", options.level);
    report_mesh_written(mesh, options.output, report);
    session.print(report);
}

} // namespace

Command level_command() {
    const auto options = std::make_shared<LevelOptions>();
    return {.name = "level",
            .text = "Write one level of a model as a mesh; level 0 is the driver",
            .options = {Option("model", options->model, "Model file").is_read().required(),
                        Option("level", options->level, "Level, 0 the coarsest").required(),
                        output_option(options->output, "Mesh file to write"),
                        Option("--ghosts", options->ghosts,
                               "Also write the driver's ghost points: moved along with it, they tell restore how "
                               "space deforms")
                            .is_written()},
            .examples = "  filigree level scan.fil 0 -o driver.obj\n"
                        "  filigree level scan.fil 0 -o driver.ply --ghosts ghosts.ply",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
