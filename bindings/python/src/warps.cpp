#include "models.h"

#include <filigree/core/parallel_for.h>
#include <filigree/deform/unwarp.h>
#include <filigree/pose.h>

#include <cstring>
#include <sstream>
#include <unordered_map>

namespace filigree::python {

namespace {

constexpr std::size_t kWarpGrain = 1024;

struct Warp;
std::vector<Warped> warped_points(const Warp& warp, const std::vector<Vec3d>& points, bool with_gradients,
                                  const RunContext& context);

/// A deformation of space; never changes.
struct Warp {
    std::shared_ptr<const SpaceWarp> warp = {}; ///< null: `function`, or `steps`
    py::object function = {}, gradient = {};    ///< of Python: points (n, 3) to (n, 3) and (n, 3, 3); no gradient: None
    std::vector<Warp> steps = {};               ///< one after the other, some of them of Python
    std::string text = {};                      ///< what it does
};

/// Warps one after the other, that others hold too.
class SharedChain : public SpaceWarp {
public:
    explicit SharedChain(std::vector<std::shared_ptr<const SpaceWarp>> warps) : warps_(std::move(warps)) {}
    Vec3d position(const Vec3d& point) const override {
        Vec3d place = point;
        for (const auto& step : warps_) place = step->position(place);
        return place;
    }
    Warped warp(const Vec3d& point) const override {
        Warped all{point, Mat3d::Identity()};
        for (const auto& step : warps_) {
            const Warped next = step->warp(all.position);
            all = {next.position, Mat3d(next.gradient * all.gradient)};
        }
        return all;
    }

private:
    std::vector<std::shared_ptr<const SpaceWarp>> warps_;
};

/// A warp in which axes are turned: of points turned there, and back.
class TurnedWarp : public SpaceWarp {
public:
    TurnedWarp(std::unique_ptr<SpaceWarp> warp, const Mat3d& turn) : warp_(std::move(warp)), turn_(turn) {}
    Vec3d position(const Vec3d& point) const override { return turn_.transpose() * warp_->position(turn_ * point); }
    Warped warp(const Vec3d& point) const override {
        const Warped there = warp_->warp(turn_ * point);
        return {turn_.transpose() * there.position, turn_.transpose() * there.gradient * turn_};
    }

private:
    std::unique_ptr<SpaceWarp> warp_;
    Mat3d turn_;
};

/// A warp with functions of Python's in it. What it does to points that were asked for together is looked up; Python is
/// asked for others one by one.
class PythonWarp : public SpaceWarp {
public:
    PythonWarp(const Warp& warp, const std::vector<Vec3d>& points, bool with_gradients, const RunContext& context)
        : warp_(warp) {
        const std::vector<Warped> found = warped_points(warp, points, with_gradients, context);
        for (std::size_t i = 0; i < points.size(); ++i) known_.try_emplace(key_of(points[i]), found[i]);
    }
    Vec3d position(const Vec3d& point) const override { return warp(point).position; }
    Warped warp(const Vec3d& point) const override {
        if (const auto found = known_.find(key_of(point)); found != known_.end()) return found->second;
        const py::gil_scoped_acquire interpreter;
        return warped_points(warp_, {point}, true, short_context(1)).front();
    }

private:
    using Key = std::array<double, 3>;
    static Key key_of(const Vec3d& point) { return {point.x() + 0.0, point.y() + 0.0, point.z() + 0.0}; } // 0 is -0
    struct Hash {
        std::size_t operator()(const Key& key) const {
            std::size_t sum = 0;
            for (const double number : key) sum = 31 * sum + std::hash<double>()(number);
            return sum;
        }
    };
    const Warp& warp_;
    std::unordered_map<Key, Warped, Hash> known_;
};

/// What a function of Python's made of points, checked.
py::array_t<double> returned_by(const py::object& function, const py::object& points, const Shape& wanted,
                                const char* name) {
    const py::object given = function(points);
    const Numbers<double> numbers = doubles_of(given, name);
    const bool fits = numbers.ndim() == static_cast<py::ssize_t>(wanted.size()) &&
                      std::equal(wanted.begin(), wanted.end(), numbers.shape());
    if (!fits) {
        std::string shape;
        for (const py::ssize_t side : wanted) shape += (shape.empty() ? "(" : ", ") + std::to_string(side);
        refuse(std::string(name) + " has to return an array of shape " + shape + ").");
    }
    for (py::ssize_t i = 0; i < numbers.size(); ++i)
        if (!std::isfinite(numbers.data()[i])) refuse(std::string(name) + " returned a number that is not finite.");
    return numbers;
}

std::vector<Vec3d> positions_by(const py::object& function, const std::vector<Vec3d>& points) {
    const Shape shape = {static_cast<py::ssize_t>(points.size()), 3};
    const py::array_t<double> moved = returned_by(function, take(std::vector(points)), shape, "function");
    std::vector<Vec3d> positions(points.size());
    if (!points.empty()) std::memcpy(static_cast<void*>(positions.data()), moved.data(), points.size() * sizeof(Vec3d));
    return positions;
}

/// Central differences over a hundred-thousandth of the points' box: of a smooth function right to about nine digits.
std::vector<Mat3d> gradients_by_differences(const py::object& function, const std::vector<Vec3d>& points) {
    Box box;
    for (const Vec3d& point : points) box.extend(point);
    const double size = std::max(box.diagonal(), box.empty() ? 0.0 : 1e-3 * box.max.cwiseAbs().maxCoeff());
    const double step = size > 0 ? 1e-5 * size : 1e-5;
    std::vector<Mat3d> gradients(points.size());
    for (int k = 0; k < 3; ++k) {
        std::vector<Vec3d> ahead = points, behind = points;
        for (std::size_t i = 0; i < points.size(); ++i) {
            ahead[i][k] += step;
            behind[i][k] -= step;
        }
        const std::vector<Vec3d> to = positions_by(function, ahead), from = positions_by(function, behind);
        for (std::size_t i = 0; i < points.size(); ++i)
            gradients[i].col(k) = (to[i] - from[i]) / (ahead[i][k] - behind[i][k]);
    }
    return gradients;
}

std::vector<Mat3d> gradients_by(const Warp& warp, const std::vector<Vec3d>& points) {
    if (warp.gradient.is_none()) return gradients_by_differences(warp.function, points);
    const Shape shape = {static_cast<py::ssize_t>(points.size()), 3, 3};
    const py::array_t<double> given = returned_by(warp.gradient, take(std::vector(points)), shape, "gradient");
    std::vector<Mat3d> gradients(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column)
                gradients[i](row, column) = given.data()[9 * i + static_cast<std::size_t>(3 * row + column)];
    return gradients;
}

/// Needs the interpreter.
std::vector<Warped> warped_points(const Warp& warp, const std::vector<Vec3d>& points, bool with_gradients,
                                  const RunContext& context) {
    std::vector<Warped> all(points.size());
    if (warp.warp) {
        without_interpreter([&] {
            parallel_for(context, points.size(), kWarpGrain, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) all[i] = warp.warp->warp(points[i]);
            });
            return Success{};
        });
    } else if (warp.function) {
        const std::vector<Vec3d> positions = positions_by(warp.function, points);
        std::vector<Mat3d> gradients;
        if (with_gradients) gradients = gradients_by(warp, points);
        for (std::size_t i = 0; i < points.size(); ++i)
            all[i] = {positions[i], with_gradients ? gradients[i] : Mat3d::Identity()};
    } else {
        for (std::size_t i = 0; i < points.size(); ++i) all[i] = {points[i], Mat3d::Identity()};
        for (const Warp& step : warp.steps) {
            std::vector<Vec3d> from(points.size());
            for (std::size_t i = 0; i < points.size(); ++i) from[i] = all[i].position;
            const std::vector<Warped> next = warped_points(step, from, with_gradients, context);
            for (std::size_t i = 0; i < points.size(); ++i)
                all[i] = {next[i].position, Mat3d(next[i].gradient * all[i].gradient)};
        }
    }
    return all;
}

