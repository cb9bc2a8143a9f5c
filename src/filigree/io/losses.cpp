#include "filigree/io/losses.h"

#include "filigree/file.h"
#include "filigree/hierarchy/pose_mesh.h"
#include "filigree/io/text_scanner.h"

#include <algorithm>
#include <functional>
#include <utility>

namespace filigree {

std::string cannot_hold(const std::string& what, std::vector<std::string> lost) {
    const bool has_polygons = std::erase(lost, kPolygonLoss) > 0;
    std::string sentence = what + " cannot hold ";
    if (lost.empty()) return sentence + kPolygonLoss + "; cut into triangles. PLY and OBJ keep them.";
    for (std::size_t i = 0; i < lost.size(); ++i)
        sentence += (i == 0 ? "" : i + 1 < lost.size() ? ", " : " and ") + lost[i];
    sentence += "; left out.";
    return has_polygons ? sentence + " Faces of more than three corners are cut into triangles; PLY and OBJ keep them."
                        : sentence;
}

std::vector<std::string> losses_of_played(std::vector<std::string> lost) {
    std::erase(lost, kPolygonLoss);
    return lost;
}

bool needs_smoothing(const Mesh& mesh) {
    return mesh.normals.empty() &&
           std::ranges::adjacent_find(mesh.smoothing, std::ranges::not_equal_to()) != mesh.smoothing.end();
}

void add_face_label_losses(const Mesh& mesh, std::vector<std::string>& lost) {
    if (!mesh.groups.empty()) lost.emplace_back("groups");
    if (!mesh.materials.empty() || !mesh.material_files.empty()) lost.emplace_back("materials");
    if (!mesh.smoothing.empty()) lost.emplace_back("smoothing groups");
}

void add_scalar_losses(const Mesh& mesh, std::vector<std::string>& lost) {
    bool has_gradients = false;
    for (const VertexScalar& scalar : mesh.scalars) {
        if (!is_gradient_name(scalar.name))
            lost.push_back("the scalar " + in_quotes(scalar.name));
        else if (!std::exchange(has_gradients, true))
            lost.emplace_back("deformation gradients (f00 to f22)");
    }
}

} // namespace filigree
