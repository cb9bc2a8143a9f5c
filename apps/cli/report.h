// What a command says at its end: a table for people and JSON for programs, from one list of facts.
#pragma once

#include "json.h"

#include "filigree/core/text.h"

#include <string>
#include <utility>
#include <vector>

namespace filigree::cli {

/// Facts in the order in which they are said. A fact is a line "title   text" of the table, and a value under a key of
/// the JSON; some are only one of the two.
class Report {
public:
    /// A fact for both.
    void add(std::string title, std::string text, const std::string& key, Json value);
    /// A count for both, "1,234,567" for people.
    void count(std::string title, const std::string& key, std::size_t count);
    /// A line for people.
    void row(std::string title, std::string text) { rows_.emplace_back(std::move(title), std::move(text)); }
    /// The other's lines of the table.
    void add_rows(const Report& other) { rows_.insert(rows_.end(), other.rows_.begin(), other.rows_.end()); }
    /// A value for programs; `set(key)` to fill it in.
    Json& set(const std::string& key) { return values_[key]; }
    void set(const std::string& key, Json value) { values_[key] = std::move(value); }
    /// Text for people below the table; whole lines.
    void say(const std::string& lines) { lines_ += lines; }

    /// The table, with its texts in one column, and what is below.
    std::string text() const;
    const Json& json() const { return values_; }

private:
    std::vector<std::pair<std::string, std::string>> rows_; ///< title and text
    std::string lines_;
    Json values_ = Json::object();
};

/// Seconds with three digits that matter: "12.3 ms".
std::string seconds_text(double seconds);

} // namespace filigree::cli
