#include "web_page.h"
#include "drawing.h"

#include "filigree/io/mesh/material_file.h"
#include "filigree/io/system/file.h"
#include "filigree/io/system/platform.h"

#include <cstdlib>
#include <fstream>
#include <map>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPieceBytes = 3 * (std::size_t{1} << 18); // browsers limit a string, and base64 takes threes

/// FILIGREE_WEB, or where the build and the installation put them, seen from the program.
fs::path find_parts() {
    std::error_code failed;
    fs::path folder;
    if (const char* named = std::getenv("FILIGREE_WEB"); named && *named)
        folder = path_of(named);
    else
        folder = platform::own_program().parent_path() / FILIGREE_WEB_FROM_PROGRAM;
    if (fs::exists(folder / "filigree.js", failed)) return folder;
    refuse(ErrorCode::unsupported,
           folder.lexically_normal().string() +
               ": the parts of the web page are not there, as they are made with node and npm's packages; run "
               "scripts/setup and build again, or say with FILIGREE_WEB where they are.");
}

/// For the text of an element and for a value in quotes: nothing in it starts a tag or ends the value.
std::string html_text(const std::string& text) {
    std::string safe;
    for (const char c : text) switch (c) {
        case '&':
            safe += "&amp;";
            break;
        case '<':
            safe += "&lt;";
            break;
        case '>':
            safe += "&gt;";
            break;
        case '"':
            safe += "&quot;";
            break;
        case '\'':
            safe += "&#39;";
            break;
        default:
            safe += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
        }
    return safe;
}

/// The page, with a value for each {{name}}. A value is text: what looks like a name in it stays as it is.
std::string filled(std::string_view page, const std::map<std::string, std::string, std::less<>>& values) {
    std::string result;
    for (std::size_t at = 0; at < page.size();) {
        const std::size_t begin = std::min(page.find("{{", at), page.size());
        result += page.substr(at, begin - at);
        if (begin == page.size()) break;
        const std::size_t end = page.find("}}", begin);
        result += values.find(page.substr(begin + 2, end - begin - 2))->second;
        at = end + 2;
    }
    return result;
}

