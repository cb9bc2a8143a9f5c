"""Bodies step by step: forces of one's own, pins, hands, saved states."""

import concurrent.futures
import warnings

import numpy
import pytest

import filigree
from conftest import same

BAR = filigree.make("bar", resolution=4)


@pytest.fixture(scope="module")
def body():
    return filigree.Body(BAR, "jelly", spacing=0.25)


def test_forces_of_ones_own(body):
    simulation = filigree.Simulation([body], gravity=(0, 0, 0))
    simulation.set_forces(0, body.mass[:, None] * [0, 3.0, 0])
    simulation.step(30)
    linear, _ = simulation.momentum()
    lost = body.material.damping * 0.5
    assert linear[1] == pytest.approx(body.mass.sum() * 1.5, rel=lost)
    simulation.set_forces(0, None)
    before = simulation.momentum()[0][1]
    simulation.step()
    assert simulation.momentum()[0][1] <= before


def test_fields_of_vertices_and_cells():
    stiff = 1 + 4 * (BAR.vertices[:, 0] > 0)
    varied = filigree.Body(BAR, "jelly", spacing=0.25, fields={"stiffness": stiff})
    assert set(varied.fields) == {"stiffness"} and len(varied.cell_centres) == len(varied.fields["stiffness"])
    right = varied.cell_centres[:, 0] > 0
    found = varied.fields["stiffness"]
    assert found[varied.cell_centres[:, 0] > 1.2].min() > 4.8 and found[varied.cell_centres[:, 0] < -1.2].max() < 1.1
    assert found.min() >= 1 and found.max() <= 5
    heavy = varied.with_fields({"density": numpy.where(right, 3, 1)})
    assert heavy.mass.sum() == pytest.approx(2 * varied.report["mass"])
    assert heavy.report["mass"] == pytest.approx(heavy.mass.sum())
    assert same(heavy.fields["stiffness"], varied.fields["stiffness"])
    assert not heavy.with_fields({"density": [], "stiffness": []}).fields
    with pytest.raises(filigree.UsageError, match="has to be one of 'stiffness', 'density'"):
        filigree.Body(BAR, fields={"mass": stiff})
    with pytest.raises(filigree.UsageError, match="give one value a vertex"):
        filigree.Body(BAR, fields={"density": [1, 2]})
    with pytest.raises(filigree.UsageError, match="has 2 values, and the body has"):
        varied.with_fields({"density": [1, 2]})
    with pytest.warns(filigree.FiligreeWarning, match="stiffness varies from 1 to 25"):
        filigree.Body(BAR, "jelly", spacing=0.25, fields={"stiffness": 1 + 6 * (stiff - 1)})


def test_pins_hold_and_move(body):
    held = numpy.flatnonzero(body.rest[:, 0] < body.rest[:, 0].min() + 1e-4)
    motion = filigree.RigidMotion([0, 1], move=[[0, 0, 0], [0, 0.5, 0]])
    simulation = filigree.Simulation([body], pins=[filigree.Pin(0, held, motion)])
    simulation.step(60)
    assert abs(simulation.positions(0)[held] - body.rest[held] - [0, 0.5, 0]).max() < 1e-5


def test_hands_pull(body):
    simulation = filigree.Simulation([body], gravity=(0, 0, 0))
    simulation.set_hands([filigree.Hand(0, (2, 0, 0), (3, 0, 0))])
    simulation.step(90)
    assert simulation.positions(0).mean(0)[0] > 0.3


def test_saved_states_go_on_with_the_same_bytes(body):
    floor = filigree.Obstacle.plane((0, -0.6, 0))
    simulation = filigree.Simulation([body], obstacles=[floor])
    simulation.step(5)
    state = simulation.save()
    wanted = (simulation.step(10), simulation.positions(0))[1]
    for threads in (1, 2):
        other = filigree.Simulation([body], obstacles=[floor], threads=threads)
        other.restore(state)
        other.step(10)
        assert same(other.positions(0), wanted)
    with pytest.raises(filigree.BadFileError):
        simulation.restore(state[:-5])
    assert same(simulation.positions(0), wanted)


