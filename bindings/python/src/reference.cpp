#include "models.h"

#include <filigree/io/file.h>
#include <filigree/io/reference_file.h>

namespace filigree::python {

namespace {

using ReferencePtr = std::shared_ptr<ReferenceModel>;

ReferencePtr strip_reference(const py::object& given, std::optional<std::size_t> base, std::optional<unsigned> levels,
                             unsigned references, unsigned threads, const py::object& progress) {
    if (base && levels) refuse("Give base or levels: each says how coarse the driver is.");
    ReferenceOptions options{.references = references, .base = base};
    if (levels) options.max_levels = *levels;
    const MeshPtr mesh = mesh_of(given);
    return std::make_shared<ReferenceModel>(LongCall{threads, progress}.owning(
        [=](const RunContext& context) { return strip_to_reference(*mesh, options, context).value(); }));
}

MeshPtr restore_with_reference(const ReferenceModel& model, const py::object& pose, const std::string& law,
                               std::optional<unsigned> level, unsigned threads) {
    const std::vector<Vec3f> driver = points_of(pose, "pose");
    const ReferenceRestoreOptions options{.law = value_of<HeightLaw>(law, "law",
                                                                     {{"keep", HeightLaw::keep},
                                                                      {"inverse", HeightLaw::inverse},
                                                                      {"proportional", HeightLaw::proportional},
                                                                      {"volume", HeightLaw::volume}}),
                                          .level = level};
    const RunContext& context = short_context(threads);
    return without_interpreter(
        [&] { return std::make_shared<Mesh>(restore_reference(model, driver, options, context).value()); });
}

MeshPtr reference_level(const ReferenceModel& model, unsigned level) {
    if (level > model.finest_level())
        refuse("There is no level " + std::to_string(level) + "; there are 0 to " +
               std::to_string(model.finest_level()) + ".");
    return std::make_shared<Mesh>(without_interpreter([&] { return level_mesh(model, level); }));
}

py::bytes reference_bytes(const ReferenceModel& model) {
    return py::bytes(without_interpreter([&] { return write_reference_model(model); }));
}

ReferencePtr reference_of_bytes(const py::bytes& bytes) {
    const auto view = bytes.cast<std::string_view>();
    return std::make_shared<ReferenceModel>(
        without_interpreter([&] { return read_reference_model(FileReader(view), "bytes", RunContext()).value(); }));
}

} // namespace

void add_reference(py::module_& m) {
    py::class_<ReferenceModel, ReferencePtr>(m, "ReferenceModel",
                                             R"(A mesh stripped by the report's method, level by level: regular quads.

Made by `strip_reference`. Pickles as the bytes of its file, which the program reads as well.
)")
        .def_property_readonly(
            "mesh", [](const ReferencePtr& self) { return MeshPtr(self, &self->mesh); },
            "The finest level: the mesh as it came in.")
        .def_property_readonly(
            "driver", [](const ReferenceModel& self) { return reference_level(self, 0); },
            "Level 0, what is moved, as a mesh.")
        .def_property_readonly(
            "finest_level", [](const ReferenceModel& self) { return self.finest_level(); },
            "Number of the finest level; 0 is the driver.")
        .def("level", &reference_level, py::arg("level"), R"(level(self, level)
--

A level as a mesh of its own, 0 (the driver) to `finest_level`.

Raises
------
UsageError
    No such level.
)")
        .def("restore", &restore_with_reference, py::arg("pose"), py::kw_only(), py::arg("law") = "inverse",
             py::arg("level") = py::none(), py::arg("threads") = 0,
             R"(restore(self, pose, *, law='inverse', level=None, threads=0)
--

Put the detail back onto a moved driver.

Parameters
----------
pose : array_like, (d, 3)
    Where the driver's vertices are, relative to the mesh's `origin`.
law : str
    How high detail is when its surroundings grow: 'keep', 'inverse', 'proportional' or 'volume'.
level : int, optional
    Restore up to this level; None: the finest.

Returns
-------
Mesh

Raises
------
MismatchError
    Another number of vertices than the driver has.
UsageError
    No such level or law.
)")
        .def("tobytes", &reference_bytes, R"(tobytes(self)
--

The bytes of the model's file (.fil); the same model gives the same bytes.
)")
        .def_static("frombytes", &reference_of_bytes, py::arg("bytes"), R"(frombytes(bytes)
--

The model of a file's bytes, as `tobytes` gives them.

Raises
------
BadFileError
    Bytes that are no model, or damaged ones.
UnsuitableError
    A model of the blend code.
)")
        .def("__repr__",
             [](const ReferenceModel& self) {
                 return "<filigree.ReferenceModel: " + std::to_string(self.mesh.vertex_count()) +
                        " vertices on a driver of " + std::to_string(self.driver().vertices.size()) + ">";
             })
        .def(py::pickle([](const ReferenceModel& self) { return reference_bytes(self); }, &reference_of_bytes));

    m.def("strip_reference", &strip_reference, py::arg("mesh"), py::kw_only(), py::arg("base") = py::none(),
          py::arg("levels") = py::none(), py::arg("references") = 3, py::arg("threads") = 0,
          py::arg("progress") = py::none(),
          R"(strip_reference(mesh, *, base=None, levels=None, references=3, threads=0, progress=None)
--

Take the detail off a mesh by the report's method. It needs quads with subdivision connectivity, as `remesh` makes.

Parameters
----------
mesh : Mesh, or an object with vertices and faces or triangles
base : int, optional
    Remove as many levels as bring the driver closest to so many vertices.
levels : int, optional
    Remove at most so many levels, 1 to 16; with neither all that can go.
references : int
    3, 4 or 6 coarse points that a point refers to.
threads : int
    0: all of the processor's. Results are the same bytes for any.
progress : callable, optional
    Called with the phase and the fraction done; when it returns False, the work is cancelled.

Returns
-------
ReferenceModel

Raises
------
UsageError
    Options that make no sense.
UnsuitableError
    No subdivision connectivity.

Examples
--------
>>> model = filigree.strip_reference(filigree.make("wavy-cube", resolution=16))
>>> model
<filigree.ReferenceModel: 1538 vertices on a driver of 8>
>>> model.restore(2 * model.driver.vertices, law="proportional")
<filigree.Mesh: 1538 vertices, 1536 faces>
)");
}

} // namespace filigree::python
