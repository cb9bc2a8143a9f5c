#include "spill.h"

#include "filigree/core/numbers.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <fstream>
#include <string_view>

namespace filigree::cli {

namespace {

/// The number in a file such as a control group's limit; `otherwise` where there is none.
std::uint64_t number_in(const char* path, const std::string& behind, std::uint64_t otherwise) {
    std::ifstream file(path);
    for (std::string word; file >> word;) {
        std::uint64_t number = 0;
        if ((behind.empty() || (word == behind && file >> word)) &&
            std::from_chars(word.data(), word.data() + word.size(), number).ec == std::errc())
            return number;
    }
    return otherwise;
}

} // namespace

std::uint64_t memory_to_use() {
    constexpr std::uint64_t kNone = ~std::uint64_t{0};
    const std::uint64_t free = number_in("/proc/meminfo", "MemAvailable:", kNone / 1024);
    const std::uint64_t limit = std::min(number_in("/sys/fs/cgroup/memory.max", "", kNone),
                                         number_in("/sys/fs/cgroup/memory/memory.limit_in_bytes", "", kNone));
    return std::min(std::min(free, kNone / 1024) * 1024, limit) / 4 * 3;
}

std::uint64_t parse_memory_size(const std::string& text) {
    double number = 0;
    const auto [end, error] = number_from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc()) return 0;
    std::string unit(end, text.data() + text.size());
    for (char& c : unit) c = char(std::toupper(static_cast<unsigned char>(c)));
    constexpr std::string_view kUnits = "KMGT";
    double factor = 1;
    if (!unit.empty() && unit != "B") {
        const std::size_t power = kUnits.find(unit[0]);
        if (power == std::string_view::npos || (unit.size() > 1 && unit.substr(1) != "B" && unit.substr(1) != "IB"))
            return 0;
        for (std::size_t i = 0; i <= power; ++i) factor *= 1024;
    }
    const double bytes = number * factor;
    return bytes >= 1 && bytes < 1e18 ? static_cast<std::uint64_t>(bytes) : 0;
}

} // namespace filigree::cli
