// In place of pictures.cpp in a module without the renderer, as in the wheels: the names are there and say what is
// missing.
#include "areas.h"
#include "errors.h"

#include <filigree/types.h>

namespace filigree::python {

namespace {

[[noreturn]] void refuse_picture(const py::args&, const py::kwargs&) {
    refuse(ErrorCode::unsupported,
           "This filigree draws, reads and writes no pictures, as it was built without the renderer: build the module "
           "from the source (`pip install .` in a clone), or show mesh.vertices and mesh.faces with another package.");
}

} // namespace

void add_pictures(py::module_& m) {
    m.def("render", &refuse_picture, R"(render(*args, **kwargs)
--

Needs the renderer, which this build does not have: raises UnsupportedError.
)");
    m.def("read_picture", &refuse_picture, R"(read_picture(*args, **kwargs)
--

Needs the renderer, which this build does not have: raises UnsupportedError.
)");
    m.def("write_picture", &refuse_picture, R"(write_picture(*args, **kwargs)
--

Needs the renderer, which this build does not have: raises UnsupportedError.
)");
}

} // namespace filigree::python
