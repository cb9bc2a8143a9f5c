#include "models.h"

#include <filigree/io/model/model_file.h>
#include <filigree/pose.h>

namespace filigree::python {

namespace {

py::bytes model_bytes(const PyModel& model) {
    const std::string bytes = without_interpreter([&] { return write_model(*model.model); });
    return py::bytes(bytes);
}
PyModel model_of_bytes(const py::bytes& bytes, const std::string& name) {
    const std::string_view view(bytes);
    return {without_interpreter(
        [&] { return std::make_shared<const Model>(read_model(view, name, RunContext()).value()); })};
}

py::dict report_of(const StripReport& report) {
    py::dict said;
    said["welded_vertices"] = report.welded_vertices;
    said["across_gap"] = report.across_gap;
    said["facing_away"] = report.facing_away;
    said["forced_collapses"] = report.forced_collapses;
    said["simplify_error"] = report.simplify_error;
    py::dict seconds;
    seconds["simplify"] = report.simplify_seconds;
    seconds["bind"] = report.bind_seconds;
    seconds["encode"] = report.encode_seconds;
    said["seconds"] = seconds;
    return said;
}

PoseSource source_of(const std::string& from) {
    return value_of<PoseSource>(from, "fidelity_from",
                                {{"positions", PoseSource::positions}, {"gradients", PoseSource::gradients}});
}

PyModel strip_to(const py::object& given, const py::object& driver_given, unsigned threads,
                 const py::object& progress) {
    const MeshPtr mesh = mesh_of(given), driver = mesh_of(driver_given);
    Stripped stripped = LongCall{threads, progress}.owning(
        [=](const RunContext& context) { return strip_to_driver(*mesh, *driver, context).value(); });
    warn(stripped.report.warnings);
    return {std::make_shared<const Model>(std::move(stripped.model)), report_of(stripped.report)};
}

py::object listed(const py::object& self, const std::vector<Index> BlendDetail::*list) {
    return view(self.cast<const PyModel&>().model->detail.*list, self);
}

PyModel strip_mesh(const py::object& given, const py::object& driver, std::optional<std::size_t> base,
                   std::optional<unsigned> levels, std::optional<double> error, std::optional<double> fidelity,
                   const std::string& fidelity_from, std::optional<double> max_edge, bool reorder, unsigned threads,
                   const py::object& progress) {
    if (!driver.is_none()) {
        if (base || levels || error || fidelity || max_edge || reorder)
            refuse("With driver, how coarse the driver is is settled: leave out base, levels, error, fidelity, "
                   "max_edge and reorder.");
        return strip_to(given, driver, threads, progress);
    }
    const MeshPtr mesh = mesh_of(given);
    StripOptions options{.base = base, .levels = levels, .error = error, .max_edge = max_edge};
    options.reorder = reorder;
    const LongCall call{threads, progress};
    if (!fidelity) {
        Stripped stripped =
            call.owning([=](const RunContext& context) { return strip(*mesh, options, context).value(); });
        return {std::make_shared<const Model>(std::move(stripped.model)), report_of(stripped.report)};
    }
    const FidelityGoal goal{*fidelity, source_of(fidelity_from)};
    StrippedToFidelity found = call.owning(
        [=](const RunContext& context) { return strip_to_fidelity(*mesh, options, goal, context).value(); });
    py::dict report = report_of(found.stripped.report), reached;
    reached["error"] = found.error;
    reached["asked"] = *fidelity;
    reached["from"] = fidelity_from;
    reached["tried"] = found.tried;
    report["fidelity"] = reached;
    return {std::make_shared<const Model>(std::move(found.stripped.model)), report};
}

} // namespace

MeshPtr finest_mesh(const std::shared_ptr<const Model>& model) {
    if (model->driver_is_behind) return std::make_shared<Mesh>(level_mesh(*model, model->finest_level()));
    return MeshPtr(model, const_cast<Mesh*>(&model->mesh));
}

std::shared_ptr<const Model> model_of(const py::handle& given, const char* name) {
    if (!py::isinstance<PyModel>(given))
        throw py::type_error(std::string(name) + " has to be a filigree.Model; this is of type " +
                             Py_TYPE(given.ptr())->tp_name + ".");
    return given.cast<const PyModel&>().model;
}

void add_models(py::module_& m) {
    py::class_<PyModel>(m, "Model",
                        R"(A stripped mesh: everything that is needed to restore it from a pose of its driver.

Made by `strip` and `read_model`; never changes. Pickles as the bytes of its file.
)")
        .def_property_readonly(
            "mesh", [](const PyModel& self) { return finest_mesh(self.model); },
            "The finest level: the mesh as it came in.")
        .def_property_readonly(
            "driver", [](const PyModel& self) { return std::make_shared<Mesh>(level_mesh(*self.model, 0)); },
            "Level 0, what is moved, as a mesh.")
        .def_property_readonly(
            "driver_vertices",
            [](const py::object& self) { return view(self.cast<const PyModel&>().model->driver().vertices, self); },
            "The driver's vertices as ids in `mesh`, ascending, uint32 (d,), read-only. Those of a driver made "
            "elsewhere "
            "are none of the mesh's: they count on behind them.")
        .def_property_readonly(
            "source_order",
            [](const py::object& self) { return view(self.cast<const PyModel&>().model->source_order, self); },
            "Where each vertex of `mesh` was in the mesh that was stripped with `reorder`: uint32 (v,), else (0,), "
            "read-only.")
        .def_property_readonly(
            "across_gap", [](const py::object& self) { return listed(self, &BlendDetail::across_gap); },
            "Vertices of `mesh` bound across a gap, as their part has no driver of its own: uint32 (k,), read-only.")
        .def_property_readonly(
            "facing_away", [](const py::object& self) { return listed(self, &BlendDetail::facing_away); },
            "Vertices of `mesh` bound to a driver triangle that faces another way: uint32 (k,), read-only.")
        .def_property_readonly(
            "finest_level", [](const PyModel& self) { return self.model->finest_level(); },
            "Number of the finest level; 0 is the driver.")
        .def_property_readonly(
            "report", [](const PyModel& self) { return self.report; },
            "What `strip` counted and how long it took; empty for a model from a file.")
        .def(
            "level",
            [](const PyModel& self, unsigned level) {
                if (level > self.model->finest_level())
                    refuse("There is no level " + std::to_string(level) + "; there are 0 to " +
                           std::to_string(self.model->finest_level()) + ".");
                return std::make_shared<Mesh>(without_interpreter([&] { return level_mesh(*self.model, level); }));
            },
            py::arg("level"), R"(level(self, level)
--

A level as a mesh of its own, 0 (the driver) to `finest_level`.

Raises
------
UsageError
    No such level.
)")
        .def("tobytes", &model_bytes, R"(tobytes(self)
--

The bytes of the model's file (.fil); the same model gives the same bytes.
)")
        .def_static(
            "frombytes", [](const py::bytes& bytes) { return model_of_bytes(bytes, "bytes"); }, py::arg("bytes"),
            R"(frombytes(bytes)
--

The model of a file's bytes, as `tobytes` gives them.

Raises
------
BadFileError
    Bytes that are no model, or damaged ones.
)")
        .def(
            "fidelity",
            [](const PyModel& self, unsigned threads, const py::object& progress) {
                const DriverFidelity found = LongCall{threads, progress}(
                    [&](const RunContext& context) { return driver_fidelity(*self.model, context).value(); });
                py::dict said;
                said["positions"] = found.positions;
                said["gradients"] = found.gradients;
                return said;
            },
            py::kw_only(), py::arg("threads") = 0, py::arg("progress") = py::none(),
            R"(fidelity(self, *, threads=0, progress=None)
--

What the driver is good for: the largest rms error over bends, a twist, a taper and random warps.

Returns
-------
dict
    'positions': from positions alone; 'gradients': with gradients. Fractions of the diagonal.
)")
        .def("__repr__",
             [](const PyModel& self) {
                 return "<filigree.Model: " + std::to_string(self.model->vertex_count()) + " vertices on a driver of " +
                        std::to_string(self.model->driver().vertices.size()) + ">";
             })
        .def(py::pickle([](const PyModel& self) { return model_bytes(self); },
                        [](const py::bytes& bytes) { return model_of_bytes(bytes, "pickle"); }));

    m.def(
        "strip", &strip_mesh, py::arg("mesh"), py::kw_only(), py::arg("driver") = py::none(),
        py::arg("base") = py::none(), py::arg("levels") = py::none(), py::arg("error") = py::none(),
        py::arg("fidelity") = py::none(), py::arg("fidelity_from") = "positions", py::arg("max_edge") = py::none(),
        py::arg("reorder") = false, py::arg("threads") = 0, py::arg("progress") = py::none(),
        R"(strip(mesh, *, driver=None, base=None, levels=None, error=None, fidelity=None, fidelity_from='positions', max_edge=None, reorder=False, threads=0, progress=None)
--

Take the detail off a mesh: a model with a light driver.

Parameters
----------
mesh : Mesh, or an object with vertices and faces or triangles
    Any mesh that has a vertex; what cannot be bound well is counted in the model's `report`.
driver : Mesh, or an object with vertices and faces or triangles, optional
    Mesh to bind to that was made elsewhere: its vertices, in their order, are the driver's. Restored meshes have
    the vertices of `mesh` alone. Goes with none of the options below but `threads` and `progress`.
base : int, optional
    Vertices of the driver, about; 3 or more. At most one of `base`, `levels`, `error` and `fidelity`; with none 1,000,
    fewer for meshes below 20,000.
levels : int, optional
    Levels below the finest, each with a quarter of the vertices of the next.
error : float, optional
    How far the driver may leave the mesh (rms), fraction of the diagonal.
fidelity : float, optional
    Smallest driver that restores bends, twists, tapers and random warps to this rms error, fraction of the diagonal.
fidelity_from : str
    What poses will come with: 'positions', or 'gradients' too.
max_edge : float, optional
    Longest edge that simplifying may leave, fraction of the diagonal: flat parts keep vertices.
reorder : bool
    Put the vertices in an order along which neighbours lie together, so that a mesh whose order is hopeless restores
    faster; the model's `source_order` says where they were.
threads : int
    0: all of the processor's. Results are the same bytes for any.
progress : callable, optional
    Called with the phase and the fraction done; when it returns False, the work is cancelled.

Returns
-------
Model

Raises
------
UsageError
    Options that make no sense.
UnsuitableError
    No vertices.
Cancelled
    `progress` returned False.

Examples
--------
>>> mesh = filigree.make("wavy-sphere", resolution=24)
>>> filigree.strip(mesh, base=200)
<filigree.Model: 3458 vertices on a driver of 200>
)");
}

} // namespace filigree::python
