"""Make driver, Bind, Update, Unbind, levels and settings: what is shown is what the library restores."""

import bpy
import numpy as np

import filigree
from filigree_detail import meshes
from stage import activate, add, begin, bend, largest, refused, restored, run_all, shown


def test_a_driver_is_made_and_followed():
    begin()
    high = add(filigree.make("wavy-sphere", resolution=40), "ball")
    rest = shown(high)
    assert bpy.ops.filigree.make_driver(vertices=300) == {"FINISHED"}
    driver = high.filigree.driver
    assert len(driver.data.vertices) == 300 and high.filigree.message == ""
    assert largest(shown(high), rest) < 3e-7
    bend(driver)
    assert largest(shown(high), rest) > 0.05
    assert largest(shown(high), restored(high)) == 0
    driver.location.z = 2
    assert abs((shown(high) - restored(high)).mean(axis=0) - [0, 0, 2]).max() < 1e-5
    high.filigree.object_motion = False
    assert largest(shown(high), restored(high)) == 0


def test_settings_reach_the_library():
    begin()
    high = add(filigree.make("wavy-plane", resolution=40), "sheet")
    bpy.ops.filigree.make_driver(vertices=200)
    high.filigree.driver.scale.x = 3
    assert largest(shown(high), meshes.vertices_of(high.data)) > 0.1
    high.filigree.enabled = False
    assert largest(shown(high), meshes.vertices_of(high.data)) == 0


def test_a_mesh_made_elsewhere_is_bound():
    begin()
    high = add(filigree.make("wavy-sphere", resolution=40), "ball")
    high.location = (3, 0, 0)
    cage = add(filigree.make("wavy-sphere", resolution=8, amplitude=0), "cage")
    cage.location, cage.scale = (3, 0, 0), (1.1, 1.1, 1.1)
    bpy.context.view_layer.update()
    rest = meshes.vertices_of(high.data)
    activate(high)
    cage.select_set(True)
    assert bpy.ops.filigree.bind() == {"FINISHED"}
    assert high.filigree.driver == cage and largest(shown(high), rest) < 1e-6
    cage.scale = (2.2, 1.1, 1.1)  # affine: exact
    assert largest(shown(high), rest * [2, 1, 1]) < 1e-5
    other = add(filigree.make("wavy-sphere", resolution=24), "second")  # two on one driver
    other.location = (3, 0, 0)
    bpy.context.view_layer.update()
    bpy.ops.filigree.bind(driver="cage")
    cage.location.z = 1
    assert abs(shown(other).mean(axis=0)[2] - 1) < 1e-3 and abs(shown(high).mean(axis=0)[2] - 1) < 1e-3


def test_nothing_is_refused_and_doubtful_vertices_are_selected():
    begin()
    ball = filigree.make("wavy-sphere", resolution=16)
    far = ball.vertices + [5, 0, 0]
    both = filigree.Mesh(np.concatenate([ball.vertices, far]), np.concatenate([ball.faces, ball.faces + len(far)]))
    high = add(both, "two")
    cage = add(filigree.make("wavy-sphere", resolution=6, amplitude=0), "cage")
    activate(high)
    assert bpy.ops.filigree.bind(driver=cage.name) == {"FINISHED"}
    selected = np.empty(len(high.data.vertices), bool)
    high.data.vertices.foreach_get("select", selected)
    assert selected[len(far):].all() and not selected[: len(far)].any()
    points = add(filigree.Mesh(ball.vertices), "points")
    assert bpy.ops.filigree.bind(driver=cage.name) == {"FINISHED"}
    assert largest(shown(points), ball.vertices) < 1e-6


def test_the_viewport_may_have_a_coarser_level():
    begin()
    high = add(filigree.make("wavy-sphere", resolution=64), "ball")
    bpy.ops.filigree.make_driver(vertices=300)
    bend(high.filigree.driver)
    fine = restored(high)
    high.filigree.viewport_level = 1
    model = filigree.strip(meshes.filigree_mesh(high.data), base=300)
    coarse = filigree.restore(model, shown(high.filigree.driver), level=1).vertices
    assert len(shown(high)) < len(fine) / 2 and largest(shown(high), coarse) == 0
    high.filigree.viewport_level = -1
    assert largest(shown(high), fine) == 0


def test_what_cannot_be_is_said():
    begin()
    high = add(filigree.make("wavy-sphere", resolution=16), "ball")
    refused(bpy.ops.filigree.bind, "Select the light mesh")
    refused(bpy.ops.filigree.update, "There is no driver")
    refused(bpy.ops.filigree.bake, "follows no driver")
    add(filigree.Mesh(np.zeros((0, 3))), "nothing")
    refused(bpy.ops.filigree.make_driver, "no vertices")
    activate(high)
    refused(bpy.ops.filigree.bind, "without vertices", driver="nothing")


def corner_normals(mesh):
    normals = np.empty(3 * len(mesh.loops), np.float32)
    if bpy.app.version < (4, 1):
        mesh.calc_normals_split()
        mesh.loops.foreach_get("normal", normals)
    else:
        mesh.corner_normals.foreach_get("vector", normals)
    return normals.reshape(-1, 3)


def test_custom_normals_and_uvs_come_along():
    """Blender turns custom normals with the faces around them, the library by the gradient."""
    begin()
    ball = filigree.make("wavy-sphere", resolution=40)
    high = add(ball, "ball")
    if bpy.app.version < (4, 1):  # later ones take custom normals as they are
        high.data.use_auto_smooth = True
    lean = np.array([0.3, 0.2, 0.9])
    own = ball.vertices / np.linalg.norm(ball.vertices, axis=1)[:, None] + 0.3 * lean  # of no surface
    own /= np.linalg.norm(own, axis=1)[:, None]
    high.data.normals_split_custom_set_from_vertices(own)
    uvs = high.data.uv_layers.new(name="map")
    uvs.data.foreach_set("uv", np.arange(2 * len(high.data.loops), dtype=np.float32))
    bpy.ops.filigree.make_driver(vertices=300)
    bend(high.filigree.driver)
    bpy.context.view_layer.update()
    evaluated = high.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    seen = corner_normals(evaluated)
    with_normals = filigree.Mesh(ball.vertices, ball.corners, ball.face_offsets, normals=own)
    model = filigree.strip(with_normals, base=300)
    wanted = filigree.restore(model, shown(high.filigree.driver))
    wanted = wanted.normals[ball.corners if wanted.normal_corners is None else wanted.normal_corners]
    angles = np.degrees(np.arccos(np.clip((seen * wanted).sum(axis=1), -1, 1)))
    at_rest = np.degrees(np.arccos(np.clip((seen * own[ball.corners]).sum(axis=1), -1, 1)))
    assert angles.mean() < 3 and angles.mean() < 0.3 * at_rest.mean(), (angles.mean(), at_rest.mean())
    kept = np.empty(2 * len(evaluated.loops), np.float32)
    evaluated.uv_layers["map"].data.foreach_get("uv", kept)
    assert (kept == np.arange(len(kept))).all()


def test_unbinding_gives_everything_back():
    begin()
    high = add(filigree.make("wavy-sphere", resolution=16), "ball")
    before = set(bpy.data.objects)
    bpy.ops.filigree.make_driver(vertices=100)
    bend(high.filigree.driver)
    driver = high.filigree.driver
    bpy.ops.filigree.unbind()
    assert largest(shown(high), meshes.vertices_of(high.data)) == 0
    assert set(bpy.data.objects) == before | {driver} and not bpy.data.texts and not high.modifiers


run_all(globals())
