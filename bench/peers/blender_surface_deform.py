"""Blender's Surface Deform: binds a fine mesh to a driver, moves the driver, and times bind and frames.

    blender -b --factory-startup -t 1 --python bench/peers/blender_surface_deform.py -- FINE [--driver DRIVER --posed POSED] [-o OUT.ply]

Meshes are PLY or OBJ. Without a driver, Decimate makes one of --faces triangles, and it is bent a little every frame.
With one, POSED (the same vertices, moved) is the last frame, and -o keeps the restored vertices as a PLY.
Prints "name value unit" lines, each time the median of the frames.
"""
import argparse
import array
import math
import statistics
import sys
import time

import bmesh
import bpy


def import_mesh(path):
    if path.lower().endswith(".obj"):
        bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z")
    else:
        bpy.ops.import_mesh.ply(filepath=path)
    return bpy.context.selected_objects[0]


def positions(mesh):
    flat = array.array("f", bytes(12 * len(mesh.vertices)))
    mesh.vertices.foreach_get("co", flat)
    return flat


def set_positions(mesh, flat):
    mesh.vertices.foreach_set("co", flat)
    mesh.update()


def evaluated(target):
    return target.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def seconds(work):
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def report(name, value, unit):
    print(f"blender.{name} {value:.6g} {unit}", flush=True)


def decimate(fine, faces):
    """A driver of about `faces` triangles, and how long it took."""
    copy = fine.copy()
    copy.data = fine.data.copy()
    bpy.context.collection.objects.link(copy)
    modifier = copy.modifiers.new("decimate", "DECIMATE")
    modifier.ratio = faces / len(fine.data.polygons)
    taken = seconds(lambda: evaluated(copy))
    driver_mesh = bpy.data.meshes.new_from_object(copy.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    bpy.data.objects.remove(copy)
    make_bindable(driver_mesh)
    driver = bpy.data.objects.new("driver", driver_mesh)
    bpy.context.collection.objects.link(driver)
    return driver, taken


def make_bindable(mesh):
    """Takes away what Surface Deform refuses to bind to: doubled vertices, third faces at an edge, loose vertices."""
    edit = bmesh.new()
    edit.from_mesh(mesh)
    size = max(high - low for low, high in ((min(axis), max(axis)) for axis in zip(*(v.co for v in edit.verts))))
    bmesh.ops.remove_doubles(edit, verts=edit.verts, dist=1e-4 * size)
    extra = {face for edge in edit.edges for face in list(edge.link_faces)[2:]}
    bmesh.ops.delete(edit, geom=list(extra), context="FACES")
    bmesh.ops.delete(edit, geom=[vertex for vertex in edit.verts if not vertex.link_faces], context="VERTS")
    edit.to_mesh(mesh)
    edit.free()


def swayed(rest, frame):
    """The driver's rest positions swayed along x by a tenth of the box: something else in every frame."""
    low, high = min(rest[2::3]), max(rest[2::3])
    moved = array.array("f", rest)
    for i in range(0, len(moved), 3):
        moved[i] += 0.1 * (high - low) * math.sin(3 * (rest[i + 2] - low) / (high - low) + frame)
    return moved


def write_ply(path, flat, faces):
    with open(path, "wb") as out:
        out.write(
            f"ply\nformat binary_little_endian 1.0\nelement vertex {len(flat) // 3}\n"
            "property float x\nproperty float y\nproperty float z\n"
            f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n".encode()
        )
        out.write(flat.tobytes())
        for face in faces:
            out.write(bytes([len(face.vertices)]) + array.array("i", face.vertices).tobytes())


def median_frame(driver, fine, frames):
    """Median seconds from a moved driver to the fine mesh."""
    times = []
    for pose in frames:
        set_positions(driver.data, pose)
        driver.data.update_tag()
        times.append(seconds(lambda: evaluated(fine)))
    return statistics.median(times)


def median_hooked_frame(modifier, fine, frames):
    """Median seconds of a frame with the cheapest modifier in place of `modifier`: what every frame costs, whoever deforms."""
    empty = bpy.data.objects.new("hook", None)
    bpy.context.collection.objects.link(empty)
    hook = fine.modifiers.new("hook", "HOOK")
    hook.object = empty
    modifier.show_viewport = False
    evaluated(fine)
    times = []
    for frame in range(frames):
        empty.location.x = 0.01 * frame
        times.append(seconds(lambda: evaluated(fine)))
    fine.modifiers.remove(hook)
    modifier.show_viewport = True
    return statistics.median(times)


def main():
    parser = argparse.ArgumentParser(prog="blender_surface_deform")
    parser.add_argument("fine")
    parser.add_argument("--driver")
    parser.add_argument("--posed")
    parser.add_argument("--faces", type=int, default=2000, help="of the driver, when Decimate makes it")
    parser.add_argument("--frames", type=int, default=7)
    parser.add_argument("-o", "--output")
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="io_mesh_ply")
    fine = import_mesh(options.fine)
    report("vertices", len(fine.data.vertices), "vertices")
    if options.driver:
        driver = import_mesh(options.driver)
    else:
        driver, taken = decimate(fine, options.faces)
        report("decimate", taken, "s")
    report("driver", len(driver.data.vertices), "vertices")

    modifier = fine.modifiers.new("wrap", "SURFACE_DEFORM")
    modifier.target = driver
    bpy.context.view_layer.objects.active = fine
    bind = lambda: bpy.ops.object.surfacedeform_bind(modifier=modifier.name)
    report("bind", seconds(bind), "s")
    if not modifier.is_bound:
        sys.exit("Blender refused to bind")

    rest = positions(driver.data)
    frames = [swayed(rest, frame) for frame in range(options.frames)]
    whole = median_frame(driver, fine, frames)
    other = median_hooked_frame(modifier, fine, options.frames)
    report("frame", whole, "s")
    report("frame_of_hook", other, "s")
    report("surface_deform_frame", len(fine.data.vertices) / whole, "vertices/s")
    if whole > other:
        report("surface_deform", len(fine.data.vertices) / (whole - other), "vertices/s")

    if options.posed:
        posed = import_mesh(options.posed)
        if len(posed.data.vertices) != len(driver.data.vertices):
            sys.exit("the posed driver has other vertices than the driver")
        set_positions(driver.data, positions(posed.data))
        driver.data.update_tag()
    if options.output:
        result = evaluated(fine)
        write_ply(options.output, positions(result), result.polygons)


main()