def test_what_is_wrong_is_said(body):
    simulation = filigree.Simulation([body])
    for call in (
        lambda: simulation.positions(1),
        lambda: simulation.set_forces(0, numpy.zeros((3, 3))),
        lambda: simulation.set_velocities(2, body.rest),
        lambda: filigree.Simulation([]),
        lambda: filigree.Simulation([body], pins=[filigree.Pin(4, [0])]),
        lambda: filigree.Simulation([body], pins=[filigree.Pin(0, [10**9])]),
        lambda: filigree.Simulation([body], frames_per_second=-1),
        lambda: filigree.Simulation([body], obstacles=[filigree.Obstacle.ball((0, 0, 0), -1)]),
        lambda: simulation.step(0),
    ):
        with pytest.raises(filigree.UsageError):
            call()


def test_actors_and_obstacles(body):
    ball = filigree.Obstacle.mesh(filigree.make("wavy-sphere", resolution=16), friction=0.2)
    moved = filigree.Actor(body, move=(0, 3, 0), axis=(0, 0, 1), degrees=90, velocity=(0, -1, 0), spin=(0, 1, 0))
    simulation = filigree.Simulation([moved], obstacles=[ball, filigree.Obstacle.box((0, -2, 0), (9, 1, 9))])
    assert abs(simulation.positions(0).mean(0) - [0, 3, 0]).max() < 1e-3
    assert simulation.momentum()[0][1] == pytest.approx(-body.mass.sum(), rel=1e-3)
    energy = simulation.energy()
    simulation.step(40)
    assert simulation.energy()["potential"] < energy["potential"]


def test_spin_in_degrees_and_radians(body):
    def momentum(**how):
        return filigree.Simulation([filigree.Actor(body, **how)], gravity=(0, 0, 0)).momentum()[1]

    assert momentum(spin_degrees=(0, 90, 0)) == pytest.approx(momentum(spin=(0, numpy.pi / 2, 0)))
    assert abs(momentum()).max() < 1e-6
    with pytest.raises(filigree.UsageError):
        filigree.Actor(body, spin=(1, 0, 0), spin_degrees=(1, 0, 0))


def test_nothing_that_floats_sleeps():
    still = filigree.Material("stone", damping=0)
    stone = filigree.Body(filigree.make("wavy-cube", resolution=8), still, particles=100)
    adrift = filigree.Simulation([stone], gravity=(0, -0.005, 0))
    adrift.step(180)
    assert adrift.positions(0)[:, 1].mean() - stone.rest[:, 1].mean() == pytest.approx(-0.5 * 0.005 * 9, rel=0.02)
    floor = filigree.Obstacle.plane((0, float(stone.rest[:, 1].min()) - 0.05, 0))
    for may_sleep in (True, False):
        lies = filigree.Simulation([filigree.Actor(stone, may_sleep=may_sleep)], obstacles=[floor])
        lies.step(300)
        assert (abs(lies.velocities(0)).max() == 0) == may_sleep


def test_states_of_other_options_are_refused(body):
    floor = filigree.Obstacle.plane((0, -0.6, 0))
    state = filigree.Simulation([body], obstacles=[floor])
    state.step(3)
    for other in (
        filigree.Simulation([body], obstacles=[floor], contacts_within_bodies=False),
        filigree.Simulation([body], obstacles=[floor], frames_per_second=30),
        filigree.Simulation([body]),
    ):
        with pytest.raises(filigree.MismatchError):
            other.restore(state.save())
        other.step(2)


def test_forces_without_particles_push_the_whole_body(body):
    pushed = filigree.Simulation([body], gravity=(0, 0, 0), forces=[filigree.Force(0, (10, 0, 0))])
    pushed.step(10)
    damped = 1 - 0.5 * body.material.damping * pushed.time
    assert pushed.momentum()[0][0] == pytest.approx(10 * pushed.time * damped, rel=0.01)


