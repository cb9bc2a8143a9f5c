#include "pictures.h"

#include "filigree/core/color.h"
#include "filigree/file.h"
#include "filigree/mesh/up_axis.h"

#include <filesystem>

namespace filigree::cli {

namespace {

const std::vector<std::pair<std::string, UpAxis>> kUpAxes = {{"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}};

} // namespace

Option up_option(UpAxis& up, const std::string& text) { return choice<UpAxis>("--up", up, kUpAxes, text); }

Option view_option(View& view, const std::string& text) {
    return choice<View>("--view", view,
                        {{"front", View::front}, {"side", View::side}, {"top", View::top}, {"iso", View::iso}}, text);
}

Vec3f parse_color(const std::string& text, const std::string& option) {
    if (const std::optional<Vec3f> color = filigree::parse_color(text)) return *color;
    refuse(option + ": '" + text + "' is no colour; write it as #rrggbb, such as #d04030.");
}

Option found_up_option(std::optional<UpAxis>& up) {
    return choice<UpAxis>("--up", up, kUpAxes,
                          "Up axis (default: the axis of the mesh's flat base; without a flat base z for STL, else y)");
}

UpAxis up_of(const std::optional<UpAxis>& asked, const Mesh& mesh, const std::string& path) {
    return asked.value_or(find_up_axis(mesh, usual_up_axis(path)));
}

void report_picture(const std::string& path, UpAxis up, Report& report) {
    report.set("picture", path);
    report.set("up", kUpAxes[std::size_t(up)].first);
}

std::string file_name(const std::string& path) {
    return path == "-" ? "standard input" : path_of(path).filename().string();
}

} // namespace filigree::cli