Warp warp_of(std::unique_ptr<SpaceWarp> warp) {
    Warp made;
    made.warp = std::move(warp);
    return made;
}
Warp warp_of(Result<std::unique_ptr<SpaceWarp>> made) { return warp_of(std::move(made).value()); }

Axis axis_of(const std::optional<std::string>& axis, const Box& box) {
    if (!axis) return longest_axis(box);
    return value_of<Axis>(*axis, "axis", {{"x", Axis::x}, {"y", Axis::y}, {"z", Axis::z}});
}

void check_number(double value, bool is_allowed, const char* wanted) {
    if (!std::isfinite(value) || !is_allowed) refuse(wanted);
}

Warp chain_of(std::vector<Warp> steps) {
    Warp all;
    std::vector<std::shared_ptr<const SpaceWarp>> ours;
    for (const Warp& step : steps) {
        all.text += (all.text.empty() ? "" : ", then ") + step.text;
        if (step.warp) ours.push_back(step.warp);
    }
    if (ours.size() == steps.size())
        all.warp = std::make_shared<SharedChain>(std::move(ours));
    else
        all.steps = std::move(steps);
    return all;
}

Warp chain(const py::args& given) {
    const bool is_list =
        given.size() == 1 && (py::isinstance<py::list>(given[0]) || py::isinstance<py::tuple>(given[0]));
    std::vector<Warp> steps;
    for (const py::handle warp : is_list ? py::sequence(given[0]) : py::sequence(given)) {
        if (!py::isinstance<Warp>(warp))
            throw py::type_error(
                "chain takes filigree.Warp alone; make one of your function by filigree.Warp(function).");
        steps.push_back(warp.cast<Warp>());
    }
    return chain_of(std::move(steps));
}

