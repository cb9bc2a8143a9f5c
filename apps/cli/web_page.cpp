#include "web_page.h"

#include "filigree/io/mesh/material_file.h"
#include "filigree/io/system/file.h"
#include "filigree/io/system/platform.h"

#include <cstdlib>
#include <fstream>

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

std::string replaced(std::string text, std::string_view what, const std::string& by) {
    for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
        text.replace(at, what.size(), by);
    return text;
}

std::string html_text(const std::string& text) {
    return replaced(replaced(replaced(text, "&", "&amp;"), "<", "&lt;"), ">", "&gt;");
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

WebPage::WebPage(OutputFolder& folder, std::string title, WebModel model)
    : kind_(model), parts_(find_parts()), title_(std::move(title)), index_(folder.file("index.html")),
      script_(folder.file("filigree.js")), style_(folder.file("filigree.css")),
      license_(folder.file("three-license.txt")), model_(folder.file(model_name(model))),
      model_script_(folder.file(model_name(model) + ".js")) {
#ifndef FILIGREE_WEB_STREAMS
    if (model == WebModel::stream)
        refuse(ErrorCode::unsupported,
               "--stream: this program was built without the page's decoder, which clang 16 for "
               "WebAssembly makes; run scripts/setup and build again.");
#endif
    std::error_code failed;
    if (model == WebModel::live && !fs::exists(parts_ / "live.js", failed))
        refuse(ErrorCode::unsupported, "--live: this program was built without the page's physics, which clang 16 for "
                                       "WebAssembly makes; run scripts/setup and build again.");
}

void WebPage::write(Session& session) {
    const std::string index = require(read_file(parts_ / part_name(kind_, "index.html")));
    const std::string titled = replaced(index, "{{title}}", html_text(title_));
    require(write_file(path_of(index_), replaced(titled, "{{model}}", kind_ == WebModel::glb ? "glb" : "stream")));
    for (const std::string& file : {script_, style_, license_})
        require(write_file(path_of(file),
                           require(read_file(parts_ / part_name(kind_, path_of(file).filename().string())))));
    write_model_script(session);
}

void WebPage::write_model_script(Session& session) const {
    std::ifstream model(model_, std::ios::binary);
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
