#include "usage_errors.h"

#include "filigree/io/system/extension.h"
#include "filigree/scene/scene_keys.h"

#include <cctype>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

std::string like(const std::string& word, const std::vector<std::string>& words) {
    const std::vector<std::string_view> views(words.begin(), words.end());
    return most_alike(word, views);
}

bool looks_like_option(const std::string& word) {
    return word.size() > 1 && word[0] == '-' && (word[1] == '-' || std::isalpha(static_cast<unsigned char>(word[1])));
}

/// "--base" of "--base=100", "-o" of "-oname".
std::string option_part(const std::string& word) {
    return word.starts_with("--") ? word.substr(0, word.find('=')) : word.substr(0, 2);
}

const Option* find_option(const OptionList& options, const std::string& name) {
    for (const Option& option : options)
        if (option.long_name() == name || option.name.substr(0, option.name.find(',')) == name) return &option;
    return nullptr;
}

/// Words behind "--" are files, whatever they are called.
std::span<const std::string> before_files(std::span<const std::string> words) {
    return words.first(static_cast<std::size_t>(std::find(words.begin(), words.end(), "--") - words.begin()));
}

bool counts_once(const Option& option) {
    if (option.is_positional() || option.takes_one) return false;
    const bool is_flag = std::holds_alternative<bool*>(option.target);
    const bool is_step = std::holds_alternative<Option::EachNumber>(option.target);
    const bool is_list = std::holds_alternative<std::vector<std::string>*>(option.target) ||
                         std::holds_alternative<std::vector<double>*>(option.target) ||
                         std::holds_alternative<std::vector<std::size_t>*>(option.target);
    return !is_flag && !is_step && !(is_list && option.most_values == 0);
}

/// The option that is meant: by how it is written, else by what its help speaks of.
std::string meant_option(const OptionList& options, const std::string& given) {
    std::vector<std::string> names = {"help"};
    for (const Option& option : options)
        if (!option.is_positional() && option.long_name().starts_with("--"))
            names.push_back(option.long_name().substr(2));
    const std::string word = given.substr(std::min(given.find_first_not_of('-'), given.size()));
    if (const std::string alike = like(word, names); !alike.empty()) return "--" + alike;
    constexpr std::size_t kShortestWord = 4;
    std::string speaks_of_it; // first of all in its help
    std::size_t earliest = std::string::npos;
    for (const Option& option : options) {
        const std::size_t at = lower_case(option.text).find(lower_case(word));
        if (word.size() < kShortestWord || option.is_positional() || at >= earliest) continue;
        earliest = at;
        speaks_of_it = option.long_name();
    }
    return speaks_of_it;
}

std::string values_taken(const Option& option) {
    const int least = std::max(1, option.least_values), most = std::max(least, option.most_values);
    std::string text = least == most ? std::to_string(least) : fmt::format("{} to {}", least, most);
    text += most == 1 ? " value" : " values";
    return option.value_name.empty() ? text : text + " (" + option.value_name + ")";
}

} // namespace

std::string no_such_command(const Program& program, const std::string& word) {
    std::vector<std::string> names;
    for (const Command& command : program.commands) names.push_back(command.name);
    const std::string alike = like(word, names);
    return fmt::format("there is no command '{}'{}", word, alike.empty() ? "" : "; did you mean '" + alike + "'?");
}

std::string wrong_command(const Program& program, std::span<const std::string> words) {
    for (const std::string& word : words) {
        if (looks_like_option(word)) continue;
        const bool known = std::any_of(program.commands.begin(), program.commands.end(),
                                       [&](const Command& command) { return command.name == word; });
        return known ? "" : no_such_command(program, word);
    }
    return "";
}

std::string given_again(const OptionList& options, std::span<const std::string> words) {
    std::vector<const Option*> met;
    for (const std::string& word : before_files(words)) {
        if (!looks_like_option(word)) continue;
        const Option* option = find_option(options, option_part(word));
        if (!option || !counts_once(*option)) continue;
        if (std::find(met.begin(), met.end(), option) != met.end())
            return option->long_name() + " is given twice; give it once";
        met.push_back(option);
    }
    return "";
}

std::string unknown_option(const OptionList& options, std::span<const std::string> words) {
    for (const std::string& word : before_files(words)) {
        if (!looks_like_option(word)) continue;
        const std::string name = option_part(word);
        if (find_option(options, name) || name == "--help" || name == "-h") continue;
        const std::string meant = meant_option(options, name);
        return "there is no option " + name + (meant.empty() ? "" : "; did you mean " + meant + "?");
    }
    return "";
}

std::string wrong_count(const OptionList& options, const std::string& name, std::size_t received) {
    const Option* option = find_option(options, name);
    if (!option) return name + " has another number of values than it takes";
    if (received == 0) return fmt::format("{} takes {}, and none is given", name, values_taken(*option));
    return fmt::format("{} takes {}, and {} {} given", name, values_taken(*option), received,
                       received == 1 ? "is" : "are");
}

std::string wrong_type(const OptionList& options, const std::string& name, const std::string& value) {
    const Option* option = find_option(options, name);
    const bool is_real = option && (std::holds_alternative<double*>(option->target) ||
                                    std::holds_alternative<std::optional<double>*>(option->target) ||
                                    std::holds_alternative<std::vector<double>*>(option->target) ||
                                    std::holds_alternative<Option::EachNumber>(option->target));
    return fmt::format("{}: '{}' is not {}", name, value, is_real ? "a number" : "a whole number from 0 up");
}

std::string wrong_word(const std::string& word, const std::vector<std::string>& words) {
    const std::string alike = like(word, words);
    return fmt::format("'{}' is not one of {}{}", word, fmt::join(words, ", "),
                       alike.empty() ? "" : "; did you mean '" + alike + "'?");
}

} // namespace filigree::cli
