#include "models.h"

#include <filigree/core/parallel_for.h>
#include <filigree/deform/unwarp.h>
#include <filigree/pose.h>

namespace filigree::python {

namespace {

constexpr std::size_t kWarpGrain = 1024;

/// A deformation of space; never changes.
struct Warp {
    std::shared_ptr<const SpaceWarp> warp;
};

/// Warps one after the other, that others hold too.
class SharedChain : public SpaceWarp {
public:
    explicit SharedChain(std::vector<Warp> warps) : warps_(std::move(warps)) {}
    Vec3d position(const Vec3d& point) const override {
        Vec3d place = point;
        for (const Warp& step : warps_) place = step.warp->position(place);
        return place;
    }
    Warped warp(const Vec3d& point) const override {
        Warped all{point, Mat3d::Identity()};
        for (const Warp& step : warps_) {
            const Warped next = step.warp->warp(all.position);
            all = {next.position, Mat3d(next.gradient * all.gradient)};
        }
        return all;
    }

private:
    std::vector<Warp> warps_;
};

Warp warp_of(std::unique_ptr<SpaceWarp> warp) { return {std::move(warp)}; }
Warp warp_of(Result<std::unique_ptr<SpaceWarp>> made) { return {std::move(made).value()}; }

Axis axis_of(const std::optional<std::string>& axis, const Box& box) {
    if (!axis) return longest_axis(box);
    return value_of<Axis>(*axis, "axis", {{"x", Axis::x}, {"y", Axis::y}, {"z", Axis::z}});
}

void check_number(double value, bool is_allowed, const char* wanted) {
    if (!std::isfinite(value) || !is_allowed) refuse(wanted);
}

Warp chain(const py::args& warps) {
    std::vector<Warp> steps;
    for (const py::handle warp : warps) {
        if (!py::isinstance<Warp>(warp)) throw py::type_error("chain takes filigree.Warp alone.");
        steps.push_back(warp.cast<Warp>());
    }
    return {std::make_shared<SharedChain>(std::move(steps))};
}

py::tuple warp_points(const Warp& self, const py::object& given, unsigned threads) {
    const std::vector<Vec3d> points = double_points_of(given, "points");
    std::vector<Vec3d> positions(points.size());
    std::vector<double> gradients(9 * points.size()); // by rows
    const RunContext& context = short_context(threads);
    without_interpreter([&] {
        parallel_for(context, points.size(), kWarpGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const Warped warped = self.warp->warp(points[i]);
                positions[i] = warped.position;
                for (int row = 0; row < 3; ++row)
                    for (int column = 0; column < 3; ++column)
                        gradients[9 * i + 3 * row + column] = warped.gradient(row, column);
            }
        });
        return Success{};
    });
    const auto count = static_cast<py::ssize_t>(points.size());
    return py::make_tuple(take(std::move(positions)), take<double>(std::move(gradients), Shape{count, 3, 3}));
}

py::object deform(const Warp& self, const py::object& given, unsigned threads) {
    const RunContext& context = short_context(threads);
    if (py::isinstance<PyModel>(given)) {
        const auto model = model_of(given);
        return py::cast(without_interpreter([&] { return warp_pose(*self.warp, *model, context); }));
    }
    if (!py::hasattr(given, "vertices")) return warp_points(self, given, threads)[0];
    const MeshPtr mesh = mesh_of(given);
    return py::cast(without_interpreter([&] {
        auto moved = std::make_shared<Mesh>(*mesh);
        warp_mesh(*self.warp, *moved, context);
        return moved;
    }));
}

} // namespace

