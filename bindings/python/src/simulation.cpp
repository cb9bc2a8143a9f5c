#include "simulation.h"

#include "calls.h"
#include "models.h"

#include <filigree/physics/body/own_weight.h>
#include <filigree/physics/grid/grid_limits.h>
#include <filigree/scene/scene_keys.h>

#include <cstdio>

namespace filigree::python {

namespace {

std::vector<Mat3f> stretches_of(const py::object& given) {
    return given.is_none() ? std::vector<Mat3f>() : gradients_of(given, "stretches");
}

/// Points that go along, and where they count from: of a driver model units and its mesh's origin.
struct Attachment {
    SimulationPtr simulation;
    std::size_t number, count;
    double scale = 1;             ///< metres a unit
    Vec3d origin = Vec3d::Zero(); ///< m

    void require() const {
        if (!simulation->simulation.has_attachment(number))
            refuse("The body that these points went along with was removed.");
    }
    Pose pose() const {
        Pose pose{std::vector<Vec3f>(count), std::vector<Mat3f>(count)};
        const RunContext& context = short_context(simulation->threads);
        simulation->alone([&] {
            require();
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

} // namespace

PyActor actor_of(const py::handle& given, const char* what) {
    if (py::isinstance<PyActor>(given)) return given.cast<PyActor>();
    if (!py::isinstance<PyBody>(given))
        throw py::type_error(std::string(what) + " to hold filigree.Body or filigree.Actor.");
    return make_actor(given.cast<PyBody>(), py::make_tuple(0, 0, 0), py::make_tuple(0, 1, 0), 0,
                      py::make_tuple(0, 0, 0), py::none(), py::none(), true);
}

std::string weight_warning(const World& world, const Actor& actor, std::size_t number) {
    const OwnWeight weight = own_weight(*actor.body, actor.placement.linear(), world.gravity);
    if (!weight.is_too_much()) return "";
    char what_does[96];
    std::snprintf(what_does, sizeof what_does, ": scale = %.1g, or young_modulus = %.0e?",
                  weight.size_that_does(actor.body->scale), weight.modulus_that_does());
    return "Body " + std::to_string(number) + " " + weight.sentence("such soft matter") + what_does;
}

namespace {

/// One number, or one a particle; infinity is one.
std::vector<float> numbers_of(const py::object& given, const char* name) {
    if (py::isinstance<py::float_>(given) || py::isinstance<py::int_>(given)) return {given.cast<float>()};
    const auto array = py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(given);
    if (!array || array.ndim() != 1) {
        PyErr_Clear();
        throw py::type_error(std::string(name) + " has to be a number or an array of one number a particle.");
    }
    return {array.data(), array.data() + array.size()};
}

/// A word of older versions counts as "auto", and a sentence says so.
StepMode mode_of(const std::string& word, std::vector<std::string>& sentences) {
    if (const std::string former = former_word_sentence(*find_key("simulation", "mode"), word); !former.empty()) {
        sentences.push_back(former + ".");
        return StepMode::automatic;
    }
    return value_of<StepMode>(word, "mode", {{"auto", StepMode::automatic}, {"explicit", StepMode::explicit_steps}});
}

SimulationPtr make_simulation(const py::object& bodies, const py::object& gravity,
                              const std::vector<Obstacle>& obstacles, const std::vector<Pin>& pins,
                              const std::vector<RegionForce>& forces, const std::vector<Hand>& hands,
                              const py::object& wind, double air_density, const py::object& air_temperature,
                              double air_heat_transfer, const std::vector<HeatSource>& heat_sources, double heat_pace,
                              double friction, double restitution, double frames_per_second, const std::string& mode,
                              unsigned most_substeps, bool contacts_between_bodies, bool contacts_within_bodies,
                              bool automatic_rigid, unsigned threads) {
    std::vector<std::optional<PyBody>> held;
    std::vector<Actor> actors;
    for (const py::handle given : py::list(bodies)) {
        const PyActor actor = actor_of(given, "bodies has");
        held.emplace_back(actor.body);
        actors.push_back(actor.actor);
    }
    World world;
    world.gravity = vector_of(gravity, "gravity");
    world.wind.constant = vector_of(wind, "wind");
    world.air_density = air_density;
    world.air_temperature = keyed_number_of(air_temperature, "air_temperature");
    world.air_heat_transfer = air_heat_transfer;
    world.heat_sources = heat_sources;
    world.heat_pace = heat_pace;
    world.obstacles = obstacles;
    world.pins = pins;
    world.forces = forces;
    world.hands = hands;
    world.body_friction = friction;
    world.body_restitution = restitution;
    StepOptions options;
    options.frames_per_second = frames_per_second;
    std::vector<std::string> sentences;
    options.mode = mode_of(mode, sentences);
    options.most_substeps = most_substeps;
    options.contacts_between_bodies = contacts_between_bodies;
    options.contacts_within_bodies = contacts_within_bodies;
    options.automatic_rigid = automatic_rigid;
    for (std::size_t b = 0; b < actors.size(); ++b)
        if (const std::string weight = weight_warning(world, actors[b], b); !weight.empty())
            sentences.push_back(weight);
    if (const std::string sentence = why_models_do_not_meet(actors); !sentence.empty())
        sentences.push_back(sentence + ".");
    for (const SlenderObstacle& slender : find_slender_obstacles(world, actors))
        sentences.push_back(slender.sentence("obstacle " + std::to_string(slender.obstacle)) + ".");
    Simulation made = LongCall{threads}([&](const RunContext& context) {
        return Simulation::create(std::move(world), std::move(actors), options, context).value();
    });
    for (const StartOverlap& overlap : made.start_overlaps())
        sentences.push_back(
            overlap.sentence("body " + std::to_string(overlap.body), "obstacle " + std::to_string(overlap.obstacle)) +
            ".");
    warn(sentences);
    return SimulationPtr(new PySimulation{std::move(held), std::move(made), threads});
}

py::dict said_of(const FrameReport& report) {
    py::dict said, seconds;
    said["substeps"] = report.substeps;
    said["unstable_substeps"] = report.unstable_substeps;
    said["unstable_body"] = report.unstable_body;
    said["contacts"] = report.contacts;
    said["deepest_contact"] = report.deepest_contact;
    said["deepest_in_matter"] = report.deepest_in_matter;
    said["least_volume_ratio"] = report.least_volume_ratio;
    said["flowed_out"] = report.flowed_out;
    said["most_stretch"] = report.most_stretch;
    said["clamped_particles"] = report.clamped_particles;
    said["clamped_body"] = report.clamped_body;
    said["clamped_at"] = array_of(report.clamped_at.cast<double>());
    seconds["elastic"] = report.elastic_seconds;
    seconds["contact"] = report.contact_seconds;
    seconds["other"] = report.other_seconds;
    said["seconds"] = seconds;
    return said;
}

std::string text_of(const Vec3f& place) {
    char text[96];
    std::snprintf(text, sizeof text, "(%.3g, %.3g, %.3g) m", double(place.x()), double(place.y()), double(place.z()));
    return text;
}

/// A sentence where a frame came out wrong, or "".
std::string doubt_of(const Simulation& simulation, const FrameReport& report) {
    const std::string frame = "Frame " + std::to_string(simulation.frame()) + ": ";
    const std::string mend = "; make it smaller, stiffer (young_modulus) or slower.";
    if (report.clamped_particles > 0)
        return frame + std::to_string(report.clamped_particles) +
               " motions of particles were not finite or had to be limited, the first of body " +
               std::to_string(report.clamped_body) + " near " + text_of(report.clamped_at) + mend;
    if (report.unstable_substeps > 0)
        return frame + std::to_string(report.unstable_substeps) +
               " substeps were longer than is stable, as a frame has " + std::to_string(kMostSubsteps) +
               " at most; give body " + std::to_string(report.unstable_body) +
               " a lower young_modulus or internal_damping or fewer particles, or take more frames_per_second.";
    if (report.least_volume_ratio > 0) return "";
    for (std::size_t b = 0; b < simulation.body_count(); ++b)
        if (const InvertedCells cells = simulation.inverted(b); cells.count > 0)
            return frame + std::to_string(cells.count) + " cells of body " + std::to_string(b) +
                   " are inside out, the worst near " + text_of(cells.place) + mend;
    return "";
}

py::dict step(PySimulation& self, unsigned frames) {
    if (frames == 0) refuse("frames has to be 1 or more.");
    std::string doubt;
    const py::dict said = said_of(LongCall{self.threads}([&](const RunContext& context) {
        const std::lock_guard lock(self.mutex);
        FrameReport report;
        for (unsigned k = 0; k < frames; ++k) {
            report = self.simulation.advance(context).value();
            if (doubt.empty()) doubt = doubt_of(self.simulation, report);
        }
        return report;
    }));
    if (!doubt.empty()) warn({doubt});
    return said;
}

py::dict inverted(PySimulation& self, std::size_t body) {
    self.checked(body);
    const InvertedCells cells = self.alone([&] { return self.simulation.inverted(body); });
    py::dict said;
    said["count"] = cells.count;
    said["least"] = cells.least;
    said["place"] = array_of(cells.place.cast<double>());
    return said;
}

Attachment attach(const SimulationPtr& self, std::size_t body, const py::object& what) {
    self->checked(body);
    const PyBody of = self->alone([&] { return self->bodies[body].value(); });
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

} // namespace

void add_simulation(py::module_& m) {
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
                    self.require();
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

    py::class_<PySimulation, SimulationPtr> simulation(
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
heat_pace : float
    How many times quicker than in truth heat goes, in and around bodies of 'mpm'.
friction, restitution : float
    Where bodies touch each other.
frames_per_second : float
mode : str
    'auto': bodies that would need more than `most_substeps` a frame become rigid. 'explicit': they stay elastic,
    whatever they cost.
contacts_between_bodies, contacts_within_bodies : bool
automatic_rigid : bool
    Bodies too small or stiff to be stepped as elastic become rigid.

Raises
------
UsageError
    With the place of the first thing that is wrong.

Warns
-----
FiligreeWarning
    A body that its own weight would flatten.

Examples
--------
>>> model = filigree.strip(filigree.make("wavy-cube", resolution=16))
>>> body = filigree.Body(model.mesh, "jelly", particles=500, size=0.2)
>>> floor = filigree.Obstacle.plane((0, -1, 0))
>>> simulation = filigree.Simulation([body], obstacles=[floor])
>>> driver = simulation.attach(0, model)
>>> for frame in range(3):
...     report = simulation.step()
>>> filigree.restore(model, driver.pose())
<filigree.Mesh: 1538 vertices, 1536 faces>
)");
    const World world;
    const StepOptions steps;
    simulation
        .def(
            py::init(&make_simulation), py::arg("bodies"), py::kw_only(),
            py::arg("gravity") = py::make_tuple(0, -9.81, 0), py::arg("obstacles") = py::tuple(),
            py::arg("pins") = py::tuple(), py::arg("forces") = py::tuple(), py::arg("hands") = py::tuple(),
            py::arg("wind") = py::make_tuple(0, 0, 0), py::arg("air_density") = world.air_density,
            py::arg("air_temperature") = world.air_temperature.constant,
            py::arg("air_heat_transfer") = world.air_heat_transfer, py::arg("heat_sources") = py::tuple(),
            py::arg("heat_pace") = world.heat_pace, py::arg("friction") = world.body_friction,
            py::arg("restitution") = world.body_restitution, py::arg("frames_per_second") = steps.frames_per_second,
            py::arg("mode") = "auto", py::arg("most_substeps") = steps.most_substeps,
            py::arg("contacts_between_bodies") = steps.contacts_between_bodies,
            py::arg("contacts_within_bodies") = steps.contacts_within_bodies,
            py::arg("automatic_rigid") = steps.automatic_rigid, py::arg("threads") = 0,
            R"(__init__(self, bodies, *, gravity=(0, -9.81, 0), obstacles=(), pins=(), forces=(), hands=(), wind=(0, 0, 0), air_density=0.0, air_temperature=293.0, air_heat_transfer=0.0, heat_sources=(), heat_pace=1.0, friction=0.3, restitution=0.7, frames_per_second=60.0, mode='auto', most_substeps=500, contacts_between_bodies=True, contacts_within_bodies=True, automatic_rigid=True, threads=0)
--

)")
        .def("step", &step, py::arg("frames") = 1, R"(step(self, frames=1)
--

So many frames. When Ctrl-C comes, the frame that was begun is undone.

Returns
-------
dict
    Of the last frame: 'substeps', 'contacts', 'deepest_contact', 'least_volume_ratio' and more.

Warns
-----
FiligreeWarning
    Of any of the frames: a motion was not finite or had to be limited, or cells were inside out at the end.
)")
        .def("inverted", &inverted, py::arg("body"), R"(inverted(self, body)
--

Cells of a body of 'fem' or 'springs' that are inside out now.

Returns
-------
dict
    'count', 'least' (the smallest volume of a cell, as a part of that at rest) and 'place' (of that cell, m, float64 (3,)).
)")
        .def_property_readonly(
            "frame", [](PySimulation& self) { return self.alone([&] { return self.simulation.frame(); }); },
            "Frames done.")
        .def_property_readonly(
            "time", [](PySimulation& self) { return self.alone([&] { return self.simulation.time(); }); },
            "Seconds done.")
        .def_property_readonly(
            "bodies", [](PySimulation& self) { return self.alone([&] { return self.bodies; }); },
            "A list of Body, by number; None of one that was removed.")
        .def(
            "why_rigid",
            [](PySimulation& self, std::size_t body) {
                self.checked(body);
                return self.alone([&] { return self.simulation.why_rigid(body); });
            },
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

Give a body's particles other velocities: array_like (p, 3), m/s. Errors: see `set_positions`.
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
    No such body, another number of particles, numbers that are not finite.
)")
        .def(
            "set_follow",
            [](PySimulation& self, std::size_t body, const py::object& frequency, const py::object& positions,
               const py::object& velocities, const py::object& damping, const py::object& leash, double leash_frequency,
               double most_acceleration, const py::object& stretches) {
                Follow follow;
                if (frequency.is_none()) {
                    self.alone([&] { return self.simulation.set_follow(body, {}, {}, {}).value(); });
                    return;
                }
                follow.frequency = numbers_of(frequency, "frequency");
                follow.damping = numbers_of(damping, "damping");
                if (!leash.is_none()) follow.leash = numbers_of(leash, "leash");
                follow.leash_frequency = leash_frequency;
                follow.most_acceleration = most_acceleration;
                if (positions.is_none() || velocities.is_none())
                    refuse("positions and velocities have to say where the targets are now.");
                const Vectors at = vectors_of(positions, "positions"), moving = vectors_of(velocities, "velocities");
                const std::vector<Mat3f> grown = stretches_of(stretches);
                self.alone(
                    [&] { return self.simulation.set_follow(body, std::move(follow), at, moving, grown).value(); });
            },
            py::arg("body"), py::arg("frequency"), py::arg("positions") = py::none(),
            py::arg("velocities") = py::none(), py::kw_only(), py::arg("damping") = 3.0, py::arg("leash") = py::none(),
            py::arg("leash_frequency") = 20.0, py::arg("most_acceleration") = 100.0, py::arg("stretches") = py::none(),
            R"(set_follow(self, body, frequency, positions=None, velocities=None, *, damping=3.0, leash=None, leash_frequency=20.0, most_acceleration=100.0, stretches=None)
--

Let a body's particles follow targets, from now on; `set_targets` says where these go.

Parameters
----------
body : int
frequency : array_like, (p,), or None
    Hz, of the spring of each particle; 0: none, inf: the particle is held. None lets the body go.
positions, velocities : array_like, (p, 3)
    Where the targets are now, world, m, and how they move, m/s.
damping : float or array_like, (p,)
    1/s, of speed beside the target.
leash : float or array_like, (p,), optional
    m: further away than this the spring is stiffer; inf: no leash. None: two spacings.
leash_frequency : float
    Hz, of the spring from twice the leash on.
most_acceleration : float
    m/s^2: particles feel no more of their target's acceleration.
stretches : array_like, (p, 3, 3), optional
    As those of `set_targets`, now.

Raises
------
UsageError
    No such body, one that is rigid, breaks or is of mpm, another number of particles, numbers out of range.
)")
        .def(
            "set_targets",
            [](PySimulation& self, std::size_t body, const py::object& positions, const py::object& velocities,
               const py::object& accelerations, const py::object& stretches) {
                const Vectors at = vectors_of(positions, "positions"), moving = vectors_of(velocities, "velocities");
                const Vectors felt = accelerations.is_none() ? Vectors() : vectors_of(accelerations, "accelerations");
                const std::vector<Mat3f> grown = stretches_of(stretches);
                self.alone([&] { return self.simulation.set_targets(body, at, moving, felt, grown).value(); });
            },
            py::arg("body"), py::arg("positions"), py::arg("velocities"), py::arg("accelerations") = py::none(),
            py::arg("stretches") = py::none(),
            R"(set_targets(self, body, positions, velocities, accelerations=None, stretches=None)
--

Where the targets of a body that follows are at the end of the next frame. Without this call they stop.

Parameters
----------
body : int
positions, velocities : array_like, (p, 3)
    World, m, and m/s, as `target_velocities` makes them.
accelerations : array_like, (p, 3), optional
    m/s^2, what particles feel during the frame beside gravity.
stretches : array_like, (p, 3, 3), optional
    Rest shapes of the matter at the particles at the end of the frame: symmetric matrices relative to the body at rest
    (1.5 times the identity: half as large again). For bodies of fem that do not yield. None: as at rest.

Raises
------
UsageError
    No such body, one that does not follow, another number of particles, numbers that are not finite.
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
                return named_result("Momentum", array_of(momentum.linear), array_of(momentum.angular));
            },
            R"(momentum(self)
--

Linear, kg m/s, and angular about the world's origin, kg m^2/s: two arrays of float64 (3,).
)")
        .def(
            "save", [](PySimulation& self) { return py::bytes(self.alone([&] { return self.simulation.save(); })); },
            R"(save(self)
--

Everything that moves, as bytes; obstacles that were set, too. Hands and forces that were set are no part of it. It goes
on only with the bodies, the world and the options that it was saved with: the same bodies have to have come and gone.
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
    Of other bodies: also where some were added or removed since.
)");
    add_changes(simulation);
}

} // namespace filigree::python
