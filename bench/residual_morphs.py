#!/usr/bin/env python3
"""Whether morph targets beside a fitted driver pay: what they leave of the error, and the bytes of both.

Usage: bench/residual_morphs.py [--resolution 36]     (a few minutes; scripts/build release bench builds what it takes)
Three faces by formulas, of 60 frames: smooth bulges, wrinkles that come and go, and bulges along rough normals. For each
error: the smallest driver alone, then smaller drivers with the fewest morph targets (principal components of what is left,
pulled back through the skin) that reach the same error. A target's bytes are those of its numbers, rounded to a quarter
of the error, after LZMA: less than EXT_meshopt_compression or our packing would take.
"""
import argparse
import lzma
import os
import sys
import tempfile
from pathlib import Path

import numpy

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "build" / "release" / "python"))
import filigree  # noqa: E402

FRAMES = 60


def faces(resolution):
    """Name, mesh and positions (frames, vertices, 3)."""
    mesh = filigree.make("wavy-sphere", resolution=resolution)
    rest = numpy.array(mesh.world_vertices, dtype=float)
    size = numpy.linalg.norm(rest.max(0) - rest.min(0))
    outwards = rest / numpy.linalg.norm(rest, axis=1)[:, None]
    random = numpy.random.default_rng(5)
    rough = outwards + 0.8 * random.normal(size=rest.shape)
    rough /= numpy.linalg.norm(rough, axis=1)[:, None]
    centres = rest[random.integers(len(rest), size=12)]
    near = numpy.exp(-0.5 * ((rest[None] - centres[:, None]) ** 2).sum(2) / (0.08 * size) ** 2)
    time = numpy.arange(FRAMES)[:, None] / 15
    weights = numpy.clip(numpy.sin((1 + 3 * random.random(12)) * time + 6 * random.random(12)), 0, 1)
    along = random.normal(size=(12, 3))
    along /= numpy.linalg.norm(along, axis=1)[:, None]
    folds = numpy.sin(60 / size * rest @ along.T).T
    yield "smooth bulges", mesh, rest + numpy.einsum("fk,kv,vi->fvi", weights, 0.03 * size * near, outwards)
    yield "wrinkles", mesh, rest + numpy.einsum("fk,kv,vi->fvi", weights, 0.006 * size * near * folds, outwards)
    yield "rough bulges", mesh, rest + numpy.einsum("fk,kv,vi->fvi", weights, 0.02 * size * near, rough)


def bytes_of(model, poses, error):
    """Of the skinned GLB and of the packed model."""
    with tempfile.TemporaryDirectory() as folder:
        glb, packed = os.path.join(folder, "a.glb"), os.path.join(folder, "a.fil")
        filigree.export(model, glb, poses, compress=True, key_error=error)
        filigree.pack(model, packed, poses=poses)
        return os.path.getsize(glb), os.path.getsize(packed)


def morphs(model, poses, positions, size, goal):
    """The fewest targets that reach the goal, and their bytes; None where FRAMES / 2 do not."""
    bonds = model.bindings
    cells, weights = numpy.array(bonds.cells), numpy.array(bonds.weights)
    pulled, matrices, left = [], [], []
    for frame in range(FRAMES):
        gradients = numpy.array(poses[frame].gradients, dtype=float).reshape(-1, 3, 3)
        blended = numpy.einsum("vk,vkij->vij", weights, gradients[cells])
        rest = positions[frame] - numpy.array(filigree.restore(model, poses[frame]).world_vertices)
        u, s, v = numpy.linalg.svd(blended)
        back = numpy.einsum("vji,vj,vkj->vik", v, 1 / numpy.maximum(s, 0.2), u)  # near singular: limited
        pulled.append(numpy.einsum("vij,vj->vi", back, rest).ravel())
        matrices.append(blended)
        left.append(rest)
    pulled = numpy.array(pulled)
    values, vectors = numpy.linalg.eigh(pulled @ pulled.T)
    for count in range(1, FRAMES // 2 + 1):
        basis = vectors[:, ::-1][:, :count]
        targets = basis.T @ pulled
        most = numpy.abs(basis).max(0)
        step = goal * size / 4 / most / numpy.sqrt(count)
        numbers = numpy.round(targets / step[:, None])
        played = basis @ (numbers * step[:, None])
        squares = sum(((numpy.einsum("vij,vj->vi", matrices[f], played[f].reshape(-1, 3)) - left[f]) ** 2).sum(1).mean()
                      for f in range(FRAMES))
        if numpy.sqrt(squares / FRAMES) <= goal * size:
            coded = numbers.reshape(count, -1, 3).astype(numpy.int32)
            coded = numpy.diff(coded, axis=1, prepend=0).astype(numpy.int16)
            planes = coded.transpose(0, 2, 1).tobytes()
            return count, len(lzma.compress(planes, preset=9)) + 2 * count * FRAMES
    return None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--resolution", type=int, default=36)
    options = parser.parse_args()
    print(f"{'animation':<14} {'error':>6} {'driver':>6} {'targets':>7} {'GLB':>9} {'packed':>9}")
    for name, mesh, positions in faces(options.resolution):
        rest = numpy.array(mesh.world_vertices)
        size = numpy.linalg.norm(rest.max(0) - rest.min(0))
        for error in (1e-4, 3e-5):
            try:
                fitted = filigree.fit(mesh, positions, error=error)
                least = len(fitted.poses[0])
                glb, packed = bytes_of(fitted.model, fitted.poses, error)
                print(f"{name:<14} {error:>6.0e} {least:>6} {0:>7} {glb:>9,} {packed:>9,}", flush=True)
            except filigree.UnsuitableError:
                least = 2000
                print(f"{name:<14} {error:>6.0e}  no driver reaches it", flush=True)
            for share in (2, 6):
                base = max(60, least // share)
                fitted = filigree.fit(mesh, positions, base=base)
                found = morphs(fitted.model, fitted.poses, positions, size, error)
                if not found:
                    print(f"{name:<14} {error:>6.0e} {base:>6}  30 targets do not reach it", flush=True)
                    continue
                glb, packed = bytes_of(fitted.model, fitted.poses, error)
                print(f"{name:<14} {error:>6.0e} {base:>6} {found[0]:>7} {glb + found[1]:>9,} {packed + found[1]:>9,}",
                      flush=True)


main()
