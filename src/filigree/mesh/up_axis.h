// Which axis of a mesh points up.
#pragma once

#include "filigree/mesh.h"
#include "filigree/types.h"

#include <string_view>

namespace filigree {

/// The axis whose lowest plane holds a large base, twice as large as those of the other axes: faces that lie in it, or
/// an opening there. A base is large from a tenth of the box's side on, and lies in the plane within a hundredth of the
/// box's height. Without one (a ball, a cube), and where the opposite side is as flat but the mesh no plate (a bar, a
/// log), it is `usual`; so it is for a sheet without any thickness. The mesh is not checked. Cost
/// O(corners).
UpAxis find_up_axis(const Mesh& mesh, UpAxis usual);

/// What files of that name usually have: z in STL (parts for printing), y in all others.
UpAxis usual_up_axis(std::string_view path);

} // namespace filigree
