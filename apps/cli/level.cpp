#include "restore_options.h"

namespace filigree::cli {

void add_level(CLI::App& app, Session& session) {
    struct Options {
        std::string model, output, ghosts;
        unsigned level = 0;
    };
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("level", "Write one level of a model as a mesh; level 0 is the driver");
    command->add_option("model", options->model, "Model file")->required();
    command->add_option("level", options->level, "Level, 0 the coarsest")->required();
    command->add_option("-o,--output", options->output, "Mesh file to write")->required();
    command->add_option(
        "--ghosts", options->ghosts,
        "Also write the driver's ghost points: moved along with it, they tell restore how space deforms");
    session.add_common_options(*command, "  filigree level scan.fil 0 -o driver.obj\n"
                                         "  filigree level scan.fil 0 -o driver.ply --ghosts ghosts.ply");
    command->callback([options, &session] {
        session.begin();
        check_second_output("--ghosts", options->ghosts, options->output);
        const Model model = session.read_model(options->model);
        if (options->level > model.finest_level())
            throw Failure{{ErrorCode::usage, fmt::format("{} has levels 0 to {}; there is no level {}.", options->model,
                                                         model.finest_level(), options->level)}};
        const Mesh mesh = options->level == 0 ? driver_mesh(model) : level_mesh(model, options->level);
        Mesh ghosts;
        if (!options->ghosts.empty()) {
            ghosts = driver_mesh(model);
            ghosts.positions = require(Restorer::create(model, {}, session.context())).rest_ghosts();
            if (ghosts.positions.empty())
                throw Failure{
                    {ErrorCode::unsuitable, "A reference model has no ghost points; strip with --code blend."}};
        }
        session.write_mesh(mesh, options->output, options->model);
        if (!options->ghosts.empty()) session.write_mesh(ghosts, options->ghosts);
        session.print(fmt::format("{}: {} vertices, {} faces\n", options->output, with_commas(mesh.vertex_count()),
                                  with_commas(mesh.face_count())),
                      {{"output", options->output},
                       {"level", options->level},
                       {"vertices", mesh.vertex_count()},
                       {"faces", mesh.face_count()}});
    });
}

} // namespace filigree::cli