Warp make_python_warp(const py::object& function, const py::object& gradient) {
    if (!PyCallable_Check(function.ptr())) throw py::type_error("function has to be callable: of points (n, 3).");
    if (!gradient.is_none() && !PyCallable_Check(gradient.ptr()))
        throw py::type_error("gradient has to be callable, of points (n, 3), or None.");
    Warp warp;
    warp.function = function;
    warp.gradient = gradient;
    warp.text = py::hasattr(function, "__name__") ? py::str(function.attr("__name__")).cast<std::string>() : "function";
    return warp;
}

py::object warp_points(const Warp& self, const py::object& given, unsigned threads) {
    const std::vector<Vec3d> points = double_points_of(given, "points");
    const std::vector<Warped> all = warped_points(self, points, true, short_context(threads));
    std::vector<Vec3d> positions(points.size());
    std::vector<double> gradients(9 * points.size()); // by rows
    for (std::size_t i = 0; i < points.size(); ++i) {
        positions[i] = all[i].position;
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column)
                gradients[9 * i + static_cast<std::size_t>(3 * row + column)] = all[i].gradient(row, column);
    }
    const auto count = static_cast<py::ssize_t>(points.size());
    return named_result("Warped", take(std::move(positions)), take<double>(std::move(gradients), Shape{count, 3, 3}));
}

/// The warp for points that are known beforehand.
std::shared_ptr<const SpaceWarp> warp_for(const Warp& self, const std::function<std::vector<Vec3d>()>& points,
                                          bool with_gradients, const RunContext& context) {
    if (self.warp) return self.warp;
    return std::make_shared<PythonWarp>(self, points(), with_gradients, context);
}

py::object deform(const Warp& self, const py::object& given, unsigned threads) {
    const RunContext& context = short_context(threads);
    if (py::isinstance<PyModel>(given)) {
        const auto model = model_of(given);
        const auto of_driver = [&] {
            std::vector<Vec3d> points;
            for (const Vec3f& p : driver_positions(*model)) points.push_back(model->mesh.origin + p.cast<double>());
            return points;
        };
        const auto warp = warp_for(self, of_driver, true, context);
        return py::cast(without_interpreter([&] { return warp_pose(*warp, *model, context); }));
    }
    if (!is_mesh_like(given)) {
        std::vector<Vec3d> points = double_points_of(given, "points");
        const std::vector<Warped> all = warped_points(self, points, false, context);
        for (std::size_t i = 0; i < points.size(); ++i) points[i] = all[i].position;
        return take(std::move(points));
    }
    const MeshPtr mesh = mesh_of(given);
    const auto of_mesh = [&] {
        std::vector<Vec3d> points;
        for (std::size_t i = 0; i < mesh->vertex_count(); ++i) points.push_back(mesh->world_position(i));
        return points;
    };
    const auto warp = warp_for(self, of_mesh, !mesh->normals.empty(), context);
    return py::cast(without_interpreter([&] {
        auto moved = std::make_shared<Mesh>(*mesh);
        warp_mesh(*warp, *moved, context);
        return moved;
    }));
}

