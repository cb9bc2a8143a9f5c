#include "commands.h"
#include "session.h"

#include "filigree/mesh.h"

namespace filigree::cli {

namespace {

struct MakeOptions {
    std::string shape, output;
    ShapeOptions size;
};

void run(const MakeOptions& options, Session& session) {
    const Mesh mesh = require(make_shape(options.shape, options.size));
    session.write_mesh(mesh, options.output);
    Report report;
    report.set("output", options.output);
    report.set("shape", options.shape);
    report_mesh_written(mesh, options.output, report);
    session.print(report);
}

} // namespace

Command make_command() {
    const auto options = std::make_shared<MakeOptions>();
    ShapeOptions& size = options->size;
    return {.name = "make",
            .text = "Make a built-in shape",
            .options =
                {Option("shape", options->shape, "Which shape")
                     .required()
                     .one_of(std::vector<std::string>(shape_names().begin(), shape_names().end())),
                 output_option(options->output, "Mesh file to write"),
                 Option("--resolution", size.resolution, "Quads along a side").with_default(),
                 Option("--frequency", size.frequency, "Waves along a side").with_default(),
                 Option("--amplitude", size.amplitude, "Height of the waves, as a fraction of the side").with_default(),
                 Option("--size", size.size, "Length of a side, or diameter, in model units").with_default(),
                 Option("--length", size.length, "Bar, cylinder: length, in sides or diameters").with_default(),
                 Option("--thickness", size.thickness,
                        "Torus: radius of the tube, as a fraction of the radius of the ring. wavy-plate: thickness, as "
                        "a fraction of the side")
                     .with_default()},
            .examples = "  filigree make wavy-cube -o cube.ply\n"
                        "  filigree make wavy-cube -o fine.ply --resolution 256 --frequency 9",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
