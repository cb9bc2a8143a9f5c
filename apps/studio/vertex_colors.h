// Numbers of vertices to be shown as colours.
#pragma once

#include "filigree/mesh/mesh.h"
#include "filigree/render.h"

#include <memory>
#include <vector>

namespace filigree::studio {

struct VertexColors {
    std::vector<float> values; ///< one a vertex
    ColorMap map = ColorMap::sequential;
    ValueRange range = {};
    std::shared_ptr<const Mesh> melt = {}; ///< whose vertices they are; null: the model's, at its finest level
};

} // namespace filigree::studio
