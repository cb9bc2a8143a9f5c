#include "models.h"

#include <filigree/mesh.h>
#include <filigree/remesh/quad_quality.h>
#include <filigree/sample.h>

namespace filigree::python {

namespace {

py::dict said_of(const Finding& finding) {
    py::dict said;
    said["count"] = finding.count;
    said["places"] = finding.places;
    return said;
}

py::dict mesh_info(const Mesh& mesh, const TopologyReport& topology) {
    py::dict said, box, defects;
    said["kind"] = "mesh";
    said["vertices"] = topology.vertices;
    said["faces"] = topology.faces;
    said["triangles"] = topology.triangles;
    said["quads"] = topology.quads;
    said["polygons"] = topology.polygons;
    said["edges"] = topology.edges;
    said["components"] = topology.components;
    said["euler"] = topology.euler;
    said["closed"] = topology.is_closed();
    said["manifold"] = topology.is_manifold();
    said["oriented"] = topology.is_oriented();
    if (mesh.vertex_count() > 0) {
        box["min"] = array_of(topology.box.min);
        box["max"] = array_of(topology.box.max);
        said["box"] = box;
        said["diagonal_units"] = topology.box.diagonal();
    }
    said["area"] = topology.area;
    said["volume"] = topology.volume;
    defects["open_edges"] = said_of(topology.open_edges);
    defects["nonmanifold_edges"] = said_of(topology.nonmanifold_edges);
    defects["inconsistent_edges"] = said_of(topology.inconsistent_edges);
    defects["nonmanifold_vertices"] = said_of(topology.nonmanifold_vertices);
    defects["degenerate_faces"] = said_of(topology.degenerate_faces);
    defects["duplicate_faces"] = said_of(topology.duplicate_faces);
    defects["unused_vertices"] = said_of(topology.unused_vertices);
    defects["duplicate_vertices"] = said_of(topology.duplicate_vertices);
    said["defects"] = defects;
    return said;
}

py::dict quad_info(const QuadQuality& quality) {
    py::dict said, jacobian;
    said["irregular_vertices"] = quality.irregular_vertices;
    jacobian["min"] = quality.min_scaled_jacobian;
    jacobian["percentile_1"] = quality.low_scaled_jacobian;
    jacobian["mean"] = quality.mean_scaled_jacobian;
    said["scaled_jacobian"] = jacobian;
    said["inverted"] = quality.inverted;
    said["worst_quad"] = quality.worst_quad;
    return said;
}

py::dict model_info(const Model& model) {
    py::dict said;
    said["kind"] = "model";
    said["code"] = "blend";
    py::list levels;
    for (unsigned k = 0; k <= model.finest_level(); ++k) {
        const LevelCounts counts = level_counts(model, k);
        py::dict level;
        level["vertices"] = counts.vertices;
        level["faces"] = counts.faces;
        levels.append(level);
    }
    said["levels"] = levels;
    said["across_gap"] = model.detail.across_gap.size();
    said["facing_away"] = model.detail.facing_away.size();
    return said;
}

py::dict info(const py::object& given, unsigned threads) {
    if (py::isinstance<PyModel>(given)) return model_info(*model_of(given));
    const MeshPtr mesh = mesh_of(given);
    const auto [topology, quality, inside] = LongCall{threads}([&](const RunContext& context) {
        return std::tuple(analyse_topology(*mesh, context), measure_quads(*mesh, context),
                          inside_volume(*mesh, context).value());
    });
    py::dict said = mesh_info(*mesh, topology);
    said["inside_volume"] = inside.volume;
    said["inside_said"] = outward_sentence(inside.outward);
    if (topology.quads > 0) said["quad_quality"] = quad_info(quality);
    return said;
}

py::dict compare(const py::object& a, const py::object& b, std::size_t samples, unsigned threads,
                 const py::object& progress) {
    const MeshPtr first = mesh_or_points_of(a, "a"), second = mesh_or_points_of(b, "b");
    const MeshDistance distance = LongCall{threads, progress}.owning(
        [=](const RunContext& context) { return mesh_distance(*first, *second, samples, context).value(); });
    py::dict said;
    said["diagonal_units"] = distance.diagonal;
    const auto add = [&](const std::string& key, double units) {
        said[py::str(key)] = distance.relative(units);
        said[py::str(key + "_units")] = units;
    };
    if (const auto& v = distance.vertices) {
        add("rms", v->rms);
        add("max", v->max);
        if (v->max_vertex != kNoIndex) said["max_vertex"] = v->max_vertex;
        said["normal_mean_deg"] = v->normal_mean_deg;
        said["normal_p95_deg"] = v->normal_p95_deg;
    }
    if (const auto& s = distance.surfaces) {
        add("hausdorff", s->hausdorff);
        add("mean_distance", s->mean_distance);
        add("rms_a_to_b", s->rms_a_to_b);
        add("max_a_to_b", s->max_a_to_b);
        add("rms_b_to_a", s->rms_b_to_a);
        add("max_b_to_a", s->max_b_to_a);
    }
    return said;
}

} // namespace

void add_comparing(py::module_& m) {
    m.def("info", &info, py::arg("what"), py::kw_only(), py::arg("threads") = 0, R"(info(what, *, threads=0)
--

Say what a mesh or a model is, and what is wrong with it.

Parameters
----------
what : Mesh, Model, or an object with vertices and faces or triangles

Returns
-------
dict
    The keys of `filigree info --json` (docs/command-line.md). Of a mesh counts, 'closed', 'manifold', 'oriented',
    'box', 'area', 'volume' (by the way faces look), 'inside_volume' (None where open), 'inside_said', 'defects'
    (each a 'count' and the first five 'places') and 'quad_quality'; of a model
    'code', 'levels' and what its code has.

Examples
--------
>>> said = filigree.info(filigree.make("wavy-plane", resolution=4))
>>> said["closed"], said["defects"]["open_edges"]["count"]
(False, 16)
)");
    m.def("compare", &compare, py::arg("a"), py::arg("b"), py::kw_only(), py::arg("samples") = 100'000,
          py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(compare(a, b, *, samples=100000, threads=0, progress=None)
--

Say how far one mesh is from another.

Parameters
----------
a, b : Mesh, an object with vertices and faces or triangles, (V, F), or array_like (n, 3)
    `b` is what is measured against: fractions are of its diagonal.
samples : int
    Points on each surface, besides its vertices.

Returns
-------
dict
    The keys of `filigree compare --json`. With as many vertices 'rms' and 'max', vertex by vertex; with faces
    'hausdorff', 'mean_distance' and more, surface to surface. Each also in model units, with '_units' at the end.
)");
    m.def(
        "vertex_distances",
        [](const py::object& a, const py::object& b, unsigned threads) {
            const MeshPtr first = mesh_or_points_of(a, "a"), second = mesh_or_points_of(b, "b");
            const RunContext& context = short_context(threads);
            return take(
                without_interpreter([&] { return vertex_distance(*first, *second, context).value().per_vertex; }));
        },
        py::arg("a"), py::arg("b"), py::kw_only(), py::arg("threads") = 0, R"(vertex_distances(a, b, *, threads=0)
--

How far each vertex of `a` is from the same vertex of `b`, model units, float32 (n,). Both are meshes or points.

Raises
------
MismatchError
    Another number of vertices.
)");
    m.def(
        "distances_to_surface",
        [](const py::object& a, const py::object& b, unsigned threads, const py::object& progress) {
            const MeshPtr first = mesh_or_points_of(a, "a"), second = mesh_of(b, "b");
            return take(LongCall{threads, progress}.owning(
                [=](const RunContext& context) { return distances_to_surface(*first, *second, context).value(); }));
        },
        py::arg("a"), py::arg("b"), py::kw_only(), py::arg("threads") = 0, py::arg("progress") = py::none(),
        R"(distances_to_surface(a, b, *, threads=0, progress=None)
--

How far each vertex of `a`, a mesh or points, is from the surface of `b`, model units, float32 (n,). `closest_points` says
where.

Raises
------
UnsuitableError
    `b` has no faces.
Cancelled
)");
    m.def(
        "edge_strains",
        [](const py::object& a, const py::object& rest) {
            const MeshPtr moved = mesh_of(a, "a"), at_rest = mesh_of(rest, "rest");
            return take(without_interpreter([&] { return edge_strains(*moved, *at_rest).value(); }));
        },
        py::arg("a"), py::arg("rest"), R"(edge_strains(a, rest)
--

How much the edges at each vertex have changed their length: the mean of abs(length in a / length in rest - 1),
float32 (n,).

Raises
------
MismatchError
    The meshes do not have the same faces.
)");
}

} // namespace filigree::python
