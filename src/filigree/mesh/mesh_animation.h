// A mesh that moves.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh.h"

#include <functional>

namespace filigree {

/// The same vertices, frame after frame, fetched one frame at a time: from memory, a file, a driver being restored.
struct MeshAnimation {
    const Mesh* rest = nullptr; ///< faces, attributes, and the origin of all positions
    std::size_t frames = 0;
    double frames_per_second = 60;
    /// Writes the positions of a frame, 0 .. frames - 1, relative to rest->origin; one a vertex. Frames may be asked
    /// for in any order, and again.
    std::function<Status(std::size_t frame, std::span<Vec3f> positions)> positions;
    double metres_per_unit = 0; ///< 0: not known. Formats that have a place for it say it
};

} // namespace filigree
