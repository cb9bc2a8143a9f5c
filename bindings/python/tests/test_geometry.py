"""What users of libigl and trimesh look for."""

import copy
import pickle

import numpy
import pytest

import filigree

V = numpy.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
F = numpy.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


class Other:
    """As trimesh's meshes and Open3D's."""

    def __init__(self, **arrays):
        self.__dict__.update(arrays)


WAYS = {
    "pair": (V, F),
    "lists": (V.tolist(), F.tolist()),
    "fortran": (numpy.asfortranarray(V), numpy.asfortranarray(F.astype(numpy.int32))),
    "trimesh": Other(vertices=V, faces=F),
    "open3d": Other(vertices=V, triangles=F.astype(numpy.int32)),
    "mesh": filigree.Mesh(V, F),
}


@pytest.mark.parametrize("given", WAYS.values(), ids=WAYS.keys())
def test_a_mesh_in_every_shape(given, tmp_path):
    points = numpy.array([[0.1, 0.1, 0.1], [2, 2, 2]])
    assert filigree.contains(given, points).tolist() == [True, False]
    assert filigree.volume(given) == pytest.approx(1 / 6)
    assert len(filigree.strip(given, base=4).mesh) == 4
    assert filigree.compare(given, (V, F))["rms"] == 0
    assert filigree.info(given)["closed"]
    assert filigree.bend(given, "z", 30)(given).vertices.shape == (4, 3)
    filigree.write_mesh(given, tmp_path / "a.ply")
    assert len(filigree.read_mesh(tmp_path / "a.ply")) == 4
    assert filigree.Body(given, "jelly", particles=50).report["volume"] > 0.1
    assert filigree.plot(given).__repr__().startswith("<filigree.View: 4 vertices")


def test_points_are_no_meshes():
    bend = filigree.bend(V, "z", 30)
    assert isinstance(bend(V), numpy.ndarray)
    assert isinstance(bend((V[0], V[1])), numpy.ndarray)  # two points
    assert isinstance(bend((V, F)), filigree.Mesh)
    with pytest.raises(TypeError, match=r"tuple \(V, F\)"):
        filigree.strip(V)


def nearest_by_hand(points, triangles):
    """By sampling each triangle."""
    grid = numpy.array([[i, j, 60 - i - j] for i in range(61) for j in range(61 - i)]) / 60
    samples = (grid @ triangles).reshape(-1, 3)
    return numpy.linalg.norm(points[:, None] - samples, axis=2).min(axis=1)


def test_closest_points():
    points = numpy.random.default_rng(1).uniform(-1, 2, (50, 3))
    found = filigree.closest_points((V, F), points)
    close, distances, faces, triangles, barycentric = found
    assert numpy.allclose(numpy.linalg.norm(points - close, axis=1), distances, atol=1e-6)
    assert numpy.allclose(numpy.einsum("nk,nkx->nx", barycentric, V[F[faces]]), close, atol=1e-6)
    assert (faces == triangles).all() and found.points is close
    by_hand = nearest_by_hand(points, V[F])
    assert (distances <= by_hand + 1e-6).all() and (distances >= by_hand - 0.02).all()
    with pytest.raises(filigree.UnsuitableError, match="no faces"):
        filigree.closest_points(filigree.Mesh(V), points)
    with pytest.raises(filigree.UsageError, match=r"points\[1\] is not finite as a 32-bit number"):
        filigree.closest_points((V, F), [[0, 0, 0], [-1e300, 0, 0]])
    far = filigree.closest_points((V, F), [[1e38, 0, 0]])
    assert far.distances[0] == pytest.approx(1e38)


def test_signed_distances_and_winding_numbers():
    points = numpy.random.default_rng(2).uniform(-1, 2, (200, 3))
    inside = (points > 0).all(axis=1) & (points.sum(axis=1) < 1)
    signed = filigree.signed_distance((V, F), points)
    assert ((signed < 0) == inside).all()
    assert numpy.allclose(numpy.abs(signed), filigree.closest_points((V, F), points).distances)
    assert (filigree.winding_numbers((V, F), points).round() == inside).all()
    half = filigree.winding_numbers((V, F[:3]), [[0.2, 0.2, 0.2], [5, 5, 5]])
    assert 0 < half[0] < 1 and abs(half[1]) < 0.01


def test_points_are_compared():
    moved = V + [0, 0, 0.5]
    assert filigree.vertex_distances(moved, V) == pytest.approx(0.5)
    assert filigree.compare(moved, V)["rms_units"] == pytest.approx(0.5)
    assert filigree.distances_to_surface([[0.1, 0.1, -2]], (V, F)) == pytest.approx([2])
    with pytest.raises(TypeError, match="a has to be a filigree.Mesh"):
        filigree.compare(5, V)


def test_far_from_the_origin():
    far = V + [1e6, 0, 0]
    assert filigree.closest_points((far, F), [[1e6 + 0.2, 0.2, -3]]).distances[0] == pytest.approx(3, rel=1e-6)
    assert filigree.closest_points((far, F), [[1e6 + 0.2, 0.2, -3]]).points[0] == pytest.approx([1e6 + 0.2, 0.2, 0])
    assert filigree.volume((far, F)) == pytest.approx(1 / 6)


