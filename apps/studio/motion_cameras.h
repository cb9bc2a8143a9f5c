// Cameras that go along with a recording, as those of films do.
#pragma once

#include "workbench.h"

#include <vector>

namespace filigree::studio {

/// One camera a frame from `first` to before `last`, or one for all of them where nothing goes far. They look along the
/// direction of `like`, with its field of view. aspect: width of the picture over its height.
std::vector<Camera> motion_cameras(const Workbench& workbench, std::size_t first, std::size_t last, const Camera& like,
                                   double aspect);

} // namespace filigree::studio