def test_the_clock_may_be_read_while_it_runs(body):
    runs = filigree.Simulation([body])
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        steps = [pool.submit(runs.step) for _ in range(10)]
        seen = [runs.frame for _ in range(50)]
        assert seen == sorted(seen)
        for done in steps:
            done.result()
    assert runs.frame == 10 and len(runs.bodies) == 1


def test_matter_melts():
    wax = filigree.Material("wax", temperature=310)
    block = filigree.make("bar", resolution=2, length=1, size=0.2)
    body = filigree.Body(block, wax, particles=200)
    lamp = filigree.HeatSource((0, 0, 0), 1, 2e6)
    floor = filigree.Obstacle.plane((0, -0.2, 0), temperature=350, heat_transfer=100)
    simulation = filigree.Simulation([body], obstacles=[floor], heat_sources=[lamp])
    heat, cold = simulation.heat(), simulation.matter(0)
    assert len(cold["positions"]) == len(body) and cold["liquid"].max() == 0 and abs(cold["temperatures"] - 310).max() < 1
    points = simulation.attach(0, block.vertices)
    simulation.step(20)
    warm = simulation.matter(0)
    assert simulation.heat() > heat and warm["temperatures"].min() > 311 and warm["liquid"].mean() > 0.1
    assert len(points.renewal()) == len(block.vertices)


MELTING = """[simulation]
frames = 6
frames_per_second = 30
[[body]]
shape = "wavy-cube"
resolution = 8
material = "ice"
particles = 300
centre = [0, 0.55, 0]
temperature = 272.9
[[obstacle]]
shape = "ground"
temperature = [{ time = 0, value = 300 }, { time = 0.1, value = 900 }]
heat_transfer = 1e6
"""


def test_what_melts_is_one_surface(tmp_path):
    path = tmp_path / "melt.toml"
    path.write_text(MELTING)
    scene = filigree.SceneRun(path)
    with pytest.raises(filigree.UsageError):
        scene.melting_mesh(1)
    scene.step(6)
    start = scene.melting_mesh(0)
    assert abs(start.vertices - scene.mesh(0, 0).vertices).max() < 1e-6
    assert (start.scalars["origin"] == numpy.arange(len(start.vertices))).all()
    later = scene.melting_mesh(6)
    assert filigree.info(later)["closed"] and filigree.info(later)["manifold"]
    scene.melting_mesh(2)
    assert same(scene.melting_mesh(6).vertices, later.vertices)  # whatever was asked for before
    path.write_text(MELTING.replace('"ice"', '"rubber"').replace("temperature = 272.9\n", ""))
    with pytest.raises(filigree.UsageError, match="No body of the scene melts"):
        filigree.SceneRun(path).melting_mesh(0)


def test_temperatures_may_have_keys():
    body = filigree.Body(filigree.make("wavy-cube", resolution=8), "wax", particles=200)
    keys = ([0.0, 0.2], [293.0, 800.0])
    floor = filigree.Obstacle.plane((0, -0.6, 0), temperature=keys, heat_transfer=1e5)
    steady = filigree.Obstacle.plane((0, -0.6, 0), heat_transfer=1e5)
    heats = []
    for obstacle, air in ((floor, 293.0), (steady, keys), (steady, 293.0)):
        simulation = filigree.Simulation([body], obstacles=[obstacle], air_temperature=air, air_heat_transfer=1e4)
        before = simulation.heat()
        simulation.step(15)
        heats.append(simulation.heat() - before)
    assert heats[1] > heats[2] and abs(heats[2]) < 0.1 * heats[1]
    for wrong in (([0, 1], [293]), ([], []), (1, 2, 3)):
        with pytest.raises(filigree.UsageError):
            filigree.Obstacle.plane(temperature=wrong)


