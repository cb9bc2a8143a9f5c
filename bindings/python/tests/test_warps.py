"""Deformations of one's own beside the library's."""

import numpy
import pytest

import filigree

P = numpy.random.default_rng(1).uniform(-1, 1, (40, 3))


def wave(points):
    return points + [0, 0, 0.2] * numpy.sin(3 * points[:, :1])


def wave_gradient(points):
    gradient = numpy.tile(numpy.eye(3), (len(points), 1, 1))
    gradient[:, 2, 0] = 0.6 * numpy.cos(3 * points[:, 0])
    return gradient


def test_a_function_is_a_warp(mesh, model):
    own, exact = filigree.Warp(wave), filigree.Warp(wave, wave_gradient)
    assert own(P) == pytest.approx(wave(P), abs=1e-14)
    positions, gradients = own.warp(P)
    assert positions == pytest.approx(wave(P)) and gradients == pytest.approx(wave_gradient(P), abs=1e-8)
    pose = own(model)
    assert pose.positions == pytest.approx(wave(model.driver.world_vertices), abs=1e-6)
    assert pose.gradients == pytest.approx(exact(model).gradients, abs=1e-6)
    assert own(mesh).vertices == pytest.approx(wave(mesh.world_vertices), abs=1e-6)
    error = filigree.compare(filigree.restore(model, pose), own(mesh))["rms"]
    assert error < 2e-3
    assert repr(own) == "<filigree.Warp: wave>"


def test_normals_turn(mesh):
    with_normals = filigree.Mesh(mesh.vertices, mesh.faces, normals=mesh.vertex_normals)
    moved = filigree.Warp(wave)(with_normals)
    assert moved.normals == pytest.approx(moved.vertex_normals, abs=0.15)
    assert moved.normals == pytest.approx(filigree.Warp(wave, wave_gradient)(with_normals).normals, abs=1e-6)


def test_chains():
    own, bend = filigree.Warp(wave), filigree.bend(P, "x", 40)
    for both in (bend @ own, filigree.chain(own, bend), filigree.chain([own, bend])):
        assert both(P) == pytest.approx(bend(wave(P)), abs=1e-12)
        assert both.warp(P)[1] == pytest.approx(bend.warp(wave(P))[1] @ wave_gradient(P), abs=1e-7)
    ours = filigree.twist(P, "y", 30) @ bend
    assert ours(P) == pytest.approx(filigree.twist(P, "y", 30)(bend(P)), abs=1e-12)
    assert repr(bend @ own) == "<filigree.Warp: wave, then <bend by 40 degrees along x>>"
    assert filigree.chain()(P) == pytest.approx(P)
    with pytest.raises(TypeError, match=r"filigree.Warp\(function\)"):
        filigree.chain(wave)


def test_back(mesh):
    own = filigree.Warp(wave)
    assert own.unwarp(wave(P)) == pytest.approx(P, abs=1e-7)


def test_axes_and_angles():
    bend = filigree.bend(P, "z", 90)
    assert filigree.bend(P, "z", radians=numpy.pi / 2)(P) == pytest.approx(bend(P), abs=1e-12)
    assert filigree.bend(P, "z", degrees=90)(P) == pytest.approx(bend(P), abs=1e-12)
    twist = filigree.twist(P, "z", 60)
    assert filigree.twist(P, (0, 0, 2), 60)(P) == pytest.approx(twist(P), abs=1e-12)
    # Along x as along z of the same points turned.
    turned = P[:, [1, 2, 0]]
    along_x = filigree.twist(turned, (0, 1, 0), 60)(turned)
    assert along_x == pytest.approx(filigree.twist(turned, "y", 60)(turned), abs=1e-12)
    diagonal = numpy.array([1.0, 2.0, -1.0])
    stretch = filigree.stretch(P, diagonal, 2)
    unit = diagonal / numpy.linalg.norm(diagonal)
    moved, gradients = stretch.warp(P)
    assert numpy.ptp((moved - 2 * (P @ unit)[:, None] * unit) @ unit) == pytest.approx(0, abs=1e-12)
    assert gradients[0] == pytest.approx(numpy.eye(3) + numpy.outer(unit, unit), abs=1e-12)
    for wrong in (dict(), dict(degrees=1, radians=1)):
        with pytest.raises(filigree.UsageError, match="degrees or radians"):
            filigree.bend(P, "z", **wrong)
    with pytest.raises(filigree.UsageError, match="not zero"):
        filigree.bend(P, (0, 0, 0), 10)


@pytest.mark.parametrize(
    "function, sentence",
    [
        (lambda p: p[1:], r"shape \(40, 3\)"),
        (lambda p: p * numpy.nan, "not finite"),
        (lambda p: "moved", "numbers"),
    ],
)
def test_bad_functions(function, sentence):
    with pytest.raises(filigree.UsageError, match=sentence):
        filigree.Warp(function)(P)


def test_what_a_function_raises_comes_through(model):
    def broken(points):
        raise KeyError("mine")

    for what in (P, model, model.mesh):
        with pytest.raises(KeyError, match="mine"):
            filigree.Warp(broken)(what)
    with pytest.raises(KeyError, match="mine"):
        filigree.Warp(broken).unwarp(P)
    with pytest.raises(TypeError, match="callable"):
        filigree.Warp(3)
