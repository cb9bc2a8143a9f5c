// Manual pages (troff, section 1) from the tables that the command line is read by.
#include "options.h"

#include <fmt/format.h>

namespace filigree::cli {

namespace {

/// Text that troff prints as it stands.
std::string escaped(const std::string& text) {
    std::string result;
    bool starts_line = true;
    for (const char c : text) {
        if (starts_line && (c == '.' || c == '\'')) result += "\\&";
        if (c == '\\')
            result += "\\e";
        else if (c == '-')
            result += "\\-";
        else
            result += c;
        starts_line = c == '\n';
    }
    return result;
}

std::string bold(const std::string& text) { return "\\fB" + escaped(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + escaped(text) + "\\fR"; }

/// What help calls a value of the type, and the value that it has at the start.
struct ValueOf {
    const char* name;
    std::string start;
};

ValueOf value_of(const bool*) { return {"", ""}; }
ValueOf value_of(const std::string* text) { return {"TEXT", *text}; }
ValueOf value_of(const unsigned* number) { return {"N", std::to_string(*number)}; }
ValueOf value_of(const std::size_t* number) { return {"N", std::to_string(*number)}; }
ValueOf value_of(const double* number) { return {"X", fmt::format("{:g}", *number)}; }
ValueOf value_of(const std::optional<double>*) { return {"X", ""}; }
ValueOf value_of(const std::vector<double>*) { return {"X", ""}; }
ValueOf value_of(const std::vector<std::string>*) { return {"TEXT", ""}; }
ValueOf value_of(const Option::EachText&) { return {"TEXT", ""}; }
ValueOf value_of(const Option::EachNumber&) { return {"X", ""}; }
template <class T>
ValueOf value_of(const T*) {
    return {"N", ""};
}

std::string value_name(const Option& option) {
    if (!option.value_name.empty()) return option.value_name;
    return std::visit([](const auto& target) { return std::string(value_of(target).name); }, option.target);
}

/// "X X X", "TEXT ...".
std::string values_text(const Option& option) {
    const std::string name = value_name(option);
    std::string text = name;
    for (int k = 1; k < option.least_values; ++k) text += (option.has_commas ? "," : " ") + name;
    const bool is_list = std::holds_alternative<std::vector<std::string>*>(option.target);
    return is_list && option.most_values == 0 && !option.takes_one ? text + " ..." : text;
}

struct CheckText {
    std::string operator()(Option::WholeFrom whole) const {
        return fmt::format("A whole number from {} up.", whole.least);
    }
    std::string operator()(Option::AboveZero) const { return "A number above 0."; }
    std::string operator()(Option::IntegerRange range) const {
        return fmt::format("From {} to {}.", range.least, range.most);
    }
    std::string operator()(Option::Range range) const {
        return fmt::format("From {:g} to {:g}.", range.least, range.most);
    }
    std::string operator()(const Option::Words& words) const {
        std::string list;
        for (const std::string& word : words.words) list += (list.empty() ? "" : ", ") + word;
        return "One of " + list + ".";
    }
    template <class T>
    std::string operator()(const T&) const {
        return "";
    }
};

std::string description(const Option& option) {
    std::string text = option.text + ".";
    if (const std::string check = std::visit(CheckText{}, option.check); !check.empty()) text += " " + check;
    for (const std::string& other : option.excluded) text += " Not with " + other + ".";
    const std::string start = std::visit([](const auto& target) { return value_of(target).start; }, option.target);
    if (option.shows_default && !start.empty()) text += " Default: " + start + ".";
    return text;
}

void print_option(const Option& option, std::string& page) {
    page += ".TP\n";
    if (option.is_positional()) {
        page += italic(option.name);
    } else {
        if (const std::size_t comma = option.name.find(','); comma != std::string::npos)
            page += bold(option.name.substr(0, comma)) + ", ";
        page += bold(option.long_name());
        if (const std::string values = values_text(option); !values.empty()) page += " " + italic(values);
    }
    page += "\n" + escaped(description(option)) + "\n";
}

std::string synopsis(const Program& program, const Command& command) {
    std::string line = bold(program.name + " " + command.name);
    for (const Option& option : command.options) {
        if (option.is_positional()) {
            const bool is_list = std::holds_alternative<std::vector<std::string>*>(option.target);
            const std::string name = italic(option.name) + (is_list ? " ..." : "");
            line += option.is_required ? " " + name : " [" + name + "]";
        } else if (option.is_required) {
            line += " " + bold(option.name.substr(0, option.name.find(','))) + " " + italic(value_name(option));
        }
    }
    return line + " [" + italic("options") + "]";
}

std::string title(const Program& program, const std::string& name, const std::string& text) {
    std::string capitals = name;
    for (char& c : capitals)
        if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
    return ".TH " + escaped(capitals) + " 1 \"\" \"" + program.name + " " + program.version + "\" \"Filigree\"\n" +
           ".SH NAME\n" + escaped(name) + " \\- " + escaped(text) + "\n";
}

std::string examples(const std::string& lines) { return ".SH EXAMPLES\n.nf\n" + escaped(lines) + "\n.fi\n"; }

std::string exit_status() {
    std::string text = ".SH EXIT STATUS\n";
    for (const auto& [code, meaning] : {std::pair{"0", "done"},
                                        {"1", "internal error"},
                                        {"2", "wrong arguments"},
                                        {"3", "a file cannot be read"},
                                        {"4", "a damaged file"},
                                        {"5", "an unknown format"},
                                        {"6", "a file cannot be written"},
                                        {"7", "unsuitable input"},
                                        {"8", "inputs that do not match"},
                                        {"9", "out of memory"},
                                        {"10", "done but not to be trusted"},
                                        {"130", "cancelled"}})
        text += std::string(".TP\n\\fB") + code + "\\fR\n" + meaning + "\n";
    return text;
}

std::string command_page(const Program& program, const Command& command) {
    std::string page = title(program, program.name + "-" + command.name, command.text);
    page += ".SH SYNOPSIS\n" + synopsis(program, command) + "\n";
    page += ".SH DESCRIPTION\n" + escaped(command.text) + ".\n.SH OPTIONS\n";
    for (const Option& option : command.options + program.common) print_option(option, page);
    page += examples(command.examples) + exit_status();
    return page + ".SH SEE ALSO\n\\fB" + program.name + "\\fR(1)\n";
}

std::string program_page(const Program& program) {
    std::string page = title(program, program.name, program.text.substr(0, program.text.find_last_not_of('.') + 1));
    page += ".SH SYNOPSIS\n" + bold(program.name) + " " + italic("command") + " [" + italic("options") + "]\n";
    page += ".SH DESCRIPTION\n" + escaped(program.text) + "\n.SH COMMANDS\n";
    std::string see_also;
    for (const Command& command : program.commands) {
        page += ".TP\n" + bold(command.name) + "\n" + escaped(command.text) + ".\n";
        see_also += (see_also.empty() ? "" : ", ") + bold(program.name + "-" + command.name) + "(1)";
    }
    page += examples(program.examples) + exit_status();
    return page + ".SH SEE ALSO\n" + see_also + "\n";
}

} // namespace

std::string manual_page(const Program& program, const std::string& command) {
    if (command.empty()) return program_page(program);
    for (const Command& known : program.commands)
        if (known.name == command) return command_page(program, known);
    return "";
}

} // namespace filigree::cli
