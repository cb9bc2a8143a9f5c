// Pictures as files, and the camera for them: of commands that draw.
#pragma once

#include "drawing.h"

#include "filigree/io/system/extension.h"
#include "filigree/present/headless_renderer.h"
#include "filigree/render/surface_materials.h"

namespace filigree::cli {

/// Shows all of a mesh.
Camera camera_for(const Mesh& mesh, View view, UpAxis up, double aspect, double point_radius = 0);

/// Writes a picture as PNG. Progress, cancelling and messages are the session's.
void write_picture(const Picture& picture, const std::string& path, Session& session);
/// Draws a scene and writes it so.
void write_picture_of(const Scene& scene, const Camera& camera, const PictureOptions& options, const std::string& path,
                      HeadlessRenderer& renderer, Session& session);

} // namespace filigree::cli
