#!/usr/bin/env python3
"""Matrices and derivatives of the Python module beside numpy and scipy doing the same, in one run.

Usage: bench/python_derivatives.py [MESH] [--threads N] [--rounds N]     (build: scripts/build release python)
Without a mesh: a wavy cube of 437,402 vertices. Each row: the library, numpy or scipy, both in ms of a processor (medians),
their ratio, and the largest difference of the results as a part of the largest result.
"""
import argparse
import statistics
import sys
import time
from pathlib import Path

import numpy
import scipy.sparse

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "build" / "release" / "python"))
import filigree  # noqa: E402


def milliseconds(work):
    start = time.process_time()
    result = work()
    return 1000 * (time.process_time() - start), result


def compare(name, first, second, rounds):
    """Each in turn, so that what else the machine does meets both."""
    times = ([], [])
    for _ in range(rounds):
        results = []
        for work, spent in zip((first, second), times):
            took, result = milliseconds(work)
            spent.append(took)
            results.append(numpy.asarray(result, float))
    ours, theirs = map(statistics.median, times)
    wrong = numpy.abs(results[0] - results[1]).max() / numpy.abs(results[1]).max()
    print(f"| {name} | {ours:.2f} | {theirs:.2f} | {theirs / ours:.1f} | {wrong:.0e} |", flush=True)
    return ours


def fem_energy(body):
    """The elastic energy as one would write it in numpy: small strains of the cells, and its derivative."""
    factor = body.stiffness_matrix().tocsr()
    return lambda x: -(factor @ (x - body.rest).ravel()).reshape(-1, 3)


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("mesh", nargs="?")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=11)
    asked = parser.parse_args()
    mesh = filigree.read_mesh(asked.mesh) if asked.mesh else filigree.make("wavy-cube", resolution=270)
    model = filigree.strip(mesh, base=1000)
    restorer = filigree.Restorer(model)
    pose = filigree.bend(mesh, "y", 60)(model)
    positions, gradients = numpy.array(pose.positions), numpy.array(pose.gradients)
    stacked, out = pose.stacked(), numpy.empty((len(restorer), 3), numpy.float32)
    pull = numpy.random.default_rng(1).normal(size=(len(restorer), 3)).astype(numpy.float32)
    took, matrix = milliseconds(restorer.matrix)
    again, csr = milliseconds(matrix.tocsr)
    transposed = csr.T.tocsr()
    print(f"{len(restorer):,} vertices, driver {len(pose):,}; the matrix of {matrix.nnz:,} entries in {took:.0f} ms, "
          f"as scipy's in {again:.0f} ms more")
    print("| | filigree, ms | numpy or scipy, ms | ratio | difference |\n|---|---|---|---|---|")
    threads = asked.threads
    restored = compare("restore / csr @ pose", lambda: restorer.positions(positions, gradients, out=out, threads=threads),
                       lambda: csr @ stacked, asked.rounds)
    adjoint = compare("adjoint / csr.T @ pull", lambda: restorer.adjoint(pull, threads=threads).positions,
                      lambda: (transposed @ pull).reshape(-1, 4, 3)[:, 0], asked.rounds)
    estimated = filigree.Restorer(model)
    estimated.adjoint(pull, positions)  # prepares
    alone, plain = [], []
    for _ in range(asked.rounds):
        plain.append(milliseconds(lambda: restorer.positions(positions, out=out, threads=threads))[0])
        alone.append(milliseconds(lambda: estimated.adjoint(pull, positions, threads=threads))[0])
    print(f"adjoint over restore: {adjoint / restored:.2f} with gradients, "
          f"{statistics.median(alone) / statistics.median(plain):.2f} with estimated ones")

    body = filigree.Body(filigree.make("wavy-cube", resolution=40), "rubber", particles=8000)
    x = body.rest + 1e-4 * numpy.random.default_rng(2).normal(size=body.rest.shape)
    print(f"body of {len(body):,} particles, near rest, where numpy's linear elasticity is the same to a part in a hundred")
    print("| | filigree, ms | numpy or scipy, ms | ratio | difference |\n|---|---|---|---|---|")
    linear = fem_energy(body)
    compare("forces / csr @ x", lambda: body.forces(x, threads=threads), lambda: linear(x), asked.rounds)
    direction = numpy.random.default_rng(3).normal(size=x.shape)
    stiffness = body.stiffness_matrix(x).tocsr()
    compare("Hessian product / csr @ x, once it is made", lambda: body.hessian_product(x, direction, threads=threads),
            lambda: (stiffness @ direction.ravel()).reshape(-1, 3), asked.rounds)
    compare("Hessian product / making the csr and csr @ x", lambda: body.hessian_product(x, direction, threads=threads),
            lambda: (body.stiffness_matrix(x).tocsr() @ direction.ravel()).reshape(-1, 3), 3)


main()
