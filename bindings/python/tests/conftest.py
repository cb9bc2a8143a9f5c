"""What the tests share. FILIGREE_PROGRAM names the program whose bytes the module has to give."""

import os
import subprocess

import numpy
import pytest

import filigree


@pytest.fixture(scope="session")
def program():
    path = os.environ.get("FILIGREE_PROGRAM")
    if not path:
        pytest.skip("FILIGREE_PROGRAM is not set")
    return lambda *words: subprocess.run([path, *map(str, words), "--quiet"], check=True, timeout=300)


@pytest.fixture(scope="session")
def mesh():
    return filigree.make("wavy-sphere", resolution=24)


@pytest.fixture(scope="session")
def model(mesh):
    return filigree.strip(mesh, base=200)


@pytest.fixture(scope="session")
def pose(model):
    return filigree.bend(model, "z", 70)(model)


@pytest.fixture(scope="session")
def big_mesh():
    """As large as the dragon: 437,402 vertices."""
    return filigree.make("wavy-cube", resolution=270)


def same(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def same_mesh(a, b):
    return (
        same(a.vertices, b.vertices)
        and same(a.corners, b.corners)
        and same(a.face_offsets, b.face_offsets)
        and numpy.array_equal(a.origin, b.origin)
    )
