// filigree._core: what `import filigree` shows.
//
// Every docstring begins with the signature in the form that Python takes apart for inspect.signature and help(), so
// pybind11's own is off; filigree/_core.pyi says the types, and a test holds the two against each other.
#include "areas.h"
#include "calls.h"

PYBIND11_MODULE(_core, m) {
    using namespace filigree::python;
    py::options options;
    options.disable_function_signatures();
    m.attr("__name__") = "filigree"; // so that classes and functions are of the package, as pickles and messages say
    for (const auto add : {add_errors,     add_meshes, add_poses,    add_models,     add_files,    add_restoring,
                           add_reference,  add_warps,  add_handles,  add_comparing,  add_sampling, add_remeshing,
                           add_fracturing, add_bodies, add_world,    add_simulation, add_scenes,   add_exporting,
                           add_fitting,    add_flesh,  add_matrices, add_geometry,   add_pictures})
        add(m);
    mend_calls(m);
    m.attr("__name__") = "filigree._core";
    py::module_::import("atexit").attr("register")(py::cpp_function(&join_left_work));
}
