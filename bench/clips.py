#!/usr/bin/env python3
"""What clips take, in bits a driver vertex and frame, and how far restored vertices are off: a bend with a twist, and a wobble.

Usage: bench/clips.py [MESH] [--base N] [--frames N]     (scripts/build release python builds what it takes)
The wobble is 24 sines that travel through the mesh, each along a direction of its own; positions and exact gradients.
Without a mesh: a wavy cube of 437,402 vertices, as many as the dragon has.
"""
import argparse
import sys
import tempfile
from pathlib import Path

import numpy

BUILD = Path(__file__).resolve().parent.parent / "build" / "release"
sys.path.insert(0, str(BUILD / "python"))
import filigree  # noqa: E402

SINES, HEIGHT = 24, 0.02  # together about a fiftieth of the diagonal


def bend_and_twist(mesh, model, frames):
    for k in range(1, frames + 1):
        t = k / frames
        yield filigree.chain(filigree.bend(mesh, "y", 90 * t), filigree.twist(mesh, "y", 90 * t))(model)


def wobble(rest, frames):
    """x + sum of a sin(k.x - w t), with its gradient I + sum of a cos(k.x - w t) k^T."""
    random = numpy.random.default_rng(1)
    diagonal = numpy.linalg.norm(numpy.ptp(rest, axis=0))
    waves = 2 * numpy.pi / diagonal * random.uniform(0.5, 3, SINES)[:, None] * directions(random)
    heights = HEIGHT * diagonal / numpy.sqrt(SINES) * directions(random)
    pace = 2 * numpy.pi * random.uniform(0.5, 2, SINES)
    for k in range(1, frames + 1):
        phase = rest @ waves.T - pace * k / 60
        gradients = numpy.eye(3) + numpy.einsum("vs,si,sj->vij", numpy.cos(phase), heights, waves)
        yield filigree.Pose(rest + numpy.sin(phase) @ heights, gradients)


def directions(random):
    vectors = random.normal(size=(SINES, 3))
    return vectors / numpy.linalg.norm(vectors, axis=1)[:, None]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", nargs="?")
    parser.add_argument("--base", type=int, default=1000)
    parser.add_argument("--frames", type=int, default=120)
    options = parser.parse_args()
    mesh = filigree.read_mesh(options.mesh) if options.mesh else filigree.make("wavy-cube", resolution=270)
    model = filigree.strip(mesh, base=options.base)
    rest = numpy.array(model.driver.vertices, numpy.float64)
    restorer = filigree.Restorer(model)
    diagonal = numpy.linalg.norm(numpy.ptp(mesh.vertices, axis=0))
    clips = {
        "bend and twist": list(bend_and_twist(mesh, model, options.frames)),
        "wobble": list(wobble(rest, options.frames)),
    }
    print(f"{len(mesh.vertices):,} vertices, driver of {len(rest):,}, {options.frames} frames")
    for name, poses in clips.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "clip.fil"
            size = filigree.pack(model, path, poses=poses)["bytes"]
            coded = filigree.read_poses(path)
            file = path.stat().st_size
        squares = []
        for pose, read in zip(poses, coded):
            off = restorer.positions(pose) - restorer.positions(read)
            squares.append((off**2).sum(axis=1).mean())
        rms = numpy.sqrt(numpy.mean(squares)) / diagonal
        bits = 8 * size["clips"] / len(rest) / options.frames
        print(f"{name:15} {bits:6.2f} bits a driver vertex and frame, restored rms {rms:.1e} of the diagonal, {file:,} bytes in all")


if __name__ == "__main__":
    main()
