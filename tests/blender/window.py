"""Long work in a window: it goes on while Blender draws, says how far it is, ends by Esc and can be undone. Run by
tests/blender/window with --enable-event-simulate."""

import os
import time
import traceback

import bpy

import filigree
import filigree_detail
from filigree_detail import meshes

filigree_detail.register()
STEPS = []


def step(function):
    STEPS.append(function)
    return function


def override():
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    return bpy.context.temp_override(window=window, area=area, region=next(r for r in area.regions if r.type == "WINDOW"))


def high():
    return bpy.data.objects["ball"]


def press(key):
    window = bpy.context.window_manager.windows[0]
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=300, y=300)
    for value in ("PRESS", "RELEASE"):
        window.event_simulate(type=key, value=value, x=300, y=300)


@step
def strip_begins():
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    made = bpy.data.objects.new("ball", meshes.blender_mesh(filigree.make("wavy-sphere", resolution=200), "ball"))
    bpy.context.scene.collection.objects.link(made)
    made.select_set(True)
    bpy.context.view_layer.objects.active = made
    with override():
        bpy.ops.ed.undo_push(message="ball")
        before = time.perf_counter()
        assert bpy.ops.filigree.make_driver("INVOKE_DEFAULT", vertices=1000) == {"RUNNING_MODAL"}
        assert time.perf_counter() - before < 1
    press("ESC")


@step
def it_ended():
    assert high().filigree.driver is None and high().filigree.model is None and len(bpy.data.objects) == 1
    with override():
        bpy.ops.filigree.make_driver("INVOKE_DEFAULT", vertices=1000)


@step
def it_is_done():
    if high().filigree.driver is None:
        return "wait"
    assert high().filigree.message == "", high().filigree.message
    bpy.context.scene.frame_end = 400
    with override():
        bpy.ops.filigree.bake("INVOKE_DEFAULT", filepath=os.path.join(bpy.app.tempdir, "long.pc2"))


@step
def a_bake_ends():
    press("ESC")


@step
def nothing_is_left():
    assert "Filigree baked" not in high().modifiers
    assert not [name for name in os.listdir(bpy.app.tempdir) if name.startswith("long")]
    with override():
        bpy.ops.ed.undo()
    assert high().filigree.driver is None and len(bpy.data.objects) == 1


def advance():
    try:
        if not STEPS:
            print("window passed", flush=True)
            os._exit(0)
        if STEPS[0]() != "wait":
            STEPS.pop(0)
    except BaseException:
        traceback.print_exc()
        os._exit(1)
    return 3.0


bpy.app.timers.register(advance, first_interval=1.0)