def test_points_of_the_view_and_the_patches_corners():
    ball = filigree.make("wavy-sphere", resolution=24)
    points = filigree.sample(ball, frustum=(20, 20, 20), method="rays")
    assert 500 < len(points) < 8000 and filigree.contains(ball, points).all()
    assert not same(points, filigree.sample(ball, frustum=(20, 20, 20), eye=(5, 0, 0), method="rays"))
    with pytest.raises(filigree.UsageError):
        filigree.sample(ball, frustum=(20, 20, 20), count=5)
    quads, report = filigree.remesh(ball, 2000)
    assert len(report["base"].faces) == report["patches"] and len(quads.faces) == report["quads"]


def test_air_and_heat_sources_change_while_it_runs():
    block = filigree.make("wavy-cube", resolution=8)
    simulation = filigree.Simulation([filigree.Body(block, "wax", particles=200)], gravity=(0, 0, 0))
    simulation.step(2)
    heat = simulation.heat()
    simulation.step(2)
    assert abs(simulation.heat() - heat) < 1e-4 * heat  # nothing warms it yet
    simulation.set_air(500, 1e5)
    simulation.step(2)
    warm = simulation.heat()
    assert warm > 1.001 * heat
    simulation.set_air(293, 0)
    simulation.set_heat_sources([filigree.HeatSource((0, 0, 0), 1, -1e6)])
    simulation.step(2)
    cooled = simulation.heat()
    assert cooled < warm
    simulation.set_heat_sources([])
    simulation.step(2)
    assert abs(simulation.heat() - cooled) < 1e-4 * cooled
    for wrong in (-1, 0, float("nan")):
        with pytest.raises(filigree.UsageError, match="air_temperature"):
            simulation.set_air(wrong, 1)
    with pytest.raises(filigree.UsageError, match=r"heat_sources\[0\]"):
        simulation.set_heat_sources([filigree.HeatSource((0, 0, 0), -1, 1)])


def test_forces_hands_and_warnings_of_mpm():
    wax = filigree.Body(BAR, filigree.Material("wax", temperature=290), particles=300)
    simulation = filigree.Simulation([wax], gravity=(0, 0, 0))
    simulation.set_forces(0, wax.mass[:, None] * [0, 3.0, 0])
    simulation.step(10)
    assert simulation.momentum()[0][1] == pytest.approx(wax.mass.sum() * 0.5, rel=0.05)
    simulation.set_forces(0, None)
    simulation.set_hands([filigree.Hand(0, (2, 0, 0), (2, -1, 0))])
    simulation.step(10)
    assert simulation.momentum()[0][1] < wax.mass.sum() * 0.5
    with pytest.warns(filigree.FiligreeWarning, match="pass through bodies of other models"):
        filigree.Simulation([wax, filigree.Body(BAR, "jelly", spacing=0.25)])
    with pytest.warns(filigree.FiligreeWarning, match="obstacle 0 is 0.002 m wide"):
        filigree.Simulation([wax], obstacles=[filigree.Obstacle.box((0, -2, 0), (0.002, 0.002, 4))])


def said_by(work):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = work()
    return result, [str(warning.message) for warning in caught if issubclass(warning.category, filigree.FiligreeWarning)]


def test_a_mode_of_older_versions_is_taken_with_a_warning():
    body = filigree.Body(BAR, "jelly", particles=100, size=0.2)
    with pytest.warns(filigree.FiligreeWarning, match="mode 'descent' is a word of older versions"):
        old = filigree.Simulation([body], mode="descent")
    new = filigree.Simulation([body], mode="auto")
    old.step(), new.step()
    assert (numpy.asarray(old.positions(0)) == numpy.asarray(new.positions(0))).all()
    with pytest.raises(filigree.UsageError, match="'auto', 'explicit'"):
        filigree.Simulation([body], mode="implicit")


def test_a_body_has_a_size_or_a_scale():
    body = filigree.Body(BAR, "rubber", size=0.8, particles=100)
    assert body.scale == pytest.approx(0.8 / 4)
    with pytest.raises(filigree.UsageError, match="scale or size, not both"):
        filigree.Body(BAR, size=1, scale=2)
    for size in (0, -1, float("nan")):
        with pytest.raises(filigree.UsageError, match="above 0"):
            filigree.Body(BAR, size=size)


