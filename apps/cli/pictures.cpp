#include "pictures.h"

#include "filigree/core/color.h"
#include "filigree/io/system/file.h"
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

Camera camera_for(const Mesh& mesh, View view, UpAxis up, double aspect, double point_radius) {
    std::vector<Vec3f> room;
    const CameraPoints points = points_of_faces(mesh, room, point_radius);
    return fit_camera(std::span(&points, 1), view_direction(view, up), up_vector(up), aspect);
}

std::string file_name(const std::string& path) {
    return path == "-" ? "standard input" : std::filesystem::path(path).filename().string();
}

void check_picture_path(const std::string& path) {
    const std::string ending = lower_extension(path);
    if (ending != ".png" && ending != ".svg" && ending != ".pdf")
        refuse(ErrorCode::unsupported, path + ": is no picture's name; let it end in .png, .svg or .pdf.");
    check_folder_of(path);
}

void check_png_path(const std::string& path) {
    if (lower_extension(path) != ".png")
        refuse(ErrorCode::unsupported, path + ": the picture is a PNG; let its name end in .png.");
    check_picture_path(path);
}

void write_picture(const Picture& picture, const std::string& path, Session& session) {
    if (session.context().is_cancelled()) throw Failure{cancelled_error()};
    require(write_file(path, encode_png(picture)));
}

void write_picture_of(const Scene& scene, const Camera& camera, const PictureOptions& options, const std::string& path,
                      HeadlessRenderer& renderer, Session& session) {
    const Picture picture = require(renderer.picture(scene, camera, options, session.context()));
    session.begin_writing(path);
    write_picture(picture, path, session);
}

} // namespace filigree::cli
