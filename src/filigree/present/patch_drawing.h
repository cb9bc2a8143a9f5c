// A semi-regular mesh as a drawing: each patch in a colour of its own, the quads' lines faint, the patches' borders
// dark.
#pragma once

#include "filigree/mesh.h"
#include "filigree/render.h"

namespace filigree {

/// The quads in their patches' colours: vertices on borders once for each patch. Patch by patch, row by row. Here and
/// below the patches are the mesh's, which is not checked.
Mesh colored_patches(const Mesh& mesh, const RegularPatches& patches);

/// Ribbons over the patches' borders, a hair above the surface. width: from the border to either side, model units.
Mesh border_ribbons(const Mesh& mesh, const RegularPatches& patches, double width);

/// Both, in graphics memory.
class PatchDrawing {
public:
    /// line_width: of the quads' edges, pixels; 0 draws none. Errors: as of Drawable::surface.
    static Result<PatchDrawing> create(const Mesh& mesh, const RegularPatches& patches, float line_width,
                                       const RunContext& context);
    void add_to(Scene& scene) const;

private:
    PatchDrawing(Drawable surface, Drawable borders, float line_width);

    Drawable surface_, borders_;
    Appearance surface_look_, border_look_;
};

} // namespace filigree
