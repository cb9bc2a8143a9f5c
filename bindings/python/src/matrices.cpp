// What filigree/_matrices.py makes matrices of: how vertices hang on the driver, how its gradients are estimated, how
// the energy of bodies depends on their particles.
#include "bodies.h"
#include "calls.h"
#include "models.h"

#include <filigree/blend/gradient_fit.h>
#include <filigree/blend/restore_adjoint.h>
#include <filigree/physics/body/embedding.h>
#include <filigree/physics/fem/cell_derivatives.h>

#include <numeric>

namespace filigree::python {

namespace {

py::ssize_t signed_size(std::size_t size) { return static_cast<py::ssize_t>(size); }

py::tuple bonds_of(const PyModel& self) {
    VertexBonds bonds = without_interpreter([&] { return vertex_bonds(*self.model); });
    const py::ssize_t count = signed_size(bonds.cells.size());
    return py::make_tuple(take<Index>(std::move(bonds.cells), Shape{count, 3}),
                          take<double>(std::move(bonds.weights), Shape{count, 3}),
                          take<double>(std::move(bonds.offsets), Shape{count, 3, 3}));
}

/// Row starts, neighbours, weights, constants, and what is completed.
py::tuple gradient_terms(const PyModel& self) {
    const RunContext& context = short_context(0);
    std::vector<std::uint64_t> starts = {0};
    std::vector<Index> neighbours;
    std::vector<Vec3d> weights, lines, normals;
    std::vector<Mat3f> constants;
    std::vector<double> shares;
    without_interpreter([&] {
        const Mesh driver = level_mesh(*self.model, 0);
        const GradientFit fit(driver, context);
        for (Index v = 0; v < driver.vertex_count(); ++v) {
            const GradientFit::Terms terms = fit.terms(v);
            neighbours.insert(neighbours.end(), terms.vertices.begin(), terms.vertices.end());
            weights.insert(weights.end(), terms.weights.begin(), terms.weights.end());
            starts.push_back(neighbours.size());
            constants.push_back(terms.constant);
            lines.push_back(terms.line.cast<double>());
            normals.push_back(terms.normal.cast<double>());
            shares.push_back(double(terms.beside_line));
            shares.push_back(double(terms.off_plane));
        }
        return Success{};
    });
    const py::ssize_t count = signed_size(lines.size());
    return py::make_tuple(take(std::move(starts)), take(std::move(neighbours)), take(std::move(weights)),
                          take(std::move(constants)), take(std::move(lines)), take(std::move(normals)),
                          take<double>(std::move(shares), Shape{count, 2}));
}

std::vector<Vec3d> particles_of(const PyBody& self, const py::object& given, const char* name) {
    std::vector<Vec3d> points = double_points_of(given, name);
    if (points.size() != self.body->particle_count())
        refuse(ErrorCode::mismatch, std::string(name) + " are " + std::to_string(points.size()) +
                                        ", and the body has " + std::to_string(self.body->particle_count()) +
                                        " particles.");
    return points;
}

py::array_t<double> energies(const PyBody& self, const py::object& given, unsigned threads) {
    const CellDerivatives of = CellDerivatives::create(*self.body).value();
    const std::vector<Vec3d> positions = particles_of(self, given, "positions");
    const RunContext& context = short_context(threads);
    return take(without_interpreter([&] { return of.energies(positions, context); }));
}

py::array_t<double> forces(const PyBody& self, const py::object& given, unsigned threads) {
    const CellDerivatives of = CellDerivatives::create(*self.body).value();
    const std::vector<Vec3d> positions = particles_of(self, given, "positions");
    const RunContext& context = short_context(threads);
    return take(without_interpreter([&] {
        std::vector<Vec3d> found = of.gradient(positions, context);
        for (Vec3d& force : found) force = -force;
        return found;
    }));
}

py::array_t<double> hessian_product(const PyBody& self, const py::object& given, const py::object& along,
                                    unsigned threads) {
    const CellDerivatives of = CellDerivatives::create(*self.body).value();
    const std::vector<Vec3d> positions = particles_of(self, given, "positions"),
                             directions = particles_of(self, along, "directions");
    const RunContext& context = short_context(threads);
    return take(without_interpreter([&] { return of.hessian_product(positions, directions, context); }));
}

py::array_t<double> hessian_blocks(const PyBody& self, const py::object& given) {
    const CellDerivatives of = CellDerivatives::create(*self.body).value();
    const std::vector<Vec3d> positions = particles_of(self, given, "positions");
    const RunContext& context = short_context(0);
    auto blocks = without_interpreter([&] { return of.hessian_blocks(positions, context); });
    const py::ssize_t count = signed_size(blocks.size());
    return take<double>(std::move(blocks), Shape{count, 24, 24});
}

py::tuple interpolation(const PyBody& self, const py::object& given) {
    const std::vector<Vec3f> points = points_of(given, "points");
    const MaterialModel model = self.body->material.model;
    if (model != MaterialModel::fem && model != MaterialModel::springs)
        refuse(ErrorCode::unsuitable,
               "Points are interpolated in bodies of 'fem' and 'springs', whose particles are the "
               "corners of cells; attach a model to a simulation of this one.");
    const RunContext& context = short_context(0);
    Embedding found = without_interpreter([&] { return embed_in_cells(points, self.body->cells, context); });
    return py::make_tuple(take(std::move(found.offsets)), take(std::move(found.particles)),
                          take(std::move(found.weights)));
}

} // namespace

void add_matrices(py::module_& m) {
    m.def("_vertex_bonds", &bonds_of, py::arg("model"));
    m.def("_gradient_terms", &gradient_terms, py::arg("model"));
    m.def("_hessian_blocks", &hessian_blocks, py::arg("body"), py::arg("positions"));
    m.def("_interpolation", &interpolation, py::arg("body"), py::arg("points"));

    auto model = py::class_<PyModel>(m.attr("Model"));
    model.def(
        "level_vertices",
        [](const PyModel& self, unsigned level) {
            const Model& of = *self.model;
            if (level > of.finest_level())
                refuse("There is no level " + std::to_string(level) + "; there are 0 to " +
                       std::to_string(of.finest_level()) + ".");
            if (level < of.finest_level()) return take(std::vector(of.levels[level].vertices));
            std::vector<Index> all(of.vertex_count());
            std::iota(all.begin(), all.end(), Index{0});
            return take(std::move(all));
        },
        py::arg("level"), R"(level_vertices(self, level)
--

The vertices of a level as ids in `mesh`, ascending, a copy, uint32 (n,): which rows of the finest level a level has.

Raises
------
UsageError
    No such level.
)");

    auto body = py::class_<PyBody>(m.attr("Body"));
    body.def_property_readonly(
            "cells",
            [](const py::object& self) {
                const auto& cells = self.cast<const PyBody&>().body->cells.cell_corners;
                const Index* const first = cells.empty() ? nullptr : cells.front().data();
                return view(first, Shape{signed_size(cells.size()), 8}, self);
            },
            "Corners of each cell, a cube at rest: uint32 (c, 8), read-only. Corner k lies at the far side along x, y "
            "and z where bit 0, 1 and 2 of k is set. Of 'fem' and 'springs' these are the particles.")
        .def_property_readonly(
            "corners",
            [](const PyBody& self) {
                const Cells& cells = self.body->cells;
                std::vector<Vec3d> corners;
                for (const Cells::LatticeIndex& at : cells.corners)
                    corners.push_back(cells.origin + cells.spacing * Vec3d(at[0], at[1], at[2]));
                return take(std::move(corners));
            },
            "Corners of the cells at rest, m, relative to the mesh's origin, a copy, float64 (k, 3).")
        .def_property_readonly(
            "cell_volumes",
            [](const PyBody& self) {
                const Cells& cells = self.body->cells;
                std::vector<double> volumes;
                for (const float part : cells.fraction)
                    volumes.push_back(double(part) * cells.spacing * cells.spacing * cells.spacing);
                return take(std::move(volumes));
            },
            "Of the occupied part of each cell, m^3, a copy, float64 (c,).")
        .def("energies", &energies, py::arg("positions"), py::kw_only(), py::arg("threads") = 0,
             R"(energies(self, positions, *, threads=0)
--

Elastic energy of each cell of a body of 'fem', J; 0 at rest.

Proportional to the material's young_modulus. Without plastic flow and damping.

Parameters
----------
positions : array_like, (p, 3)
    Of the particles, m.

Returns
-------
ndarray
    float64 (c,)

Raises
------
MismatchError
    Another number of particles.
UnsuitableError
    A body of another model.

Examples
--------
>>> body = filigree.Body(filigree.make("bar", resolution=4), "jelly", spacing=0.25)
>>> float(body.energies(body.rest).sum())
0.0
)")
        .def("forces", &forces, py::arg("positions"), py::kw_only(), py::arg("threads") = 0,
             R"(forces(self, positions, *, threads=0)
--

Elastic forces on the particles of a body of 'fem', N: minus the derivative of `energies(positions).sum()`, float64 (p, 3).
Parameters and errors: see `energies`.
)")
        .def("hessian_product", &hessian_product, py::arg("positions"), py::arg("directions"), py::kw_only(),
             py::arg("threads") = 0, R"(hessian_product(self, positions, directions, *, threads=0)
--

The second derivative of the elastic energy times directions, (p, 3): minus how `forces` change along them. float64 (p, 3).
Other parameters and errors: see `energies`. A solver wants it in place of the matrix, which is `stiffness_matrix`.
)");
}

} // namespace filigree::python
