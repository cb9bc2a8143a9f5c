#!/usr/bin/env python3
"""What a texture costs a stream: bits a vertex of texture coordinates in one piece and in levels, and the first level
with and without them.

Usage: bench/textured_streams.py PROGRAM MESH...
Blender makes the charts (Smart UV Project).
"""

import json
import pathlib
import re
import sys
import tempfile

from coded_meshes import UNWRAP, run


def packed(program, folder, mesh, profile):
    return json.loads(run(program, "pack", mesh, "-o", folder / "coded.fil", "--profile", profile, "--json"))


def row(program, folder, mesh):
    source, plain, script, dressed = (folder / name for name in ("source.obj", "plain.obj", "unwrap.py", "dressed.obj"))
    run(program, "deform", mesh, "--stretch", 1, "-o", source)  # a copy as OBJ
    lines = [line for line in source.read_text().splitlines() if line.startswith(("v ", "f "))]
    plain.write_text("\n".join(re.sub(r"/[0-9/]*", "", line) for line in lines) + "\n")
    script.write_text(UNWRAP.replace("export_materials=False", "export_materials=False, export_normals=False"))
    run("blender", "-b", "--python-exit-code", "1", "--python", script, "--", plain, dressed)
    one_piece = packed(program, folder, dressed, "compact")
    without, textured = packed(program, folder, plain, "stream"), packed(program, folder, dressed, "stream")
    cost = textured["bits_per_vertex"]["all"] - without["bits_per_vertex"]["all"]
    first = [f"{of['stream'][0]['vertices']:,} vertices, {of['stream'][0]['bytes']:,} bytes" for of in (without, textured)]
    print(f"{mesh.stem:20} {one_piece['bits_per_vertex']['attributes']:>9.2f} {cost:>9.2f}   {first[0]:28} {first[1]}")


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__.strip())
    print(f"{'':20} {'one piece':>9} {'levels':>9}   {'first level without':28} with")
    with tempfile.TemporaryDirectory() as name:
        for mesh in sys.argv[2:]:
            row(pathlib.Path(sys.argv[1]), pathlib.Path(name), pathlib.Path(mesh))


if __name__ == "__main__":
    main()
