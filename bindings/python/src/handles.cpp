#include "models.h"

#include <filigree/io/handles_file.h>
#include <filigree/mesh.h>
#include <filigree/pose.h>

#include <mutex>
#include <numbers>

namespace filigree::python {

namespace {

/// The solver keeps its last solution, so one thread solves at a time.
struct PyHandleSolver {
    MeshPtr mesh;
    HandleSolver solver;
    std::mutex mutex = {};
};

std::unique_ptr<PyHandleSolver> make_solver(const py::object& given, const py::object& handles, unsigned threads,
                                            const py::object& progress) {
    const MeshPtr mesh = mesh_of(given);
    const std::vector<Index> held = indices_of(handles, "handles", mesh->vertex_count());
    HandleSolver solver = LongCall{threads, progress}([&](const RunContext& context) {
        const auto triangles = triangulate(*mesh, context).value().triangles;
        return HandleSolver::create(mesh->positions, triangles, held, context).value();
    });
    return std::unique_ptr<PyHandleSolver>(new PyHandleSolver{mesh, std::move(solver)});
}

Pose solve(PyHandleSolver& self, const py::object& targets, unsigned iterations, double tolerance, double smoothness,
           unsigned threads, const py::object& progress) {
    const std::vector<Vec3f> places = points_of(targets, "targets");
    return LongCall{threads, progress}([&](const RunContext& context) {
        const std::lock_guard alone(self.mutex);
        return self.solver.solve(places, {iterations, tolerance, smoothness}, context).value().pose;
    });
}

HandleRegion make_region(const py::object& vertices, const py::object& box, const py::object& sphere,
                         const py::object& move, const py::object& axis, double degrees, const py::object& centre,
                         const std::string& name) {
    HandleRegion region;
    region.name = name;
    if (!vertices.is_none()) region.vertices = indices_of(vertices, "vertices", kNoIndex);
    if (!box.is_none()) region.box = box_of(box);
    if (!sphere.is_none()) {
        const py::list pair(sphere);
        if (pair.size() != 2) refuse("sphere has to be a centre and a radius.");
        region.sphere = {vector_of(pair[0], "sphere"), pair[1].cast<double>()};
    }
    region.move = vector_of(move, "move");
    const Vec3d about = vector_of(axis, "axis");
    if (!(about.norm() > 0)) refuse("axis has no length.");
    region.rotation = Eigen::AngleAxisd(degrees * std::numbers::pi / 180, about.normalized());
    region.centre = optional_vector_of(centre, "centre");
    return region;
}

py::object move_handles(const py::object& given, const std::vector<HandleRegion>& handles, unsigned threads,
                        const py::object& progress) {
    const LongCall call{threads, progress};
    if (py::isinstance<PyModel>(given)) {
        const auto model = model_of(given);
        return py::cast(
            call([&](const RunContext& context) { return pose_by_handles(*model, handles, context).value(); }));
    }
    const MeshPtr mesh = mesh_of(given);
    return py::cast(call([&](const RunContext& context) {
        return std::make_shared<Mesh>(move_by_handles(*mesh, handles, context).value());
    }));
}

} // namespace

void add_handles(py::module_& m) {
    py::class_<PyHandleSolver>(
        m, "HandleSolver",
        R"(As-rigid-as-possible handles: some vertices are put somewhere, the rest follows with as little strain as it can.

Parameters
----------
mesh : Mesh, or an object with vertices and faces or triangles
    A model's `driver` for poses; its vertices at rest.
handles : array_like of int, (h,)
    Distinct vertices whose positions will be given, one or more.

Raises
------
UsageError
    A handle out of range or repeated, or none.
UnsuitableError, OutOfMemoryError, Cancelled

Examples
--------
>>> model = filigree.strip(filigree.make("bar", resolution=8))
>>> rest = model.driver.vertices
>>> ends = [rest[:, 0].argmin(), rest[:, 0].argmax()]
>>> solver = filigree.HandleSolver(model.driver, ends)
>>> solver.solve(rest[ends] + [[0, 0, 0], [0, 1, 0]])
<filigree.Pose: 57 vertices with gradients>
)")
        .def(py::init(&make_solver), py::arg("mesh"), py::arg("handles"), py::kw_only(), py::arg("threads") = 0,
             py::arg("progress") = py::none(),
             R"(__init__(self, mesh, handles, *, threads=0, progress=None)
--

)")
        .def("solve", &solve, py::arg("targets"), py::kw_only(), py::arg("iterations") = 200,
             py::arg("tolerance") = 1e-5, py::arg("smoothness") = 0.03, py::arg("threads") = 0,
             py::arg("progress") = py::none(),
             R"(solve(self, targets, *, iterations=200, tolerance=1e-05, smoothness=0.03, threads=0, progress=None)
--

The pose with the handles at their targets. Starts from the last solution, so dragging is cheap.

Parameters
----------
targets : array_like, (h, 3)
    One position a handle, in their order, relative to the mesh's `origin`.
iterations : int
    At most so many rounds.
tolerance : float
    Stop when no vertex moves further in a round; fraction of the diagonal.
smoothness : float
    Length over which a sharp bend is spread, fraction of the diagonal.

Raises
------
MismatchError
    Another number of targets than handles.
UsageError, Cancelled
)")
        .def(
            "reset",
            [](PyHandleSolver& self) {
                without_interpreter([&] {
                    const std::lock_guard alone(self.mutex);
                    self.solver.reset();
                    return Success{};
                });
            },
            R"(reset(self)
--

Forget the last solution: the next one starts from rest.
)");

    py::class_<HandleRegion>(m, "HandleRegion",
                             R"(Vertices that go together: turned about `centre`, then moved.

Parameters
----------
vertices : array_like of int, optional
    Of the mesh.
box : array_like, (n, 3), optional
    All vertices in the box of these points, world coordinates.
sphere : (centre, radius), optional
    All vertices inside, world coordinates.
move : array_like, (3,)
    Model units.
axis, degrees : array_like (3,), float
    What it is turned about, and how far.
centre : array_like, (3,), optional
    World coordinates; None: the middle of its vertices.
name : str
    For messages.
)")
        .def(
            py::init(&make_region), py::kw_only(), py::arg("vertices") = py::none(), py::arg("box") = py::none(),
            py::arg("sphere") = py::none(), py::arg("move") = py::make_tuple(0, 0, 0),
            py::arg("axis") = py::make_tuple(0, 1, 0), py::arg("degrees") = 0.0, py::arg("centre") = py::none(),
            py::arg("name") = "",
            R"(__init__(self, *, vertices=None, box=None, sphere=None, move=(0, 0, 0), axis=(0, 1, 0), degrees=0.0, centre=None, name='')
--

)")
        .def("part", &HandleRegion::part, py::arg("fraction"), R"(part(self, fraction)
--

On the way from rest (0) to where it goes (1).
)");
    m.def(
        "read_handles", [](const std::filesystem::path& path) { return read_handles(path).value(); }, py::arg("path"),
        R"(read_handles(path)
--

The handles of a JSON file (docs/handles.md), a list of HandleRegion.

Raises
------
NotFoundError, BadFileError, UsageError
)");
    m.def("move_by_handles", &move_handles, py::arg("what"), py::arg("handles"), py::kw_only(), py::arg("threads") = 0,
          py::arg("progress") = py::none(), R"(move_by_handles(what, handles, *, threads=0, progress=None)
--

Put regions somewhere and let the rest follow as rigidly as it can.

Parameters
----------
what : Model or Mesh
handles : list of HandleRegion

Returns
-------
Pose or Mesh
    Of a model its driver's pose, by a solve over the driver alone; of a mesh the mesh, every vertex solved for.

Raises
------
UsageError
    A handle that holds no vertex, or a vertex in two handles.
UnsuitableError, OutOfMemoryError, Cancelled
)");
}

} // namespace filigree::python
