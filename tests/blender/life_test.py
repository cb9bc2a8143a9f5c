"""The life of a file: save and open, undo, copies, deleting, other vertex counts, appending, missing parts. Each works, or
says in one sentence why not and recovers."""

import os
import tempfile

import bpy
import numpy as np

import filigree
from filigree_detail import meshes
from stage import activate, add, begin, bend, largest, restored, run_all, shown

folder = tempfile.TemporaryDirectory(prefix="filigree-blender-")
FILE = os.path.join(folder.name, "life.blend")


def bent_ball():
    begin()
    high = add(filigree.make("wavy-sphere", resolution=40), "ball")
    bpy.ops.filigree.make_driver(vertices=300)
    bend(high.filigree.driver)
    return high


def rest(high):
    return meshes.vertices_of(high.data)


def test_saved_and_opened():
    before = shown(bent_ball())
    bpy.ops.wm.save_as_mainfile(filepath=FILE)
    bpy.ops.wm.open_mainfile(filepath=FILE)
    high = bpy.data.objects["ball"]
    assert largest(shown(high), before) == 0
    high.filigree.driver.modifiers["Bend"].angle = 0.3
    assert largest(shown(high), before) > 0.01 and largest(shown(high), restored(high)) == 0


def test_opened_without_the_add_on_nothing_is_lost():
    """The last shape is in the file, and what it takes to go on."""
    import filigree_detail

    before = shown(bent_ball())
    bpy.ops.wm.save_as_mainfile(filepath=FILE)
    filigree_detail.unregister()
    bpy.ops.wm.open_mainfile(filepath=FILE)
    assert largest(shown(bpy.data.objects["ball"]), before) == 0
    bpy.ops.wm.save_as_mainfile(filepath=FILE)
    filigree_detail.register()
    bpy.ops.wm.open_mainfile(filepath=FILE)
    high = bpy.data.objects["ball"]
    high.filigree.driver.modifiers["Bend"].angle = 0
    assert largest(shown(high), rest(high)) < 1e-6


def test_copies_follow_by_themselves():
    high = bent_ball()
    copy = high.copy()
    copy.data = high.data.copy()
    bpy.context.scene.collection.objects.link(copy)
    high.filigree.driver.modifiers["Bend"].angle = 0.5
    assert largest(shown(copy), shown(high)) == 0
    driver = high.filigree.driver.copy()
    driver.data = driver.data.copy()
    bpy.context.scene.collection.objects.link(driver)
    driver.modifiers["Bend"].angle = -0.5
    copy.filigree.driver = driver
    copy.filigree.object_motion = True  # any setting: follow again
    assert largest(shown(copy), shown(high)) > 0.05
    activate(copy)
    bpy.ops.filigree.unbind()
    assert largest(shown(high), restored(high)) == 0  # the original keeps its model
    linked = high.copy()  # one mesh, two shapes
    bpy.context.scene.collection.objects.link(linked)
    linked.filigree.driver = driver
    linked.filigree.object_motion = True
    bpy.context.view_layer.update()
    assert linked.data == high.data and largest(shown(linked), shown(high)) > 0.05
    assert largest(shown(high), restored(high)) == 0 and largest(shown(linked), restored(linked)) == 0


def test_the_driver_is_deleted():
    high = bent_ball()
    bpy.data.objects.remove(high.filigree.driver)
    bpy.context.scene.frame_set(2)
    assert "was deleted" in high.filigree.message and largest(shown(high), rest(high)) == 0
    cage = add(filigree.make("wavy-sphere", resolution=8), "cage")
    high.filigree.driver = cage
    activate(high)
    bpy.ops.filigree.update()
    cage.scale.x = 2
    assert high.filigree.message == "" and largest(shown(high), rest(high) * [2, 1, 1]) < 1e-5


def test_the_driver_is_taken_out_of_the_scene():
    high = bent_ball()
    bpy.context.scene.collection.objects.unlink(high.filigree.driver)
    bpy.context.scene.frame_set(2)
    assert "is not in this scene" in high.filigree.message
    activate(high)
    bpy.ops.filigree.update()
    assert high.filigree.message == "" and high.filigree.driver.name in bpy.context.scene.objects


def test_other_vertex_counts():
    high = bent_ball()
    subdivide = high.filigree.driver.modifiers.new("Subdivision", "SUBSURF")
    bpy.context.scene.frame_set(2)
    assert "300 were bound" in high.filigree.message and largest(shown(high), rest(high)) == 0
    high.filigree.driver.modifiers.remove(subdivide)
    bpy.context.scene.frame_set(3)
    assert high.filigree.message == "" and largest(shown(high), restored(high)) == 0
    activate(high)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.scene.frame_set(4)
    assert "vertices" in high.filigree.message and largest(shown(high), rest(high)) == 0
    high.filigree.driver.modifiers.clear()
    bpy.ops.filigree.update()
    bend(high.filigree.driver)
    assert high.filigree.message == "" and largest(shown(high), rest(high)) > 0.05


def test_appended_to_another_file():
    before = shown(bent_ball())
    bpy.ops.wm.save_as_mainfile(filepath=FILE)
    begin()
    bpy.ops.wm.append(directory=os.path.join(FILE, "Object"), filename="ball")
    high = bpy.data.objects["ball"]
    assert largest(shown(high), before) == 0
    bpy.context.scene.frame_set(2)
    if high.filigree.message:
        assert "is not in this scene" in high.filigree.message
        high.filigree.driver.modifiers.clear()
        activate(high)
        bpy.ops.filigree.update()
        bend(high.filigree.driver)
    assert largest(shown(high), before) < 2e-3


def test_the_detail_is_lost():
    high = bent_ball()
    bpy.data.texts.remove(high.filigree.model)
    bpy.context.scene.frame_set(2)
    assert "is gone" in high.filigree.message and largest(shown(high), rest(high)) == 0
    activate(high)
    assert bpy.ops.filigree.update() == {"FINISHED"} and high.filigree.message == ""


def test_undone_and_redone():
    begin()
    high = add(filigree.make("wavy-sphere", resolution=40), "ball")
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.filigree.make_driver(vertices=300)
    bpy.ops.ed.undo_push(message="driver")
    bend(high.filigree.driver)
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="bent")
    bent = shown(high).copy()
    bpy.ops.ed.undo()
    high = bpy.data.objects["ball"]
    assert largest(shown(high), rest(high)) < 1e-6
    bpy.ops.ed.undo()
    high = bpy.data.objects["ball"]
    assert high.filigree.model is None and len(bpy.data.objects) == 1
    bpy.ops.ed.redo()
    bpy.ops.ed.redo()
    high = bpy.data.objects["ball"]
    assert largest(shown(high), bent) == 0
    high.filigree.driver.modifiers["Bend"].angle = 0.2
    assert largest(shown(high), restored(high)) == 0


run_all(globals())
