// Errors of the library as Python's.
#pragma once

#include "areas.h"

#include <filigree/result.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace filigree::python {

/// Raises the Python class of the code with this sentence.
[[noreturn]] void refuse(ErrorCode code, const std::string& sentence);
/// Raises UsageError.
[[noreturn]] void refuse(const std::string& sentence);

/// Says every sentence as a FiligreeWarning. Needs the interpreter.
void warn(const std::vector<std::string>& sentences);

/// What a word stands for; refuses others with the list of those there are.
template <class Value>
Value value_of(const std::string& word, const char* name,
               const std::vector<std::pair<std::string_view, Value>>& words) {
    std::string list;
    for (const auto& [known, value] : words) {
        if (known == word) return value;
        list += (list.empty() ? "'" : ", '") + std::string(known) + "'";
    }
    refuse(std::string(name) + " is '" + word + "', and has to be one of " + list + ".");
}

} // namespace filigree::python
