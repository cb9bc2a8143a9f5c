// A folder that shows a GLB in a browser: our page, three.js with it, and nothing from the network (docs/web.md).
#pragma once

#include "output_folder.h"
#include "session.h"

#include <filesystem>
#include <string>

namespace filigree::cli {

/// index.html, filigree.js, filigree.css, three-license.txt, model.glb, and model.glb.js, which holds the same bytes as
/// text: a page that was opened from disk may not read other files, but may run scripts.
class WebPage {
public:
    /// To be made before the work: finds the page's parts, and asks the folder for all of its files. Fails with
    /// `unsupported` where the program was built without the page. title: the page's heading.
    WebPage(OutputFolder& folder, std::string title);

    /// Where the caller puts the GLB.
    const std::string& model_path() const { return model_; }
    /// Everything else, once the GLB is there. Memory: pieces of the GLB.
    void write(Session& session);

private:
    std::filesystem::path parts_; ///< the folder that they are copied from
    std::string title_, index_, script_, style_, license_, model_, model_script_;

    void write_model_script(Session& session) const;
};

} // namespace filigree::cli
