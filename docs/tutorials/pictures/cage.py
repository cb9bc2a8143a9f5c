"""The steps of docs/tutorials/cage.md that are clicks, and the pictures of that page. Works in the current folder.

blender -b -P cage.py      the first part in Blender: cage.obj becomes cage.mdd
cage.py there              pictures cage_2.png to cage_4.png: the same in a window
cage.py back               picture cage_5.png: dragon.ply and turned.pc2 in a window
cage.py moments            picture cage_1.png: the cage and the dragon at three moments, of cage.obj, cage.mdd and dragon.fil

The last three are for /usr/bin/python3, and need xvfb-run, xdotool and Blender.
"""

import math
import os
import subprocess
import sys
import tempfile
import traceback

try:
    import bpy
    from mathutils import Euler
except ImportError:
    bpy = None

KEYS = {1: 0, 15: 120, 35: -120, 48: 0}  # degrees of twist at these frames
WIDTH, HEIGHT = 960, 640
STEPS = []


def step(function):
    STEPS.append(function)
    return function


# --- What the reader clicks


def read_cage():
    bpy.ops.preferences.addon_enable(module="io_shape_mdd")
    clear()
    bpy.ops.wm.obj_import(filepath="cage.obj")
    bpy.ops.object.origin_set(type="ORIGIN_GEOMETRY")


def twist_cage():
    twist = bpy.context.object.modifiers.new("SimpleDeform", "SIMPLE_DEFORM")
    twist.deform_method, twist.deform_axis = "TWIST", "Y"
    for frame, degrees in KEYS.items():
        twist.angle = math.radians(degrees)
        twist.keyframe_insert("angle", frame=frame)
    bpy.context.scene.frame_end = max(KEYS)


def write_cage():
    scene = bpy.context.scene
    bpy.ops.export_shape.mdd(filepath="cage.mdd", frame_start=1, frame_end=scene.frame_end, fps=scene.render.fps)


# --- Pictures of the window


def clear():
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)


def area(kind):
    return next(a for a in bpy.context.window.screen.areas if a.type == kind)


def to_edge():
    """Puts the mouse on the edge of the properties: only there, and only then, Blender moves it."""
    mouse(area("PROPERTIES").x - 1, HEIGHT // 2)


def arrange():
    """Wide properties, no toolbar."""
    bpy.ops.screen.area_move(x=area("PROPERTIES").x - 1, y=HEIGHT // 2, delta=-120)
    space = area("VIEW_3D").spaces.active
    space.show_region_toolbar = space.show_region_tool_header = False
    space.clip_start = 0.001
    space.shading.show_cavity = True


def look(turn, tilt, distance, at):
    region = area("VIEW_3D").spaces.active.region_3d
    region.view_rotation = Euler((tilt, 0, turn)).to_quaternion()
    region.view_perspective = "PERSP"
    region.view_distance, region.view_location = distance, at


def mouse(*words):
    """Moves and clicks, after this step: Blender does not look before."""
    subprocess.Popen(["xdotool", "mousemove", *map(str, words)])


def picture(name):
    bpy.ops.screen.screenshot(filepath=os.path.abspath(name))


def modifiers():
    area("PROPERTIES").spaces.active.context = "MODIFIER"


def there():
    @step
    def _():
        read_cage()
        to_edge()

    @step
    def _():
        arrange()
        look(0.2, 1.3, 0.29, (-0.01, 0, 0.122))
        area("VIEW_3D").spaces.active.overlay.show_wireframes = True

    @step
    def _():
        picture("cage_2.png")
        twist_cage()
        modifiers()
        bpy.context.scene.frame_set(35)

    @step
    def _():
        picture("cage_3.png")
        mouse(62, 13, "click", 1)

    # A move for each step, or Blender on a busy machine sees but the last of them.
    for move in ((80, 316), (80, 316, "click", 1), (260, 318), (260, 524)):
        step(lambda move=move: mouse(*move))

    @step
    def _():
        picture("cage_4.png")


def back():
    @step
    def _():
        clear()
        bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath("dragon.blend"))
        (bpy.ops.import_mesh.ply if bpy.app.version < (4, 0) else bpy.ops.wm.ply_import)(filepath=os.path.abspath("dragon.ply"))
        dragon = bpy.context.object
        dragon.rotation_euler.x = math.pi / 2
        bpy.ops.object.shade_smooth()
        cache = dragon.modifiers.new("MeshCache", "MESH_CACHE")
        cache.cache_format, cache.filepath = "PC2", "//turned.pc2"
        cache.frame_start = 1
        bpy.context.scene.frame_end = max(KEYS)
        bpy.context.scene.frame_set(35)
        to_edge()

    @step
    def _():
        arrange()
        look(0.2, 1.3, 0.29, (-0.01, 0, 0.122))
        area("VIEW_3D").spaces.active.overlay.show_outline_selected = False
        modifiers()

    @step
    def _():
        picture("cage_5.png")


def advance():
    if not STEPS:
        bpy.ops.wm.quit_blender()
        return None
    try:
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area("VIEW_3D")):
            STEPS.pop(0)()
    except Exception:
        traceback.print_exc()
        os._exit(1)
    return 2.0


# --- Outside of Blender


def open_window(part):
    """Blender with settings of its own, on a display of its own."""
    with tempfile.TemporaryDirectory() as config:
        environment = dict(os.environ, BLENDER_USER_CONFIG=config, OMP_NUM_THREADS="1")
        settings = "import bpy; view = bpy.context.preferences.view; view.show_splash = view.show_tooltips = False; bpy.ops.wm.save_userpref()"
        run = dict(env=environment, check=True, stdout=subprocess.DEVNULL)
        subprocess.run(["blender", "-b", "--python-expr", settings], **run)
        screen = f"-screen 0 {WIDTH}x{HEIGHT}x24"
        window = ["--window-geometry", "0", "0", str(WIDTH), str(HEIGHT)]
        subprocess.run(["xvfb-run", "-a", "-s", screen, "blender", *window, "-P", __file__, "--", part], **run)


def filigree(*words):
    subprocess.run(["filigree", *words, "--quiet"], check=True)


def moments():
    frames = (1, 15, 35)
    filigree("export", "cage.obj", "--poses", "cage.mdd", "--pose-up", "z", "-o", "poses/")
    cages, meshes = [f"poses/cage_{k:04}.ply" for k in frames], [f"moment_{k}.ply" for k in frames]
    for cage, mesh in zip(cages, meshes):
        filigree("restore", "dragon.fil", "--pose", cage, "-o", mesh)
    look = "--shared-camera --up y --no-captions --camera -0.22 0.26 0.52 -0.006 0.122 0 --field-of-view 20 --size 960x280".split()
    filigree("render", *cages, *look, "--edges", "--color", "#7d9cc0", "-o", "cages.png")
    filigree("render", *meshes, *look, "--passes", "10", "-o", "meshes.png")
    subprocess.run("ffmpeg -loglevel error -y -i cages.png -i meshes.png -filter_complex vstack cage_1.png".split(), check=True)


PARTS = {"there": there, "back": back}
if bpy is None:
    moments() if sys.argv[1] == "moments" else open_window(sys.argv[1])
elif "--" in sys.argv:
    PARTS[sys.argv[-1]]()
    bpy.app.timers.register(advance, first_interval=2.0)
else:
    read_cage()
    twist_cage()
    write_cage()
