#include "models.h"

#include <filigree/blend/restore_adjoint.h>
#include <filigree/restore.h>

#include <cmath>
#include <mutex>

namespace filigree::python {

namespace {

/// A restorer and the model that it is of; pickled, the model and the options.
struct PyRestorer {
    PyModel model;
    RestoreOptions options;
    Restorer restorer;
    /// Made when it is asked for first.
    struct Adjoint {
        std::once_flag made;
        std::optional<RestoreAdjoint> adjoint;
    };
    std::shared_ptr<Adjoint> adjoint = std::make_shared<Adjoint>();

    PyRestorer(PyModel of, const RestoreOptions& how)
        : model(std::move(of)), options(how),
          restorer(without_interpreter([&] { return Restorer::create(*model.model, options, RunContext()).value(); })) {
    }
};

PyRestorer make_restorer(const PyModel& model, std::optional<unsigned> level) { return {model, {.level = level}}; }

py::object restore_positions(const PyRestorer& self, const py::object& pose, const py::object& gradients,
                             const py::object& out, bool world, unsigned threads) {
    const Pose moved = pose_of(pose, gradients);
    const RunContext& context = short_context(threads);
    if (!out.is_none()) {
        if (world) refuse("out takes positions relative to the mesh's origin; leave world out.");
        const std::span<Vec3f> positions = writable_points(out, "out", self.restorer.vertex_count());
        without_interpreter([&] { return self.restorer.positions(moved, positions, context).value(); });
        return out;
    }
    std::vector<Vec3f> positions = without_interpreter([&] { return self.restorer.positions(moved, context).value(); });
    if (!world) return take(std::move(positions));
    std::vector<Vec3d> in_world(positions.size());
    for (std::size_t i = 0; i < positions.size(); ++i)
        in_world[i] = self.model.model->mesh.origin + positions[i].cast<double>();
    return take(std::move(in_world));
}

MeshPtr restore_mesh(const PyRestorer& self, const py::object& pose, const py::object& gradients, unsigned threads) {
    const Pose moved = pose_of(pose, gradients);
    const RunContext& context = short_context(threads);
    return without_interpreter([&] { return std::make_shared<Mesh>(self.restorer.mesh(moved, context).value()); });
}

py::tuple adjoint_of(const PyRestorer& self, const py::object& given, unsigned threads) {
    const Numbers<float> numbers = floats_of(given, "vertices"); // not copied where it is so already
    if (numbers.ndim() != 2 || numbers.shape(1) != 3) refuse("vertices has to be of shape (n, 3).");
    const std::span<const Vec3f> vertices(reinterpret_cast<const Vec3f*>(numbers.data()),
                                          static_cast<std::size_t>(numbers.shape(0)));
    const RunContext& context = short_context(threads);
    PoseDerivative derivative = without_interpreter([&] {
        std::call_once(self.adjoint->made, [&] {
            self.adjoint->adjoint = RestoreAdjoint::create(*self.model.model, self.options.level, RunContext()).value();
        });
        return self.adjoint->adjoint->apply(vertices, context).value();
    });
    float sum = 0; // one number that is not finite makes the sum so, as every vertex hangs on something
    for (const Vec3f& position : derivative.positions) sum += 0 * position.sum();
    if (sum != 0 || std::isnan(sum)) refuse("vertices has numbers that are not finite, or too large for 32 bits.");
    return py::make_tuple(take(std::move(derivative.positions)), take(std::move(derivative.gradients)));
}

py::dict expect_error(const PyModel& self, const py::object& pose, unsigned threads) {
    const Pose moved = pose_of(pose, py::none());
    const RunContext& context = short_context(threads);
    PoseError::Estimate found = without_interpreter([&] {
        check_pose(*self.model, moved).value();
        const Restorer restorer = Restorer::create(*self.model, {}, context).value();
        const std::vector<Mat3f> gradients = restorer.gradients(moved, context).value();
        return PoseError(*self.model, context).estimate(moved, gradients).value();
    });
    py::dict said;
    said["rms"] = found.share();
    said["rms_units"] = found.rms;
    said["is_too_curved"] = found.is_too_curved();
    said["local_units"] = take(std::move(found.local));
    return said;
}

} // namespace

void add_restoring(py::module_& m) {
    py::class_<PyRestorer>(m, "Restorer",
                           R"(Puts the detail back, pose after pose. What does not depend on the pose is prepared once.

Parameters
----------
model : Model
level : int, optional
    Restore up to this level; None: the finest.

Raises
------
UsageError
    No such level.

Notes
-----
Many threads may use one restorer. It pickles as its model and options.

Examples
--------
>>> model = filigree.strip(filigree.make("wavy-cube", resolution=24))
>>> restorer = filigree.Restorer(model)
>>> out = numpy.empty((len(restorer), 3), numpy.float32)
>>> restorer.positions(2 * model.driver.vertices, out=out) is out
True
)")
        .def(py::init(&make_restorer), py::arg("model"), py::kw_only(), py::arg("level") = py::none(),
             R"(__init__(self, model, *, level=None)
--

)")
        .def("positions", &restore_positions, py::arg("pose"), py::arg("gradients") = py::none(), py::kw_only(),
             py::arg("out") = py::none(), py::arg("world") = false, py::arg("threads") = 0,
             R"(positions(self, pose, gradients=None, *, out=None, world=False, threads=0)
--

Positions of the level's vertices.

Parameters
----------
pose : Pose, or array_like (d, 3)
    Where the driver is; positions are relative to the mesh's `origin`.
gradients : array_like, (d, 3, 3), optional
    With positions: how space is deformed at each driver vertex. Without them they are estimated.
out : ndarray of float32, (n, 3) or flat, optional
    Written in place, in C order; no array is made then.
world : bool
    Add the mesh's `origin`, in float64.
threads : int
    0: all of the processor's. The same bytes for any.

Returns
-------
ndarray
    float32 (n, 3) relative to the mesh's `origin` (`out` where that was given), or with `world` float64.

Raises
------
MismatchError
    Another number of vertices than the driver has.
UsageError
    Numbers that are not finite; an `out` that cannot be written in place.
)")
        .def("mesh", &restore_mesh, py::arg("pose"), py::arg("gradients") = py::none(), py::kw_only(),
             py::arg("threads") = 0,
             R"(mesh(self, pose, gradients=None, *, threads=0)
--

The level as a mesh: restored positions, normals where the mesh came with normals, all other attributes as they came.
Parameters and errors are those of `positions`.
)")
        .def(
            "gradients",
            [](const PyRestorer& self, const py::object& pose, unsigned threads) {
                const Pose moved = pose_of(pose, py::none());
                const RunContext& context = short_context(threads);
                return take(without_interpreter([&] { return self.restorer.gradients(moved, context).value(); }));
            },
            py::arg("pose"), py::kw_only(), py::arg("threads") = 0,
            R"(gradients(self, pose, *, threads=0)
--

The gradients that a pose is restored with, float32 (d, 3, 3): its own, or estimated from its positions.
)")
        .def("_adjoint", &adjoint_of, py::arg("vertices"), py::arg("threads") = 0)
        .def_property_readonly(
            "model", [](const PyRestorer& self) { return self.model; }, "The model it restores.")
        .def_property_readonly(
            "level", [](const PyRestorer& self) { return self.options.level; },
            "As it was made with; None: the finest.")
        .def("__len__", [](const PyRestorer& self) { return self.restorer.vertex_count(); })
        .def(py::pickle([](const PyRestorer& self) { return py::make_tuple(self.model, self.options.level); },
                        [](const py::tuple& state) {
                            return make_restorer(state[0].cast<PyModel>(), state[1].cast<std::optional<unsigned>>());
                        }));

    m.def(
        "restore",
        [](const PyModel& model, const py::object& pose, const py::object& gradients, std::optional<unsigned> level,
           unsigned threads) { return restore_mesh(make_restorer(model, level), pose, gradients, threads); },
        py::arg("model"), py::arg("pose"), py::arg("gradients") = py::none(), py::kw_only(),
        py::arg("level") = py::none(), py::arg("threads") = 0,
        R"(restore(model, pose, gradients=None, *, level=None, threads=0)
--

Put the detail back onto a moved driver, once; for pose after pose make a `Restorer`.

Parameters
----------
model : Model
pose : Pose, or array_like (d, 3)
    Where the driver is; positions are relative to the mesh's `origin`.
gradients : array_like, (d, 3, 3), optional
    With positions: how space is deformed at each driver vertex. Without them they are estimated.
level : int, optional
    Restore up to this level; None: the finest.

Returns
-------
Mesh

Examples
--------
>>> model = filigree.strip(filigree.make("bar", resolution=8))
>>> filigree.restore(model, model.driver.vertices)
<filigree.Mesh: 1154 vertices, 1152 faces>
)");
    m.def("expected_error", &expect_error, py::arg("model"), py::arg("pose"), py::kw_only(), py::arg("threads") = 0,
          R"(expected_error(model, pose, *, threads=0)
--

How far the restored mesh is expected to be from deforming every vertex, judged from the pose alone.

Parameters
----------
model : Model
pose : Pose, or array_like (d, 3)
    As of `Restorer.positions`.

Returns
-------
dict
    'rms': fraction of the posed driver's diagonal, within a factor of 2 for nine poses in ten; 'rms_units';
    'is_too_curved': whether one sees it; 'local_units': around each driver vertex, float32 (d,).
)");
}

} // namespace filigree::python
