// The one source that knows CLI11: a command line read by the tables of options.h.
#include "options.h"
#include "session.h"
#include "usage_errors.h"

#include "filigree/core/numbers.h"

#include <charconv>
#include <cmath>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace filigree::cli {

namespace {

bool read_number(const std::string& text, double& number) {
    const auto [end, error] = number_from_chars(text.data(), text.data() + text.size(), number);
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
    std::int64_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    const bool is_whole = error == std::errc() && end == text.data() + text.size() && number >= least;
    return is_whole ? "" : "'" + text + "' is not a whole number from " + std::to_string(least) + " up";
}

/// CLI11's validator, which says in help what it wants, with a sentence of ours.
template <class Says>
CLI::Validator in_our_words(CLI::Validator validator, Says says) {
    return validator.operation([asked = CLI::Validator(validator), says](std::string& text) -> std::string {
        const std::string given = text;
        return asked(text).empty() ? "" : says(given);
    });
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
    void operator()(Option::IntegerRange range) const {
        option.check(in_our_words(CLI::Range(range.least, range.most), [range](const std::string& given) {
            return fmt::format("'{}' is not a whole number from {} to {}", given, range.least, range.most);
        }));
    }
    void operator()(Option::Range range) const {
        option.check(in_our_words(CLI::Range(range.least, range.most), [range](const std::string& given) {
            return fmt::format("'{}' is not a number from {:g} to {:g}", given, range.least, range.most);
        }));
    }
    void operator()(const Option::Words& words) const {
        option.check(in_our_words(CLI::IsMember(words.words), [words = words.words](const std::string& given) {
            return wrong_word(given, words);
        }));
    }
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
    if (option.takes_one) added->allow_extra_args(false)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
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

/// "--at" of "--at: At least 3 required ...", "--at" of "Could not convert: --at = x", with what is behind it.
std::pair<std::string, std::string> split_at(const std::string& text, const std::string& mark) {
    const std::size_t at = text.find(mark);
    if (at == std::string::npos) return {text, ""};
    return {text.substr(0, at), text.substr(at + mark.size())};
}

/// CLI11's sentence in our words. words: those behind the command.
std::string sentence_of(const CLI::App& command, const CLI::ParseError& error, const OptionList& options,
                        std::span<const std::string> words) {
    const std::string kind = error.get_name(), said = error.what();
    if (dynamic_cast<const CLI::ExtrasError*>(&error)) { // whose name is the command's
        if (std::string unknown = unknown_option(options, words); !unknown.empty()) return unknown;
        if (!command.remaining().empty()) return "'" + command.remaining().front() + "' is one argument too many";
    }
    if (kind == "ArgumentMismatch") {
        const std::string received = split_at(said, "received ").second;
        return wrong_count(options, split_at(said, ":").first, std::size_t(std::atoll(received.c_str())));
    }
    if (kind == "ConversionError" && said.starts_with("Could not convert: ")) {
        const auto [name, value] = split_at(split_at(said, ": ").second, " = ");
        return wrong_type(options, name, value);
    }
    if (kind == "ExcludesError") {
        const auto [one, other] = split_at(said, " excludes ");
        return one + " and " + other + " exclude each other; give one of them";
    }
    return said;
}

int say_usage(const std::string& program, const std::string& command, std::string sentence) {
    std::replace(sentence.begin(), sentence.end(), '\n', ' ');
    const std::string where = command.empty() ? "'" + program + " --help' lists the commands."
                                              : "'" + program + " " + command + " --help' lists the options.";
    say(program + ": " + sentence + (sentence.ends_with('?') ? " " : "; ") + where);
    return static_cast<int>(ErrorCode::usage);
}

/// What is wrong with the arguments, in one line that says where help is; or the help or version that was asked for.
int leave(const CLI::App& app, const CLI::ParseError& error, const Program& program,
          std::span<const std::string> words) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const std::vector<CLI::App*> chosen = app.get_subcommands();
    if (chosen.empty()) {
        const std::string unknown = unknown_option({}, words);
        return say_usage(program.name, "", unknown.empty() ? "A command is required" : unknown);
    }
    const std::string name = chosen.front()->get_name();
    OptionList options = program.common;
    for (const Command& command : program.commands)
        if (command.name == name) options = command.options + program.common;
    const auto behind = std::find(words.begin(), words.end(), name);
    return say_usage(
        program.name, name,
        sentence_of(*chosen.front(), error, options, words.last(static_cast<std::size_t>(words.end() - behind) - 1)));
}

/// What CLI11 would let pass: a word that is no command beside --help, and an option given again whose values would be
/// taken for one. Empty: nothing.
std::optional<int> refuse_words(const Program& program, std::span<const std::string> words) {
    if (const std::string wrong = wrong_command(program, words); !wrong.empty())
        return say_usage(program.name, "", wrong);
    for (const Command& command : program.commands) {
        const auto at = std::find(words.begin(), words.end(), command.name);
        if (at == words.end() || std::any_of(words.begin(), at, [](const auto& word) { return word[0] != '-'; }))
            continue;
        const std::string again =
            given_again(command.options + program.common, words.last(static_cast<std::size_t>(words.end() - at) - 1));
        if (!again.empty()) return say_usage(program.name, command.name, again);
    }
    return {};
}

/// "help strip" is "strip --help".
std::vector<std::string> words_of(const std::vector<std::string>& arguments) {
    std::vector<std::string> words(arguments.begin() + (arguments.empty() ? 0 : 1), arguments.end());
    if (words.empty() || words[0] != "help") return words;
    words.erase(words.begin());
    words.emplace_back("--help");
    return words;
}

} // namespace

int run_command_line(const Program& program, Session& session, const std::vector<std::string>& arguments) {
    CLI::App app{program.text, program.name};
    app.set_version_flag("--version", program.name + " " + program.version);
    app.require_subcommand(1);
    app.footer("Examples:\n" + program.examples + "\n\n" + program.notes);
    for (const Command& command : program.commands) add(app, command, command.options + program.common, session);
    const std::vector<std::string> words = words_of(arguments);
    if (const std::optional<int> refused = refuse_words(program, words)) return *refused;
    try {
        app.parse(std::vector<std::string>(words.rbegin(), words.rend())); // which CLI11 wants from behind
        return 0;
    } catch (const CLI::ParseError& error) {
        return leave(app, error, program, words);
    }
}

} // namespace filigree::cli
