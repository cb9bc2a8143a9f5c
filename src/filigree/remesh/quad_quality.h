// How good a quad mesh is: shape and regularity, measured, never assumed.
#pragma once

#include "filigree/remesh.h"

#include "filigree/context.h"
#include "filigree/mesh.h"

namespace filigree {

/// Smallest over the four corners of (e x f) . n / (|e| |f|), with e, f the edges that leave the corner and n the
/// quad's unit normal (of its diagonals' cross product): 1 for a rectangle, 0 or less when a corner is straight or
/// turned inside out. -1 where an edge has no length or the quad no normal.
double scaled_jacobian(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d);

} // namespace filigree
