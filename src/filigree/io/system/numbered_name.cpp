#include "filigree/io/system/numbered_name.h"
#include "filigree/file.h"
#include "filigree/io/system/text_scanner.h"

#include <charconv>

namespace filigree {

namespace {

namespace fs = std::filesystem;

/// The name around characters begin .. end - 1, which stand for the number.
NumberedName name_around(const fs::path& path, std::size_t begin, std::size_t end, std::size_t digits) {
    const std::string name = path.filename().string();
    return {path.parent_path(), name.substr(0, begin), name.substr(end), digits};
}

} // namespace

fs::path NumberedName::file(std::size_t number) const {
    std::string text = std::to_string(number);
    if (text.size() < digits) text.insert(0, digits - text.size(), '0');
    return folder / path_of(before + text + after);
}

std::optional<std::uint64_t> NumberedName::number_of(const std::string& file) const {
    if (file.size() <= before.size() + after.size() || !file.starts_with(before) || !file.ends_with(after)) return {};
    const char* const first = file.data() + before.size();
    const char* const last = file.data() + file.size() - after.size();
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(first, last, number);
    if (error != std::errc() || end != last) return {};
    return number;
}

std::optional<NumberedName> numbered_name(const fs::path& path) {
    const std::string name = path.filename().string();
    if (const std::size_t last = name.rfind('#'); last != std::string::npos) {
        const std::size_t before = name.find_last_not_of('#', last);
        const std::size_t begin = before == std::string::npos ? 0 : before + 1;
        return name_around(path, begin, last + 1, last + 1 - begin);
    }
    const std::size_t percent = name.find('%');
    if (percent == std::string::npos) return {};
    std::size_t end = percent + 1;
    while (end < name.size() && is_digit(name[end])) ++end;
    if (end == name.size() || name[end] != 'd') return {};
    unsigned digits = 1; // "%d"
    constexpr unsigned kMostDigits = 20;
    std::from_chars(name.data() + percent + 1, name.data() + end, digits);
    if (digits > kMostDigits) return {};
    return name_around(path, percent, end + 1, digits);
}

std::optional<NumberedName> printf_numbered_name(const fs::path& path) {
    const std::string name = path.filename().string();
    const std::size_t percent = name.find('%');
    if (percent == std::string::npos || name.find('%', percent + 1) != std::string::npos) return {};
    const std::string_view rest = std::string_view(name).substr(percent + 1);
    if (rest.starts_with('d')) return name_around(path, percent, percent + 2, 1);
    const bool filled = rest.size() >= 3 && rest[0] == '0' && is_digit(rest[1]) && rest[1] != '0' && rest[2] == 'd';
    if (!filled) return {};
    return name_around(path, percent, percent + 4, std::size_t(rest[1] - '0'));
}

} // namespace filigree
