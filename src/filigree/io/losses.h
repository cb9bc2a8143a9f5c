// What a format cannot hold, said in one sentence.
#pragma once

#include "filigree/mesh.h"

#include <string>
#include <vector>

namespace filigree {

/// The loss of formats that hold triangles alone: not left out like others, but cut.
inline constexpr const char* kPolygonLoss = "faces of more than three corners";

/// "WHAT cannot hold a, b and c; left out.", and of polygons that they are cut. Each loss is a noun.
std::string cannot_hold(const std::string& what, std::vector<std::string> lost);

/// Those of a file that is played and not worked on: that its faces are triangles is none.
std::vector<std::string> losses_of_played(std::vector<std::string> lost);

/// Whether smoothing groups are lost where normals are written: there are several, and the mesh has no normals yet.
bool needs_smoothing(const Mesh& mesh);
/// Names what a format without face labels loses.
void add_face_label_losses(const Mesh& mesh, std::vector<std::string>& lost);
/// Names what a format without numbers a vertex loses; the nine of a gradient together.
void add_scalar_losses(const Mesh& mesh, std::vector<std::string>& lost);

} // namespace filigree
