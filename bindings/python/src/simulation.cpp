#include "bodies.h"
#include "models.h"

#include <filigree/physics/simulation.h>

#include <mutex>
#include <numbers>

namespace filigree::python {

namespace {

Keyed<Vec3d> keyed_of(const py::object& values, const py::object& times, const char* name) {
    if (times.is_none()) return {{}, {}, vector_of(values, name)};
    Keyed<Vec3d> keyed{double_values_of(times, "times"), double_points_of(values, name), Vec3d::Zero()};
    if (keyed.times.size() != keyed.values.size())
        refuse("There are " + std::to_string(keyed.times.size()) + " times and " + std::to_string(keyed.values.size()) +
               " of " + name + ".");
    return keyed;
}

/// A number, or (times, values).
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

/// A body with how it starts.
struct PyActor {
    PyBody body;
    Actor actor;
};

PyActor make_actor(const PyBody& body, const py::object& move, const py::object& axis, double degrees,
                   const py::object& velocity, const py::object& spin) {
    PyActor made{body, {.body = body.body}};
    const Vec3d about = vector_of(axis, "axis");
    if (!(about.norm() > 0)) refuse("axis has no length.");
    const Vec3d middle = body.body->scale * body.origin;
    made.actor.placement = Eigen::Translation3d(middle + vector_of(move, "move")) *
                           Eigen::AngleAxisd(degrees * std::numbers::pi / 180, about.normalized());
    made.actor.velocity = vector_of(velocity, "velocity");
    made.actor.spin = vector_of(spin, "spin");
    return made;
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

/// One thread moves it at a time.
struct PySimulation {
    std::vector<PyBody> bodies;
    Simulation simulation;
    unsigned threads;
    std::mutex mutex = {};

    std::size_t checked(std::size_t body) const {
        if (body >= bodies.size())
            refuse("There is no body " + std::to_string(body) + "; there are " + std::to_string(bodies.size()) +
                   ", counted from 0.");
        return body;
    }
    /// work() without the interpreter, alone.
    template <class Work>
    auto alone(const Work& work) {
        return without_interpreter([&] {
            const std::lock_guard lock(mutex);
            return work();
        });
    }
};
using SimulationPtr = std::shared_ptr<PySimulation>;

/// Points that go along, and where they count from: of a driver model units and its mesh's origin.
struct Attachment {
    SimulationPtr simulation;
    std::size_t number, count;
    double scale = 1;             ///< metres a unit
    Vec3d origin = Vec3d::Zero(); ///< m

    Pose pose() const {
        Pose pose{std::vector<Vec3f>(count), std::vector<Mat3f>(count), {}};
        const RunContext& context = short_context(simulation->threads);
        simulation->alone([&] {
            simulation->simulation.attached(number, pose.positions, pose.gradients, context);
            return Success{};
        });
        if (!origin.isZero(0))
            for (Vec3f& p : pose.positions) p = (p.cast<double>() - origin).cast<float>();
        if (scale != 1)
            for (Vec3f& p : pose.positions) p *= float(1 / scale);
        return pose;
    }
};

SimulationPtr make_simulation(const py::object& bodies, const py::object& gravity,
                              const std::vector<Obstacle>& obstacles, const std::vector<Pin>& pins,
                              const std::vector<RegionForce>& forces, const std::vector<Hand>& hands,
                              const py::object& wind, double air_density, const py::object& air_temperature,
                              double air_heat_transfer, const std::vector<HeatSource>& heat_sources, double friction,
                              double restitution, double frames_per_second, const std::string& mode,
                              unsigned most_substeps, unsigned descent_substeps, unsigned descent_iterations,
                              bool contacts_between_bodies, bool contacts_within_bodies, bool automatic_rigid,
                              unsigned threads) {
    std::vector<PyBody> held;
    std::vector<Actor> actors;
    for (const py::handle given : py::list(bodies)) {
        if (!py::isinstance<PyActor>(given) && !py::isinstance<PyBody>(given))
            throw py::type_error("bodies has to hold filigree.Body or filigree.Actor.");
        const PyActor actor = py::isinstance<PyActor>(given)
                                  ? given.cast<PyActor>()
                                  : make_actor(given.cast<PyBody>(), py::make_tuple(0, 0, 0), py::make_tuple(0, 1, 0),
                                               0, py::make_tuple(0, 0, 0), py::make_tuple(0, 0, 0));
        held.push_back(actor.body);
        actors.push_back(actor.actor);
    }
    World world;
    world.gravity = vector_of(gravity, "gravity");
    world.wind.constant = vector_of(wind, "wind");
    world.air_density = air_density;
    world.air_temperature = keyed_number_of(air_temperature, "air_temperature");
    world.air_heat_transfer = air_heat_transfer;
    world.heat_sources = heat_sources;
    world.obstacles = obstacles;
    world.pins = pins;
    world.forces = forces;
    for (RegionForce& force : world.forces)
        if (force.particles.empty() && force.body < held.size())
            for (Index i = 0; i < held[force.body].body->particle_count(); ++i) force.particles.push_back(i);
    world.hands = hands;
    world.body_friction = friction;
    world.body_restitution = restitution;
    StepOptions options;
    options.frames_per_second = frames_per_second;
    options.mode = value_of<StepMode>(
        mode, "mode",
        {{"auto", StepMode::automatic}, {"explicit", StepMode::explicit_steps}, {"descent", StepMode::descent}});
    options.most_substeps = most_substeps;
    options.descent_substeps = descent_substeps;
    options.descent_iterations = descent_iterations;
    options.contacts_between_bodies = contacts_between_bodies;
    options.contacts_within_bodies = contacts_within_bodies;
    options.automatic_rigid = automatic_rigid;
    Simulation made = LongCall{threads}([&](const RunContext& context) {
        return Simulation::create(std::move(world), std::move(actors), options, context).value();
    });
    return SimulationPtr(new PySimulation{std::move(held), std::move(made), threads});
}

py::dict said_of(const FrameReport& report) {
    constexpr const char* causes[] = {"", "chosen", "too_many_substeps", "not_finite"};
    py::dict said, seconds;
    said["used"] = report.used == StepMode::descent ? "descent" : "explicit";
    said["why_descent"] = causes[static_cast<std::size_t>(report.why_descent)];
    said["substeps"] = report.substeps;
    said["contacts"] = report.contacts;
    said["deepest_contact"] = report.deepest_contact;
    said["deepest_in_matter"] = report.deepest_in_matter;
    said["least_volume_ratio"] = report.least_volume_ratio;
    said["most_stretch"] = report.most_stretch;
    said["clamped_particles"] = report.clamped_particles;
    seconds["elastic"] = report.elastic_seconds;
    seconds["contact"] = report.contact_seconds;
    seconds["other"] = report.other_seconds;
    said["seconds"] = seconds;
    return said;
}

py::dict step(PySimulation& self, unsigned frames) {
    if (frames == 0) refuse("frames has to be 1 or more.");
    return said_of(LongCall{self.threads}([&](const RunContext& context) {
        const std::lock_guard lock(self.mutex);
        FrameReport report;
        for (unsigned k = 0; k < frames; ++k) report = self.simulation.advance(context).value();
        return report;
    }));
}

Attachment attach(const SimulationPtr& self, std::size_t body, const py::object& what) {
    self->checked(body);
    const PyBody& of = self->bodies[body];
    Attachment made{self, 0, 0};
    std::vector<Vec3f> points;
    if (py::isinstance<PyModel>(what)) {
        const auto model = model_of(what);
        points = driver_positions(*model);
        made.scale = of.body->scale;
        made.origin = made.scale * model->mesh.origin;
        for (Vec3f& p : points) p *= float(made.scale);
    } else {
        points = points_of(what, "points");
    }
    made.count = points.size();
    const RunContext& context = short_context(self->threads);
    made.number = self->alone([&] { return self->simulation.attach(body, points, context); });
    return made;
}

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

A ball; m. The others as of `plane`.
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

A box along the axes before its motion; m. The others as of `plane`.
)");
    obstacle.def_static(
        "mesh",
        [](const py::object& given, double scale, double spacing, const RigidMotion& motion, double friction,
           double restitution, double stiffness, const py::object& temperature, double heat_transfer, unsigned threads,
           const py::object& progress) {
            const MeshPtr mesh = mesh_of(given);
            auto field = LongCall{threads, progress}([&](const RunContext& context) {
                return std::make_shared<const DistanceField>(
                    DistanceField::create(*mesh, scale, spacing, context).value());
            });
            return make_obstacle(MeshObstacle{std::move(field), scale * mesh->origin}, motion, friction, restitution,
                                 stiffness, temperature, heat_transfer);
        },
        py::arg("mesh"), py::arg("scale") = 1.0, py::kw_only(), py::arg("spacing") = 0.0,
        py::arg("motion") = RigidMotion{}, py::arg("friction") = 0.5, py::arg("restitution") = 0.5,
        py::arg("stiffness") = 1.0, py::arg("temperature") = 293.0, py::arg("heat_transfer") = 0.0,
        py::arg("threads") = 0, py::arg("progress") = py::none(),
        R"(mesh(mesh, scale=1.0, *, spacing=0.0, motion=..., friction=0.5, restitution=0.5, stiffness=1.0, temperature=293.0, heat_transfer=0.0, threads=0, progress=None)
--

A mesh, `scale` metres a model unit, as a field of distances with this `spacing` (m; 0: a 64th of the longest side).
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
spin : array_like, (3,)
    rad/s about the centre of mass.
)")
        .def(py::init(&make_actor), py::arg("body"), py::kw_only(), py::arg("move") = py::make_tuple(0, 0, 0),
             py::arg("axis") = py::make_tuple(0, 1, 0), py::arg("degrees") = 0.0,
             py::arg("velocity") = py::make_tuple(0, 0, 0), py::arg("spin") = py::make_tuple(0, 0, 0),
             R"(__init__(self, body, *, move=(0, 0, 0), axis=(0, 1, 0), degrees=0.0, velocity=(0, 0, 0), spin=(0, 0, 0))
--

)");
}

} // namespace

