// Where the program's pictures are taken: OpenGL, the renderer, and what goes into a scene.
#pragma once

#include "session.h"

#include "filigree/render/film.h"
#include "filigree/render/gl_context.h"
#include "filigree/render/renderer.h"
#include "filigree/render/surface_materials.h"

namespace filigree::cli {

/// OpenGL without a window, and a renderer in it. One at a time.
class Stage {
public:
    explicit Stage(Session& session);

    Picture take(const Scene& scene, const Camera& camera, const PictureOptions& options);
    Renderer& renderer() { return renderer_; }
    const std::string& renderer_name() const { return gl_.renderer_name(); }

private:
    Session& session_;
    HeadlessContext gl_;
    Renderer renderer_;
};

/// --up and --view.
Option up_option(UpAxis& up, const std::string& text);
Option view_option(View& view, const std::string& text);

/// As load_surface_materials; its warnings are said.
SurfaceMaterials load_materials(const Mesh& mesh, const std::string& path, Session& session);

/// "#d04030", sRGB; otherwise a Failure that names the option.
Vec3f parse_color(const std::string& text, const std::string& option);

/// --up, where the mesh says it itself (find_up_axis) unless it is given.
Option found_up_option(std::optional<UpAxis>& up);

/// What a picture calls a file.
std::string file_name(const std::string& path);
/// How a file's name ends, in small letters: ".png".
std::string lower_ending(const std::string& path);

/// Refuses, before any work, a name that ends in none of .png, .svg and .pdf, or lies in no folder.
void check_picture_path(const std::string& path);

/// Writes a picture as PNG. Progress, cancelling and messages are the session's.
void write_picture(const Picture& picture, const std::string& path, Session& session);

} // namespace filigree::cli
