#include "commands.h"
#include "restore_options.h"

#include <fmt/format.h>

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
    const Model model = session.read_model(options.model);
    if (options.level > model.finest_level())
        refuse(fmt::format("{} has levels 0 to {}; there is no level {}.", options.model, model.finest_level(),
                           options.level));
    const Mesh mesh = options.level == 0 ? driver_mesh(model) : level_mesh(model, options.level);
    const Mesh ghosts = options.ghosts.empty() ? Mesh() : ghost_points(model, session.context());
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
                        Option("-o,--output", options->output, "Mesh file to write").is_written().required(),
                        Option("--ghosts", options->ghosts,
                               "Also write the driver's ghost points: moved along with it, they tell restore how "
                               "space deforms")
                            .is_written()},
            .examples = "  filigree level scan.fil 0 -o driver.obj\n"
                        "  filigree level scan.fil 0 -o driver.ply --ghosts ghosts.ply",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