/// Turns `axis` to z.
Mat3d turn_to_z(const Vec3d& axis) {
    return Eigen::Quaterniond::FromTwoVectors(axis.normalized(), Vec3d::UnitZ()).toRotationMatrix();
}

/// Makes a warp along an axis of a box: 'x', 'y', 'z', None or a vector.
template <class Make>
Warp along_axis(const Make& make, const py::object& given, const py::object& axis, double value,
                const std::string& text) {
    const auto named = [&](const std::string& name) { return "<" + text + " along " + name + ">"; };
    Warp made;
    if (axis.is_none() || py::isinstance<py::str>(axis)) {
        const Box box = box_of(given);
        const Axis along = axis_of(axis.is_none() ? std::nullopt : std::optional(axis.cast<std::string>()), box);
        made = warp_of(make(box, along, value));
        made.text = named(std::string(1, "xyz"[static_cast<int>(along)]));
        return made;
    }
    const Vec3d direction = vector_of(axis, "axis");
    if (!(direction.norm() > 0)) refuse("axis has to be 'x', 'y', 'z', None or a vector that is not zero.");
    const Mat3d turn = turn_to_z(direction);
    Box box;
    for (const Vec3d& point : world_points_of(given)) box.extend(turn * point);
    if (box.empty()) refuse("box has to hold a point.");
    std::unique_ptr<SpaceWarp> straight;
    if constexpr (std::is_same_v<decltype(make(box, Axis::z, value)), std::unique_ptr<SpaceWarp>>)
        straight = make(box, Axis::z, value);
    else
        straight = make(box, Axis::z, value).value();
    made.warp = std::make_shared<TurnedWarp>(std::move(straight), turn);
    std::ostringstream name;
    name << "(" << direction.x() << ", " << direction.y() << ", " << direction.z() << ")";
    made.text = named(name.str());
    return made;
}

/// One of the two, in degrees.
double angle_of(const std::optional<double>& degrees, const std::optional<double>& radians) {
    if (degrees.has_value() == radians.has_value()) refuse("Give degrees or radians, one of them.");
    const double angle = degrees ? *degrees : *radians * 180 / std::numbers::pi;
    check_number(angle, true, degrees ? "degrees has to be a number." : "radians has to be a number.");
    return angle;
}

std::string number_text(double number) {
    std::ostringstream text;
    text << number;
    return text.str();
}

} // namespace

void add_warps(py::module_& m) {
    py::class_<Warp>(m, "Warp",
                     R"(A deformation of space with its gradients, of world points to world points.

Made by `stretch`, `squeeze`, `bend`, `twist`, `taper`, `smooth_random`, `rbf` and `chain`, or of a function of yours. Called
with a model it gives the pose of its driver, with a mesh the deformed mesh, with points the moved points. `a @ b` does b
first: `(a @ b)(x)` is `a(b(x))`.

Parameters
----------
function : callable
    From points, float64 (n, 3), to where they go, (n, 3). Called with all points at once.
gradient : callable, optional
    From points to the derivatives there, (n, 3, 3): [point, row, column] is d position_row / d point_column. None: by
    central differences, with six calls of `function`, right to about nine digits where the function is smooth.

Raises
------
UsageError
    In a call: a function that returns another shape, or numbers that are not finite.

Examples
--------
>>> wave = filigree.Warp(lambda p: p + [0, 0, 0.1] * numpy.sin(p[:, :1]))
>>> model = filigree.strip(filigree.make("bar", resolution=8))
>>> wave(model)
<filigree.Pose: 57 vertices with gradients>
>>> filigree.bend(model, "x", 30) @ wave
<filigree.Warp: <lambda>, then <bend by 30 degrees along x>>
)")
        .def(py::init(&make_python_warp), py::arg("function"), py::arg("gradient") = py::none(),
             R"(__init__(self, function, gradient=None)
--

)")
        .def(
            "__matmul__",
            [](const Warp& self, const Warp& other) {
                return chain_of({other, self});
            },
            py::is_operator(), py::arg("other"))
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
                const auto warp = warp_for(
                    self, [] { return std::vector<Vec3d>(); }, true, short_context(1));
                without_interpreter([&] {
                    for (std::size_t i = 0; i < found.size(); ++i) found[i] = unwarped(*warp, found[i], from[i]);
                    return Success{};
                });
                return take(std::move(found));
            },
            py::arg("places"), py::arg("guesses") = py::none(), R"(unwarp(self, places, guesses=None)
