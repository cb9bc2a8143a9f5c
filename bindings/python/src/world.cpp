#include "world.h"

#include "arrays.h"
#include "calls.h"

#include <numbers>

namespace filigree::python {

Keyed<double> keyed_number_of(const py::object& given, const char* name) {
    if (!py::isinstance<py::tuple>(given) && !py::isinstance<py::list>(given)) return {{}, {}, given.cast<double>()};
    const auto pair = given.cast<py::sequence>();
    if (pair.size() != 2) refuse(std::string(name) + " has to be a number, or a pair of times and values.");
    Keyed<double> keyed{double_values_of(pair[0], "times"), double_values_of(pair[1], name), 0};
    if (keyed.times.empty() || keyed.times.size() != keyed.values.size())
        refuse("There are " + std::to_string(keyed.times.size()) + " times and " + std::to_string(keyed.values.size()) +
               " of " + name + ".");
    return keyed;
}

PyActor make_actor(const PyBody& body, const py::object& move, const py::object& axis, double degrees,
                   const py::object& velocity, const py::object& spin, const py::object& spin_degrees, bool may_sleep) {
    PyActor made{body, {.body = body.body}};
    const Vec3d about = vector_of(axis, "axis");
    if (!(about.norm() > 0)) refuse("axis has no length.");
    const Vec3d middle = body.body->scale * body.origin;
    made.actor.placement = Eigen::Translation3d(middle + vector_of(move, "move")) *
                           Eigen::AngleAxisd(degrees * std::numbers::pi / 180, about.normalized());
    made.actor.velocity = vector_of(velocity, "velocity");
    if (!spin.is_none() && !spin_degrees.is_none()) refuse("Give one of spin (rad/s) and spin_degrees (degrees/s).");
    if (!spin.is_none()) made.actor.spin = vector_of(spin, "spin");
    if (!spin_degrees.is_none()) made.actor.spin = std::numbers::pi / 180 * vector_of(spin_degrees, "spin_degrees");
    made.actor.may_sleep = may_sleep;
    return made;
}

namespace {

Keyed<Vec3d> keyed_of(const py::object& values, const py::object& times, const char* name) {
    if (times.is_none()) return {{}, {}, vector_of(values, name)};
    Keyed<Vec3d> keyed{double_values_of(times, "times"), double_points_of(values, name), Vec3d::Zero()};
    if (keyed.times.size() != keyed.values.size())
        refuse("There are " + std::to_string(keyed.times.size()) + " times and " + std::to_string(keyed.values.size()) +
               " of " + name + ".");
    return keyed;
}

HeatSource make_heat_source(const py::object& centre, double radius, const py::object& power, const py::object& times,
                            const py::object& move) {
    HeatSource source{{vector_of(centre, "centre"), radius}, {}, {}};
    if (times.is_none()) {
        source.power.constant = power.cast<double>();
    } else {
        source.power.times = double_values_of(times, "times");
        source.power.values = double_values_of(power, "power");
        if (source.power.times.size() != source.power.values.size())
            refuse("There are " + std::to_string(source.power.times.size()) + " times and " +
                   std::to_string(source.power.values.size()) + " of power.");
    }
    source.move = move.is_none() ? Keyed<Vec3d>{{}, {}, Vec3d::Zero()} : keyed_of(move, times, "move");
    return source;
}

RigidMotion make_motion(const py::object& times, const py::object& move, const py::object& degrees,
                        const py::object& centre) {
    RigidMotion motion;
    motion.centre = vector_of(centre, "centre");
    if (!move.is_none()) motion.move = keyed_of(move, times, "move");
    if (!degrees.is_none()) {
        motion.angle = keyed_of(degrees, times, "degrees");
        for (Vec3d& angle : motion.angle.values) angle *= std::numbers::pi / 180;
        motion.angle.constant *= std::numbers::pi / 180;
    }
    return motion;
}

template <class Shape>
Obstacle make_obstacle(Shape shape, const RigidMotion& motion, double friction, double restitution, double stiffness,
                       const py::object& temperature, double heat_transfer) {
    Obstacle obstacle;
    obstacle.shape = std::move(shape);
    obstacle.motion = motion;
    obstacle.friction = friction;
    obstacle.restitution = restitution;
    obstacle.stiffness = stiffness;
    obstacle.temperature = keyed_number_of(temperature, "temperature");
    obstacle.heat_transfer = heat_transfer;
    return obstacle;
}

/// All ids of a body's particles where none are named.
std::vector<Index> particles_of(const py::object& given) { return indices_of(given, "particles", kNoIndex); }

} // namespace

void add_world(py::module_& m) {
    py::class_<RigidMotion>(m, "RigidMotion",
                            R"(A rigid motion in time: turned about `centre`, then moved; linear between keys.

Parameters
----------
times : array_like, (k,), optional
    Seconds, ascending. None: `move` and `degrees` are one each, and hold always.
move : array_like, (k, 3), optional
    m.
degrees : array_like, (k, 3), optional
    Axis times angle.
centre : array_like, (3,)
    World, m.
)")
        .def(py::init(&make_motion), py::arg("times") = py::none(), py::kw_only(), py::arg("move") = py::none(),
             py::arg("degrees") = py::none(), py::arg("centre") = py::make_tuple(0, 0, 0),
             R"(__init__(self, times=None, *, move=None, degrees=None, centre=(0, 0, 0))
--

)");

    py::class_<Obstacle> obstacle(m, "Obstacle",
                                  R"(Something solid that bodies touch and that does not feel them.

Made by `Obstacle.plane`, `Obstacle.ball`, `Obstacle.box` and `Obstacle.mesh`.
)");
    const auto add = [&](const char* name, auto make, auto first, auto second, const char* text) {
        obstacle.def_static(name, make, first, second, py::kw_only(), py::arg("motion") = RigidMotion{},
                            py::arg("friction") = 0.5, py::arg("restitution") = 0.5, py::arg("stiffness") = 1.0,
                            py::arg("temperature") = 293.0, py::arg("heat_transfer") = 0.0, text);
    };
    add(
        "plane",
        [](const py::object& point, const py::object& normal, const RigidMotion& motion, double friction,
           double restitution, double stiffness, const py::object& temperature, double heat_transfer) {
            return make_obstacle(HalfSpace{vector_of(point, "point"), vector_of(normal, "normal")}, motion, friction,
                                 restitution, stiffness, temperature, heat_transfer);
        },
        py::arg("point") = py::make_tuple(0, 0, 0), py::arg("normal") = py::make_tuple(0, 1, 0),
        R"(plane(point=(0, 0, 0), normal=(0, 1, 0), *, motion=..., friction=0.5, restitution=0.5, stiffness=1.0, temperature=293.0, heat_transfer=0.0)
--

Solid below a plane. `friction`: Coulomb's coefficient; `restitution`: 0 to 1; `stiffness` of the contact: above 0,
to 1; `temperature` (K; a number, or a pair of times and values) and `heat_transfer` (W/(m^2 K)): of what bodies of
'mpm' touch.
)");
    add(
        "ball",
        [](const py::object& centre, double radius, const RigidMotion& motion, double friction, double restitution,
           double stiffness, const py::object& temperature, double heat_transfer) {
            return make_obstacle(Ball{vector_of(centre, "centre"), radius}, motion, friction, restitution, stiffness,
                                 temperature, heat_transfer);
        },
        py::arg("centre"), py::arg("radius"),
        R"(ball(centre, radius, *, motion=..., friction=0.5, restitution=0.5, stiffness=1.0, temperature=293.0, heat_transfer=0.0)
--

A ball; m. Other parameters: see `plane`.
)");
    add(
        "box",
        [](const py::object& centre, const py::object& size, const RigidMotion& motion, double friction,
           double restitution, double stiffness, const py::object& temperature, double heat_transfer) {
            return make_obstacle(Cuboid{vector_of(centre, "centre"), vector_of(size, "size")}, motion, friction,
                                 restitution, stiffness, temperature, heat_transfer);
        },
        py::arg("centre"), py::arg("size"),
        R"(box(centre, size, *, motion=..., friction=0.5, restitution=0.5, stiffness=1.0, temperature=293.0, heat_transfer=0.0)
--

A box along the axes before its motion; m. Other parameters: see `plane`.
)");
    obstacle.def_static(
        "mesh",
        [](const py::object& given, double scale, double spacing, const RigidMotion& motion, double friction,
           double restitution, double stiffness, const py::object& temperature, double heat_transfer, unsigned threads,
           const py::object& progress) {
            const MeshPtr mesh = mesh_of(given);
            OutwardReport outward;
            MeshObstacle shape = LongCall{threads, progress}([&](const RunContext& context) {
                return make_mesh_obstacle(*mesh, scale, spacing, context, &outward).value();
            });
            warn_of_turns(outward);
            shape.offset = scale * mesh->origin;
            return make_obstacle(std::move(shape), motion, friction, restitution, stiffness, temperature,
                                 heat_transfer);
        },
        py::arg("mesh"), py::arg("scale") = 1.0, py::kw_only(), py::arg("spacing") = 0.0,
        py::arg("motion") = RigidMotion{}, py::arg("friction") = 0.5, py::arg("restitution") = 0.5,
        py::arg("stiffness") = 1.0, py::arg("temperature") = 293.0, py::arg("heat_transfer") = 0.0,
        py::arg("threads") = 0, py::arg("progress") = py::none(),
        R"(mesh(mesh, scale=1.0, *, spacing=0.0, motion=..., friction=0.5, restitution=0.5, stiffness=1.0, temperature=293.0, heat_transfer=0.0, threads=0, progress=None)
--

A mesh, `scale` metres a model unit. Its faces are walls with two sides: open sheets, terrain, rooms and thin plates stop
what comes from either side. What starts inside of a closed mesh stays in it, as in a room. `spacing`: of the grid of
distances beside it, m (0: a 64th of the longest side). Warns where faces count as turned on that grid.
)");

    py::class_<Pin>(m, "Pin", R"(Particles held fast.

Parameters
----------
body : int
    Which of the simulation's.
particles : array_like of int
motion : RigidMotion
    How they go from where they were at the start.
)")
        .def(py::init([](std::size_t body, const py::object& particles, const RigidMotion& motion) {
                 return Pin{body, particles_of(particles), motion};
             }),
             py::arg("body"), py::arg("particles"), py::arg("motion") = RigidMotion{},
             R"(__init__(self, body, particles, motion=...)
--

)");
    py::class_<RegionForce>(
        m, "Force",
        R"(A force on a region of a body, shared out by mass. For forces that a program works out see `Simulation.set_forces`.

Parameters
----------
body : int
newtons : array_like, (3,), or (k, 3) with `times`
    Of the whole region.
times : array_like, (k,), optional
    Seconds, ascending; linear between.
particles : array_like of int
    None at all: the whole body.
)")
        .def(py::init(
                 [](std::size_t body, const py::object& newtons, const py::object& times, const py::object& particles) {
                     return RegionForce{body, particles_of(particles), keyed_of(newtons, times, "newtons")};
                 }),
             py::arg("body"), py::arg("newtons"), py::arg("times") = py::none(), py::kw_only(),
             py::arg("particles") = py::tuple(),
             R"(__init__(self, body, newtons, times=None, *, particles=())
--

)");
    py::class_<Hand>(m, "Hand",
                     R"(A hand that pulls a point of a body towards a moving target by a damped spring.

Parameters
----------
body : int
point : array_like, (3,)
    Of the body at rest, m.
target : array_like, (3,), or (k, 3) with `times`
    World, m.
times : array_like, (k,), optional
    Seconds, ascending; linear between.
stiffness : float
    N/m; 0: chosen from the body's.
begin, end : float
    Seconds; `end` None: it never lets go.
)")
        .def(py::init([](std::size_t body, const py::object& point, const py::object& target, const py::object& times,
                         double stiffness, double begin, std::optional<double> end) {
                 return Hand{body,      vector_of(point, "point").cast<float>(),
                             stiffness, keyed_of(target, times, "target"),
                             begin,     end.value_or(std::numeric_limits<double>::infinity())};
             }),
             py::arg("body"), py::arg("point"), py::arg("target"), py::arg("times") = py::none(), py::kw_only(),
             py::arg("stiffness") = 0.0, py::arg("begin") = 0.0, py::arg("end") = py::none(),
             R"(__init__(self, body, point, target, times=None, *, stiffness=0.0, begin=0.0, end=None)
--

)");
    py::class_<HeatSource>(m, "HeatSource",
                           R"(Something that warms bodies of 'mpm': matter in a ball takes up its power.

Parameters
----------
centre : array_like, (3,)
radius : float
    World, m.
power : float, or array_like (k,) with `times`
    W; below 0 it cools.
times : array_like, (k,), optional
    Seconds, ascending; linear between.
move : array_like, (3,), or (k, 3) with `times`, optional
    Of the ball, m.
)")
        .def(py::init(&make_heat_source), py::arg("centre"), py::arg("radius"), py::arg("power"),
             py::arg("times") = py::none(), py::kw_only(), py::arg("move") = py::none(),
             R"(__init__(self, centre, radius, power, times=None, *, move=None)
--

)");
    py::class_<PyActor>(m, "Actor",
                        R"(A body and how it starts: turned about its mesh's origin, then moved from where its mesh is.

Parameters
----------
body : Body
move : array_like, (3,)
    m.
axis, degrees : array_like (3,), float
velocity : array_like, (3,)
    m/s.
spin : array_like, (3,), optional
    rad/s about the centre of mass; or
spin_degrees : array_like, (3,), optional
    degrees/s, as scenes have it.
may_sleep : bool
    A rigid body that hardly moves while something holds it sleeps, and costs nothing until something touches it.
)")
        .def(
            py::init(&make_actor), py::arg("body"), py::kw_only(), py::arg("move") = py::make_tuple(0, 0, 0),
            py::arg("axis") = py::make_tuple(0, 1, 0), py::arg("degrees") = 0.0,
            py::arg("velocity") = py::make_tuple(0, 0, 0), py::arg("spin") = py::none(),
            py::arg("spin_degrees") = py::none(), py::arg("may_sleep") = true,
            R"(__init__(self, body, *, move=(0, 0, 0), axis=(0, 1, 0), degrees=0.0, velocity=(0, 0, 0), spin=None, spin_degrees=None, may_sleep=True)
--

)");
}

} // namespace filigree::python
