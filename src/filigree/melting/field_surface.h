// The surface of a particle field as a mesh.
#pragma once

#include "filigree/melting/particle_field.h"
#include "filigree/mesh.h"

namespace filigree {

/// A closed, manifold, oriented mesh of triangles where the field is 0, with normals a vertex from the field's
/// gradient; no mesh where nothing is inside. Each cell's faces are crossed by segments, which link to loops, each
/// filled by a fan around its middle; inside corners across a face's diagonal stay apart. The same bytes for any number
/// of threads. Cost O(blocks + triangles). Errors: cancelled, unsuitable (more vertices or corners than indices).
Result<Mesh> make_field_surface(const ParticleField& field, const RunContext& context);

} // namespace filigree
