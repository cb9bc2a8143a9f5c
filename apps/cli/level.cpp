#include "commands.h"

#include "session.h"

#include "filigree/blend/pose_mesh.h"
#include "filigree/io/system/file.h"

namespace filigree::cli {

namespace {

struct LevelOptions {
    std::string model, output;
    unsigned level = 0;
};

void run(const LevelOptions& options, Session& session) {
    const FileReader file = session.open_model(options.model);
    Mesh mesh = session.read_level(file, options.level, options.model);
    if (options.level == 0) mesh = driver_mesh(std::move(mesh));
    session.write_mesh(mesh, options.output, options.model);
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
                        Option("level", options->level, "Level; 0 is the coarsest").required(),
                        output_option(options->output, "Mesh file to write")},
            .examples = "  filigree level scan.fil 0 -o driver.obj",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
