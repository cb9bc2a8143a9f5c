// Every command, in the order of the help; each is in the file of its name.
#pragma once

#include "options.h"

namespace filigree::cli {

Command make_command();
Command info_command();
Command remesh_command();
Command fracture_command();
Command strip_command();
Command pack_command();
Command unpack_command();
Command level_command();
Command deform_command();
Command restore_command();
Command compare_command();
Command bench_command();
Command demo_command();
Command render_command();
Command sample_command();
Command simulate_command();
Command drop_command();
Command sweep_command();
Command convert_command();
Command export_command();
Command fit_command();
Command flesh_command();
Command figures_command();
/// Those of them that do nothing but draw: none in a program that is built without the renderer.
std::vector<Command> drawing_commands();

inline std::vector<Command> all_commands() {
    std::vector<Command> commands = {make_command(),  info_command(),   remesh_command(),  strip_command(),
                                     level_command(), deform_command(), restore_command(), compare_command(),
                                     bench_command(), demo_command(),   sample_command(),  simulate_command(),
                                     drop_command(),  export_command(), convert_command(), fracture_command(),
                                     pack_command(),  unpack_command(), sweep_command(),   fit_command(),
                                     flesh_command()};
    for (Command& command : drawing_commands()) commands.push_back(std::move(command));
    return commands;
}

} // namespace filigree::cli
