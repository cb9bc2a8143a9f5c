#!/usr/bin/env python3
"""Processor time and memory of every command over a ladder of sizes, each twice the one before: neither may grow more
than 2.5 times a rung. Shared machines are faster in one minute than in the next: a run of always the same work before
each command says how fast, and seconds are those of a machine as fast as in the middle of all these runs. What takes
little is run three times, and the least counts.

Usage: bounds.py PROGRAM [--rungs N] [--first VERTICES] [--json FILE]     (4 rungs from 125,000 vertices)
"""
import argparse
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

MOST = 2.5  # times, a rung
LEAST_SECONDS, LEAST_MIB = 0.3, 60  # below, what a program costs at all counts for more than its input
TRIES, MOST_SECONDS_OF_TRIES = 3, 6

COMMANDS = {  # in their order: later ones read what earlier ones wrote
    "info": "info {mesh} --json",
    "strip": "strip {mesh} -o {folder}/plain.fil --base 1000",
    "strip --reorder": "strip {mesh} -o {folder}/reordered.fil --base 1000 --reorder",
    "strip --code reference": "strip {mesh} -o {folder}/reference.fil --code reference",
    "level": "level {folder}/plain.fil 1 -o {folder}/level.ply",
    "deform mesh": "deform {mesh} -o {folder}/bent.ply --bend 60",
    "deform model": "deform {folder}/plain.fil -o {folder}/restored.ply --bend 60",
    "deform to poses": "deform {folder}/plain.fil -o {folder}/clip.fil --bend 60 --frames 8",
    "restore": "restore {folder}/clip.fil --frames -o {folder}/clip.pc2",
    "compare": "compare {folder}/bent.ply {folder}/restored.ply --json",
    "sample scan": "sample {mesh} -o {folder}/points.ply --count {vertices}",
    "sample rays": "sample {mesh} -o {folder}/points.ply --count {vertices} --method rays",
    "sample poisson": "sample {mesh} -o {folder}/points.ply --count {vertices} --pattern poisson",
    "remesh": "remesh {mesh} -o {folder}/quads.ply --quads {vertices}",
    "fracture": "fracture {mesh} -o {folder}/pieces.ply --pieces 20",
    "pack": "pack {triangles} -o {folder}/packed.fil",
    "pack --profile stream": "pack {triangles} -o {folder}/stream.fil --profile stream",
    "pack --profile lossless": "pack {folder}/plain.fil -o {folder}/lossless.fil --profile lossless",
    "unpack": "unpack {folder}/packed.fil -o {folder}/unpacked.fil",
    "export skin": "export {folder}/clip.fil -o {folder}/skin.glb",
    "export --compress": "export {folder}/clip.fil -o {folder}/small.glb --compress",
    "render": "render {mesh} -o {folder}/picture.png --size 320x240",
}


def measure(words):
    """Seconds on processors, and MiB at most."""
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    said = process.stderr.read().decode()
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"bounds: {' '.join(words)}: {said.strip()}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def measured_with_pace(words, same_work):
    """The same, at the least of some tries, with the seconds of the same work beside it."""
    tries = []
    while len(tries) < TRIES and sum(seconds for seconds, _, _ in tries) < MOST_SECONDS_OF_TRIES:
        pace = measure(same_work)[0]
        tries.append((*measure(words), pace))
    return min(tries, key=lambda t: t[0] / t[2])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--rungs", type=int, default=4)
    parser.add_argument("--first", type=int, default=125_000)
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    program = str(options.program.resolve())
    rows, sizes, paces = {name: [] for name in COMMANDS}, [], []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        always, moved = folder / "always.ply", folder / "moved.ply"
        measure([program, "make", "wavy-cube", "--resolution", "104", "-o", str(always)])
        measure([program, "deform", str(always), "-o", str(moved), "--bend", "60"])
        same_work = [program, "compare", str(always), str(moved), "--quiet"]
        for rung in range(options.rungs):
            side = 8 * round(math.sqrt(options.first * 2**rung / 6) / 8)  # so that rows can go
            vertices = 6 * side * side + 2
            sizes.append(vertices)
            mesh, triangles = folder / "mesh.ply", folder / "triangles.stl"
            measure([program, "make", "wavy-cube", "--resolution", str(side), "-o", str(mesh)])
            measure([program, "deform", str(mesh), "-o", str(triangles), "--stretch", "1"])
            for command, words in COMMANDS.items():
                filled = words.format(mesh=mesh, triangles=triangles, folder=folder, vertices=vertices)
                rows[command].append(measured_with_pace([program, *filled.split(), "--quiet"], same_work))
                paces.append(rows[command][-1][2])
            print(f"bounds: {vertices:,} vertices done", file=sys.stderr, flush=True)
    middle = statistics.median(paces)
    rows = {command: [(seconds * middle / pace, mib) for seconds, mib, pace in row] for command, row in rows.items()}
    told, over = {}, []
    print(f"{'':24} {'seconds, processor':>36} {'growth':>7} {'MiB':>28} {'growth':>7}")
    for command, measured in rows.items():
        growth = []
        for which, least in ((0, LEAST_SECONDS), (1, LEAST_MIB)):
            steps = [after[which] / before[which] * 2 * sizes[k] / sizes[k + 1]  # as if it were twice, to the vertex
                     for k, (before, after) in enumerate(zip(measured, measured[1:])) if before[which] >= least]
            growth.append(max(steps, default=0))
        told[command] = {"seconds": [m[0] for m in measured], "mib": [m[1] for m in measured],
                         "seconds_growth": growth[0], "mib_growth": growth[1]}
        if max(growth) > MOST:
            over.append(command)
        seconds = " ".join(f"{m[0]:8.2f}" for m in measured)
        memory = " ".join(f"{m[1]:6.0f}" for m in measured)
        print(f"{command:24} {seconds:>36} {growth[0]:>7.2f} {memory:>28} {growth[1]:>7.2f}")
    if options.json:
        options.json.write_text(json.dumps({"first": options.first, "rungs": options.rungs, "commands": told}, indent=1))
    if over:
        print(f"bounds: more than {MOST} times a rung: {', '.join(over)}", file=sys.stderr)
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
