"""What the tests share: an empty file, meshes from Filigree's shapes, and what Blender shows of an object."""

import sys

import bpy
import numpy as np

sys.dont_write_bytecode = True

import filigree
import filigree_detail
from filigree_detail import meshes


def begin():
    """An empty file with the add-on."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    if not hasattr(bpy.types.Object, "filigree"):
        filigree_detail.register()


def add(mesh, name):
    """One of Filigree's meshes as an object, active."""
    made = bpy.data.objects.new(name, meshes.blender_mesh(mesh, name))
    bpy.context.scene.collection.objects.link(made)
    activate(made)
    return made


def activate(obj):
    for other in bpy.context.view_layer.objects:
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def shown(obj):
    """Vertices of an object as the viewport has them, in its own space."""
    bpy.context.view_layer.update()
    return meshes.vertices_of(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)


def largest(a, b):
    """Largest difference of two shapes, as a fraction of the second's diagonal."""
    assert a.shape == b.shape, (a.shape, b.shape)
    return float(np.abs(a - b).max() / np.linalg.norm(np.ptp(b, axis=0)))


def bend(driver, angle=1.2):
    """A modifier that bends an object."""
    modifier = driver.modifiers.new("Bend", "SIMPLE_DEFORM")
    modifier.deform_method, modifier.deform_axis, modifier.angle = "BEND", "Z", angle
    return modifier


def restored(high):
    """What the library restores for the driver as it is, from a model of its own."""
    model = filigree.strip(meshes.filigree_mesh(high.data), base=len(high.filigree.driver.data.vertices))
    return filigree.restore(model, shown(high.filigree.driver)).vertices


def refused(operator, *words, **options):
    """Runs an operator that has to fail with a sentence that has these words."""
    try:
        operator(**options)
    except RuntimeError as error:
        assert all(word in str(error) for word in words), error
        return
    raise AssertionError(f"{operator} was not refused")


def run_all(names):
    """Runs the tests of a script, in order."""
    for name, test in list(names.items()):
        if name.startswith("test_"):
            test()
            print(name, "passed")
