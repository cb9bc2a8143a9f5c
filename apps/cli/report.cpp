#include "report.h"

#include <algorithm>

#include <fmt/format.h>

namespace filigree::cli {

void Report::add(std::string title, std::string text, const std::string& key, Json value) {
    row(std::move(title), std::move(text));
    set(key, std::move(value));
}

void Report::count(std::string title, const std::string& key, std::size_t count) {
    add(std::move(title), with_commas(count), key, count);
}

std::string Report::text() const {
    std::size_t width = 0;
    for (const auto& [title, value] : rows_) width = std::max(width, title.size());
    std::string text;
    for (const auto& [title, value] : rows_) text += fmt::format("{:<{}}  {}\n", title, width, value);
    return text + lines_;
}

std::string seconds_text(double seconds) {
    if (seconds < 1e-3) return fmt::format("{:.3g} us", seconds * 1e6);
    if (seconds < 1) return fmt::format("{:.3g} ms", seconds * 1e3);
    return fmt::format("{:.3g} s", seconds);
}

} // namespace filigree::cli
