"""Makes the pictures of docs/blender.md inside Blender, with a window. Run by scripts/blender-pictures: MESH FOLDER."""

import os
import subprocess
import sys

import bpy
from mathutils import Euler, Matrix

mesh, folder = sys.argv[sys.argv.index("--") + 1:]
STEPS = []


def step(function):
    STEPS.append(function)
    return function


def view3d():
    return next(a for a in bpy.context.window.screen.areas if a.type == "VIEW_3D")


def screenshot(name):
    bpy.ops.screen.screenshot(filepath=os.path.join(folder, name))


@step
def scene():
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.wm.obj_import(filepath=mesh)
    high = bpy.context.object
    bpy.ops.object.transform_apply(location=False)
    low = min(c[2] for c in high.bound_box)
    high.data.transform(Matrix.Scale(2 / max(high.dimensions), 4) @ Matrix.Translation((0, 0, -low)))
    bpy.ops.object.shade_smooth()
    bpy.ops.filigree.make_driver(vertices=600)


@step
def bent():
    high = bpy.context.object
    driver = high.filigree.driver
    bend = driver.modifiers.new("Bend", "SIMPLE_DEFORM")
    bend.deform_method, bend.deform_axis, bend.angle = "BEND", "X", 1.2
    area = view3d()
    space, region = area.spaces.active, area.spaces.active.region_3d
    space.show_region_ui, space.show_region_toolbar = True, False
    space.shading.type, space.shading.show_cavity = "SOLID", True
    space.overlay.show_floor = True
    region.view_rotation = Euler((1.3, 0, -0.35)).to_quaternion()
    region.view_location, region.view_distance = (0.9, 0, 0.7), 3.9
    high.filigree.object_motion = False  # so that it may stand beside its driver
    high.location.x = 1.3


@step
def choose_tab():
    """Blender 3.4 has no call for it: a click on the last tab of the sidebar."""
    subprocess.run(["xdotool", "mousemove", "1043", "248", "click", "1"], check=True)


@step
def panel():
    screenshot("panel.png")


@step
def error():
    high = bpy.context.object
    high.filigree.driver.modifiers.clear()
    lattice = bpy.data.objects.new("lattice", bpy.data.lattices.new("lattice"))
    bpy.context.scene.collection.objects.link(lattice)
    lattice.data.points_u = lattice.data.points_v = lattice.data.points_w = 3
    lattice.location, lattice.scale = (0, 0, 1), (2.2, 2.2, 2.2)
    for index in (18, 19, 20):
        lattice.data.points[index].co_deform.x += 0.35
    lattice.hide_set(True)
    high.filigree.driver.modifiers.new("Lattice", "LATTICE").object = lattice
    bpy.context.view_layer.update()
    high.filigree.driver.hide_set(True)
    bpy.ops.filigree.show_error()


@step
def error_picture():
    screenshot("error.png")


def advance():
    if not STEPS:
        bpy.ops.wm.quit_blender()
        return None
    try:
        window = bpy.context.window_manager.windows[0]
        with bpy.context.temp_override(window=window, area=next(a for a in window.screen.areas if a.type == "VIEW_3D")):
            STEPS.pop(0)()
    except Exception:
        import traceback

        traceback.print_exc()
        os._exit(1)
    return 2.0


bpy.app.timers.register(advance, first_interval=2.0)
