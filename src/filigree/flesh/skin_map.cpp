#include "filigree/flesh/skin_map.h"

#include "filigree/mesh/mesh_map.h"

#include <algorithm>

namespace filigree {

namespace {

/// Whether a joint, or one above it, is called so.
bool is_below(const SkinnedMesh& skin, Index joint, std::string_view pattern) {
    for (std::size_t steps = 0; joint != kNoIndex && steps <= skin.joints.size(); ++steps) {
        if (fits_pattern(skin.joints[joint].name, pattern)) return true;
        joint = skin.joints[joint].parent;
    }
    return false;
}

} // namespace

Result<std::vector<float>> skin_map(const SkinnedMesh& skin, std::string_view from) {
    constexpr std::string_view kJoint = "joint ";
    if (!from.starts_with(kJoint) || !skin.has_bones) return mesh_map(skin.mesh, from);
    std::vector<std::uint8_t> counts;
    for (Index joint = 0; joint < skin.joints.size(); ++joint)
        counts.push_back(is_below(skin, joint, from.substr(kJoint.size())));
    if (std::ranges::count(counts, 1) == 0) {
        std::string names;
        for (const SkinJoint& joint : skin.joints) names += (names.empty() ? "" : ", ") + joint.name;
        return Error{ErrorCode::unsuitable,
                     "The mesh has nothing for '" + std::string(from) + "'; it has the joints " + names + "."};
    }
    std::vector<float> carried(skin.mesh.vertex_count());
    for (std::size_t v = 0; v < carried.size(); ++v)
        for (std::size_t k = skin.weights.first[v]; k < skin.weights.first[v + 1]; ++k)
            if (counts[skin.weights.joints[k]]) carried[v] += skin.weights.weights[k];
    return carried;
}

} // namespace filigree
