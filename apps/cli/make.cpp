#include "session.h"

#include "filigree/mesh/shapes.h"

namespace filigree::cli {

void add_make(CLI::App& app, Session& session) {
    struct Options {
        std::string shape, output;
        ShapeOptions shape_options;
    };
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("make", "Make a built-in shape");
    std::vector<std::string> names(shape_names().begin(), shape_names().end());
    command->add_option("shape", options->shape, "The shape")->required()->check(CLI::IsMember(names));
    command->add_option("-o,--output", options->output, "Mesh file to write")->required();
    ShapeOptions& shape = options->shape_options;
    command->add_option("--resolution", shape.resolution, "Quads along a side")->capture_default_str();
    command->add_option("--frequency", shape.frequency, "Waves along a side")->capture_default_str();
    command->add_option("--amplitude", shape.amplitude, "Height of the waves, fraction of the side")
        ->capture_default_str();
    command->add_option("--size", shape.size, "Side or diameter, model units")->capture_default_str();
    command->add_option("--length", shape.length, "Bar, cylinder: length in sides")->capture_default_str();
    command->add_option("--thickness", shape.thickness, "Torus: radius of the tube in radii of the ring")
        ->capture_default_str();
    session.add_common_options(*command, "  filigree make wavy-cube -o cube.ply\n"
                                         "  filigree make wavy-cube -o fine.ply --resolution 256 --frequency 9");
    command->callback([options, &session] {
        session.begin();
        const Mesh mesh = require(make_shape(options->shape, options->shape_options));
        session.write_mesh(mesh, options->output);
        session.print(fmt::format("{}: {} vertices, {} faces\n", options->output, with_commas(mesh.vertex_count()),
                                  with_commas(mesh.face_count())),
                      {{"output", options->output},
                       {"shape", options->shape},
                       {"vertices", mesh.vertex_count()},
                       {"faces", mesh.face_count()}});
    });
}

} // namespace filigree::cli
