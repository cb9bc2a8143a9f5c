#include "models.h"

#include <filigree/fit.h>

namespace filigree::python {

namespace {

/// Frames of shape (f, n, 3) in the world, as numpy has them: floats where that loses nothing.
struct Frames {
    MeshPtr mesh;
    std::optional<Numbers<float>> floats;
    std::optional<Numbers<double>> doubles;

    Frames(MeshPtr of, const py::object& positions) : mesh(std::move(of)) {
        py::ssize_t frames = 0;
        if (mesh->origin.isZero()) {
            floats = floats_of(positions, "positions");
            frames = checked(*floats);
        } else {
            doubles = doubles_of(positions, "positions");
            frames = checked(*doubles);
        }
        count = static_cast<std::size_t>(frames);
    }

    Status read(std::size_t frame, std::span<Vec3f> out) const {
        const std::size_t begin = 3 * out.size() * frame;
        if (floats) {
            const float* from = floats->data() + begin;
            for (std::size_t i = 0; i < out.size(); ++i) out[i] = {from[3 * i], from[3 * i + 1], from[3 * i + 2]};
        } else {
            const double* from = doubles->data() + begin;
            for (std::size_t i = 0; i < out.size(); ++i)
                out[i] = (Vec3d(from[3 * i], from[3 * i + 1], from[3 * i + 2]) - mesh->origin).cast<float>();
        }
        return Success{};
    }

    std::size_t count = 0;

private:
    template <class Array>
    py::ssize_t checked(const Array& array) const {
        const auto vertices = static_cast<py::ssize_t>(mesh->vertex_count());
        if (array.ndim() != 3 || array.shape(1) != vertices || array.shape(2) != 3)
            refuse(ErrorCode::mismatch, "positions has to be of shape (frames, " + std::to_string(vertices) +
                                            ", 3): one a vertex of the mesh.");
        return array.shape(0);
    }
};

py::dict said_of(const FitReport& report) {
    py::dict said;
    said["driver_vertices"] = report.driver_vertices;
    said["frames"] = report.frames;
    said["rms"] = report.rms;
    said["max"] = report.max;
    said["max_frame"] = report.max_frame;
    said["max_vertex"] = report.max_vertex;
    said["diagonal_units"] = report.diagonal;
    said["normal_mean_degrees"] = report.normal_mean_deg;
    said["normal_p95_degrees"] = report.normal_p95_deg;
    said["choice"] = std::string(name_of(report.choice));
    said["parted_vertices"] = report.parted;
    said["tries"] = report.tries;
    return said;
}

py::object fit(const py::object& given, const py::object& positions, double error, std::optional<double> max_error,
               std::optional<std::size_t> base, const py::object& rest_frame, double frames_per_second,
               bool sound_gradients, unsigned threads, const py::object& progress) {
    if (!(frames_per_second > 0)) refuse("frames_per_second has to be above 0.");
    const Frames frames(mesh_of(given), positions);
    const MeshAnimation animation{frames.mesh.get(), frames.count, frames_per_second,
                                  [&](std::size_t frame, std::span<Vec3f> out) { return frames.read(frame, out); }};
    FitOptions options{.error = error, .max_error = max_error, .base = base, .sound_gradients = sound_gradients};
    const bool chooses_rest = py::isinstance<py::str>(rest_frame);
    if (chooses_rest && rest_frame.cast<std::string>() != "best")
        refuse("rest_frame has to be a number, 'best' or None.");
    if (!chooses_rest && !rest_frame.is_none()) options.rest_frame = rest_frame.cast<std::size_t>();
    Fitted fitted = LongCall{threads, progress}([&](const RunContext& context) {
        if (chooses_rest) options.rest_frame = least_stretched_frame(animation, context).value();
        return fit_animation(animation, options, context).value();
    });
    PyModel model{std::make_shared<const Model>(std::move(fitted.model)), said_of(fitted.report)};
    return named_result("Fitted", std::move(model), std::move(fitted.poses));
}

} // namespace

void add_fitting(py::module_& m) {
    m.def(
        "fit", &fit, py::arg("mesh"), py::arg("positions"), py::kw_only(), py::arg("error") = 1e-4,
        py::arg("max_error") = py::none(), py::arg("base") = py::none(), py::arg("rest_frame") = py::none(),
        py::arg("frames_per_second") = 60.0, py::arg("sound_gradients") = false, py::arg("threads") = 0,
        py::arg("progress") = py::none(),
        R"(fit(mesh, positions, *, error=0.0001, max_error=None, base=None, rest_frame=None, frames_per_second=60.0, sound_gradients=False, threads=0, progress=None)
--

Find the smallest driver, and its poses, whose restored mesh follows an animation within an error.

The error is measured on every vertex of every frame. model.report says it: 'rms' and 'max' (fractions of the diagonal),
'max_frame' and 'max_vertex' (both from 0), 'normal_mean_degrees', 'normal_p95_degrees', 'driver_vertices', and more.

Parameters
----------
mesh : Mesh, or an object with vertices and faces or triangles
    At rest. It has faces.
positions : array_like, (f, n, 3)
    World coordinates of its vertices, frame by frame. float32 is read without a copy.
error : float
    Largest root of the mean squared distance, fraction of the rest shape's diagonal, above 0.
max_error : float, optional
    Largest distance of any vertex in any frame, fraction of the diagonal.
base : int, optional
    Vertices of the driver, about, 12 or more; the error is then what it is.
rest_frame : int or 'best', optional
    The frame that is the rest shape, from 0; 'best': the one from which others are stretched least. None: the mesh.
frames_per_second : float
    Above 0.
sound_gradients : bool
    Keep gradients near the driver's own motion, so that viewers, which turn normals by them, shade a skin right. It
    follows less closely.

Returns
-------
Fitted
    model and poses, which unpack.

Raises
------
UnsuitableError
    No frames, no faces, a frame whose vertices are in another order, or an error that is not reached: the message says
    what is.
MismatchError
    Another number of vertices.
UsageError, OutOfMemoryError, Cancelled

Examples
--------
>>> import numpy
>>> mesh = filigree.make("wavy-plane", resolution=30)
>>> frames = [mesh.world_vertices + [0, 0, 0.01 * k] * numpy.sin(3 * mesh.world_vertices[:, :1]) for k in range(5)]
>>> model, poses = filigree.fit(mesh, frames, error=1e-3)
>>> len(poses), model.report["rms"] < 1e-3
(5, True)
)");
}

} // namespace filigree::python
