"""What calls of the compiled part return where that is several things; and how objects say what they are."""

from typing import NamedTuple

import numpy

from . import _core


class Remeshed(NamedTuple):
    """What `remesh` returns: the quads, and the keys of `filigree remesh --json` with 'base'."""

    mesh: "_core.Mesh"
    report: dict


class Fitted(NamedTuple):
    """What `fit` returns: a model, and its pose for each frame."""

    model: "_core.Model"
    poses: "_core.PoseSequence"


class Momentum(NamedTuple):
    """What `Simulation.momentum` returns: kg m/s and kg m^2/s, float64 (3,) each."""

    linear: numpy.ndarray
    angular: numpy.ndarray


class Warped(NamedTuple):
    """What `Warp.warp` returns: positions, float64 (n, 3), and gradients, float64 (n, 3, 3)."""

    positions: numpy.ndarray
    gradients: numpy.ndarray


def _says(name, text):
    def say(self):
        return f"<filigree.{name}: {text(self)}>"

    getattr(_core, name).__repr__ = say


def put_onto_classes():
    quantities = ("density", "young_modulus", "poisson_ratio", "damping", "internal_damping")
    _says("Material", lambda m: ", ".join([repr(m.model), *(f"{k} {getattr(m, k):g}" for k in quantities)]))
    _says("FracturedMesh", lambda f: f"{f.pieces} pieces, {len(f.mesh)} vertices")
    _says("Restorer", lambda r: f"{len(r)} vertices" + ("" if r.level is None else f" of level {r.level}"))
    _says("Attachment", lambda a: f"{len(a)} points")
    _says("Simulation", lambda s: f"{sum(b is not None for b in s.bodies)} bodies, {s.frame} frames done")
    _says("SceneRun", lambda s: f"{len(s.bodies)} bodies, {s.frame} of {s.frames} frames done")