def test_normals_areas_edges():
    mesh = filigree.make("wavy-sphere", resolution=40, amplitude=0)
    radial = mesh.vertices / numpy.linalg.norm(mesh.vertices, axis=1)[:, None]
    assert numpy.allclose(filigree.normals(mesh), radial, atol=0.02) and (mesh.vertex_normals == filigree.normals(mesh)).all()
    assert mesh.area == pytest.approx(numpy.pi, rel=1e-3) and mesh.volume == pytest.approx(numpy.pi / 6, rel=2e-3)
    assert numpy.allclose(numpy.linalg.norm(mesh.face_normals, axis=1), 1)
    assert filigree.areas((V, F)) == pytest.approx([0.5, 0.5, 0.5, 3**0.5 / 2])
    assert filigree.face_normals((V, F))[0] == pytest.approx([0, 0, -1])
    assert len(mesh.edges) == 2 * len(mesh.faces) == filigree.info(mesh)["edges"]
    assert filigree.edges((V, F)).tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
    assert (filigree.adjacency((V, F)).toarray() == 1 - numpy.eye(4)).all()


def test_boundaries():
    plane = filigree.make("wavy-plane", resolution=5)
    (loop,) = filigree.boundary(plane)
    assert len(loop) == 20
    steps = plane.vertices[numpy.roll(loop, -1)] - plane.vertices[loop]
    assert numpy.allclose(numpy.linalg.norm(steps[:, :2], axis=1), 0.2, atol=1e-5)
    assert filigree.boundary((V, F)) == []
    assert [len(loop) for loop in filigree.boundary((V, F[:2]))] == [4]
    assert [len(loop) for loop in filigree.boundary((V, F[1:]))] == [3]


def test_meshes_as_objects():
    a, b = filigree.Mesh(V, F), filigree.Mesh(V, F)
    assert a == b and hash(a) == hash(b) and a != filigree.Mesh(V + 1, F) and a != 5 and len(a) == 4
    assert a != filigree.Mesh(V, F, colors=numpy.ones((4, 3)))
    assert a.copy() == a and copy.copy(a) == a and copy.deepcopy(a) == a
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        assert pickle.loads(pickle.dumps(a, protocol)) == a


def test_concatenate_and_split():
    quads = filigree.make("wavy-cube", resolution=3)
    colored = filigree.Mesh(V, F, colors=V.clip(0, 1), scalars={"height": V[:, 2]})
    both = filigree.concatenate([colored, filigree.Mesh(V + 5, F, colors=V, scalars={"height": V[:, 2], "other": V[:, 0]})])
    assert len(both) == 8 and both.colors.shape == (8, 4) and list(both.scalars) == ["height"]
    one, two = both.split()
    assert one == colored.with_vertices(V) and (two.world_vertices == V + 5).all() and (two.scalars["height"] == V[:, 2]).all()
    mixed = filigree.concatenate([quads, (V + 9, F)])
    assert mixed.faces is None and [len(part) for part in filigree.split(mixed)] == [len(quads), 4]
    with pytest.raises(filigree.UsageError, match="hold a mesh"):
        filigree.concatenate([])
    assert filigree.split(filigree.Mesh(V)) == []


def test_pages_and_cards(tmp_path):
    mesh = filigree.make("torus", resolution=12)
    model = filigree.strip(mesh, base=30)
    pose = filigree.bend(mesh, "x", 20)(model)
    for thing in (mesh, model, pose, filigree.Body(mesh, particles=60)):
        assert thing._repr_html_().startswith("<table>") and type(thing).__name__ in thing._repr_html_()
    filigree.plot(mesh, scalars=mesh.vertices[:, 0]).save(tmp_path / "a.html")
    assert "webgl2" in (tmp_path / "a.html").read_text()
    assert "288 vertices" in repr(pose.plot(model)) and "30 vertices" in repr(pose.plot())
    assert "<iframe" in mesh.plot()._repr_html_()
    with pytest.raises(filigree.MismatchError, match="scalars"):
        filigree.plot(mesh, scalars=[1, 2])


def test_results_have_names_and_unpack():
    mesh = filigree.make("wavy-sphere", resolution=10)
    frames = numpy.stack([mesh.world_vertices, 1.1 * mesh.world_vertices])
    fitted = filigree.fit(mesh, frames, error=1e-2)
    model, poses = fitted
    assert fitted.model is model and len(fitted.poses) == len(poses) == 2
    remeshed = filigree.remesh(mesh, 200)
    assert remeshed.mesh is remeshed[0] and "base" in remeshed.report
    warped = filigree.bend(mesh, "z", 20).warp(mesh.world_vertices)
    assert warped.positions.shape == (len(mesh), 3) and warped.gradients.shape == (len(mesh), 3, 3)
    simulation = filigree.Simulation([filigree.Body(mesh, particles=100)])
    assert simulation.momentum().linear.shape == (3,)
    for thing in (simulation, filigree.Material("jelly"), filigree.Restorer(model), filigree.fracture(mesh, 3)):
        assert repr(thing).startswith(f"<filigree.{type(thing).__name__}: ")
