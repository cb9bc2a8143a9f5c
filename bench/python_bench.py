#!/usr/bin/env python3
"""The Python module beside C++, in one run: each task in turn by both, and the ratio of the medians.

Usage: bench/python_bench.py [MESH] [--threads N] [--rounds N]     (scripts/build release bench builds what it takes)
Without a mesh: a wavy cube of 437,402 vertices, as many as the dragon has.
"""
import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy

BUILD = Path(__file__).resolve().parent.parent / "build" / "release"
sys.path.insert(0, str(BUILD / "python"))
import filigree  # noqa: E402

RESTORES, CALLS = 20, 20000


def seconds_of(times, work):
    """Mean of so many times."""
    start = time.perf_counter()
    for _ in range(times):
        work()
    return (time.perf_counter() - start) / times


def tasks_of(mesh, threads):
    model = filigree.strip(mesh, base=1000, threads=threads)
    restorer = filigree.Restorer(model)
    out = numpy.empty((len(restorer), 3), numpy.float32)
    pose = filigree.bend(mesh, "y", 60)(model)
    positions, gradients = numpy.array(pose.positions), numpy.array(pose.gradients)

    small = filigree.strip(mesh, base=50, threads=threads).driver
    tiny = filigree.Restorer(filigree.strip(small, base=50))
    tiny_out = numpy.empty((len(tiny), 3), numpy.float32)
    tiny_pose = filigree.bend(small, "y", 60)(tiny.model)
    tiny_positions, tiny_gradients = numpy.array(tiny_pose.positions), numpy.array(tiny_pose.gradients)

    body = filigree.Body(mesh, filigree.Material("wood", young_modulus=1e5, density=1000, damping=0.5), threads=threads)
    simulation = filigree.Simulation([body], mode="explicit", threads=threads)
    return len(tiny), {
        "restore": lambda: seconds_of(
            RESTORES, lambda: restorer.positions(positions, gradients, out=out, threads=threads)
        ),
        "restore positions": lambda: seconds_of(RESTORES, lambda: restorer.positions(positions, out=out, threads=threads)),
        "call": lambda: seconds_of(
            CALLS, lambda: tiny.positions(tiny_positions, tiny_gradients, out=tiny_out, threads=threads)
        ),
        "strip": lambda: seconds_of(1, lambda: filigree.strip(mesh, base=1000, threads=threads)),
        "body step": lambda: seconds_of(1, simulation.step),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", nargs="?")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=15)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = options.mesh or str(Path(folder) / "cube.ply")
        if not options.mesh:
            filigree.write_mesh(filigree.make("wavy-cube", resolution=270), path)
        mesh = filigree.read_mesh(path)
        command = [str(BUILD / "bin" / "python_pair"), path, str(options.threads)]
        other = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        vertices, tasks = tasks_of(mesh, options.threads)
        assert int(other.stdout.readline()) == vertices
        print(f"{len(mesh.vertices):,} vertices, {options.threads} threads, medians of {options.rounds}")
        print(f"{'':18} {'C++':>12} {'Python':>12}   ratio   (least, most of a round)")
        for name, work in tasks.items():
            ours, theirs = [], []
            for _ in range(options.rounds + 1):
                other.stdin.write(name + "\n")
                theirs.append(float(other.stdout.readline()))
                ours.append(work())
            ours, theirs = ours[1:], theirs[1:]  # the first is warm-up
            ratios = [a / b for a, b in zip(ours, theirs)]
            label = f"call, {vertices} vertices" if name == "call" else name
            a, b = statistics.median(theirs), statistics.median(ours)
            print(f"{label:18} {1e3 * a:9.4f} ms {1e3 * b:9.4f} ms   {b / a:.3f}   ({min(ratios):.2f}, {max(ratios):.2f})")
        other.stdin.close()
        other.wait(10)


main()
