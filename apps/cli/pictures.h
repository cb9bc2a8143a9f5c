// Options of commands that draw, and what a picture calls things.
#pragma once

#include "session.h"

#include "filigree/mesh.h"
#include "filigree/render.h"

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

/// "#d04030", sRGB; otherwise a Failure that names the option.
Vec3f parse_color(const std::string& text, const std::string& option);

/// What a picture calls a file.
std::string file_name(const std::string& path);

} // namespace filigree::cli
