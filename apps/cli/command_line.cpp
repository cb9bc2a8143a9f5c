// The one source that knows CLI11: a command line read by the tables of options.h.
#include "options.h"
#include "session.h"

#include <charconv>
#include <cmath>

#include <CLI/CLI.hpp>

namespace filigree::cli {

namespace {

bool read_number(const std::string& text, double& number) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    return error == std::errc() && end == text.data() + text.size() && std::isfinite(number);
}

std::string check_finite(std::string& text) {
    double number;
    return read_number(text, number) ? "" : "'" + text + "' is not a number";
}

std::string check_above_zero(std::string& text) {
    double number;
    return read_number(text, number) && number > 0 ? "" : "'" + text + "' is not a number above 0";
}

std::string check_whole(const std::string& text, std::int64_t least) {
    std::int64_t number;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    const bool is_whole = error == std::errc() && end == text.data() + text.size() && number >= least;
    return is_whole ? "" : "'" + text + "' is not a whole number from " + std::to_string(least) + " up";
}

/// Adds an option's check to CLI11's option.
struct AddCheck {
    CLI::Option& option;

    void operator()(Option::Any) const {}
    void operator()(Option::Finite) const { option.check(CLI::Validator(check_finite, "")); }
    void operator()(Option::AboveZero) const { option.check(CLI::Validator(check_above_zero, "")); }
    void operator()(Option::WholeFrom whole) const {
        option.check(CLI::Validator([whole](std::string& text) { return check_whole(text, whole.least); }, ""));
    }
    void operator()(Option::IntegerRange range) const { option.check(CLI::Range(range.least, range.most)); }
    void operator()(Option::Range range) const { option.check(CLI::Range(range.least, range.most)); }
    void operator()(const Option::Words& words) const { option.check(CLI::IsMember(words.words)); }
};

/// Adds an option by what it writes to.
struct AddOption {
    CLI::App& command;
    const Option& option;

    CLI::Option* operator()(bool* flag) const { return command.add_flag(option.name, *flag, option.text); }
    template <class T>
    CLI::Option* operator()(T* value) const {
        return command.add_option(option.name, *value, option.text);
    }
    CLI::Option* operator()(const Option::EachText& set) const {
        return command.add_option_function<std::string>(option.name, set, option.text);
    }
    CLI::Option* operator()(const Option::EachNumber& set) const {
        return command
            .add_option_function<double>(
                option.name, [set](const double& number) { set(number); }, option.text)
            ->trigger_on_parse()
            ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    }
};

CLI::Option* add(CLI::App& command, const Option& option) {
    CLI::Option* added = std::visit(AddOption{command, option}, option.target);
    std::visit(AddCheck{*added}, option.check);
    if (option.is_required) added->required();
    if (option.most_values > 0) added->expected(option.least_values, option.most_values);
    if (option.has_commas) added->delimiter(',');
    if (option.takes_one) added->allow_extra_args(false);
    if (!option.value_name.empty()) added->type_name(option.value_name);
    if (option.shows_default) added->capture_default_str();
    return added;
}

void add(CLI::App& app, const Command& command, const OptionList& options, Session& session) {
    CLI::App* added = app.add_subcommand(command.name, command.text);
    std::vector<std::pair<std::string, CLI::Option*>> by_name;
    for (const Option& option : options) by_name.emplace_back(option.long_name(), add(*added, option));
    const auto find = [&](const std::string& name) {
        return std::find_if(by_name.begin(), by_name.end(), [&](const auto& entry) { return entry.first == name; });
    };
    for (std::size_t i = 0; i < options.size(); ++i)
        for (const std::string& other : options[i].excluded) by_name[i].second->excludes(find(other)->second);
    added->footer("Examples:\n" + command.examples);
    added->callback([by_name, options, run = command.run, &session] {
        for (const auto& [name, option] : by_name)
            if (option->count() > 0) session.note_given(name, option->results());
        session.begin();
        refuse_to_overwrite_inputs(options);
        run(session);
    });
}

/// What is wrong with the arguments, in one line that says where help is; or the help or version that was asked for.
int leave(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::string sentence = error.what(), command = app.get_name();
    std::replace(sentence.begin(), sentence.end(), '\n', ' ');
    for (const CLI::App* chosen : app.get_subcommands()) command += " " + chosen->get_name();
    if (app.get_subcommands().empty() && error.get_name() == "RequiredError")
        sentence = argc > 1 ? "'" + std::string(argv[1]) + "' is no command" : "A command is required";
    say(app.get_name() + ": " + sentence + "; '" + command + " --help' says what there is.");
    return static_cast<int>(ErrorCode::usage);
}

} // namespace

int run_command_line(const Program& program, Session& session, int argc, char** argv) {
    CLI::App app{program.text, program.name};
    app.set_version_flag("--version", program.name + " " + program.version);
    app.require_subcommand(1);
    app.footer("Examples:\n" + program.examples + "\n\n" + program.notes);
    for (const Command& command : program.commands) add(app, command, command.options + program.common, session);
    try {
        app.parse(argc, argv);
        return 0;
    } catch (const CLI::ParseError& error) {
        return leave(app, error, argc, argv);
    }
}

} // namespace filigree::cli