std::string base64(std::string_view bytes) {
    constexpr char kLetters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        unsigned bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kLetters[bits >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

bool is_png(std::string_view bytes) { return bytes.starts_with("\x89PNG\r\n\x1a\n"); }

/// Whether it begins and ends as an SVG, which is all that can be said of XML without reading it.
bool looks_like_svg(std::string_view bytes) {
    const std::size_t last = bytes.find_last_not_of(" \t\r\n");
    if (last == std::string_view::npos) return false;
    const std::string_view text = bytes.substr(0, last + 1),
                           end = text.substr(text.size() - std::min<std::size_t>(text.size(), 6));
    const std::size_t root = text.find("<svg");
    return root != std::string_view::npos && text.find_first_not_of("\xef\xbb\xbf \t\r\n") == text.find('<') &&
           (end == "</svg>" || end.ends_with("/>") || end.ends_with("-->"));
}

/// The logo as an element. It is an image inside the page: a browser runs no script of it and fetches nothing for it.
std::string logo_element(const std::string& path) {
    if (path.empty()) return "";
    constexpr std::size_t kMostBytes = 1 << 20; // it is in the page itself, which is read before all else
    const std::string bytes = require(read_file(path_of(path)));
    if (bytes.size() > kMostBytes)
        refuse(ErrorCode::unsuitable, fmt::format("{}: has {:.1f} MB, and a logo has at most 1 MB; make it smaller.",
                                                  path, double(bytes.size()) / 1e6));
    const bool png = is_png(bytes);
    if (!png && !looks_like_svg(bytes))
        refuse(ErrorCode::unsupported,
               path + ": is neither an SVG nor a PNG, or is cut off; --logo takes a picture in one of these formats.");
    if (png) check_png(bytes, path);
    return fmt::format(R"(<img id="logo" alt="" src="data:image/{};base64,{}">)", png ? "png" : "svg+xml",
                       base64(bytes));
}

std::string model_name(WebModel model) {
    return model == WebModel::glb ? "model.glb" : model == WebModel::stream ? "model.fil" : "model.live";
}
/// Of the page's parts: what goes into the folder as index.html and filigree.js.
std::string part_name(WebModel model, const std::string& name) {
    if (model != WebModel::live) return name;
    return name == "index.html" ? "live.html" : name == "filigree.js" ? "live.js" : name;
}

/// What a page can show of the materials beside a model: PNG and JPEG, in the file.
std::vector<MeshMaterial> page_materials(const Mesh& mesh, const std::string& input, Session& session) {
    MeshMaterials found = read_materials_and_pictures(mesh, path_of(input));
    for (MeshMaterial& material : found.materials) {
        if (!material.picture_bytes || !picture_extension(*material.picture_bytes).empty()) continue;
        found.warnings.push_back("The texture of " + material.name + " is neither PNG nor JPEG and was left out.");
        material.picture_bytes = nullptr;
    }
    session.warn(found.warnings);
    return std::move(found.materials);
}

} // namespace

std::optional<Model> with_page_materials(const Model& model, const std::string& input, Session& session) {
    if (model.mesh.materials.empty()) return std::nullopt;
    Model made = model;
    made.mesh.embedded_materials = page_materials(model.mesh, input, session);
    made.mesh.material_files.clear();
    return made;
}

WebPage::WebPage(OutputFolder& folder, const WebLook& look, WebModel model)
    : kind_(model), parts_(find_parts()), title_(html_text(look.title)), logo_(logo_element(look.logo)),
      index_(folder.file("index.html")), script_(folder.file("filigree.js")), style_(folder.file("filigree.css")),
      licenses_(folder.file("licenses.txt")), model_(folder.file(model_name(model))),
      model_script_(folder.file(model_name(model) + ".js")), poster_(look.poster ? folder.file("poster.jpg") : "") {
#ifndef FILIGREE_WEB_STREAMS
    if (model == WebModel::stream)
        refuse(ErrorCode::unsupported,
               "--stream: this program was built without the page's decoder, which clang 16 for "
               "WebAssembly makes; run scripts/setup and build again.");
#endif
    std::error_code failed;
    if (model == WebModel::live && !fs::exists(parts_ / "live.js", failed))
        refuse(ErrorCode::unsupported, "--live: the page's physics is not built; run 'scripts/setup page' and then "
                                       "'scripts/build release program'.");
}

void WebPage::write(Session& session) {
    std::error_code failed;
    const bool has_poster = !poster_.empty() && fs::exists(path_of(poster_), failed);
    const std::string page =
        filled(require(read_file(parts_ / path_of(part_name(kind_, "index.html")))),
               {{"title", title_},
                {"logo", logo_},
                {"model", kind_ == WebModel::glb ? "glb" : "stream"},
                {"bytes", std::to_string(fs::file_size(path_of(model_)))},
                {"poster", has_poster ? R"(<img id="poster" src="poster.jpg" alt="">)" : ""},
                {"poster_tags", has_poster ? "<meta property=\"og:image\" content=\"poster.jpg\">\n"
                                             "<meta name=\"twitter:card\" content=\"summary_large_image\">\n"
                                           : ""}});
    require(write_file(path_of(index_), page));
    for (const std::string& file : {script_, style_, licenses_})
        require(write_file(path_of(file),
                           require(read_file(parts_ / path_of(part_name(kind_, path_of(file).filename().string()))))));
    write_model_script(session);
}

void WebPage::write_model_script(Session& session) const {
    std::ifstream model(path_of(model_), std::ios::binary);
    FileWriter script = require(FileWriter::create(path_of(model_script_)));
    std::string piece(kPieceBytes, '\0');
    while (model.read(piece.data(), std::streamsize(piece.size())), model.gcount() > 0) {
        if (session.context().is_cancelled()) throw Failure{cancelled_error()};
        const std::string_view read(piece.data(), std::size_t(model.gcount()));
        require(script.write("filigree_part(\"" + base64(read) + "\");\n"));
    }
    if (!model.eof()) refuse(ErrorCode::not_found, model_ + ": cannot be read again; try once more.");
    require(script.finish());
}

} // namespace filigree::cli
