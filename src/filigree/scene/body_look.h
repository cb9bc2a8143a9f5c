// Look of a body with materials and textures, for the surface of its melt.
#pragma once

#include "filigree/mesh.h"

#include <span>
#include <vector>

namespace filigree {

/// All empty: of a body without materials, or with colours of its own, one a vertex. Colours are sRGB, RGBA, 0 to 1.
struct BodyLook {
    std::vector<MeshMaterial> materials; ///< one a name of the mesh's materials; pictures as bytes
    std::vector<Vec4f> vertex_colors;    ///< one a vertex of the mesh: what is seen there
    std::vector<Vec3f> places;           ///< all over the surface, model units
    std::vector<Vec4f> place_colors;     ///< one a place: what is seen around it

    bool empty() const { return materials.empty(); }
};

/// A surface of matter for programs that multiply textures with vertex colours. A vertex that faces of several
/// materials share is copied, so that each copy has the colour of one material.
struct DrawnSurface {
    Mesh mesh;                 ///< the surface's vertices, and copies of some behind them, with all that they have
    std::vector<Index> copied; ///< of each copy: which vertex
};
/// colors: one a name in surface.materials. Without materials or colours: the surface as it is. It is not
/// checked. Cost O(size).
DrawnSurface with_materials_apart(Mesh surface, std::span<const Vec3f> colors);

} // namespace filigree
