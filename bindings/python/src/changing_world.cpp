// What changes a simulation between frames, and what may be asked of one.
#include "simulation.h"

#include "arrays.h"
#include "calls.h"

#include <filigree/physics/body/own_weight.h>
#include <filigree/physics/grid/grid_limits.h>

#include <numbers>

namespace filigree::python {

namespace {

/// What should be told of a body that comes, beside those that are there.
std::vector<std::string> doubts_of(const PySimulation& self, const Actor& actor, std::size_t number) {
    std::vector<std::string> sentences;
    const World& world = self.simulation.world();
    if (const std::string weight = weight_warning(world, actor, number); !weight.empty()) sentences.push_back(weight);
    std::vector<Actor> there;
    for (const std::optional<PyBody>& body : self.bodies)
        if (body) there.emplace_back().body = body->body;
    const std::string before = why_models_do_not_meet(there);
    there.push_back(actor);
    if (const std::string now = why_models_do_not_meet(there); before.empty() && !now.empty())
        sentences.push_back(now + ".");
    for (const SlenderObstacle& slender : find_slender_obstacles(world, std::span(&actor, 1)))
        sentences.push_back(slender.sentence("obstacle " + std::to_string(slender.obstacle)) + ".");
    return sentences;
}

std::size_t add_body(PySimulation& self, const py::object& given) {
    const PyActor actor = actor_of(given, "body has");
    std::vector<std::string> sentences;
    const std::size_t number = LongCall{self.threads}([&](const RunContext& context) {
        const std::lock_guard lock(self.mutex);
        sentences = doubts_of(self, actor.actor, self.bodies.size());
        self.bodies.reserve(self.bodies.size() + 1);
        const std::size_t added = self.simulation.add_body(actor.actor, context).value();
        self.bodies.emplace_back(actor.body);
        for (const StartOverlap& overlap : self.simulation.start_overlaps())
            if (overlap.body == added)
                sentences.push_back(
                    overlap.sentence("body " + std::to_string(added), "obstacle " + std::to_string(overlap.obstacle)) +
                    ".");
        return added;
    });
    warn(sentences);
    return number;
}

void remove_body(PySimulation& self, std::size_t body) {
    self.alone([&] {
        self.simulation.remove_body(body).value();
        self.bodies[body].reset();
    });
}

/// Of 4 x 4 numbers, or turned about the obstacle's middle and moved from where its shape was made.
Eigen::Isometry3d stance_of(PySimulation& self, std::size_t obstacle, const py::object& move, const py::object& axis,
                            double degrees, const py::object& matrix) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    if (!matrix.is_none()) {
        const Numbers<double> numbers = doubles_of(matrix, "matrix");
        if (numbers.ndim() != 2 || numbers.shape(0) != 4 || numbers.shape(1) != 4)
            refuse("matrix has to be of shape (4, 4).");
        for (int row = 0; row < 4; ++row)
            for (int column = 0; column < 4; ++column) pose.matrix()(row, column) = numbers.at(row, column);
        if (pose.matrix().row(3) != Eigen::RowVector4d(0, 0, 0, 1))
            refuse("matrix has to end with the row 0, 0, 0, 1.");
        return pose;
    }
    const Vec3d about = vector_of(axis, "axis"), by = vector_of(move, "move");
    if (!(about.norm() > 0)) refuse("axis has no length.");
    const Vec3d pivot = self.alone([&]() -> Vec3d {
        const std::vector<Obstacle>& all = self.simulation.world().obstacles;
        return obstacle < all.size() ? pivot_of(all[obstacle]) : Vec3d(Vec3d::Zero()); // refused with the rest
    });
    return Eigen::Translation3d(pivot + by) * Eigen::AngleAxisd(degrees * std::numbers::pi / 180, about.normalized()) *
           Eigen::Translation3d(-pivot);
}

void set_obstacle(PySimulation& self, std::size_t obstacle, const py::object& move, const py::object& axis,
                  double degrees, const py::object& matrix, const py::object& velocity, const py::object& spin,
                  const py::object& spin_degrees) {
    const Eigen::Isometry3d pose = stance_of(self, obstacle, move, axis, degrees, matrix);
    const Vec3d goes = vector_of(velocity, "velocity");
    if (!spin.is_none() && !spin_degrees.is_none()) refuse("Give one of spin (rad/s) and spin_degrees (degrees/s).");
    Vec3d turns = Vec3d::Zero();
    if (!spin.is_none()) turns = vector_of(spin, "spin");
    if (!spin_degrees.is_none()) turns = std::numbers::pi / 180 * vector_of(spin_degrees, "spin_degrees");
    self.alone([&] { return self.simulation.set_obstacle(obstacle, pose, goes, turns).value(); });
}

void move_obstacle(PySimulation& self, std::size_t obstacle, const py::object& move, const py::object& axis,
                   double degrees, const py::object& matrix) {
    const Eigen::Isometry3d pose = stance_of(self, obstacle, move, axis, degrees, matrix);
    self.alone([&] { return self.simulation.move_obstacle(obstacle, pose).value(); });
}

py::array_t<double> obstacle_pose(PySimulation& self, std::size_t obstacle) {
    const Eigen::Isometry3d pose = self.alone([&] {
        const std::size_t count = self.simulation.world().obstacles.size();
        if (obstacle >= count)
            refuse("There is no obstacle " + std::to_string(obstacle) + "; there are " + std::to_string(count) +
                   ", counted from 0.");
        return self.simulation.obstacle_pose(obstacle);
    });
    py::array_t<double> matrix({4, 4});
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column) matrix.mutable_at(row, column) = pose.matrix()(row, column);
    return matrix;
}

