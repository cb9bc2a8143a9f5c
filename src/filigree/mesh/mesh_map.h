// Numbers of a mesh's vertices by name: what maps of bodies are made of. Private to the library.
#pragma once

#include "filigree/mesh.h"

#include <array>

namespace filigree {

/// The first thing wrong with a map's name, without a full stop, or "".
std::string check_mesh_map(std::string_view from);

/// One number a vertex. from: "color.r" (g, b, a), 0 to 1; "scalar NAME", as in the file; "group NAME", "object NAME"
/// or "material NAME": the part of the faces around a vertex that is called so, in which * stands for any letters.
/// "joint NAME" is for skin_map (flesh). Errors: usage (what check_mesh_map refuses), unsuitable (the mesh has no such
/// thing: the sentence says what it has). Cost O(V + corners).
Result<std::vector<float>> mesh_map(const Mesh& mesh, std::string_view from);

/// Numbers from `values` as numbers from `range`, straight in between; those beyond get the ends. values: not alike.
std::vector<float> in_range(std::vector<float> numbers, const std::array<double, 2>& values,
                            const std::array<double, 2>& range);

/// Whether a name is as a pattern says, in which * stands for any letters.
bool fits_pattern(std::string_view name, std::string_view pattern);

} // namespace filigree
