"""Whatever form numbers come in, the bytes that come out are those of the plain form; or the error is clear."""

import os
import warnings

import numpy
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import filigree
from conftest import same, same_mesh
from strange_arrays import forms_of, strange_things

# scripts/python-fuzz asks for more.
CASES = int(os.environ.get("FILIGREE_CASES", 80))
often = settings(max_examples=CASES, deadline=None, suppress_health_check=list(HealthCheck), database=None)

FLOATS, INTEGERS = ["f2", "f4", "f8", "g"], ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"]
CUBE = filigree.make("wavy-cube", resolution=3, amplitude=0)
# Whole numbers and eighths: all dtypes hold them.
VERTICES = numpy.round(8 * CUBE.vertices) / 8
WHOLE = numpy.round(3 * CUBE.vertices + 4)
FACES = numpy.array(CUBE.faces)
MODEL = filigree.strip(filigree.make("wavy-sphere", resolution=8), base=20)
RESTORER = filigree.Restorer(MODEL)
MOVED = numpy.round(16 * filigree.twist(MODEL, "z", 50)(MODEL).positions) / 16
GRADIENTS = numpy.round(16 * filigree.twist(MODEL, "z", 50)(MODEL).gradients) / 16
SPARE = numpy.zeros((len(RESTORER), 3), "f4")

CLEAR = (filigree.Error, TypeError)


@often
@given(st.data())
def test_meshes(data):
    whole = data.draw(st.booleans())
    vertices = data.draw(forms_of(WHOLE if whole else VERTICES, FLOATS + (INTEGERS if whole else [])))
    faces = data.draw(forms_of(FACES, INTEGERS))
    assert same_mesh(filigree.Mesh(vertices, faces), filigree.Mesh(WHOLE if whole else VERTICES, FACES))


@often
@given(st.data())
def test_faces_of_all_sizes(data):
    flat = filigree.Mesh(VERTICES, data.draw(forms_of(FACES.ravel(), INTEGERS)), data.draw(forms_of(numpy.arange(0, FACES.size + 1, 4), ["u1", "i2", "u4", "i8"])))
    assert same_mesh(flat, filigree.Mesh(VERTICES, FACES))


@often
@given(st.data())
def test_poses(data):
    positions, gradients = data.draw(forms_of(MOVED, FLOATS)), data.draw(forms_of(GRADIENTS, FLOATS))
    with_gradients = data.draw(st.booleans())
    wanted = RESTORER.positions(MOVED, GRADIENTS if with_gradients else None)
    found = RESTORER.positions(positions, gradients if with_gradients else None)
    assert same(found, wanted)
    pose = filigree.Pose(positions, gradients)
    assert same(pose.positions, MOVED.astype("f4")) and numpy.array_equal(pose.gradients, GRADIENTS)


@often
@given(st.data())
def test_out(data):
    """An array that cannot be written in place is refused, and what can be is written."""
    count = len(RESTORER)
    kind = data.draw(st.sampled_from(["f4", "f8", ">f4", "i4"]))
    shape = data.draw(st.sampled_from([(count, 3), (3 * count,), (count + 1, 3), (count, 4), (3, count), (0, 3)]))
    out = numpy.zeros(shape, kind, order=data.draw(st.sampled_from("CF")))
    if data.draw(st.booleans()):
        out = out[::-1] if data.draw(st.booleans()) else numpy.zeros((2 * shape[0],) + shape[1:], kind)[::2]
    out.flags.writeable = data.draw(st.booleans())
    before = out.copy()
    fits = kind == "f4" and shape in ((count, 3), (3 * count,)) and out.flags.c_contiguous and out.flags.writeable
    if fits:
        assert RESTORER.positions(MOVED, out=out) is out
        assert out.tobytes() == RESTORER.positions(MOVED).tobytes()
    else:
        with pytest.raises(filigree.UsageError, match="out has to be"):
            RESTORER.positions(MOVED, out=out)
        assert out.tobytes() == before.tobytes()


@often
@given(st.data())
def test_views_are_read_only_and_keep_their_owner(data):
    name = data.draw(st.sampled_from(["vertices", "corners", "face_offsets", "faces"]))
    array = getattr(filigree.Mesh(VERTICES, FACES), name)
    assert not array.flags.writeable and array.sum() == getattr(CUBE if name != "vertices" else filigree.Mesh(VERTICES), name).sum()
    with pytest.raises(ValueError):
        array[0] = 0
    with pytest.raises(ValueError):
        array.flags.writeable = True


