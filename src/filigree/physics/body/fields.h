// What varies within a body: the numbers of its cells, at its corners and by its mesh. Private to the library.
#pragma once

#include "filigree/physics/body.h"

#include <array>

namespace filigree {

inline constexpr std::array kFields = {FieldOf::stiffness, FieldOf::density, FieldOf::damping, FieldOf::yield_stress,
                                       FieldOf::strength};
/// As scenes and Python name it: "yield_stress".
std::string_view name_of(FieldOf field);

/// Masses of particles by their volumes, the material's density and its field.
void set_masses(Body& body);

/// Spreads fields of the mesh's vertices inwards, and gives them to the body.
Status add_vertex_fields(Body& body, const Mesh& mesh, std::span<const VertexField> fields, const RunContext& context);

/// A field at the corners: means over the cells around, by what these hold. Cost O(cells).
std::vector<float> at_corners(const Cells& cells, std::span<const float> field);
/// The mean of values by weights.
double mean_at(std::span<const float> values, std::span<const float> weights);

/// The fields of some of a body's cells.
BodyFields part_of(const BodyFields& whole, std::span<const Index> cells);

} // namespace filigree
