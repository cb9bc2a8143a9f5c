// filigree: the command line. Each command is in the file of its name.
#include "session.h"

#include <new>

int main(int argc, char** argv) {
    using namespace filigree;
    cli::Session session;
    CLI::App app{"Filigree takes the detail off a mesh, lets anything move what is left, and puts the detail back.",
                 "filigree"};
    app.set_version_flag("--version", "filigree " FILIGREE_VERSION);
    app.require_subcommand(1);
    app.footer("Exit codes: 0 done, 2 usage, 3 cannot read, 4 damaged file, 5 unknown format, 6 cannot write,\n"
               "7 unsuitable input, 8 inputs do not belong together, 9 out of memory, 130 cancelled.\n"
               "'filigree COMMAND --help' has examples.");
    cli::add_make(app, session);
    cli::add_info(app, session);
    cli::add_strip(app, session);
    cli::add_level(app, session);
    cli::add_deform(app, session);
    cli::add_restore(app, session);
    cli::add_compare(app, session);
    cli::add_bench(app, session);
    cli::add_demo(app, session);
    try {
        app.parse(argc, argv);
        return 0;
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : static_cast<int>(ErrorCode::usage);
    } catch (const cli::Failure& failure) {
        fmt::print(stderr, "filigree: {}\n", failure.error.message);
        return static_cast<int>(failure.error.code);
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "filigree: Out of memory; nothing was written. Close other programs or use a smaller mesh.\n");
        return static_cast<int>(ErrorCode::out_of_memory);
    }
}
