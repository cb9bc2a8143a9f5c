#include "calls.h"
#include "meshes.h"

#include <filigree/sample.h>
#include <filigree/sample/frustum.h>

namespace filigree::python {

namespace {

InsideOptions inside_options(const std::string& method, const std::string& overlap, double accuracy,
                             const py::object& eye, const Mesh& mesh) {
    InsideOptions options;
    options.method = value_of<InsideMethod>(method, "method",
                                            {{"auto", InsideMethod::automatic},
                                             {"scan", InsideMethod::scan},
                                             {"rays", InsideMethod::rays},
                                             {"winding", InsideMethod::winding}});
    options.overlap = value_of<Overlap>(overlap, "overlap", {{"parity", Overlap::parity}, {"merged", Overlap::merged}});
    if (!(accuracy >= 1e-4 && accuracy <= 0.1)) refuse("accuracy has to be from 0.0001 to 0.1.");
    options.accuracy = accuracy;
    if (const auto from = optional_vector_of(eye, "eye")) options.eye = *from - mesh.origin;
    return options;
}

/// What prepares the question, and points of the world.
struct PyInsideTest {
    std::shared_ptr<const InsideTest> test;
    Vec3d origin;
};

PyInsideTest make_test(const py::object& given, const std::string& method, const std::string& overlap, double accuracy,
                       const py::object& eye, unsigned threads, const py::object& progress) {
    const MeshPtr mesh = mesh_of(given);
    const InsideOptions options = inside_options(method, overlap, accuracy, eye, *mesh);
    auto test = LongCall{threads, progress}.owning([=](const RunContext& context) {
        return std::make_shared<const InsideTest>(InsideTest::create(*mesh, options, context).value());
    });
    warn_of_turns(test->outward());
    return {std::move(test), mesh->origin};
}

py::array_t<bool> ask(const PyInsideTest& self, const py::object& given, unsigned threads, const py::object& progress) {
    std::vector<Vec3d> points = double_points_of(given, "points");
    for (Vec3d& point : points) point -= self.origin;
    std::vector<std::uint8_t> inside =
        LongCall{threads, progress}.owning([test = self.test, points = std::move(points)](const RunContext& context) {
            return test->contains(points, context).value();
        });
    const auto count = static_cast<py::ssize_t>(inside.size());
    return take<bool>(std::move(inside), Shape{count});
}

/// Points of the world, and how they were found.
struct Sampled {
    std::vector<Vec3d> points;
    InsideReport report;
};

py::array_t<double> take_warned(Sampled&& found) {
    warn_of_turns(found.report.outward);
    return take(std::move(found.points));
}

/// The report's points: in the view from the eye, in regular steps across the picture and in depth.
py::array_t<double> sample_in_view(const MeshPtr& mesh, const std::array<std::size_t, 3>& counts, InsideOptions options,
                                   const LongCall& call) {
    Frustum frustum = frustum_around(bounds(mesh->positions), options.eye);
    options.eye = frustum.eye;
    frustum.counts = counts;
    return take_warned(call.owning([=](const RunContext& context) {
        Sampled found;
        found.points = points_inside(*mesh, frustum_points(frustum).value(), options, context, &found.report).value();
        for (Vec3d& point : found.points) point += mesh->origin;
        return found;
    }));
}

py::array_t<double> sample(const py::object& given, std::optional<double> spacing, std::optional<std::size_t> count,
                           const std::string& pattern, const py::object& origin, const std::string& method,
                           const std::string& overlap, double accuracy, std::uint64_t seed,
                           const std::optional<std::array<std::size_t, 3>>& frustum, const py::object& eye,
                           unsigned threads, const py::object& progress) {
    const MeshPtr mesh = mesh_of(given);
    if (int(spacing.has_value()) + int(count.has_value()) + int(frustum.has_value()) != 1)
        refuse("Say how many points: spacing, count or frustum.");
    InsideOptions options = inside_options(method, overlap, accuracy, eye, *mesh);
    if (frustum) return sample_in_view(mesh, *frustum, options, LongCall{threads, progress, seed});
    const auto how =
        value_of<Pattern>(pattern, "pattern",
                          {{"lattice", Pattern::lattice}, {"jitter", Pattern::jitter}, {"poisson", Pattern::poisson}});
    LatticeOptions wanted{.spacing = spacing.value_or(0)};
    if (const auto at = optional_vector_of(origin, "origin")) wanted.origin = *at - mesh->origin;
    return take_warned(LongCall{threads, progress, seed}.owning([=](const RunContext& context) {
        LatticeOptions lattice = wanted;
        if (count) lattice.spacing = spacing_for_count(*mesh, *count, options, context).value();
        const Lattice points = make_lattice(bounds(mesh->positions), lattice).value();
        Sampled found;
        found.points = spread_inside(*mesh, points, how, options, context, &found.report).value();
        for (Vec3d& point : found.points) point += mesh->origin;
        return found;
    }));
}

} // namespace

void add_sampling(py::module_& m) {
    py::class_<PyInsideTest>(m, "InsideTest", R"(Whether points are inside a mesh, asked again and again.

Parameters
----------
mesh : Mesh, or an object with vertices and faces or triangles
method : str
    'auto' ('scan' where the mesh is closed, else 'winding'), 'scan' and 'rays' (exact, closed meshes alone),
    'winding' (any mesh).
overlap : str
    Closed parts that overlap are hollow there ('parity') or 'merged'. Open meshes are always merged.
accuracy : float
    Winding: largest error of a winding number, 0.0001 to 0.1.
eye : array_like, (3,), optional
    Rays: where they start, world coordinates.

Raises
------
UnsuitableError
    No faces; 'scan' or 'rays' of an open mesh.
UsageError, Cancelled
)")
        .def(
            py::init(&make_test), py::arg("mesh"), py::kw_only(), py::arg("method") = "auto",
            py::arg("overlap") = "parity", py::arg("accuracy") = 0.01, py::arg("eye") = py::none(),
            py::arg("threads") = 0, py::arg("progress") = py::none(),
            R"(__init__(self, mesh, *, method='auto', overlap='parity', accuracy=0.01, eye=None, threads=0, progress=None)
--

)")
        .def("contains", &ask, py::arg("points"), py::kw_only(), py::arg("threads") = 0,
             py::arg("progress") = py::none(), R"(contains(self, points, *, threads=0, progress=None)
--

Whether each point, in world coordinates, is inside: bool (n,).
)");
    m.def(
        "contains",
        [](const py::object& mesh, const py::object& points, const std::string& method, const std::string& overlap,
           double accuracy, unsigned threads, const py::object& progress) {
            return ask(make_test(mesh, method, overlap, accuracy, py::none(), threads, progress), points, threads,
                       progress);
        },
        py::arg("mesh"), py::arg("points"), py::kw_only(), py::arg("method") = "auto", py::arg("overlap") = "parity",
        py::arg("accuracy") = 0.01, py::arg("threads") = 0, py::arg("progress") = py::none(),
        R"(contains(mesh, points, *, method='auto', overlap='parity', accuracy=0.01, threads=0, progress=None)
--

Whether points are inside a mesh, once; for more questions make an `InsideTest`, which says what the options are.

Parameters
----------
mesh : Mesh, or an object with vertices and faces or triangles
points : array_like, (n, 3)
    World coordinates.
method, overlap, accuracy
    As of `InsideTest`.

Returns
-------
ndarray of bool, (n,)

Examples
--------
>>> filigree.contains(filigree.make("torus"), [[0, 0, 0], [0.385, 0, 0]])
array([False,  True])
)");
    m.def(
        "sample", &sample, py::arg("mesh"), py::kw_only(), py::arg("spacing") = py::none(),
        py::arg("count") = py::none(), py::arg("pattern") = "lattice", py::arg("origin") = py::none(),
        py::arg("method") = "auto", py::arg("overlap") = "parity", py::arg("accuracy") = 0.01, py::arg("seed") = 1,
        py::arg("frustum") = py::none(), py::arg("eye") = py::none(), py::arg("threads") = 0,
        py::arg("progress") = py::none(),
        R"(sample(mesh, *, spacing=None, count=None, pattern='lattice', origin=None, method='auto', overlap='parity', accuracy=0.01, seed=1, frustum=None, eye=None, threads=0, progress=None)
--

Fill a mesh with points.

Parameters
----------
mesh : Mesh, or an object with vertices and faces or triangles
spacing : float, optional
    Between lattice points, model units. One of this, `count` and `frustum`.
count : int, optional
    Choose the spacing so that about as many are inside.
pattern : str
    'lattice'; 'jitter', each somewhere in its own cell; 'poisson', in random places, none closer to another than 0.8
    of the spacing.
origin : array_like, (3,), optional
    A lattice point, world coordinates.
method, overlap, accuracy
    As of `InsideTest`.
seed : int
    Of the patterns.
frustum : (int, int, int), optional
    The report's points instead of a lattice: so many across the view from `eye`, up and in depth.
eye : array_like, (3,), optional
    World coordinates; unset: in front of the mesh.

Returns
-------
ndarray, float64 (n, 3)
    World coordinates.

Raises
------
UsageError
    A spacing that is not above 0, or larger than the mesh.
UnsuitableError
    No faces, nothing inside, too many points.
Cancelled

Examples
--------
>>> filigree.sample(filigree.make("bar", resolution=4), spacing=0.5).shape
(32, 3)
)");
}

} // namespace filigree::python