const char* name_of(ContactKind kind) {
    return kind == ContactKind::began ? "began" : kind == ContactKind::stays ? "stays" : "ended";
}

py::list contact_events(PySimulation& self) {
    const std::vector<ContactEvent> events = self.alone([&] { return self.simulation.contact_events(); });
    py::list said;
    for (const ContactEvent& event : events) {
        py::dict one;
        one["kind"] = name_of(event.kind);
        one["body"] = event.body;
        one["other"] = event.other;
        one["obstacle"] = event.obstacle;
        one["place"] = array_of(event.place);
        one["normal"] = array_of(event.normal);
        one["impulse"] = event.impulse;
        one["speed"] = event.speed;
        said.append(one);
    }
    return said;
}

py::object cast_ray(PySimulation& self, const py::object& origin, const py::object& direction,
                    std::optional<double> reach, std::optional<std::size_t> ignore) {
    const Vec3d from = vector_of(origin, "origin"), way = vector_of(direction, "direction");
    if (!(way.norm() > 0)) refuse("direction has no length.");
    RayOptions options;
    options.reach = reach.value_or(options.reach);
    if (!(options.reach > 0)) refuse("reach has to be above 0 m.");
    options.ignore = ignore;
    const std::optional<WorldHit> hit = self.alone([&] { return self.simulation.cast_ray(from, way, options); });
    if (!hit) return py::none();
    py::dict said;
    said["distance"] = hit->distance;
    said["place"] = array_of(hit->place);
    said["normal"] = array_of(hit->normal);
    said["body"] = hit->body;
    said["obstacle"] = hit->obstacle;
    said["rest"] = hit->body ? py::object(array_of(hit->rest.cast<double>())) : py::none();
    return said;
}

} // namespace