def test_a_body_that_cannot_carry_itself_is_told():
    large, small = (filigree.Body(BAR, "jelly", particles=100, size=size) for size in (20, 0.4))
    assert said_by(lambda: filigree.Simulation([small]))[1] == []
    (sentence,) = said_by(lambda: filigree.Simulation([small, large]))[1]
    assert sentence.startswith("Body 1 is 5 m high and weighs") and "cannot carry itself: scale = " in sentence
    assert said_by(lambda: filigree.Simulation([large], gravity=(0, 0, 0)))[1] == []


def test_parts_that_are_joined_are_told():
    vertices, faces = [], []
    for low, high in (((0, 0, 0), (2, 0.2, 0.2)), ((0, 0.23, 0), (2, 0.43, 0.2)), ((-0.3, 0, 0), (0.05, 0.43, 0.2))):
        corners = numpy.array([[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)])
        quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
        faces += [tuple(corner + len(vertices) for corner in quad) for quad in quads]
        vertices += corners.tolist()
    fork = filigree.Mesh(vertices, faces)
    body, said = said_by(lambda: filigree.Body(fork, "jelly", spacing=0.05))
    assert "move as one" in said[0] and body.report["joined_corners"] > 40
    assert said_by(lambda: filigree.Body(fork, "jelly", spacing=0.014))[1] == []


def test_frames_that_went_wrong_are_told(body):
    simulation = filigree.Simulation([body], gravity=(0, 0, 0))
    assert said_by(lambda: simulation.step(3))[1] == []
    assert simulation.inverted(0)["count"] == 0 and simulation.inverted(0)["least"] == pytest.approx(1, abs=0.01)
    simulation.set_positions(0, simulation.positions(0) * [-1, 1, 1])
    assert simulation.inverted(0)["count"] == body.report["cells"]
    assert simulation.inverted(0)["least"] == pytest.approx(-1, abs=0.01)
    _, said = said_by(simulation.step)
    assert any("are inside out, the worst near (" in sentence or "had to be limited" in sentence for sentence in said)


def test_a_scene_that_went_wrong_is_told(tmp_path):
    path = tmp_path / "sunk.toml"
    path.write_text(
        '[[body]]\nname = "cube"\nshape = "wavy-cube"\nresolution = 8\nparticles = 200\ndriver = 60\n'
        '[[obstacle]]\nshape = "ground"\n'
    )
    run, said = said_by(lambda: filigree.SceneRun(path))
    assert said == [] and run.doubt is None
    _, said = said_by(lambda: run.step(4))
    assert said[-1] == run.doubt and "energy came from nowhere" in run.doubt
    assert any("frame 1 " in sentence and "'cube'" in sentence for sentence in said)
    assert said_by(lambda: run.step(2))[1] == [], "once"


def test_open_sheets_hold_from_both_sides(body):
    sheet = filigree.Mesh([[-9, 0, -9], [9, 0, -9], [9, 0, 9], [-9, 0, 9]], [[0, 1, 2, 3]])
    for side in (1, -1):
        thrown = filigree.Actor(body, move=(0, 2 * side, 0), velocity=(0, -20 * side, 0))
        simulation = filigree.Simulation([thrown], gravity=(0, 0, 0), obstacles=[filigree.Obstacle.mesh(sheet)])
        simulation.step(20)
        assert simulation.positions(0).mean(0)[1] * side > 0


def test_a_start_inside_an_obstacle_is_told(body):
    room = filigree.Obstacle.mesh(filigree.make("wavy-cube"), scale=20)
    with pytest.warns(filigree.FiligreeWarning, match="body 0 starts inside obstacle 0, which is a room for it"):
        filigree.Simulation([body], obstacles=[room])
    with pytest.warns(filigree.FiligreeWarning, match="deep in obstacle 0 and is pushed out at once"):
        filigree.Simulation([body], obstacles=[filigree.Obstacle.plane((0, 0, 0))])


