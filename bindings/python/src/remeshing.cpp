#include "calls.h"
#include "meshes.h"

#include <filigree/remesh.h>

namespace filigree::python {

namespace {

py::dict said_of(const Deviation& deviation, double diagonal) {
    py::dict said;
    said["rms"] = deviation.rms;
    said["max"] = deviation.max;
    said["rms_units"] = deviation.rms * diagonal;
    said["max_units"] = deviation.max * diagonal;
    return said;
}

py::dict said_of(const CleanReport& clean) {
    py::dict said;
    said["welded_vertices"] = clean.welded_vertices;
    said["unused_vertices"] = clean.unused_vertices;
    said["degenerate_faces"] = clean.degenerate_faces;
    said["duplicate_faces"] = clean.duplicate_faces;
    said["flipped_faces"] = clean.flipped_faces;
    said["cut_edges"] = clean.cut_edges;
    said["separated_edges"] = clean.separated_edges;
    said["split_vertices"] = clean.split_vertices;
    said["removed_components"] = clean.removed_components;
    said["closed_handles"] = clean.closed_handles;
    said["filled_triangles"] = clean.filled_triangles;
    said["removed_area"] = clean.removed_area;
    return said;
}

py::dict said_of(const SurfaceTopology& topology) {
    py::dict said;
    said["components"] = topology.components;
    said["border_edges"] = topology.border_edges;
    said["border_loops"] = topology.border_loops;
    said["euler"] = topology.euler;
    said["handles"] = topology.genus();
    return said;
}

py::dict said_of(const QuadRemeshReport& report, std::size_t quads) {
    py::dict said, jacobian, topology, seconds;
    said["quads"] = quads;
    said["patches"] = report.patches;
    said["levels"] = report.levels;
    said["irregular_vertices"] = report.quality.irregular_vertices;
    jacobian["min"] = report.quality.min_scaled_jacobian;
    jacobian["percentile_1"] = report.quality.low_scaled_jacobian;
    jacobian["mean"] = report.quality.mean_scaled_jacobian;
    said["scaled_jacobian"] = jacobian;
    said["inverted"] = report.quality.inverted;
    said["diagonal_units"] = report.diagonal;
    said["to_input"] = said_of(report.to_input, report.diagonal);
    said["from_input"] = said_of(report.from_input, report.diagonal);
    said["max_distance"] = report.max_distance;
    said["max_distance_from_input"] = report.max_distance_from_input;
    said["clean"] = said_of(report.clean);
    topology["input"] = said_of(report.input);
    topology["output"] = said_of(report.output);
    said["topology"] = topology;
    said["feature_edges"] = report.feature_edges;
    said["wrapped"] = report.wrapped;
    said["tries"] = report.tries;
    said["retried"] = report.retried;
    for (const PhaseSeconds& phase : report.seconds) seconds[phase.phase] = phase.seconds;
    said["seconds"] = seconds;
    return said;
}

py::object remesh(const py::object& given, std::size_t quads, std::optional<unsigned> levels, double feature_angle,
                  const std::string& small_parts, const std::string& wrap, std::optional<double> max_distance,
                  bool attributes, unsigned threads, const py::object& progress) {
    const MeshPtr mesh = mesh_of(given);
    QuadRemeshOptions options{.quads = quads,
                              .levels = levels,
                              .feature_angle_deg = feature_angle,
                              .max_distance = max_distance,
                              .attributes = attributes};
    options.small_parts =
        value_of<SmallParts>(small_parts, "small_parts", {{"remove", SmallParts::remove}, {"keep", SmallParts::keep}});
    options.wrap = value_of<WrapUse>(
        wrap, "wrap", {{"auto", WrapUse::automatic}, {"never", WrapUse::never}, {"always", WrapUse::always}});
    QuadRemeshed made = LongCall{threads, progress}.owning(
        [=](const RunContext& context) { return quad_remesh(*mesh, options, context).value(); });
    py::dict said = said_of(made.report, made.mesh.face_count());
    said["base"] = std::make_shared<Mesh>(base_mesh(made));
    return named_result("Remeshed", std::make_shared<Mesh>(std::move(made.mesh)), said);
}

} // namespace

void add_remeshing(py::module_& m) {
    m.def(
        "remesh", &remesh, py::arg("mesh"), py::arg("quads") = 50'000, py::kw_only(), py::arg("levels") = py::none(),
        py::arg("feature_angle") = 40.0, py::arg("small_parts") = "remove", py::arg("wrap") = "auto",
        py::arg("max_distance") = py::none(), py::arg("attributes") = true, py::arg("threads") = 0,
        py::arg("progress") = py::none(),
        R"(remesh(mesh, quads=50000, *, levels=None, feature_angle=40.0, small_parts='remove', wrap='auto', max_distance=None, attributes=True, threads=0, progress=None)
--

Turn any mesh into quads: patches of a regular grid, as the reference code needs them.

Parameters
----------
mesh : Mesh, or an object with vertices and faces or triangles
quads : int
    About how many, 6 to 100 million.
levels : int, optional
    How often each patch is halved, 1 to 8.
feature_angle : float
    Edges whose faces meet at more than this stay edges, degrees, 0 to 180; 180: none.
small_parts : str
    Handles and components too small for the patches: 'remove' or 'keep'.
wrap : str
    A closed wrap around the mesh instead of itself: 'auto', 'never' or 'always'.
max_distance : float, optional
    The limit on both distances, fraction of the diagonal.
attributes : bool
    Carry UVs, colours, normals, labels and scalars over.

Returns
-------
mesh : Mesh
    Quads alone, patch by patch.
report : dict
    The keys of `filigree remesh --json`; and 'base', the patches' corners as a Mesh, a quad each.

Raises
------
UsageError
    Options out of range.
UnsuitableError
    Nothing with an area; fewer quads than the parts need; no way passes the limits.
Cancelled

Examples
--------
>>> quads, report = filigree.remesh(filigree.make("torus", resolution=16), 2000)
>>> report["inverted"], quads.faces.shape[1]
(0, 4)
)");
}

} // namespace filigree::python
