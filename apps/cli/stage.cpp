#include "stage.h"

#include "filigree/core/color.h"
#include "filigree/io/file.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

namespace filigree::cli {

Stage::Stage(Session& session)
    : session_(session), gl_(require(HeadlessContext::create())), renderer_(require(Renderer::create())) {}

Picture Stage::take(const Scene& scene, const Camera& camera, const PictureOptions& options) {
    return require(renderer_.picture(scene, camera, options, session_.context()));
}

Option up_option(UpAxis& up, const std::string& text) {
    return choice<UpAxis>("--up", up, {{"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}}, text);
}

Option view_option(View& view, const std::string& text) {
    return choice<View>("--view", view,
                        {{"front", View::front}, {"side", View::side}, {"top", View::top}, {"iso", View::iso}}, text);
}

SurfaceMaterials load_materials(const Mesh& mesh, const std::string& path, Session& session) {
    SurfaceMaterials loaded = load_surface_materials(mesh, path);
    for (const std::string& warning : loaded.warnings) session.warn(warning);
    return loaded;
}

Vec3f parse_color(const std::string& text, const std::string& option) {
    if (const std::optional<Vec3f> color = filigree::parse_color(text)) return *color;
    throw Failure{{ErrorCode::usage, option + ": '" + text + "' is no colour; write it as #rrggbb, such as #d04030."}};
}

Option found_up_option(std::optional<UpAxis>& up) {
    return choice<UpAxis>("--up", up, {{"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}},
                          "Which axis is up (unset: by the mesh's flat base, else z for STL and y for all others)");
}

std::string file_name(const std::string& path) {
    return path == "-" ? "standard input" : std::filesystem::path(path).filename().string();
}

std::string lower_ending(const std::string& path) {
    std::string ending = std::filesystem::path(path).extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return ending;
}

void check_picture_path(const std::string& path) {
    const std::string ending = lower_ending(path);
    if (ending != ".png" && ending != ".svg" && ending != ".pdf")
        throw Failure{{ErrorCode::unsupported, path + ": is no picture's name; let it end in .png, .svg or .pdf."}};
    std::error_code ignored;
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    if (!folder.empty() && !std::filesystem::is_directory(folder, ignored))
        throw Failure{{ErrorCode::unwritable, path + ": cannot be written: there is no such folder."}};
}

void write_picture(const Picture& picture, const std::string& path, Session& session) {
    if (session.context().is_cancelled()) throw Failure{cancelled_error()};
    require(write_file(path, encode_png(picture)));
}

} // namespace filigree::cli