def test_a_mode_that_is_not_there_is_refused(body):
    with pytest.raises(filigree.UsageError, match="mode"):
        filigree.Simulation([body], mode="implicit")


STONE = filigree.Material("stone")


def crate(size=0.2):
    return filigree.Body(filigree.make("wavy-cube", resolution=8), STONE, particles=64, size=size)


def test_bodies_come_and_go(body):
    floor = filigree.Obstacle.plane((0, 0, 0))
    simulation = filigree.Simulation([crate()], obstacles=[floor], gravity=(0, -9.81, 0))
    assert simulation.add_body(filigree.Actor(crate(), move=(2, 1, 0), velocity=(0, 0, 1))) == 1
    assert simulation.add_body(body) == 2
    simulation.step(10)
    assert len(simulation.bodies) == 3 and simulation.bodies[1].mass.sum() > 0
    points = simulation.attach(1, [[0, 0, 0]])
    simulation.remove_body(1)
    assert simulation.bodies[1] is None
    assert not simulation.has_body(1) and simulation.has_body(2) and not simulation.has_body(7)
    for ask in (
        lambda: simulation.positions(1),
        lambda: simulation.velocities(1),
        lambda: simulation.set_positions(1, [[0, 0, 0]]),
        lambda: simulation.set_forces(1, None),
        lambda: simulation.inverted(1),
        lambda: simulation.matter(1),
        lambda: simulation.attach(1, [[0, 0, 0]]),
        lambda: simulation.why_rigid(1),
        lambda: simulation.is_asleep(1),
        lambda: simulation.wake(1),
        lambda: simulation.remove_body(1),
        lambda: simulation.set_hands([filigree.Hand(1, (0, 0, 0), (1, 1, 1))]),
    ):
        with pytest.raises(filigree.UsageError, match="Body 1 was removed"):
            ask()
    with pytest.raises(filigree.UsageError, match="body that these points went along with was removed"):
        points.pose()
    with pytest.raises(filigree.UsageError, match="There is no body 9; there are 3, counted from 0"):
        simulation.remove_body(9)
    assert simulation.add_body(crate()) == 3
    simulation.step(5)
    with pytest.raises(TypeError, match="Body or filigree.Actor"):
        simulation.add_body("stone")


def test_a_body_that_comes_is_as_one_that_was_there(body):
    floor = filigree.Obstacle.plane((0, -1, 0))
    later = filigree.Actor(body, move=(0.1, 1.5, 0))
    whole = filigree.Simulation([body, later], obstacles=[floor])
    grown = filigree.Simulation([body], obstacles=[floor], threads=2)
    grown.add_body(later)
    whole.step(20)
    grown.step(20)
    assert same(whole.positions(1), grown.positions(1))
    other = filigree.Simulation([body], obstacles=[floor])
    with pytest.raises(filigree.MismatchError, match="some were added or removed"):
        other.restore(grown.save())


def test_a_body_that_comes_is_told_of():
    simulation = filigree.Simulation([crate()], obstacles=[filigree.Obstacle.plane((0, -2, 0))])
    soft = filigree.Body(filigree.make("wavy-cube", resolution=8), "jelly", particles=500, size=8.0)
    _, said = said_by(lambda: simulation.add_body(soft))
    assert any("Body 1 " in sentence for sentence in said)
    assert any("body 1 starts up to" in sentence for sentence in said)


