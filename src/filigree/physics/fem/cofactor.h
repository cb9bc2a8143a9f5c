// How areas turn. Private to the layer.
#pragma once

#include "filigree/types.h"

namespace filigree {

/// Takes an area's normal at rest, times the area, to where the deformation gradient takes the area; also where that
/// turns space inside out, as the inverse transpose does not.
inline Mat3f cofactor(const Mat3f& gradient) {
    Mat3f c;
    c << gradient.col(1).cross(gradient.col(2)), gradient.col(2).cross(gradient.col(0)),
        gradient.col(0).cross(gradient.col(1));
    return c;
}

} // namespace filigree
