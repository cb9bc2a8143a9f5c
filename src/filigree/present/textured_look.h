// What is seen of a textured mesh, place by place.
#pragma once

#include "filigree/render.h"
#include "filigree/result.h"
#include "filigree/scene/body_look.h"
#include "filigree/scene/world_setup.h"

#include <string>
#include <vector>

namespace filigree {

/// The look of a mesh by its materials and textures, found beside mesh_path. spacing: of the places, about; model
/// units, above 0. plain: of faces without a material, sRGB. Textures are averaged over what lies around a place.
/// Textures that cannot be read are white, and `warnings` says so. Cost O(pictures + area / spacing^2 + faces).
/// Errors: usage (check_mesh refuses the mesh), cancelled.
Result<BodyLook> textured_look(const Mesh& mesh, const std::string& mesh_path, double spacing, const Vec3f& plain,
                               std::vector<std::string>& warnings, const RunContext& context);

/// A surface of matter, not checked, to be drawn with these materials. materials: none, or one a name in
/// surface.materials.
DrawnSurface melt_as_drawn(const Mesh& surface, std::span<const SurfaceMaterial> materials);

/// The looks of a scene's bodies, one each: empty for those that the scene gives a colour, or whose mesh has colours
/// or no materials, or that do not melt. Errors: as above.
Result<std::vector<BodyLook>> looks_of(const ReadyScene& ready, std::vector<std::string>& warnings,
                                       const RunContext& context);

} // namespace filigree
