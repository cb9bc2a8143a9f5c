#include "coding_report.h"

#include "filigree/core/text.h"
#include "filigree/io/model/model_file.h"

#include <fmt/format.h>

namespace filigree::cli {

void add_coding_shares(const PackedBytes& parts, std::size_t vertices, std::optional<std::uint64_t> bytes,
                       Report& report) {
    Json& shares = report.set("bits_per_vertex");
    shares = Json::object();
    std::string text;
    const auto bits = [&](std::uint64_t part) { return 8 * double(part) / double(std::max<std::size_t>(vertices, 1)); };
    const auto share = [&](const char* name, std::uint64_t part) {
        shares[name] = bits(part);
        if (part > 0) text += fmt::format("{}{:.2f} {}", text.empty() ? "" : ", ", bits(part), name);
    };
    if (bytes) shares["all"] = bits(*bytes);
    if (parts.levels > 0) {
        share("levels", parts.levels);
        share("refinements", parts.refinements);
    }
    share("connectivity", parts.connectivity);
    if (parts.records > 0) share("records", parts.records);
    share("places", parts.places);
    share("attributes", parts.attributes);
    share("order", parts.order);
    share("driver", parts.driver);
    if (parts.clips > 0) share("poses", parts.clips);
    report.row("bits a vertex", bytes ? fmt::format("{:.2f}: {}", bits(*bytes), text) : text);
}

void add_stream_marks(const ModelOutline& model, Report& report) {
    if (!model.coding || model.coding->levels.empty()) return;
    Json& marks = report.set("stream");
    marks = Json::array();
    std::string lines = "\n       bytes   of all   vertices   surface error (rms, model units)\n";
    for (const PackedLevelMark& mark : model.coding->levels) {
        const double share = double(mark.bytes) / double(std::max<std::uint64_t>(model.bytes, 1));
        lines += fmt::format("{:>12} {:>7.1f}% {:>10} {:>10.2g}\n", with_commas(mark.bytes), 100 * share,
                             with_commas(mark.vertices), mark.error);
        marks.push_back(
            {{"bytes", mark.bytes}, {"share", share}, {"vertices", mark.vertices}, {"error_units", mark.error}});
    }
    report.say(lines);
}

} // namespace filigree::cli