void add_warps(py::module_& m) {
    py::class_<Warp>(m, "Warp",
                     R"(A deformation of space with its exact gradients, of world points to world points.

Made by `stretch`, `squeeze`, `bend`, `twist`, `taper`, `smooth_random`, `rbf` and `chain`. Called with a model it gives the pose
of its driver, with a mesh the deformed mesh, with points the moved points.
)")
        .def("__call__", &deform, py::arg("what"), py::kw_only(), py::arg("threads") = 0,
             R"(__call__(self, what, *, threads=0)
--

Deform something.

Parameters
----------
what : Model, Mesh (or an object with vertices and faces), or array_like (n, 3)

Returns
-------
Pose, Mesh or ndarray
    Of a model the driver's pose with gradients; of a mesh the mesh with every vertex moved and normals turned; of
    points float64 (n, 3).
)")
        .def("warp", &warp_points, py::arg("points"), py::kw_only(), py::arg("threads") = 0,
             R"(warp(self, points, *, threads=0)
--

Where points of the world go, and how space is deformed there.

Returns
-------
positions : ndarray, float64 (n, 3)
gradients : ndarray, float64 (n, 3, 3)
    [point, row, column]: d position_row / d point_column.
)")
        .def(
            "unwarp",
            [](const Warp& self, const py::object& places, const py::object& guesses) {
                std::vector<Vec3d> found = double_points_of(places, "places");
                const std::vector<Vec3d> from = guesses.is_none() ? found : double_points_of(guesses, "guesses");
                if (from.size() != found.size()) refuse("guesses has to be as many as places.");
                without_interpreter([&] {
                    for (std::size_t i = 0; i < found.size(); ++i) found[i] = unwarped(*self.warp, found[i], from[i]);
                    return Success{};
                });
                return take(std::move(found));
            },
            py::arg("places"), py::arg("guesses") = py::none(), R"(unwarp(self, places, guesses=None)
--

The points that go to `places`, float64 (n, 3), by Newton's method from `guesses` (None: from the places themselves).
Where it does not arrive: the best points found.
)")
        .def("__repr__", [](const Warp&) { return "<filigree.Warp>"; });

    const auto add = [&](const char* name, auto make, const char* amount, const char* wanted, bool only_positive,
                         const char* text) {
        m.def(
            name,
            [=](const py::object& box, const std::optional<std::string>& axis, double value) {
                check_number(value, only_positive ? value > 0 : true, wanted);
                const Box all = box_of(box);
                return warp_of(make(all, axis_of(axis, all), value));
            },
            py::arg("box"), py::arg("axis"), py::arg(amount), text);
    };
    add("stretch", &make_stretch, "factor", "factor has to be a number above 0.", true, R"(stretch(box, axis, factor)
--

Scale by `factor`, above 0, along the axis about the box's middle.

Parameters
----------
box : Mesh, Model, or array_like (n, 3)
    What the box is of, in the world.
axis : str or None
    'x', 'y' or 'z'; None: the box's longest.

Returns
-------
Warp
)");
    add("squeeze", &make_squeeze, "factor", "factor has to be a number above 0.", true, R"(squeeze(box, axis, factor)
--

Scale by `factor`, above 0, along the axis and across it so that the volume stays. `box` and `axis` as of `stretch`.
)");
    add("bend", &make_bend, "degrees", "degrees has to be a number.", false, R"(bend(box, axis, degrees)
--

Bend the axis into an arc of `degrees` over the box's length. `box` and `axis` as of `stretch`.

Examples
--------
>>> model = filigree.strip(filigree.make("bar", resolution=8))
>>> filigree.bend(model, "x", 90)(model)
<filigree.Pose: 57 vertices with gradients>
)");
    add("twist", &make_twist, "degrees", "degrees has to be a number.", false, R"(twist(box, axis, degrees)
--

Turn cross-sections about the axis, the far end by `degrees` against the near end. `box` and `axis` as of `stretch`.
)");
    add("taper", &make_taper, "factor", "factor has to be a number above 0.", true, R"(taper(box, axis, factor)
--

Scale cross-sections, from 1 at the near end to `factor`, above 0, at the far end. `box` and `axis` as of `stretch`.
)");
    m.def(
        "smooth_random",
        [](const py::object& box, double amplitude, std::uint64_t seed) {
            check_number(amplitude, true, "amplitude has to be a number.");
            return Warp{make_smooth_random(box_of(box), amplitude, seed)};
        },
        py::arg("box"), py::arg("amplitude"), py::arg("seed") = 1, R"(smooth_random(box, amplitude, seed=1)
--

Smooth random displacement of up to `amplitude` times the box's diagonal. `box` as of `stretch`.
)");
    m.def(
        "rbf",
        [](const py::object& centres, const py::object& displacements) {
            const std::vector<Vec3d> from = double_points_of(centres, "centres"),
                                     by = double_points_of(displacements, "displacements");
            if (from.size() != by.size()) refuse("displacements has to be as many as centres.");
            return Warp{without_interpreter([&] { return make_rbf(from, by); })};
        },
        py::arg("centres"), py::arg("displacements"), R"(rbf(centres, displacements)
--

Move each centre by its displacement and everything else smoothly along: cubic radial basis functions.

Parameters
----------
centres, displacements : array_like, (n, 3)
    World coordinates, model units. Cost O(n^3) once.
)");
    m.def("chain", &chain, R"(chain(*warps)
--

The warps one after the other; none at all: nothing moves.
)");
}

} // namespace filigree::python
