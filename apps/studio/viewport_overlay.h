// What stands over the picture: collected from the document, the camera and the mouse.
#pragma once

#include "drawn_objects.h"
#include "overlay.h"
#include "pointer.h"

namespace filigree::studio {

struct PictureParts {
    Workbench& workbench;
    DrawnObjects& drawn;
    const PictureCamera& camera;
    const Pointer& pointer;
};

/// drawn_level: of the picture. hint_strength: 0 to 1, fades once the mouse has been used.
OverlayContent overlay_content(const PictureParts& parts, unsigned drawn_level, double hint_strength);

} // namespace filigree::studio
