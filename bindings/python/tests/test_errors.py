"""One class an error code, each also its built-in twin, with the library's sentence."""

import numpy
import pytest

import filigree
from conftest import same_mesh

TWINS = {
    "UsageError": (2, ValueError),
    "NotFoundError": (3, FileNotFoundError),
    "BadFileError": (4, ValueError),
    "UnsupportedError": (5, NotImplementedError),
    "UnwritableError": (6, OSError),
    "UnsuitableError": (7, ValueError),
    "MismatchError": (8, ValueError),
    "OutOfMemoryError": (9, MemoryError),
    "Cancelled": (130, Exception),
}


@pytest.mark.parametrize("name", TWINS)
def test_classes(name):
    kind = getattr(filigree, name)
    code, twin = TWINS[name]
    assert issubclass(kind, filigree.Error) and issubclass(kind, twin) and kind.code == code
    assert kind.__module__ == "filigree" and kind.__doc__


def raises(name, words, call):
    with pytest.raises(getattr(filigree, name), match=words) as caught:
        call()
    assert str(caught.value)[-1] in ".?", caught.value


def test_each_is_raised(tmp_path, mesh, model):
    bad = tmp_path / "bad.ply"
    bad.write_bytes(b"ply\nformat ascii 1.0\nelement vertex 5\nend_header\n")
    raises("UsageError", "base", lambda: filigree.strip(mesh, base=2))
    raises("UsageError", "At most one|one of", lambda: filigree.strip(mesh, base=50, levels=2))
    raises(
        "UsageError",
        "fidelity_from is 'faces'.*'positions', 'gradients'",
        lambda: filigree.strip(mesh, fidelity=1e-3, fidelity_from="faces"),
    )
    raises("UsageError", r"faces\[0\]\[2\] is 9; there are 3", lambda: filigree.Mesh(numpy.eye(3), [[0, 1, 9]]))
    raises("UsageError", r"vertices\[1\] is not finite", lambda: filigree.Mesh([[0, 0, 0], [0, numpy.nan, 0]]))
    raises("UsageError", r"positions\[0\] is not finite", lambda: filigree.restore(model, numpy.full((200, 3), numpy.inf)))
    raises("UsageError", "spacing, count or frustum", lambda: filigree.sample(mesh))
    raises("UsageError", "wood", lambda: filigree.Material("concrete"))
    raises("UsageError", "density", lambda: filigree.Material(density=-1))
    raises("UsageError", "no level 9", lambda: model.level(9))
    raises("NotFoundError", "nothing.obj", lambda: filigree.read_mesh(tmp_path / "nothing.obj"))
    raises("BadFileError", "bad.ply", lambda: filigree.read_mesh(bad))
    raises("BadFileError", "", lambda: filigree.read_model(bad))
    raises("UnsupportedError", "mesh.xyz", lambda: filigree.write_mesh(mesh, "mesh.xyz"))
    raises("UnwritableError", "nowhere", lambda: filigree.write_mesh(mesh, "/nowhere/mesh.ply"))
    raises("UnsuitableError", "", lambda: filigree.strip(filigree.Mesh(numpy.zeros((0, 3)))))
    raises("UnsuitableError", "", lambda: filigree.contains(filigree.make("wavy-plane"), [[0, 0, 0]], method="scan"))
    raises("MismatchError", "driver 200 vertices", lambda: filigree.restore(model, numpy.zeros((7, 3))))
    raises("MismatchError", "gradients", lambda: filigree.Pose(numpy.zeros((7, 3)), numpy.zeros((6, 3, 3))))


def test_sentences_name_no_options_of_the_program(model):
    ends = [filigree.HandleRegion(vertices=[0]), filigree.HandleRegion(sphere=((9, 9, 9), 0.1))]
    with pytest.raises(filigree.UsageError) as caught:
        filigree.move_by_handles(model, ends)
    assert "--" not in str(caught.value)


def test_things_that_are_no_mesh():
    with pytest.raises(TypeError, match="vertices and faces or triangles; this is of type int"):
        filigree.strip(5)
    with pytest.raises(TypeError, match="filigree.Model"):
        filigree.expected_error(5, [[0, 0, 0]])


class Trimesh:
    """As trimesh's: arrays."""

    def __init__(self, mesh):
        self.vertices, self.faces = mesh.vertices.astype("f8"), mesh.triangles.astype("i8")


class Vector3dVector:
    """As Open3D's: a buffer that numpy understands, and no array."""

    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None):
        return numpy.array(self.array, dtype)

    def __len__(self):
        return len(self.array)


class TriangleMesh:
    def __init__(self, mesh):
        self.vertices = Vector3dVector(mesh.vertices.astype("f8"))
        self.triangles = Vector3dVector(mesh.triangles.astype("i4"))


