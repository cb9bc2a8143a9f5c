"""Bakes play what was shown, also without the add-on; bodies are baked into the driver; the error is what it says."""

import os
import tempfile

import bpy
import numpy as np

import filigree
import filigree_detail
from filigree_detail import baking, meshes, obstacles, simulating
from stage import activate, add, begin, bend, largest, refused, run_all, shown

folder = tempfile.TemporaryDirectory(prefix="filigree-blender-")


def in_a_file():
    begin()
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder.name, "bake.blend"))


def collection_of(*objects):
    made = bpy.data.collections.new("obstacles")
    bpy.context.scene.collection.children.link(made)
    for obj in objects:
        made.objects.link(obj)
        bpy.context.scene.collection.objects.unlink(obj)
    return made


def ground():
    return add(filigree.Mesh([[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]], [[0, 1, 2, 3]]), "ground")


def test_a_bake_plays_without_the_add_on():
    in_a_file()
    high = add(filigree.make("wavy-sphere", resolution=40), "ball")
    bpy.ops.filigree.make_driver(vertices=300)
    modifier, scene = bend(high.filigree.driver, 0), bpy.context.scene
    for frame, angle in ((3, 0.0), (7, 1.6)):
        modifier.angle = angle
        modifier.keyframe_insert("angle", frame=frame)
    scene.frame_start, scene.frame_end = 3, 7
    followed = []
    for frame in range(3, 8):
        scene.frame_set(frame)
        followed.append(shown(high).copy())
    scene.frame_set(5)
    assert bpy.ops.filigree.bake() == {"FINISHED"} and scene.frame_current == 5
    high.filigree.driver.modifiers.clear()
    filigree_detail.unregister()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    high = bpy.data.objects["ball"]
    for frame in range(3, 8):
        bpy.context.scene.frame_set(frame)
        assert largest(shown(high), followed[frame - 3]) <= 1e-6, frame
    filigree_detail.register()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    high = bpy.data.objects["ball"]
    activate(high)
    bpy.ops.filigree.free_bake()
    assert largest(shown(high), meshes.vertices_of(high.data)) < 1e-6  # the driver has lost its modifiers


def test_a_bake_that_fails_leaves_nothing():
    in_a_file()
    high = add(filigree.make("wavy-sphere", resolution=16), "ball")
    bpy.ops.filigree.make_driver(vertices=100)
    target = os.path.join(folder.name, "half.pc2")
    high.filigree.driver.modifiers.new("Subdivision", "SUBSURF")
    refused(bpy.ops.filigree.bake, "Frame 1", filepath=target)
    assert not [name for name in os.listdir(folder.name) if name.startswith("half")]
    assert baking.BAKED not in high.modifiers
    refused(bpy.ops.filigree.bake, "denied" if os.getuid() else "", filepath="/proc/nowhere/half.pc2")
    begin()
    add(filigree.make("wavy-sphere", resolution=16), "ball")
    bpy.ops.filigree.make_driver(vertices=100)
    refused(bpy.ops.filigree.bake, "Save the file first")


def test_a_body_falls_on_a_moving_ground():
    in_a_file()
    scene = bpy.context.scene
    scene.frame_end = 30
    floor = ground()
    for frame, height in ((1, 0.0), (30, 1.0)):
        floor.location.z = height
        floor.keyframe_insert("location", frame=frame)
    scene.filigree_body.obstacles = collection_of(floor)
    scene.filigree_body.particles = 500
    high = add(filigree.make("wavy-cube", resolution=20), "cube")
    high.location.z, high.scale = 1.5, (0.5, 0.5, 0.5)
    bpy.context.view_layer.update()
    refused(bpy.ops.filigree.simulate, "Make a driver first")
    bpy.ops.filigree.make_driver(vertices=200)
    assert bpy.ops.filigree.simulate() == {"FINISHED"}
    lowest = []
    for frame in range(1, 31):
        scene.frame_set(frame)
        vertices = meshes.moved(shown(high), high.matrix_world)
        lowest.append(vertices[:, 2].min())
        fallen = 0.5 * 9.81 * ((frame - 1) / 24) ** 2
        if frame < 8:
            assert abs(vertices[:, 2].mean() - (1.5 - fallen)) < 0.02, frame
    heights = [(frame - 1) / 29 for frame in range(1, 31)]  # as keys ease in and out, between these
    assert min(lowest) < 0.9 and lowest[-1] > 0.9, lowest
    assert heights[-1] == 1


