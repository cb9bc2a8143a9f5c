// Bodies and materials as Python has them.
#pragma once

#include "meshes.h"

#include <filigree/physics/body.h>

#include <memory>

namespace filigree::python {

/// A body never changes once Python has it.
struct PyBody {
    std::shared_ptr<const Body> body;
    Vec3d origin = Vec3d::Zero(); ///< of its mesh, model units
    BodyReport report = {};
};

/// A material of ours, or the name of one.
Material material_of(const py::handle& given);

} // namespace filigree::python
