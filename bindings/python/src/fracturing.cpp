#include "calls.h"
#include "meshes.h"

#include <filigree/fracture.h>

namespace filigree::python {

namespace {

constexpr double kFarthestApart = 1e6;

py::dict fracture_report(const FracturedMesh& fractured) {
    const CutReport& report = fractured.report;
    py::dict said;
    said["pieces"] = fractured.pieces;
    said["cells"] = report.cells;
    said["islands"] = report.islands;
    said["joined"] = report.joined;
    said["smallest"] = report.smallest;
    said["median"] = report.median;
    said["largest"] = report.largest;
    said["sheet"] = report.is_sheet;
    said["facets"] = report.facets;
    said["cone_facets"] = report.fan_facets;
    said["inside_faces"] = report.inside_faces;
    said["open_edges"] = report.open_edges;
    said["closing_triangles"] = report.closing_triangles;
    said["volume"] = report.volume;
    said["volume_error"] = report.volume_error;
    return said;
}

using FracturedPtr = std::shared_ptr<const FracturedMesh>;

FracturedPtr fracture_mesh(const py::object& given, std::size_t pieces, const std::string& kind, const py::object& at,
                           const py::object& grain, double stretch, std::size_t clump, double roughness,
                           std::optional<double> edge, double smallest, std::uint64_t seed, unsigned threads,
                           const py::object& progress) {
    const MeshPtr mesh = mesh_of(given);
    FracturePattern pattern;
    pattern.kind = value_of<FracturePatternKind>(kind, "pattern",
                                                 {{"even", FracturePatternKind::even},
                                                  {"impact", FracturePatternKind::impact},
                                                  {"slabs", FracturePatternKind::slabs},
                                                  {"radial", FracturePatternKind::radial},
                                                  {"grains", FracturePatternKind::grains}});
    pattern.pieces = static_cast<Index>(std::min<std::size_t>(pieces, kNoIndex));
    if (!at.is_none())
        for (const Vec3d& point : double_points_of(at, "at")) pattern.at.push_back(point - mesh->origin);
    pattern.grain = optional_vector_of(grain, "grain");
    pattern.stretch = stretch;
    pattern.clump = static_cast<Index>(std::min<std::size_t>(clump, kNoIndex));
    pattern.roughness = roughness;
    if (edge && !(*edge >= 0)) refuse("edge has to be 0 or more.");
    if (!(smallest >= 0 && smallest <= 1)) refuse("smallest has to be from 0 to 1.");
    FracturedPtr fractured = LongCall{threads, progress, seed}.owning([=](const RunContext& context) {
        const FractureCells cells = make_fracture_cells(*mesh, pattern, context).value();
        const FractureOptions options{.edge = edge, .smallest = smallest};
        return std::make_shared<const FracturedMesh>(fracture(*mesh, cells, options, context).value());
    });
    warn_of_turns(fractured->report.outward);
    return fractured;
}

} // namespace

void add_fracturing(py::module_& m) {
    py::class_<FracturedMesh, std::shared_ptr<FracturedMesh>>(m, "FracturedMesh",
                                                              R"(A mesh in pieces, made by `fracture`.

Vertices of the mesh that was broken come first, in their order and to the bit; each vertex belongs to one piece.
)")
        .def_property_readonly(
            "mesh", [](const std::shared_ptr<FracturedMesh>& self) { return MeshPtr(self, &self->mesh); },
            "All pieces in one mesh: objects 'piece_0' and so on, a scalar 'piece', a material 'inside'.")
        .def_property_readonly(
            "pieces", [](const FracturedMesh& self) { return self.pieces; }, "How many.")
        .def_property_readonly(
            "piece_of_face",
            [](const py::object& self) { return view(self.cast<const FracturedMesh&>().piece_of_face, self); },
            "The piece of each face, uint32 (m,), read-only.")
        .def_property_readonly(
            "piece_of_vertex",
            [](const py::object& self) { return view(self.cast<const FracturedMesh&>().piece_of_vertex, self); },
            "The piece of each vertex, uint32 (n,), read-only; 4294967295 for a vertex without a face.")
        .def_property_readonly(
            "is_inside",
            [](const py::object& self) {
                const auto& inside = self.cast<const FracturedMesh&>().is_inside;
                return view(reinterpret_cast<const bool*>(inside.data()),
                            Shape{static_cast<py::ssize_t>(inside.size())}, self);
            },
            "Whether each face lies on a crack, bool (m,), read-only.")
        .def_property_readonly("report", &fracture_report,
                               "The counts and volumes of `filigree fracture --json`, dict.")
        .def(
            "piece",
            [](const FracturedMesh& self, Index piece) {
                if (piece >= self.pieces)
                    refuse("There is no piece " + std::to_string(piece) + "; there are " + std::to_string(self.pieces) +
                           ", counted from 0.");
                return std::make_shared<Mesh>(without_interpreter([&] { return piece_mesh(self, piece); }));
            },
            py::arg("piece"), R"(piece(self, piece)
--

One piece as a mesh of its own.
)")
        .def(
            "exploded",
            [](const FracturedMesh& self, double distance) {
                if (!(std::abs(distance) <= kFarthestApart))
                    refuse("distance has to be from -1,000,000 to 1,000,000 times the way to a piece.");
                return without_interpreter([&] {
                    FracturedMesh apart = self;
                    explode(apart, distance);
                    return std::make_shared<Mesh>(std::move(apart.mesh));
                });
            },
            py::arg("distance"), R"(exploded(self, distance)
--

All pieces in one mesh, each moved by `distance` (-1e6 to 1e6) times the way from the mesh's middle to its own.
)");
    m.def(
        "fracture",
        [](const py::object& mesh, std::size_t pieces, const std::string& pattern, const py::object& at,
           const py::object& grain, double stretch, std::size_t clump, double roughness, std::optional<double> edge,
           double smallest, std::uint64_t seed, unsigned threads, const py::object& progress) {
            return std::const_pointer_cast<FracturedMesh>(fracture_mesh(
                mesh, pieces, pattern, at, grain, stretch, clump, roughness, edge, smallest, seed, threads, progress));
        },
        py::arg("mesh"), py::arg("pieces") = 20, py::kw_only(), py::arg("pattern") = "even", py::arg("at") = py::none(),
        py::arg("grain") = py::none(), py::arg("stretch") = 6.0, py::arg("clump") = 1, py::arg("roughness") = 0.5,
        py::arg("edge") = py::none(), py::arg("smallest") = 0.01, py::arg("seed") = 1, py::arg("threads") = 0,
        py::arg("progress") = py::none(),
        R"(fracture(mesh, pieces=20, *, pattern='even', at=None, grain=None, stretch=6.0, clump=1, roughness=0.5, edge=None, smallest=0.01, seed=1, threads=0, progress=None)
--

Break a mesh into pieces.

Parameters
----------
mesh : Mesh, or an object with vertices and faces or triangles
pieces : int
    How many, 1 to 100,000.
pattern : str
    'even', pieces of about one size; 'impact', small ones around `at`; 'slabs', long ones, as of wood; 'radial', rays and
    rings around `at`, as of glass; 'grains', small here and large there, as of stone.
at : array_like, (k, 3), optional
    Points that were hit, world coordinates.
grain : array_like, (3,), optional
    Slabs: along which pieces are longer; None: the longest axis.
stretch : float
    Slabs: how many times longer, 1 to 100.
clump : int
    Cells that a piece is made of, 1 to 100; with more, pieces are knobbly and have hollows.
roughness : float
    Of cracks, 0 (planes) to 1.
edge : float, optional
    Longest edges wanted on cracks, model units; 0: none but the outlines'.
smallest : float
    Parts below this share of the mean volume join a neighbour.
seed : int
    Another number, other pieces.

Returns
-------
FracturedMesh

Raises
------
UsageError
    Options out of range.
UnsuitableError
    No faces.
Cancelled

Examples
--------
>>> broken = filigree.fracture(filigree.make("bar", resolution=8), 6, roughness=0)
>>> broken.report["open_edges"]
0
)");
}

} // namespace filigree::python
