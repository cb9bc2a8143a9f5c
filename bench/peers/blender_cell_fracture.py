"""Blender's Cell Fracture: breaks a mesh with its own seeds, and says how long it took and what came out.

    blender -b --factory-startup -t 1 --python bench/peers/blender_cell_fracture.py -- MESH [PIECES]

MESH is PLY or OBJ. Prints "name value unit" lines: seconds, pieces, pieces that are not closed, and how far their
volumes are from adding up to the mesh's.
"""
import sys
import time

import addon_utils
import bmesh
import bpy


def volume_and_open_edges(data):
    mesh = bmesh.new()
    mesh.from_mesh(data)
    bmesh.ops.remove_doubles(mesh, verts=mesh.verts, dist=0)
    open_edges = sum(1 for edge in mesh.edges if len(edge.link_faces) != 2)
    volume = mesh.calc_volume(signed=True)
    mesh.free()
    return volume, open_edges


def main():
    arguments = sys.argv[sys.argv.index("--") + 1:]
    path, pieces = arguments[0], int(arguments[1]) if len(arguments) > 1 else 20
    addon_utils.enable("object_fracture_cell")
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    if path.lower().endswith(".obj"):
        bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z")
    else:
        bpy.ops.import_mesh.ply(filepath=path)
    whole = bpy.context.selected_objects[0]
    bpy.context.view_layer.objects.active = whole
    volume, _ = volume_and_open_edges(whole.data)

    before = set(bpy.data.objects)
    start = time.perf_counter()
    bpy.ops.object.add_fracture_cell_objects(source={"VERT_OWN"}, source_limit=pieces, source_noise=0, use_recenter=False,
                                             use_smooth_faces=False, use_sharp_edges=False, use_data_match=False,
                                             use_island_split=False, margin=0, recursion=0)
    seconds = time.perf_counter() - start
    made = [volume_and_open_edges(o.data) for o in bpy.data.objects if o not in before and o.type == "MESH"]
    print(f"cellfracture.seconds {seconds:.6g} s", flush=True)
    print(f"cellfracture.pieces {len(made)} pieces", flush=True)
    print(f"cellfracture.open {sum(1 for _, edges in made if edges)} pieces", flush=True)
    print(f"cellfracture.volume_error {abs(sum(v for v, _ in made) / volume - 1):.3e} part", flush=True)


main()
