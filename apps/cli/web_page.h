// A folder that shows a model in a browser: our page, three.js with it, and nothing from the network (docs/web.md).
#pragma once

#include "output_folder.h"
#include "session.h"

#include <filesystem>
#include <optional>
#include <string>

namespace filigree::cli {

/// What the page shows: a GLB, a coded model that comes level by level, or bodies that move by themselves.
enum class WebModel { glb, stream, live };

/// What a page has of its own.
struct WebLook {
    std::string title; ///< the heading
    std::string logo;  ///< an SVG or PNG file; empty: none
    bool poster = true;
};

/// index.html, filigree.js, filigree.css, licenses.txt, poster.jpg, model.glb (or model.fil, model.live), and
/// model.glb.js, which holds the same bytes as text: a page that was opened from disk may not read other files, but may
/// run scripts.
class WebPage {
public:
    /// To be made before the work: finds the page's parts, reads the logo, and asks the folder for all files. Fails
    /// with `unsupported` where the program was built without the page, or its decoder, and as of a logo that is none.
    WebPage(OutputFolder& folder, const WebLook& look, WebModel model);

    /// Where the caller puts the model.
    const std::string& model_path() const { return model_; }
    /// Where the caller may put a JPEG of the model; empty: none is wanted.
    const std::string& poster_path() const { return poster_; }
    /// Everything else, once the model is there. Memory: pieces of it.
    void write(Session& session);

private:
    WebModel kind_;
    std::filesystem::path parts_; ///< the folder that they are copied from
    std::string title_, logo_;    ///< as HTML
    std::string index_, script_, style_, licenses_, model_, model_script_, poster_;

    void write_model_script(Session& session) const;
};

/// A model whose materials lie beside it, with those that a page can show inside: pictures that are PNG or JPEG. Empty:
/// it has none. input: the model's file.
std::optional<Model> with_page_materials(const Model& model, const std::string& input, Session& session);

} // namespace filigree::cli
