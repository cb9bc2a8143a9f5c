"""Blender's QuadriFlow: turns a mesh into quads and says how long that took.

    blender -b --factory-startup --python bench/peers/blender_quadriflow.py -- MESH.ply -o QUADS.ply --quads N

MESH: PLY. Vertices at one place are merged first, as ours are, for QuadriFlow takes them for holes. Boundaries and sharp
edges are kept, as a user would ask for; all else as Blender has it. Prints "seconds S" of the remeshing alone. Exit code 3 where Blender refuses the mesh.
"""
import argparse
import array
import sys
import time

import bmesh
import bpy


def merge_doubles(mesh):
    edit = bmesh.new()
    edit.from_mesh(mesh)
    size = max(high - low for low, high in ((min(axis), max(axis)) for axis in zip(*(v.co for v in edit.verts))))
    bmesh.ops.remove_doubles(edit, verts=edit.verts, dist=1e-7 * size)
    edit.to_mesh(mesh)
    edit.free()


def write_ply(path, mesh):
    flat = array.array("f", bytes(12 * len(mesh.vertices)))
    mesh.vertices.foreach_get("co", flat)
    with open(path, "wb") as out:
        out.write(
            f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.vertices)}\n"
            "property float x\nproperty float y\nproperty float z\n"
            f"element face {len(mesh.polygons)}\nproperty list uchar int vertex_indices\nend_header\n".encode()
        )
        out.write(flat.tobytes())
        for face in mesh.polygons:
            out.write(bytes([len(face.vertices)]) + array.array("i", face.vertices).tobytes())


def main():
    parser = argparse.ArgumentParser(prog="blender_quadriflow")
    parser.add_argument("mesh")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--quads", type=int, required=True)
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="io_mesh_ply")
    bpy.ops.import_mesh.ply(filepath=options.mesh)
    fine = bpy.context.selected_objects[0]
    bpy.context.view_layer.objects.active = fine
    merge_doubles(fine.data)

    before = len(fine.data.polygons), len(fine.data.vertices)
    start = time.perf_counter()
    try:
        done = bpy.ops.object.quadriflow_remesh(
            mode="FACES", target_faces=options.quads, use_preserve_boundary=True, use_preserve_sharp=True
        )
    except RuntimeError as error:  # what Blender would show in its status bar
        print(f"refused {error}".strip().replace("\n", " "), flush=True)
        sys.exit(3)
    seconds = time.perf_counter() - start
    if done != {"FINISHED"} or (len(fine.data.polygons), len(fine.data.vertices)) == before:
        print("refused Blender left the mesh as it was", flush=True)
        sys.exit(3)
    print(f"seconds {seconds:.6g}", flush=True)
    write_ply(options.output, fine.data)


main()
