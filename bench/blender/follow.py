"""Frames a second of a mesh that follows a driver: Filigree's add-on and Blender's Surface Deform, in turn, in one run.

Run by scripts/bench-blender, inside Blender. Arguments: vertices of the driver, frames of a round, rounds, mesh files.
"""

import statistics
import sys
import time

import bpy
import numpy as np

import filigree
import filigree_detail
from filigree_detail import meshes

BEND = 0.8  # radians, to and fro


def add(mesh, name):
    made = bpy.data.objects.new(name, meshes.blender_mesh(mesh, name))
    bpy.context.scene.collection.objects.link(made)
    for other in bpy.context.view_layer.objects:
        other.select_set(other == made)
    bpy.context.view_layer.objects.active = made
    return made


def only(*objects):
    """A file with nothing else in its scene."""
    for obj in list(bpy.context.scene.collection.objects):
        bpy.context.scene.collection.objects.unlink(obj)
    for obj in objects:
        bpy.context.scene.collection.objects.link(obj)


def moved(driver, frames):
    modifier = driver.modifiers.new("Bend", "SIMPLE_DEFORM")
    modifier.deform_method, modifier.deform_axis = "BEND", "Z"
    for frame, angle in ((1, -BEND), (frames, BEND)):
        modifier.angle = angle
        modifier.keyframe_insert("angle", frame=frame)


def play(objects, frames):
    """Wall and processor seconds of each frame, medians."""
    only(*objects)
    scene, wall, processor = bpy.context.scene, [], []
    scene.frame_set(1)
    for frame in range(2, frames + 1):
        before, before_processor = time.perf_counter(), time.process_time()
        scene.frame_set(frame)
        wall.append(time.perf_counter() - before)
        processor.append(time.process_time() - before_processor)
    return statistics.median(wall), statistics.median(processor)


def surface_deform(mesh, driver_mesh, frames):
    """The same pair under Surface Deform. It refuses drivers with faces that are not convex or edges of three faces;
    then a ball of about as many vertices is its driver."""
    high = add(mesh, "theirs")
    for light in (driver_mesh, "ball"):
        if light == "ball":
            box = mesh.bounds
            ball = filigree.make("wavy-sphere", resolution=max(2, round((len(driver_mesh.vertices) / 6) ** 0.5)), amplitude=0)
            light = ball.with_vertices(ball.vertices * (box[1] - box[0]) * 1.2 + (box[0] + box[1]) / 2)
        driver = add(light, "their driver")
        modifier = high.modifiers.new("Surface Deform", "SURFACE_DEFORM")
        modifier.target = driver
        bpy.context.view_layer.objects.active = high
        before = time.perf_counter()
        with bpy.context.temp_override(object=high, active_object=high):
            bpy.ops.object.surfacedeform_bind(modifier=modifier.name)
        seconds = time.perf_counter() - before
        if modifier.is_bound:
            moved(driver, frames)
            return (high, driver), seconds, light is driver_mesh
        high.modifiers.remove(modifier)
        bpy.data.objects.remove(driver)
    return None, seconds, False


def measure(path, base, frames, rounds):
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    mesh = filigree.read_mesh(path)
    mesh = filigree.Mesh(mesh.vertices, mesh.corners, mesh.face_offsets)
    high = add(mesh, "ours")
    before = time.perf_counter()
    bpy.ops.filigree.make_driver(vertices=base)
    bound = time.perf_counter() - before
    settings = high.filigree
    driver_mesh = meshes.filigree_mesh(settings.driver.data)
    moved(settings.driver, frames)
    ours = (high, settings.driver, settings.anchor)
    theirs, their_bound, same_driver = surface_deform(mesh, driver_mesh, frames)
    measured = {"ours": [], "theirs": []}
    for _ in range(rounds):
        measured["ours"].append(play(ours, frames))
        if theirs:
            measured["theirs"].append(play(theirs, frames))
    assert settings.message == "", settings.message
    best = {who: [min(x) for x in zip(*times)] for who, times in measured.items()}
    name = path.rsplit("/", 1)[-1]
    wall, processor = best["ours"]
    print(f"follow {name}: {len(mesh.vertices):,} vertices, driver {len(driver_mesh.vertices):,}")
    print(f"follow   Filigree        {1e3 * wall:8.1f} ms a frame, {1e3 * processor:8.1f} of the processor; made and bound in {bound:.2f} s")
    if theirs:
        their_wall, their_processor = best["theirs"]
        note = "" if same_driver else "; refused our driver, so by a ball of as many vertices"
        print(f"follow   Surface Deform  {1e3 * their_wall:8.1f} ms a frame, {1e3 * their_processor:8.1f} of the processor; bound in {their_bound:.2f} s{note}")
        print(f"follow   frames a second over Surface Deform's: {their_wall / wall:.2f}; by processor time {their_processor / processor:.2f}")
    else:
        print("follow   Surface Deform could not be bound at all")


def bind_all(paths):
    """Whether each mesh can be bound, by both."""
    ours = theirs = 0
    for path in paths:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        try:
            mesh = filigree.read_mesh(path)
        except filigree.Error as error:
            print(f"bind {path.rsplit('/', 1)[-1]}: not read: {error}")
            continue
        mesh = filigree.Mesh(mesh.vertices, mesh.corners, mesh.face_offsets)
        high = add(mesh, "ours")
        bpy.ops.filigree.make_driver(vertices=max(50, min(1000, len(mesh.vertices) // 20)))
        depsgraph = bpy.context.evaluated_depsgraph_get()
        shown = meshes.vertices_of(high.evaluated_get(depsgraph).data)
        size = max(float(np.linalg.norm(np.ptp(shown, axis=0))), 1e-30)
        error = float(np.abs(shown - meshes.vertices_of(high.data)).max()) / size
        follows = high.filigree.message == "" and error < 1e-6
        pair, _, same = surface_deform(mesh, meshes.filigree_mesh(high.filigree.driver.data), 2)
        ours, theirs = ours + follows, theirs + bool(pair and same)
        said = "follows" if follows else f"off by {error:.1e}: {high.filigree.message}"
        print(f"bind {path.rsplit('/', 1)[-1]}: {said}; Surface Deform {'bound' if pair and same else 'refused'}")
    print(f"bind {len(paths)} meshes: {ours} follow their drivers; Surface Deform took {theirs} of those drivers")


filigree_detail.register()
words = sys.argv[sys.argv.index("--") + 1:]
if words[0] == "bind":
    bind_all(words[1:])
else:
    for mesh_path in words[3:]:
        measure(mesh_path, int(words[0]), int(words[1]), int(words[2]))
