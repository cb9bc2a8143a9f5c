// Errors at a mesh's vertices as colours, and as a picture of their own.
#pragma once

#include "filigree/context.h"
#include "filigree/render.h"
#include "filigree/restore.h"

#include <string>

namespace filigree {

/// Where a restored pose is expected to be off, one value a vertex of the finest mesh. The range ends at 1e-4 at least:
/// less is not to be seen, and at rest it is rounding. Empty for other than blend models.
HeatMap expected_error_map(const Model& model, const PoseError::Estimate& estimate);

/// Writes the mesh in these colours with their legend beside it and a caption below, 1250 x 880 pixels; .png, .svg or
/// .pdf by the path's ending. errors: one value a vertex. Errors: cancelled; unsupported (no OpenGL); as of
/// Page::write.
Status write_error_picture(const Mesh& mesh, const HeatMap& errors, const std::string& legend,
                           const std::string& caption, UpAxis up, const std::string& path, const RunContext& context);

} // namespace filigree