def test_obstacles_are_set_and_moved():
    table = filigree.Obstacle.box((0, -0.1, 0), (2, 0.2, 2), friction=1)
    simulation = filigree.Simulation([filigree.Actor(crate(), move=(0, 0.1, 0))], obstacles=[table])
    simulation.step(20)
    start = simulation.positions(0).mean(0)
    for frame in range(30):
        simulation.move_obstacle(0, move=((frame + 1) / 60, 0, 0))
        simulation.step()
    assert simulation.positions(0).mean(0)[0] - start[0] == pytest.approx(0.5, abs=0.05)
    assert simulation.obstacle_pose(0)[:3, 3] == pytest.approx([0.5, 0, 0])
    simulation.set_obstacle(0, move=(0, -3, 0), axis=(0, 0, 1), degrees=30, spin_degrees=(0, 0, 60))
    pose = simulation.obstacle_pose(0)
    assert pose @ [0, -0.1, 0, 1] == pytest.approx([0, -3.1, 0, 1])
    simulation.step(30)
    turned = simulation.obstacle_pose(0)
    assert turned @ [0, -0.1, 0, 1] == pytest.approx([0, -3.1, 0, 1])
    assert numpy.degrees(numpy.arctan2(turned[1, 0], turned[0, 0])) == pytest.approx(60)
    simulation.set_obstacle(0, matrix=pose)
    assert simulation.obstacle_pose(0) == pytest.approx(pose)
    with pytest.raises(filigree.UsageError, match="There is no obstacle 1"):
        simulation.set_obstacle(1)
    with pytest.raises(filigree.UsageError, match="There is no obstacle 1"):
        simulation.obstacle_pose(1)
    with pytest.raises(filigree.UsageError, match=r"shape \(4, 4\)"):
        simulation.set_obstacle(0, matrix=[[1, 0], [0, 1]])
    with pytest.raises(filigree.UsageError, match="pose must be a turn and a shift"):
        simulation.move_obstacle(0, matrix=numpy.diag([2.0, 1, 1, 1]))


def test_contact_events_say_how_hard():
    floor = filigree.Obstacle.plane((0, 0, 0))
    falls = filigree.Actor(crate(), move=(0, 0.15, 0), velocity=(0, -3, 0))
    simulation = filigree.Simulation([falls], obstacles=[floor])
    mass = simulation.bodies[0].mass.sum()
    kinds, impulse = [], 0
    for _ in range(20):
        simulation.step()
        for event in simulation.contact_events():
            assert event["body"] == 0 and event["obstacle"] == 0 and event["other"] is None
            assert event["normal"] == pytest.approx([0, 1, 0], abs=1e-3)
            if event["kind"] == "began" and not kinds:
                assert event["speed"] == pytest.approx(3.1, abs=0.3)
                assert event["place"][1] == pytest.approx(0, abs=0.03)
            kinds.append(event["kind"])
            impulse += event["impulse"]
    assert kinds[0] == "began" and "ended" in kinds
    gained = simulation.momentum()[0][1] + 3 * mass + mass * 9.81 * 20 / 60
    assert impulse == pytest.approx(gained, rel=0.03)


def test_rays_meet_what_is_first(body):
    floor = filigree.Obstacle.plane((0, -1, 0))
    simulation = filigree.Simulation([body], obstacles=[floor])
    hit = simulation.cast_ray((0, 3, 0), (0, -2, 0))
    assert hit["body"] == 0 and hit["obstacle"] is None
    assert hit["place"] == pytest.approx(hit["rest"], abs=1e-3)
    assert hit["distance"] == pytest.approx(3 - hit["place"][1])
    assert hit["normal"][1] > 0.7
    below = simulation.cast_ray((0, 3, 0), (0, -1, 0), ignore=0)
    assert below["body"] is None and below["obstacle"] == 0 and below["rest"] is None
    assert below["distance"] == pytest.approx(4)
    assert simulation.cast_ray((0, 3, 0), (0, -1, 0), reach=1) is None
    assert simulation.cast_ray((0, 3, 0), (0, 1, 0)) is None
    with pytest.raises(filigree.UsageError, match="direction has no length"):
        simulation.cast_ray((0, 0, 0), (0, 0, 0))


def test_sleep_is_switched():
    floor = filigree.Obstacle.plane((0, -0.1, 0))
    simulation = filigree.Simulation([crate(), filigree.Actor(crate(), move=(1, 0, 0))], obstacles=[floor])
    simulation.set_may_sleep(1, False)
    simulation.step(150)
    assert simulation.is_asleep(0) and not simulation.is_asleep(1)
    simulation.wake(0)
    assert not simulation.is_asleep(0)
