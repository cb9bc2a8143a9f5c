"""Takes a picture of Blender's window that plays a GLB: /usr/bin/python3 glb_in_blender.py MOVES.glb FRAME OUT.png

Needs xvfb-run and Blender 3.4. Blender runs this file too, with the same words.
"""

import os
import subprocess
import sys
import tempfile
import traceback

import numpy

try:
    import bpy
    from mathutils import Euler
except ImportError:
    bpy = None

WIDTH, HEIGHT = 960, 600
glb, frame, out = sys.argv[-3:]


def load():
    numpy.bool = bool  # Debian's importer is older than its numpy
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.context.scene.render.fps = 60
    bpy.ops.import_scene.gltf(filepath=os.path.abspath(glb), import_shading="SMOOTH")


def look():
    scene = bpy.context.scene
    mesh, armature = (next(obj for obj in scene.objects if obj.type == kind) for kind in ("MESH", "ARMATURE"))
    armature.hide_set(True)
    bpy.context.view_layer.objects.active = mesh
    scene.frame_end = round(max(scene.frame_end, armature.animation_data.action.frame_range[1]))
    scene.frame_set(int(frame))
    moved = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
    places = numpy.empty(3 * len(moved.data.vertices), numpy.float32)
    moved.data.vertices.foreach_get("co", places)
    world = numpy.array(moved.matrix_world)
    places = numpy.reshape(places, (-1, 3)) @ world[:3, :3].T + world[:3, 3]
    space = view().spaces.active
    space.show_region_toolbar = space.show_region_tool_header = space.overlay.show_outline_selected = False
    space.overlay.show_cursor = space.overlay.show_object_origins = False
    space.shading.show_cavity = space.shading.show_shadows = True
    region = space.region_3d
    region.view_rotation = Euler((1.25, 0, 0.35)).to_quaternion()
    region.view_location = (places.min(0) + places.max(0)) / 2
    region.view_distance = 1.75 * max(places.max(0) - places.min(0))


def shoot():
    bpy.ops.screen.screenshot(filepath=os.path.abspath(out))


def view():
    return next(area for area in bpy.context.window_manager.windows[0].screen.areas if area.type == "VIEW_3D")


STEPS = [load, look, shoot]


def advance():
    if not STEPS:
        bpy.ops.wm.quit_blender()
        return None
    try:
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=view()):
            STEPS.pop(0)()
    except Exception:
        traceback.print_exc()
        os._exit(1)
    return 2.0


if bpy is None:
    with tempfile.TemporaryDirectory() as config:
        screen = ["xvfb-run", "-a", "-s", f"-screen 0 {WIDTH}x{HEIGHT}x24"]
        blender = ["blender", "--window-geometry", "0", "0", str(WIDTH), str(HEIGHT), "-P", __file__, "--"]
        subprocess.run([*screen, *blender, glb, frame, out], env=dict(os.environ, BLENDER_USER_CONFIG=config), check=True,
                       stdout=subprocess.DEVNULL)
else:
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(advance, first_interval=2.0)
