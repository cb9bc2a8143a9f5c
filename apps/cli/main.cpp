// filigree: the command line. Each command is in the file of its name.
#include "session.h"

#include <algorithm>
#include <new>
#include <stdexcept>

using namespace filigree;

namespace {

constexpr int kOwnError = 1; // what no ErrorCode foresees: a mistake in this program

int exit_code(ErrorCode code) { return static_cast<int>(code); }

/// What is wrong with the arguments, in one line that says where help is; or the help or version that was asked for.
int leave(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::string sentence = error.what(), command = "filigree";
    std::replace(sentence.begin(), sentence.end(), '\n', ' ');
    for (const CLI::App* chosen : app.get_subcommands()) command += " " + chosen->get_name();
    if (app.get_subcommands().empty() && error.get_name() == "RequiredError")
        sentence = argc > 1 ? fmt::format("'{}' is no command", argv[1]) : "A command is required";
    cli::say(fmt::format("filigree: {}; '{} --help' says what there is.", sentence, command));
    return exit_code(ErrorCode::usage);
}

int run(int argc, char** argv) {
    cli::Session session;
    CLI::App app{"Filigree takes the detail off a mesh, lets anything move what is left, and puts the detail back.",
                 "filigree"};
    app.set_version_flag("--version", "filigree " FILIGREE_VERSION);
    app.require_subcommand(1);
    app.footer("Examples:\n"
               "  filigree demo\n"
               "  filigree strip scan.ply -o scan.fil && filigree level scan.fil 0 -o driver.obj\n"
               "  filigree restore scan.fil --pose moved_driver.obj -o restored.ply\n\n"
               "FILE '-' is standard input or output. Each command has examples: 'filigree COMMAND --help'.\n"
               "Exit codes: 0 done, 1 an error of our own, 2 usage, 3 cannot read, 4 damaged file, 5 unknown format, 6 "
               "cannot write,\n"
               "7 unsuitable input, 8 inputs do not belong together, 9 out of memory, 130 cancelled.");
    cli::add_make(app, session);
    cli::add_info(app, session);
    cli::add_remesh(app, session);
    cli::add_strip(app, session);
    cli::add_level(app, session);
    cli::add_deform(app, session);
    cli::add_restore(app, session);
    cli::add_compare(app, session);
    cli::add_bench(app, session);
    cli::add_demo(app, session);
    cli::add_render(app, session);
    cli::add_sample(app, session);
    cli::add_simulate(app, session);
    cli::add_export(app, session);
    cli::add_figures(app, session);
    try {
        app.parse(argc, argv);
        return 0;
    } catch (const CLI::ParseError& error) {
        return leave(app, error, argc, argv);
    }
}

int out_of_memory() {
    cli::say("filigree: Out of memory; nothing was written. Close other programs or use a smaller mesh.");
    return exit_code(ErrorCode::out_of_memory);
}

} // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const cli::Failure& failure) {
        cli::say("filigree: " + failure.error.message);
        return exit_code(failure.error.code);
    } catch (const std::bad_alloc&) {
        return out_of_memory();
    } catch (const std::length_error&) { // more than any vector can hold
        return out_of_memory();
    } catch (const std::exception& error) {
        cli::say(fmt::format("filigree: An error of our own ({}); please report it with the command.", error.what()));
        return kOwnError;
    }
}