def test_a_vertex_group_says_where_a_body_is_soft():
    in_a_file()
    scene = bpy.context.scene
    scene.frame_end = 8
    body = scene.filigree_body
    body.particles, body.soft_group, body.softness = 200, "belly", 0.2
    high = add(filigree.make("wavy-cube", resolution=8), "cube")
    bpy.ops.filigree.make_driver(vertices=100)
    refused(bpy.ops.filigree.simulate, "no vertex group 'belly'")
    group = high.vertex_groups.new(name="belly")
    group.add([v.index for v in high.data.vertices if v.co.z < 0], 0.5, "REPLACE")
    fields = simulating.fields_of(body, high)
    weights = np.where(meshes.vertices_of(high.data)[:, 2] < 0, 0.6, 1)
    assert np.allclose(fields["stiffness"], weights, atol=1e-6)
    assert bpy.ops.filigree.simulate() == {"FINISHED"}
    body.soft_group = ""


def test_an_obstacle_spins_on_through_full_turns():
    in_a_file()
    scene = bpy.context.scene
    wheel = add(filigree.make("bar"), "wheel")
    add(filigree.make("wavy-cube", resolution=4), "cube")  # active, so no obstacle
    wheel.location.x = 2
    wheel.rotation_euler.z = 0.3
    wheel.keyframe_insert("rotation_euler", frame=1)
    wheel.rotation_euler.z = 0.3 + np.radians(20 * 54)
    wheel.keyframe_insert("rotation_euler", frame=55)
    for curve in wheel.animation_data.action.fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    gathered, = obstacles.gather(bpy.context, collection_of(wheel), range(1, 56))
    assert np.allclose(np.array(gathered.turns)[:, 2], 20 * np.arange(55), atol=0.01), gathered.turns
    assert np.allclose(gathered.times, np.arange(55) / 24) and np.allclose(gathered.pivot, (2, 0, 0))
    gathered.for_simulation()


def test_a_body_breaks():
    in_a_file()
    scene = bpy.context.scene
    scene.frame_end = 24
    scene.filigree_body.obstacles = collection_of(ground())
    scene.filigree_body.particles, scene.filigree_body.pieces, scene.filigree_body.strength = 600, 6, 2e4
    high = add(filigree.make("wavy-cube", resolution=20), "cube")
    high.location.z = 1.5
    bpy.context.view_layer.update()
    assert bpy.ops.filigree.fracture() == {"FINISHED"}
    pieces = bpy.data.objects["cube pieces"]
    assert pieces.filigree.message == "" and high.hide_render
    scene.frame_set(1)
    whole = shown(pieces)
    assert abs(whole[:, 2].mean() - 1.5) < 0.02 and len(whole) > len(high.data.vertices)
    scene.frame_set(24)
    assert np.ptp(shown(pieces), axis=0).max() > 1.3 * np.ptp(whole, axis=0).max()


def test_the_error_is_what_it_says():
    begin()
    high = add(filigree.make("wavy-sphere", resolution=40), "ball")
    bpy.ops.filigree.make_driver(vertices=300)
    lattice = bpy.data.objects.new("lattice", bpy.data.lattices.new("lattice"))
    bpy.context.scene.collection.objects.link(lattice)
    lattice.data.points_u = lattice.data.points_v = lattice.data.points_w = 3
    lattice.scale = (1.3, 1.3, 1.3)
    lattice.data.points[26].co_deform.x += 0.4
    lattice.data.points[0].co_deform.z -= 0.4
    high.filigree.driver.modifiers.new("Lattice", "LATTICE").object = lattice
    bpy.context.view_layer.update()
    assert bpy.ops.filigree.show_error() == {"FINISHED"}
    known = np.empty(len(high.data.vertices), np.float32)
    high.data.attributes["filigree_error"].data.foreach_get("value", known)
    truth = high.copy()
    truth.data = high.data.copy()
    truth.modifiers.clear()
    bpy.context.scene.collection.objects.link(truth)
    truth.modifiers.new("Lattice", "LATTICE").object = lattice
    expected = np.linalg.norm(shown(high) - shown(truth), axis=1)
    assert np.abs(known - expected).max() < 1e-6 and 1e-6 < known.mean() < 2e-3, known.mean()
    high.filigree.driver.modifiers.clear()
    high.filigree.driver.modifiers.new("Cloth", "CLOTH")  # nothing to try on the mesh: the error is expected
    bend(high.filigree.driver, 2.0)
    assert bpy.ops.filigree.show_error() == {"FINISHED"}
    high.data.attributes["filigree_error"].data.foreach_get("value", known)
    assert 1e-5 < known.max() < 0.1


run_all(globals())
