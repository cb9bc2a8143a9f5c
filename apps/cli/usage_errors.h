// What is wrong with a command line, in sentences of ours: nouns, what was given, and the nearest that there is.
#pragma once

#include "options.h"

#include <span>

namespace filigree::cli {

/// What is wrong with the word that stands where a command should, with the command that is most like it; empty:
/// nothing, or there is no such word.
std::string wrong_command(const Program& program, std::span<const std::string> words);
std::string no_such_command(const Program& program, const std::string& word);

/// The first option that counts once and is given again; empty: none is. words: those behind the command.
std::string given_again(const OptionList& options, std::span<const std::string> words);

/// The first word that is no option of these, with the nearest one; empty: there is none.
std::string unknown_option(const OptionList& options, std::span<const std::string> words);

/// That an option (by the long name that the parser says) got another number of values than it takes.
std::string wrong_count(const OptionList& options, const std::string& name, std::size_t received);
/// That a value is not of the option's type.
std::string wrong_type(const OptionList& options, const std::string& name, const std::string& value);
/// That a word is not one of those that an option takes.
std::string wrong_word(const std::string& word, const std::vector<std::string>& words);

} // namespace filigree::cli
