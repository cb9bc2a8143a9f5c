#!/usr/bin/python3
"""What `strip --reorder` gains on a mesh whose order is hopeless: restoring a shuffled cube, and the same renumbered.

Usage: bench/reorder.py PROGRAM [RESOLUTION]     (640: 2.5 million vertices; one thread)
"""

import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np


def run(*words):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True).stdout


def shuffle(source, target):
    """Vertices and faces of a PLY of float positions alone and quads, in any order."""
    data = source.read_bytes()
    begin = data.index(b"end_header\n") + len(b"end_header\n")
    head = data[:begin].decode()
    vertices, faces = (int(head.split(f"element {what} ")[1].split()[0]) for what in ("vertex", "face"))
    quads = np.dtype([("n", "u1"), ("corners", "<i4", 4)])
    positions = np.frombuffer(data, "<f4", 3 * vertices, begin).reshape(-1, 3)
    records = np.frombuffer(data, quads, faces, begin + positions.nbytes).copy()
    random = np.random.default_rng(1)
    order = random.permutation(vertices)
    number = np.empty(vertices, "<i4")
    number[order] = np.arange(vertices)
    records["corners"] = number[records["corners"]]
    target.write_bytes(data[:begin] + positions[order].tobytes() + records[random.permutation(faces)].tobytes())


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__.strip())
    program, resolution = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else 640
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        made, shuffled, model, renumbered = (folder / file for file in ("made.ply", "shuffled.ply", "m.fil", "new.ply"))
        run(program, "make", "wavy-cube", "--resolution", resolution, "-o", made)
        shuffle(made, shuffled)
        run(program, "strip", shuffled, "-o", model, "--reorder")
        finest = len(json.loads(run(program, "info", model, "--json"))["levels"]) - 1
        run(program, "level", model, finest, "-o", renumbered)
        speeds = []
        for mesh in (shuffled, renumbered):
            results = json.loads(run(program, "bench", "restore", "--mesh", mesh, "--threads", 1, "--json"))["results"]
            speeds.append({result["name"]: result["value"] for result in results})
        print(f"{'million vertices a second':44} {'shuffled':>9} {'renumbered':>11} {'ratio':>6}")
        for what in ("float.in_mesh_order", "float.in_mesh_order.with_normals"):
            before, after = (speed[f"restore.{what}"] / 1e6 for speed in speeds)
            print(f"{what:44} {before:9.0f} {after:11.0f} {after / before:6.2f}")


if __name__ == "__main__":
    main()