@pytest.mark.parametrize("kind", [Trimesh, TriangleMesh])
def test_meshes_of_others(kind, mesh):
    ours = filigree.Mesh(mesh.vertices, mesh.triangles)
    theirs = kind(mesh)
    assert filigree.strip(theirs, base=100).tobytes() == filigree.strip(ours, base=100).tobytes()
    assert filigree.info(theirs)["triangles"] == len(mesh.triangles)
    assert filigree.compare(theirs, ours, samples=100)["max"] == 0
    assert filigree.contains(theirs, [[0, 0, 0]])[0]


def test_masked_arrays(mesh):
    masked = numpy.ma.array(mesh.vertices, mask=False)
    assert same_mesh(filigree.Mesh(masked, mesh.faces), mesh)
    masked[3] = numpy.ma.masked
    raises("UsageError", "vertices has masked entries", lambda: filigree.Mesh(masked, mesh.faces))
    raises("UsageError", "vertices has masked entries", lambda: filigree.Mesh(masked.astype("f8"), mesh.faces))
    hidden = numpy.ma.array(numpy.zeros((2, 3, 3), "f4"), mask=True)
    raises("UsageError", "gradients has masked entries", lambda: filigree.Pose(numpy.zeros((2, 3)), hidden))


def test_a_body_has_particles_or_a_spacing(mesh):
    raises("UsageError", "particles or spacing", lambda: filigree.Body(mesh, particles=100, spacing=0.1))


def test_parts_of_a_sequence():
    poses = filigree.PoseSequence(numpy.arange(24 * 15, dtype="f4").reshape(24, 5, 3), 24)
    part = poses[20:2:-3]
    assert len(part) == 6 and part.frames_per_second == 24
    assert numpy.array_equal(part.positions, poses.positions[20:2:-3])
    assert len(poses[30:]) == 0
    with pytest.raises(TypeError):
        poses["first"]


def test_faces_that_fit_no_vertices():
    for dtype in ("f4", "f8"):
        corners = numpy.array([[5e5, 0, 0], [5e5 + 1, 0, 0], [5e5, 1, 0]], dtype)
        with pytest.raises(filigree.Error, match="there are 3, counted from 0"):
            filigree.Mesh(corners, [[0, 1, 3_000_000_000]])
        with pytest.raises(filigree.MismatchError, match="3 vertices and was given 2"):
            filigree.Mesh(corners, [[0, 1, 2]]).with_vertices(corners[:2])


@pytest.mark.parametrize("distance", [float("nan"), float("inf"), 1e39])
def test_pieces_go_no_further_than_numbers(mesh, distance):
    with pytest.raises(filigree.UsageError, match="distance"):
        filigree.fracture(mesh, 3).exploded(distance)


def test_drivers_that_are_inside_out_are_named(mesh):
    cage = filigree.make("wavy-sphere", resolution=6, amplitude=0)
    ball = filigree.make("wavy-sphere", resolution=16)
    with pytest.warns(filigree.FiligreeWarning, match="inside out"):
        filigree.strip(ball, driver=filigree.Mesh(cage.vertices, numpy.array(cage.faces)[:, ::-1]))


def test_a_stray_vertex_far_away_takes_no_digits(mesh):
    world = numpy.vstack([mesh.vertices + numpy.array([1e7, 0, 0]), [[0, 0, 0]]])
    for far in (filigree.Mesh(world, mesh.faces), filigree.Mesh(0 * world, mesh.faces).with_vertices(world)):
        assert far.origin[0] > 9e6 and abs(far.world_vertices - world)[:-1].max() < 1e-6


def test_far_from_the_origin_digits_stay(mesh):
    far = filigree.Mesh(mesh.vertices + numpy.array([1e7, 0, 0]), mesh.faces)
    assert far.origin[0] > 9e6 and abs(far.world_vertices - mesh.vertices - [1e7, 0, 0]).max() < 1e-6
    model = filigree.strip(far, base=200)
    world = filigree.Restorer(model).positions(model.driver.vertices, world=True)
    assert world.dtype == "f8" and abs(world - far.world_vertices).max() < 1e-6
    assert filigree.contains(far, [[1e7, 0, 0]])[0]
    assert abs(filigree.sample(far, spacing=0.2).mean(0) - [1e7, 0, 0]).max() < 0.01
    bent = filigree.bend(far, "z", 40)
    assert abs(bent(far).world_vertices - bent(far.world_vertices)).max() < 1e-5
    body = filigree.Body(far, "jelly", particles=200)
    simulation = filigree.Simulation([body], gravity=(0, 0, 0))
    driver = simulation.attach(0, model)
    simulation.step()
    assert abs(simulation.positions(0).mean(0) - [1e7, 0, 0]).max() < 2
