#!/usr/bin/env python3
"""Bits a vertex of meshes, `pack` beside Draco with as many bits: positions and faces alone, and with texture
coordinates and normals.

Usage: bench/coded_meshes.py PROGRAM MESH...
Blender makes the charts (Smart UV Project) and smooth normals; draco_encoder is Debian's package draco.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

UNWRAP = """
import bpy, math, sys
source, target = sys.argv[-2:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.obj_import(filepath=source)
bpy.context.view_layer.objects.active = bpy.context.selected_objects[0]
bpy.ops.object.shade_smooth()
bpy.ops.object.mode_set(mode="EDIT")
bpy.ops.mesh.select_all(action="SELECT")
bpy.ops.uv.smart_project(angle_limit=math.radians(66), island_margin=0.002)
bpy.ops.object.mode_set(mode="OBJECT")
bpy.ops.wm.obj_export(filepath=target, export_materials=False)
"""


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"bench/coded_meshes.py: {' '.join(map(str, words))}: {done.stderr.strip()}")
    return done.stdout


def row(program, folder, mesh, bits, what):
    coded, draco = folder / "coded.fil", folder / "mesh.drc"
    packed = json.loads(run(program, "pack", mesh, "-o", coded, "--bits", bits, "--json"))
    vertices, part = packed["vertices"], packed["bits_per_vertex"]
    run("draco_encoder", "-i", mesh, "-o", draco, "-qp", bits, "-qt", 12, "-qn", 10, "-cl", 10)
    peer = 8 * draco.stat().st_size / vertices
    ours = part["connectivity"] + part["places"] + (part["attributes"] if "charts" in what else 0)
    print(f"{what:36} {vertices:>9,} {ours:>8.2f} {part['attributes']:>12.2f} {peer:>13.2f} {ours / peer:>7.2f}")


def rows(program, folder, mesh):
    source, plain, script, dressed = (folder / name for name in ("source.obj", "plain.obj", "unwrap.py", "dressed.obj"))
    run(program, "deform", mesh, "--stretch", 1, "-o", source)  # a copy as OBJ
    lines = source.read_text().splitlines()
    plain.write_text("\n".join(re.sub(r"/[0-9/]*", "", line) for line in lines if line.startswith(("v ", "f "))) + "\n")
    for bits in (12, 14):
        row(program, folder, plain, bits, f"{mesh.stem}, {bits} bits")
    script.write_text(UNWRAP)
    run("blender", "-b", "--python-exit-code", "1", "--python", script, "--", plain, dressed)
    row(program, folder, dressed, 14, f"{mesh.stem}, 14, charts and normals")


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__.strip())
    print(f"{'':36} {'vertices':>9} {'ours':>8} {'(attributes)':>12} {'Draco -cl 10':>13} {'ratio':>7}")
    with tempfile.TemporaryDirectory() as name:
        for mesh in sys.argv[2:]:
            rows(pathlib.Path(sys.argv[1]), pathlib.Path(name), pathlib.Path(mesh))


if __name__ == "__main__":
    main()
