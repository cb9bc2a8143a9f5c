// Commands and their options as plain tables. command_line.cpp reads a command line by them, manual.cpp prints them as
// manual pages; no command knows how either is done.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace filigree::cli {

class Session;

/// One option ("-o,--output"), flag ("--json") or positional argument ("mesh"). It says where the value goes, so the
/// target has to live until the command has run.
struct Option {
    using EachText = std::function<void(const std::string&)>;
    using EachNumber = std::function<void(double)>; ///< called at once, in the order of the command line
    using Target = std::variant<bool*, std::string*, unsigned*, std::size_t*, double*, std::optional<unsigned>*,
                                std::optional<std::size_t>*, std::optional<double>*, std::vector<std::string>*,
                                std::vector<double>*, std::vector<std::size_t>*, EachText, EachNumber>;

    struct Any {};
    struct Finite {};
    struct AboveZero {};
    struct WholeFrom {
        std::int64_t least;
    };
    struct IntegerRange {
        int least, most;
    };
    struct Range {
        double least, most;
    };
    struct Words {
        std::vector<std::string> words;
    };
    /// What a value must be. Numbers are read by the same rules in every locale.
    using Check = std::variant<Any, Finite, AboveZero, WholeFrom, IntegerRange, Range, Words>;

    /// What the value is the name of. No command writes over a file that it reads.
    enum class File { none, read, written };

    std::string name;
    Target target;
    std::string text; ///< what it is for
    Check check = Any{};
    bool is_required = false, shows_default = false;
    int least_values = 0, most_values = 0; ///< of a list; 0: any number
    bool has_commas = false;               ///< a list may be written "1,2,3"
    bool takes_one = false;                ///< a list gets one value each time the option is given
    File file = File::none;
    std::string value_name;            ///< what help calls the value; empty: by its type
    std::vector<std::string> excluded; ///< options that cannot be given with this one

    template <class T>
    Option(std::string names, T& value, std::string purpose)
        : name(std::move(names)), target(&value), text(std::move(purpose)) {}
    Option(std::string names, EachText set, std::string purpose)
        : name(std::move(names)), target(std::move(set)), text(std::move(purpose)) {}
    Option(std::string names, EachNumber set, std::string purpose)
        : name(std::move(names)), target(std::move(set)), text(std::move(purpose)) {}

    bool is_positional() const { return name[0] != '-'; }
    /// "--output" of "-o,--output".
    std::string long_name() const { return name.substr(name.find(',') + 1); }

    Option required() const { return with(&Option::is_required, true); }
    /// Help shows the value that the target has at the start.
    Option with_default() const { return with(&Option::shows_default, true); }
    Option is_read() const { return with(&Option::file, File::read); }
    Option is_written() const { return with(&Option::file, File::written); }
    Option finite() const { return with(&Option::check, Finite{}); }
    Option above_zero() const { return with(&Option::check, AboveZero{}); }
    Option whole_from(std::int64_t least) const { return with(&Option::check, WholeFrom{least}); }
    Option between(int least, int most) const { return with(&Option::check, IntegerRange{least, most}); }
    Option between(double least, double most) const { return with(&Option::check, Range{least, most}); }
    Option one_of(std::vector<std::string> words) const { return with(&Option::check, Words{std::move(words)}); }
    Option values(int least, int most) const {
        return with(&Option::least_values, least).with(&Option::most_values, most);
    }
    Option values(int count) const { return values(count, count); }
    Option comma_separated() const { return with(&Option::has_commas, true); }
    Option one_at_a_time() const { return with(&Option::takes_one, true); }
    Option named(std::string value) const { return with(&Option::value_name, std::move(value)); }
    Option excludes(std::vector<std::string> others) const { return with(&Option::excluded, std::move(others)); }

private:
    template <class Member, class Value>
    Option with(Member Option::*member, Value value) const {
        Option changed = *this;
        changed.*member = std::move(value);
        return changed;
    }
};

/// "-o" of a command that has to be told where to write.
inline Option output_option(std::string& target, std::string text) {
    return Option("-o,--output", target, std::move(text)).is_written().required();
}

/// An option that is one of a few words, each of which stands for a value of `target` (a T or an optional T).
template <class T, class Target>
Option choice(std::string name, Target& target, std::vector<std::pair<std::string, T>> choices, std::string text) {
    std::vector<std::string> words;
    for (const auto& [word, value] : choices) words.push_back(word);
    std::sort(words.begin(), words.end());
    const auto set = [&target, choices = std::move(choices)](const std::string& word) {
        for (const auto& [known, value] : choices)
            if (known == word) target = value;
    };
    return Option(std::move(name), Option::EachText(set), std::move(text)).one_of(std::move(words)).named("WORD");
}

using OptionList = std::vector<Option>;

/// Both, one behind the other.
inline OptionList operator+(OptionList first, const OptionList& second) {
    first.insert(first.end(), second.begin(), second.end());
    return first;
}

struct Command {
    std::string name, text;
    OptionList options;
    std::string examples; ///< a line each
    std::function<void(Session&)> run;
};

/// What is said of the program itself.
struct Program {
    std::string name, text, version;
    std::string examples;
    std::string notes; ///< below the examples
    OptionList common; ///< of every command
    std::vector<Command> commands;
};

/// Refuses an option that would have the command write over a file that another has it read, under whatever name.
void refuse_to_overwrite_inputs(const OptionList& options);

/// Runs the command that the arguments name, or prints the help or version that they ask for; returns the exit code.
/// The first argument is the program's own name.
int run_command_line(const Program& program, Session& session, const std::vector<std::string>& arguments);

/// The manual page (troff, section 1) of the program, or of the command of this name; empty: there is none.
std::string manual_page(const Program& program, const std::string& command = {});

} // namespace filigree::cli