void add_changes(py::class_<PySimulation, SimulationPtr>& simulation) {
    simulation
        .def("add_body", &add_body, py::arg("body"), R"(add_body(self, body)
--

One more body from now on, between frames; also while others break.

Parameters
----------
body : Body or Actor
    It touches others with the simulation's `friction` and `restitution`.

Returns
-------
int
    Its number, the next; a number is given once.

Raises
------
UsageError
    As the constructor does. A body of 'mpm' whose particles lie further apart than the grid that others of 'mpm' share.

Warns
-----
FiligreeWarning
    As the constructor does: a body that its own weight would flatten, or that starts in an obstacle.
)")
        .def("remove_body", &remove_body, py::arg("body"), R"(remove_body(self, body)
--

A body is gone, with its pieces, and with pins, forces, hands and attachments of it; what lay on it wakes. Whatever asks
for it afterwards raises UsageError.

Raises
------
UsageError
    No such body, or it was removed before.
)")
        .def(
            "has_body",
            [](PySimulation& self, std::size_t body) {
                return self.alone([&] { return self.simulation.has_body(body); });
            },
            py::arg("body"), R"(has_body(self, body)
--

Whether there is a body of this number, and it was not removed.
)")
        .def(
            "set_obstacle", &set_obstacle, py::arg("obstacle"), py::kw_only(),
            py::arg("move") = py::make_tuple(0, 0, 0), py::arg("axis") = py::make_tuple(0, 1, 0),
            py::arg("degrees") = 0.0, py::arg("matrix") = py::none(), py::arg("velocity") = py::make_tuple(0, 0, 0),
            py::arg("spin") = py::none(), py::arg("spin_degrees") = py::none(),
            R"(set_obstacle(self, obstacle, *, move=(0, 0, 0), axis=(0, 1, 0), degrees=0.0, matrix=None, velocity=(0, 0, 0), spin=None, spin_degrees=None)
--

From now on an obstacle stands somewhere, and goes on at a constant pace until it is set again. What touches it feels
that pace. A pose within a quarter of the finest body's spacing of where it stands is reached evenly in the next frame;
further it is a jump, which sweeps over nothing.

Parameters
----------
obstacle : int
    Which of the simulation's.
move : array_like, (3,)
    m, from where its shape was made.
axis, degrees : array_like (3,), float
    Its turn, about its middle (of a plane its point, of a mesh its origin); before the move.
matrix : array_like, (4, 4), optional
    In place of these three: from the shape's own coordinates to the world.
velocity : array_like, (3,)
    m/s, of that middle.
spin : array_like, (3,), optional
    rad/s about it; or
spin_degrees : array_like, (3,), optional
    degrees/s.

Raises
------
UsageError
    No such obstacle, numbers that are not finite, a matrix that is no turn and shift.
)")
        .def("move_obstacle", &move_obstacle, py::arg("obstacle"), py::kw_only(),
             py::arg("move") = py::make_tuple(0, 0, 0), py::arg("axis") = py::make_tuple(0, 1, 0),
             py::arg("degrees") = 0.0, py::arg("matrix") = py::none(),
             R"(move_obstacle(self, obstacle, *, move=(0, 0, 0), axis=(0, 1, 0), degrees=0.0, matrix=None)
--

In the next frame an obstacle goes there evenly, pushing what is in its way, and stands there. Parameters and errors: see
`set_obstacle`.
)")
        .def("obstacle_pose", &obstacle_pose, py::arg("obstacle"), R"(obstacle_pose(self, obstacle)
--

Where an obstacle stands now, from its shape's own coordinates to the world, float64 (4, 4).

Raises
------
UsageError
    No such obstacle.
)")
        .def("contact_events", &contact_events, R"(contact_events(self)
--

What touched in the last frame, and what no longer did.

Returns
-------
list of dict
    One for each two, ascending by body: 'kind' ('began', 'stays' or 'ended'), 'body', and 'other' (a body of a higher
    number) or 'obstacle', the other one None; 'place' (world, m) and 'normal' (unit, towards 'body'), float64 (3,);
    'impulse' (N s of the whole frame, along the normal) and 'speed' (m/s, the largest with which points that touch came
    nearer). Pieces of one body, and bodies of 'mpm', make none. What sleeps stays, without an impulse.
)")
        .def("cast_ray", &cast_ray, py::arg("origin"), py::arg("direction"), py::kw_only(),
             py::arg("reach") = py::none(), py::arg("ignore") = py::none(),
             R"(cast_ray(self, origin, direction, *, reach=None, ignore=None)
--

The first thing that a ray meets: bodies as they are now, and obstacles. Bodies of 'mpm' are met as their particles, as
balls. A ray that starts inside of something meets it at once.

Parameters
----------
origin : array_like, (3,)
    World, m.
direction : array_like, (3,)
    Any length above 0.
reach : float, optional
    m; what is further is not met.
ignore : int, optional
    A body that the ray goes through.

Returns
-------
dict or None
    'distance' (m), 'place' and 'normal' (world, float64 (3,)), 'body' or 'obstacle' (a number, the other None), and
    'rest': of a body the point on the body at rest, m, as Hand takes it.

Raises
------
UsageError
    Numbers that are not finite, a direction without length, a reach of 0.
)")
        .def(
            "set_may_sleep",
            [](PySimulation& self, std::size_t body, bool may_sleep) {
                self.alone([&] { return self.simulation.set_may_sleep(body, may_sleep).value(); });
            },
            py::arg("body"), py::arg("may_sleep"), R"(set_may_sleep(self, body, may_sleep)
--

Whether a rigid body may sleep, from now on; one that may not wakes.

Raises
------
UsageError
    No such body.
)")
        .def(
            "is_asleep",
            [](PySimulation& self, std::size_t body) {
                self.checked(body);
                return self.alone([&] { return self.simulation.is_asleep(body); });
            },
            py::arg("body"), R"(is_asleep(self, body)
--

Whether a rigid body sleeps: nothing is computed for it until something touches it.

Raises
------
UsageError
    No such body.
)")
        .def(
            "wake",
            [](PySimulation& self, std::size_t body) {
                self.alone([&] { return self.simulation.wake(body).value(); });
            },
            py::arg("body"), R"(wake(self, body)
--

Wake a body. What lies on it wakes as it moves.

Raises
------
UsageError
    No such body.
)");
}

} // namespace filigree::python
