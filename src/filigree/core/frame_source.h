// What changes from frame to frame, fetched one frame at a time.
#pragma once

#include "filigree/core/result.h"

#include <cstddef>
#include <functional>

namespace filigree {

/// Frames from memory, from a file or from whoever computes them: poses, meshes, moments. They need not fit into
/// memory.
template <class Frame>
struct FrameSource {
    std::size_t frames = 0;
    double frames_per_second = 60;
    /// Frame number `frame`, 0 .. frames - 1. Unless a function says otherwise, it asks in any order, and again.
    std::function<Result<Frame>(std::size_t frame)> frame;
    double metres_per_unit = 0; ///< 0: not known. Formats that have a place for it say it
};

} // namespace filigree
