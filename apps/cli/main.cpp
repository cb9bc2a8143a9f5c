// filigree: the command line. Each command is in the file of its name.
#include "commands.h"
#include "session.h"
#include "usage_errors.h"

#include "filigree/io/system/platform.h"

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <stdexcept>
#include <string_view>
#include <system_error>

using namespace filigree;

namespace {

constexpr int kOwnError = 1; // what no ErrorCode foresees: a mistake in this program

int exit_code(ErrorCode code) { return static_cast<int>(code); }

cli::Program make_program(cli::Session& session) {
    return {.name = "filigree",
            .text = "Filigree takes the detail off a mesh, lets any program move the light driver that is left, and "
                    "puts the detail back.",
            .version = FILIGREE_VERSION,
            .examples = "  filigree demo\n"
                        "  filigree strip scan.ply -o scan.fil && filigree level scan.fil 0 -o driver.obj\n"
                        "  filigree restore scan.fil --pose moved_driver.obj -o restored.ply",
            .notes = "The file name '-' is standard input or output.\n"
                     "'filigree COMMAND --help' lists a command's options, with examples.\n"
                     "Exit codes: 0 done, 1 internal error, 2 wrong arguments, 3 cannot read, 4 damaged file,\n"
                     "5 unknown format, 6 cannot write, 7 unsuitable input, 8 inputs do not match, 9 out of memory,\n"
                     "10 done but not to be trusted, 130 cancelled.",
            .common = session.common_options(),
            .commands = cli::all_commands()};
}

/// `filigree --man [COMMAND]`, for those who package the program; not in the help.
int print_manual(const cli::Program& program, const std::string& command) {
    const std::string page = cli::manual_page(program, command);
    if (page.empty()) {
        const std::string sentence = cli::no_such_command(program, command);
        cli::say("filigree: " + sentence + (sentence.ends_with('?') ? " " : "; ") +
                 "'filigree --help' lists the commands.");
        return exit_code(ErrorCode::usage);
    }
    const bool is_written = std::fputs(page.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
    return is_written ? 0 : exit_code(ErrorCode::unwritable);
}

int run(const std::vector<std::string>& arguments) {
    cli::Session session;
    const cli::Program program = make_program(session);
    const std::size_t count = arguments.size();
    if (count > 1 && count <= 3 && arguments[1] == "--man") return print_manual(program, count > 2 ? arguments[2] : "");
    return cli::run_command_line(program, session, arguments);
}

int fail(const Error& error) {
    cli::say("filigree: " + error.message);
    return exit_code(error.code);
}

int out_of_memory() {
    return fail(
        {ErrorCode::out_of_memory, "Out of memory; nothing was written. Close other programs or use a smaller mesh."});
}

int own_error(const std::exception& error) {
    cli::say(std::string("filigree: Internal error (") + error.what() + "); please report it, with the command.");
    return kOwnError;
}

/// Whether this is a thread for which there was no room.
bool is_thread_refused(const std::exception& error) {
    const auto* system = dynamic_cast<const std::system_error*>(&error);
    return system && system->code() == std::errc::resource_unavailable_try_again;
}

/// Where memory ends in a destructor (nlohmann's JSON takes some when it goes), no exception comes here.
[[noreturn]] void end_at_once() {
    constexpr std::string_view kLine =
        "filigree: Out of memory; nothing was written. Close other programs or use a smaller mesh.\n";
    if (const std::exception_ptr thrown = std::current_exception()) {
        try {
            std::rethrow_exception(thrown);
        } catch (const std::bad_alloc&) {
            platform::write(platform::kStandardError, kLine);
            platform::end_process(static_cast<int>(ErrorCode::out_of_memory));
        } catch (...) {
        }
    }
    std::abort();
}

} // namespace

int main(int argc, char** argv) {
    // Buffers of a few megabytes come and go (a chunk of a model, a frame): to give them back and have them again costs
    // a page fault every 4 KiB, more than what is done with them.
    platform::keep_freed_memory();
    std::set_terminate(end_at_once);
    try {
        return run(platform::arguments(argc, argv));
    } catch (const cli::Failure& failure) {
        return fail(failure.error);
    } catch (const cli::Doubt& doubt) {
        cli::say("filigree: " + doubt.sentence);
        return cli::kDoubtful;
    } catch (const BadResultAccess& failure) {
        return fail(failure.error());
    } catch (const std::bad_alloc&) {
        return out_of_memory();
    } catch (const std::length_error&) { // more than any vector can hold
        return out_of_memory();
    } catch (const std::exception& error) {
        return is_thread_refused(error) ? out_of_memory() : own_error(error);
    }
}
