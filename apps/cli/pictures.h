// What commands that draw share: options, what goes into a picture, and where it goes.
#pragma once

#include "session.h"

#include "filigree/io/extension.h"
#include "filigree/present/headless_renderer.h"
#include "filigree/render.h"
#include "filigree/render/surface_materials.h"

namespace filigree::cli {

/// --view.
Option view_option(View& view, const std::string& text);
/// --up.
Option up_option(UpAxis& up, const std::string& text);
/// --up, where the mesh says it itself (up_of) unless it is given.
Option found_up_option(std::optional<UpAxis>& up);
/// As asked for, else as the mesh's flat base or the file's format has it.
UpAxis up_of(const std::optional<UpAxis>& asked, const Mesh& mesh, const std::string& path);

/// The picture that a command drew beside its work, and what is up in it.
void report_picture(const std::string& path, UpAxis up, Report& report);

/// Shows all of a mesh.
Camera camera_for(const Mesh& mesh, View view, UpAxis up, double aspect, double point_radius = 0);

/// "#d04030", sRGB; otherwise a Failure that names the option.
Vec3f parse_color(const std::string& text, const std::string& option);

/// What a picture calls a file.
std::string file_name(const std::string& path);

/// Refuses, before any work, a name that ends in none of .png, .svg and .pdf, or lies in no folder.
void check_picture_path(const std::string& path);

/// Refuses the same of a picture that can only be a PNG.
void check_png_path(const std::string& path);

/// Writes a picture as PNG. Progress, cancelling and messages are the session's.
void write_picture(const Picture& picture, const std::string& path, Session& session);
/// Draws a scene and writes it so.
void write_picture_of(const Scene& scene, const Camera& camera, const PictureOptions& options, const std::string& path,
                      HeadlessRenderer& renderer, Session& session);

} // namespace filigree::cli
