#include "chunks.h"

#include <charconv>

#include <fmt/format.h>

namespace filigree::cli {

WorkChunk chunk_of(const std::string& text) {
    WorkChunk chunk;
    const auto number = [](std::string_view digits, std::size_t& value) {
        const auto [end, failed] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        return failed == std::errc() && end == digits.data() + digits.size();
    };
    const std::size_t slash = text.find('/');
    const bool is_right = slash != std::string::npos && number(std::string_view(text).substr(0, slash), chunk.number) &&
                          number(std::string_view(text).substr(slash + 1), chunk.count) && chunk.number >= 1 &&
                          chunk.number <= chunk.count && chunk.count <= 1'000'000;
    if (!is_right) refuse("--chunk must be K/N, the K-th of N chunks from 1 on, such as 3/40; '" + text + "' is not.");
    return chunk;
}

void report_chunk(const std::string& output, const WorkChunk& chunk, const SharedItemsReport& written,
                  const std::string& things, double seconds, Session& session) {
    const std::string share =
        written.count == 0 ? "no " + things
                           : fmt::format("{} {} to {}", things, written.first + 1, written.first + written.count);
    const std::string made =
        written.made == 0 ? "were there before" : fmt::format("{} made in {}", written.made, seconds_text(seconds));
    Report report;
    report.say(fmt::format("{}: chunk {} of {}: {}{}; {}\n", output, chunk.number, chunk.count, share,
                           written.count == 0 ? "" : ", " + made,
                           written.is_whole ? "all is there and in its place"
                                            : fmt::format("{} of {} are there", written.done, written.items)));
    report.set("output", output);
    report.set("chunk", chunk.number);
    report.set("chunks", chunk.count);
    report.set("first", written.first + 1);
    report.set("count", written.count);
    report.set("made", written.made);
    report.set("done", written.done);
    report.set("items", written.items);
    report.set("is_whole", written.is_whole);
    report.set("seconds", seconds);
    session.print(report);
}

} // namespace filigree::cli