CALLS = {
    "Mesh": lambda x: filigree.Mesh(x, FACES),
    "faces": lambda x: filigree.Mesh(VERTICES, x),
    "face_offsets": lambda x: filigree.Mesh(VERTICES, FACES.ravel(), x),
    "normals": lambda x: filigree.Mesh(VERTICES, FACES, normals=x),
    "normal_corners": lambda x: filigree.Mesh(VERTICES, FACES, normals=VERTICES, normal_corners=x),
    "uvs": lambda x: filigree.Mesh(VERTICES, FACES, uvs=x),
    "colors": lambda x: filigree.Mesh(VERTICES, FACES, colors=x),
    "scalars": lambda x: filigree.Mesh(VERTICES, FACES, scalars={"a": x}),
    "with_vertices": lambda x: CUBE.with_vertices(x),
    "Pose": lambda x: filigree.Pose(x),
    "Pose.gradients": lambda x: filigree.Pose(MOVED, x),
    "PoseSequence": lambda x: filigree.PoseSequence(x),
    "positions": lambda x: RESTORER.positions(x),
    "positions with gradients": lambda x: RESTORER.positions(MOVED, x),
    "out": lambda x: RESTORER.positions(MOVED, out=x),
    "restore": lambda x: filigree.restore(MODEL, x),
    "expected_error": lambda x: filigree.expected_error(MODEL, x),
    "bend": lambda x: filigree.bend(x, "x", 10),
    "warp": lambda x: filigree.bend(CUBE, "x", 10)(x),
    "unwarp": lambda x: filigree.bend(CUBE, "x", 10).unwarp(x),
    "rbf": lambda x: filigree.rbf(x, x),
    "HandleSolver": lambda x: filigree.HandleSolver(CUBE, x),
    "solve": lambda x: filigree.HandleSolver(CUBE, [0, 1]).solve(x, iterations=1),
    "contains": lambda x: filigree.contains(CUBE, x),
    "sample": lambda x: filigree.sample(CUBE, spacing=0.3, origin=x),
    "fracture": lambda x: filigree.fracture(CUBE, 2, at=x, pattern="impact", roughness=0),
    "strip": lambda x: filigree.strip(x),
    "info": lambda x: filigree.info(x),
    "compare": lambda x: filigree.compare(CUBE, x, samples=10),
    "Body": lambda x: filigree.Body(x, particles=10),
    "particles_near": lambda x: BODY.particles_near(x),
    "Simulation": lambda x: filigree.Simulation([BODY], gravity=x),
    "bodies": lambda x: filigree.Simulation(x),
    "Pin": lambda x: filigree.Simulation([BODY], pins=[filigree.Pin(0, x)]),
    "Force": lambda x: filigree.Simulation([BODY], forces=[filigree.Force(0, x)]),
    "RigidMotion": lambda x: filigree.RigidMotion(x, move=x),
    "Hand": lambda x: filigree.Hand(0, x, x),
    "set_forces": lambda x: SIMULATION.set_forces(0, x),
    "set_follow": lambda x: filigree.Simulation([BODY], automatic_rigid=False).set_follow(0, x, BODY.rest, BODY.rest),
    "target_velocities": lambda x: filigree.target_velocities(x, x, x, 60),
    "set_positions": lambda x: filigree.Simulation([BODY]).set_positions(0, x),
    "attach": lambda x: filigree.Simulation([BODY]).attach(0, x).pose(),
    "chain": lambda x: filigree.chain(x),
    "HandleRegion": lambda x: filigree.HandleRegion(sphere=x),
    "Material": lambda x: filigree.Material("jelly", density=x),
    "restore state": lambda x: SIMULATION.restore(x),
    "frombytes": lambda x: filigree.Model.frombytes(x),
    "write_picture": lambda x: filigree.write_picture(x, "/nowhere/at/all.png"),
    "write_animation": lambda x: filigree.write_animation(CUBE, x, "/nowhere/at/all.pc2"),
    "read_mesh": lambda x: filigree.read_mesh(x),
    "closest_points": lambda x: filigree.closest_points(CUBE, x),
    "closest_points of": lambda x: filigree.closest_points(x, VERTICES),
    "pair": lambda x: filigree.areas((VERTICES, x)),
    "pair of": lambda x: filigree.areas((x, FACES)),
    "signed_distance": lambda x: filigree.signed_distance(CUBE, x),
    "winding_numbers": lambda x: filigree.winding_numbers(CUBE, x),
    "boundary": lambda x: filigree.boundary(x),
    "split": lambda x: filigree.split(x),
    "concatenate": lambda x: filigree.concatenate([CUBE, x]),
    "adjacency": lambda x: filigree.adjacency(x),
    "axis": lambda x: filigree.twist(CUBE, x, 10),
    "radians": lambda x: filigree.bend(CUBE, "x", radians=x),
    "Warp": lambda x: filigree.Warp(x),
    "Warp of what returns": lambda x: filigree.Warp(lambda points: x)(VERTICES),
    "Warp.gradient": lambda x: filigree.Warp(lambda points: points, lambda points: x).warp(VERTICES),
    "adjoint": lambda x: RESTORER.adjoint(x),
    "adjoint at": lambda x: RESTORER.adjoint(SPARE, x),
    "from_stacked": lambda x: filigree.Pose.from_stacked(x),
    "matrix": lambda x: RESTORER.matrix() @ x,
    "prolongation": lambda x: MODEL.prolongation(x),
    "energies": lambda x: BODY.energies(x),
    "forces": lambda x: BODY.forces(x),
    "hessian_product": lambda x: BODY.hessian_product(BODY.rest, x),
    "stiffness_matrix": lambda x: BODY.stiffness_matrix(x),
    "interpolation": lambda x: BODY.interpolation(x),
    "plot": lambda x: filigree.plot(x),
    "plot scalars": lambda x: filigree.plot(CUBE, scalars=x),
    "plot color": lambda x: filigree.plot(CUBE, color=x),
}
BODY = filigree.Body(CUBE, "jelly", particles=30)
SIMULATION = filigree.Simulation([BODY])


@settings(often, max_examples=8 * CASES)
@given(st.sampled_from(sorted(CALLS)), strange_things(len(CUBE.vertices)))
def test_strange_things_are_refused_clearly(name, thing):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            CALLS[name](thing)
        except CLEAR as error:
            assert str(error)