--

The points that go to `places`, float64 (n, 3), by Newton's method from `guesses` (None: from the places themselves).
Where it does not arrive: the best points found.
)")
        .def("__repr__", [](const Warp& self) {
            return "<filigree.Warp: " + (self.text.empty() ? "nothing moves" : self.text) + ">";
        });

    const auto add = [&](const char* name, auto make, const char* text) {
        m.def(
            name,
            [=, word = std::string(name)](const py::object& box, const py::object& axis, double factor) {
                check_number(factor, factor > 0, "factor has to be a number above 0.");
                return along_axis(make, box, axis, factor, word + " by " + number_text(factor));
            },
            py::arg("box"), py::arg("axis"), py::arg("factor"), text);
    };
    const auto add_turning = [&](const char* name, auto make, const char* text) {
        m.def(
            name,
            [=, word = std::string(name)](const py::object& box, const py::object& axis, std::optional<double> degrees,
                                          std::optional<double> radians) {
                const double angle = angle_of(degrees, radians);
                return along_axis(make, box, axis, angle, word + " by " + number_text(angle) + " degrees");
            },
            py::arg("box"), py::arg("axis"), py::arg("degrees") = py::none(), py::kw_only(),
            py::arg("radians") = py::none(), text);
    };
    add("stretch", &make_stretch, R"(stretch(box, axis, factor)
--

Scale by `factor`, above 0, along the axis about the box's middle.

Parameters
----------
box : Mesh, Model, or array_like (n, 3)
    What the box is of, in the world.
axis : str, array_like (3,) or None
    'x', 'y' or 'z', or a direction, along which a box is then put around; None: the box's longest.

Returns
-------
Warp
)");
    add("squeeze", &make_squeeze, R"(squeeze(box, axis, factor)
--

Scale by `factor`, above 0, along the axis and across it so that the volume stays. `box` and `axis`: see `stretch`.
)");
    add_turning("bend", &make_bend, R"(bend(box, axis, degrees=None, *, radians=None)
--

Bend the axis into an arc of `degrees` (or `radians`) over the box's length. `box` and `axis`: see `stretch`.

Examples
--------
>>> model = filigree.strip(filigree.make("bar", resolution=8))
>>> filigree.bend(model, "x", 90)(model)
<filigree.Pose: 57 vertices with gradients>
)");
    add_turning("twist", &make_twist, R"(twist(box, axis, degrees=None, *, radians=None)
--

Turn cross-sections about the axis, the far end by `degrees` (or `radians`) against the near end. `box` and `axis`: see
`stretch`.
)");
    add("taper", &make_taper, R"(taper(box, axis, factor)
--

Scale cross-sections, from 1 at the near end to `factor`, above 0, at the far end. `box` and `axis`: see `stretch`.
)");
    m.def(
        "smooth_random",
        [](const py::object& box, double amplitude, std::uint64_t seed) {
            check_number(amplitude, true, "amplitude has to be a number.");
            Warp warp;
            warp.warp = make_smooth_random(box_of(box), amplitude, seed);
            warp.text = "<smooth_random of " + number_text(amplitude) + ">";
            return warp;
        },
        py::arg("box"), py::arg("amplitude"), py::arg("seed") = 1, R"(smooth_random(box, amplitude, seed=1)
--

Smooth random displacement of up to `amplitude` times the box's diagonal. Equal seeds give equal displacements: `seed`
is a whole number, 0 or more. `box`: see `stretch`.
)");
    m.def(
        "rbf",
        [](const py::object& centres, const py::object& displacements) {
            const std::vector<Vec3d> from = double_points_of(centres, "centres"),
                                     by = double_points_of(displacements, "displacements");
            if (from.size() != by.size()) refuse("displacements has to be as many as centres.");
            Warp warp;
            warp.warp = without_interpreter([&] { return make_rbf(from, by); });
            warp.text = "<rbf of " + std::to_string(from.size()) + " centres>";
            return warp;
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

The warps one after the other, given one by one or as a list; none at all: nothing moves. `b @ a` is `chain(a, b)`.
)");
}

} // namespace filigree::python