void add_simulation(py::module_& m) {
    add_world(m);
    py::class_<Attachment>(m, "Attachment", R"(Points that go along with a body, made by `Simulation.attach`.)")
        .def("pose", &Attachment::pose, R"(pose(self)
--

Where they are now, with gradients from rest to there: a Pose, of a driver in model units, of points in metres.
)")
        .def(
            "renewal",
            [](const Attachment& self) {
                std::vector<float> renewal(self.count);
                self.simulation->alone([&] {
                    self.simulation->simulation.renewal(self.number, renewal);
                    return Success{};
                });
                return take(std::move(renewal));
            },
            R"(renewal(self)
--

How far the matter around each point is new, float32 (n,): 0 as it was at the start, 1 molten or kneaded through. Of bodies
that are not of 'mpm' 0.
)")
        .def("__len__", [](const Attachment& self) { return self.count; });

    py::class_<PySimulation, SimulationPtr>(
        m, "Simulation",
        R"(Bodies in a world, moved frame by frame. SI units. The same bytes for any number of threads.

Parameters
----------
bodies : sequence of Body or Actor
gravity, wind : array_like, (3,)
    m/s^2 and m/s.
obstacles, pins, forces, hands : sequence of Obstacle, Pin, Force, Hand
air_density : float
    kg/m^3: how hard the wind presses.
air_temperature, air_heat_transfer : float
    K (a number, or a pair of times and values) and W/(m^2 K): heat between the air and bodies of 'mpm'.
heat_sources : sequence of HeatSource
friction, restitution : float
    Where bodies touch each other.
frames_per_second : float
mode : str
    'auto', 'explicit' or 'descent' (docs/bodies.md); `most_substeps`, `descent_substeps` and `descent_iterations` belong
    to it.
contacts_between_bodies, contacts_within_bodies : bool
automatic_rigid : bool
    Bodies too small or stiff to be stepped as elastic become rigid.

Raises
------
UsageError
    With the place of the first thing that is wrong.

Examples
--------
>>> model = filigree.strip(filigree.make("wavy-cube", resolution=16))
>>> body = filigree.Body(model.mesh, "jelly", particles=500)
>>> floor = filigree.Obstacle.plane((0, -1, 0))
>>> simulation = filigree.Simulation([body], obstacles=[floor])
>>> driver = simulation.attach(0, model)
>>> for frame in range(3):
...     report = simulation.step()
>>> filigree.restore(model, driver.pose())
<filigree.Mesh: 1538 vertices, 1536 faces>
)")
        .def(
            py::init(&make_simulation), py::arg("bodies"), py::kw_only(),
            py::arg("gravity") = py::make_tuple(0, -9.81, 0), py::arg("obstacles") = py::tuple(),
            py::arg("pins") = py::tuple(), py::arg("forces") = py::tuple(), py::arg("hands") = py::tuple(),
            py::arg("wind") = py::make_tuple(0, 0, 0), py::arg("air_density") = 0.0, py::arg("air_temperature") = 293.0,
            py::arg("air_heat_transfer") = 0.0, py::arg("heat_sources") = py::tuple(), py::arg("friction") = 0.3,
            py::arg("restitution") = 0.7, py::arg("frames_per_second") = 60.0, py::arg("mode") = "auto",
            py::arg("most_substeps") = 256, py::arg("descent_substeps") = 4, py::arg("descent_iterations") = 8,
            py::arg("contacts_between_bodies") = true, py::arg("contacts_within_bodies") = true,
            py::arg("automatic_rigid") = true, py::arg("threads") = 0,
            R"(__init__(self, bodies, *, gravity=(0, -9.81, 0), obstacles=(), pins=(), forces=(), hands=(), wind=(0, 0, 0), air_density=0.0, air_temperature=293.0, air_heat_transfer=0.0, heat_sources=(), friction=0.3, restitution=0.7, frames_per_second=60.0, mode='auto', most_substeps=256, descent_substeps=4, descent_iterations=8, contacts_between_bodies=True, contacts_within_bodies=True, automatic_rigid=True, threads=0)
--

)")
        .def("step", &step, py::arg("frames") = 1, R"(step(self, frames=1)
--

So many frames. When Ctrl-C comes, the frame that was begun is undone.

Returns
-------
dict
    Of the last frame: 'used' ('explicit' or 'descent'), 'substeps', 'contacts', 'least_volume_ratio' and more.
)")
        .def_property_readonly(
            "frame", [](const PySimulation& self) { return self.simulation.frame(); }, "Frames done.")
        .def_property_readonly(
            "time", [](const PySimulation& self) { return self.simulation.time(); }, "Seconds done.")
        .def_property_readonly(
            "bodies", [](const PySimulation& self) { return self.bodies; }, "A list of Body.")
        .def(
            "why_rigid",
            [](const PySimulation& self, std::size_t body) { return self.simulation.why_rigid(self.checked(body)); },
            py::arg("body"), R"(why_rigid(self, body)
--

Why `automatic_rigid` made a body rigid, as in 'it has only 5 cells'; '' where it did not.
)")
        .def(
            "positions",
            [](PySimulation& self, std::size_t body) {
                self.checked(body);
                return array_of(self.alone([&] { return self.simulation.positions(body); }));
            },
            py::arg("body"), R"(positions(self, body)
--

Of a body's particles, world, m, a copy, float32 (p, 3).
)")
        .def(
            "velocities",
            [](PySimulation& self, std::size_t body) {
                self.checked(body);
                return array_of(self.alone([&] { return self.simulation.velocities(body); }));
            },
            py::arg("body"), R"(velocities(self, body)
--

Of a body's particles, m/s, a copy, float32 (p, 3).
)")
        .def(
            "set_positions",
            [](PySimulation& self, std::size_t body, const py::object& positions) {
                const Vectors given = vectors_of(positions, "positions");
                self.alone([&] { return self.simulation.set_positions(body, given).value(); });
            },
            py::arg("body"), py::arg("positions"), R"(set_positions(self, body, positions)
--

Put a body's particles somewhere: array_like (p, 3), world, m.

Raises
------
UsageError
    No such body, another number of particles.
)")
        .def(
            "set_velocities",
            [](PySimulation& self, std::size_t body, const py::object& velocities) {
                const Vectors given = vectors_of(velocities, "velocities");
                self.alone([&] { return self.simulation.set_velocities(body, given).value(); });
            },
            py::arg("body"), py::arg("velocities"), R"(set_velocities(self, body, velocities)
--

Give a body's particles other velocities: array_like (p, 3), m/s. Errors as of `set_positions`.
)")
        .def(
            "set_forces",
            [](PySimulation& self, std::size_t body, const py::object& newtons) {
                const Vectors given = newtons.is_none() ? Vectors() : vectors_of(newtons, "newtons");
                self.alone([&] { return self.simulation.set_forces(body, given).value(); });
            },
            py::arg("body"), py::arg("newtons"), R"(set_forces(self, body, newtons)
--

Forces on a body's particles from now on, in place of those set before.

Parameters
----------
body : int
newtons : array_like, (p, 3), or None
    One a particle, N; None: no such forces.

Raises
------
UsageError
    No such body, one of 'mpm', another number of particles, numbers that are not finite.
)")
        .def(
            "set_hands",
            [](PySimulation& self, const std::vector<Hand>& hands) {
                const RunContext& context = short_context(self.threads);
                self.alone([&] { return self.simulation.set_hands(hands, context).value(); });
            },
            py::arg("hands"), R"(set_hands(self, hands)
--

Hands that pull from now on, in place of those there were: a sequence of Hand.
)")
        .def(
            "set_air",
            [](PySimulation& self, const py::object& temperature, double heat_transfer) {
                const Keyed<double> keyed = keyed_number_of(temperature, "temperature");
                self.alone([&] { return self.simulation.set_air(keyed, heat_transfer).value(); });
            },
            py::arg("temperature"), py::arg("heat_transfer"), R"(set_air(self, temperature, heat_transfer)
--

The air around bodies of 'mpm' from now on.

Parameters
----------
temperature : float, or (times, values)
    K, above 0.
heat_transfer : float
    W/(m^2 K), 0 or more.

Raises
------
UsageError
    A number out of its range.
)")
        .def(
            "set_heat_sources",
            [](PySimulation& self, const std::vector<HeatSource>& sources) {
                self.alone([&] { return self.simulation.set_heat_sources(sources).value(); });
            },
            py::arg("heat_sources"), R"(set_heat_sources(self, heat_sources)
--

What warms bodies of 'mpm' from now on, in place of what did before: a sequence of HeatSource.
)")
        .def(
            "matter",
            [](PySimulation& self, std::size_t body) {
                self.checked(body);
                MatterParticles matter = self.alone([&] { return self.simulation.matter(body); });
                py::dict said;
                said["positions"] = take(std::move(matter.positions));
                said["volumes"] = take(std::move(matter.volumes));
                said["temperatures"] = take(std::move(matter.temperatures));
                said["liquid"] = take(std::move(matter.liquid));
                said["renewal"] = take(std::move(matter.renewal));
                return said;
            },
            py::arg("body"), R"(matter(self, body)
--

The particles of a body of 'mpm', dict of arrays (none in them for others): 'positions' (world, m), 'volumes' (m^3),
'temperatures' (K), 'liquid' (0 solid to 1 fluid), 'renewal' (0 as it was at the start to 1 new).
)")
        .def(
            "heat", [](PySimulation& self) { return self.alone([&] { return self.simulation.heat(); }); },
            R"(heat(self)
--

In bodies of 'mpm', J, from 0 K.
)")
        .def("attach", &attach, py::arg("body"), py::arg("what"), R"(attach(self, body, what)
--

Let points go along with a body.

Parameters
----------
body : int
what : Model, or array_like (n, 3)
    A model of the body's mesh, whose driver goes along; or points of the body at rest, m.

Returns
-------
Attachment
)")
        .def(
            "energy",
            [](PySimulation& self) {
                const RunContext& context = short_context(self.threads);
                const Energy energy = self.alone([&] { return self.simulation.energy(context); });
                py::dict said;
                said["kinetic"] = energy.kinetic;
                said["elastic"] = energy.elastic;
                said["potential"] = energy.potential;
                return said;
            },
            R"(energy(self)
--

'kinetic', 'elastic' and 'potential' (of gravity, relative to the world's origin), J.
)")
        .def(
            "momentum",
            [](PySimulation& self) {
                const Momentum momentum = self.alone([&] { return self.simulation.momentum(); });
                return py::make_tuple(array_of(momentum.linear), array_of(momentum.angular));
            },
            R"(momentum(self)
--

Linear, kg m/s, and angular about the world's origin, kg m^2/s: two arrays of float64 (3,).
)")
        .def(
            "save", [](PySimulation& self) { return py::bytes(self.alone([&] { return self.simulation.save(); })); },
            R"(save(self)
--

Everything that moves, as bytes. Hands and forces that were set are no part of it.
)")
        .def(
            "restore",
            [](PySimulation& self, const py::bytes& state) {
                const std::string_view bytes(state);
                self.alone([&] { return self.simulation.restore(bytes).value(); });
            },
            py::arg("state"), R"(restore(self, state)
--

Back to where `save` was called; goes on with the same bytes.

Raises
------
BadFileError
    Damaged.
MismatchError
    Of other bodies.
)");
}

} // namespace filigree::python
