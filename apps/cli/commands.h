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
Command sweep_command();
Command export_command();
Command figures_command();

inline std::vector<Command> all_commands() {
    return {make_command(),     info_command(),    remesh_command(),   strip_command(),  level_command(),
            deform_command(),   restore_command(), compare_command(),  bench_command(),  demo_command(),
            render_command(),   sample_command(),  simulate_command(), export_command(), figures_command(),
            fracture_command(), pack_command(),    unpack_command(),   sweep_command()};
}

} // namespace filigree::cli
