"""How the Blender add-on's obstacles turn: its arithmetic is numpy alone, and the library joins its keys."""

import importlib.util
import pathlib

import numpy as np
import pytest

import filigree

PATH = pathlib.Path(__file__).resolve().parents[3] / "addons/blender/filigree_detail/turning.py"
SPEC = importlib.util.spec_from_file_location("turning", PATH)
turning = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(turning)


def spin(axis, degrees):
    axis = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    return [turning.rotation_of(np.radians(d) * axis) for d in degrees]


def between(keys, time):
    """The rotation at a time in frames, as RigidMotion joins keys."""
    times = [k for k, _ in keys]
    turns = np.array([turn for _, turn in keys])
    at = np.searchsorted(times, time, side="right")
    if at == len(times):
        return turning.rotation_of(turns[-1])
    share = (time - times[at - 1]) / (times[at] - times[at - 1])
    return turning.rotation_of(turns[at - 1] + share * (turns[at] - turns[at - 1]))


def angle_between(a, b):
    return np.degrees(np.linalg.norm(turning.turn_of(a.T @ b)))


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0), (0, -1, 0), (1, 2, -3)])
@pytest.mark.parametrize("step", [20, -20, 7.3, 90, 170, -170])
def test_a_wheel_goes_on_through_full_turns(axis, step):
    keys = turning.turn_keys(spin(axis, step * np.arange(60)))
    assert [k for k, _ in keys] == list(range(60))
    turned = np.degrees(np.array([turn for _, turn in keys])) @ np.array(axis) / np.linalg.norm(axis)
    assert np.allclose(turned, step * np.arange(60), atol=1e-6)


def test_a_wheel_that_turns_back_counts_back():
    degrees = np.concatenate([np.arange(0, 1000, 25), np.arange(1000, -500, -25)])
    turns = np.array([turn for _, turn in turning.turn_keys(spin((0, 0, 1), degrees))])
    assert np.allclose(np.degrees(turns[:, 2]), degrees, atol=1e-6)


def test_rotations_of_single_precision_go_on_too():
    """What Blender hands over: float matrices, that come through exact full turns with noise for an axis."""
    rotations = [r.astype(np.float32) for r in spin((0, 0, 1), 30 * np.arange(100))]
    turns = np.array([turn for _, turn in turning.turn_keys(rotations)])
    assert np.allclose(np.degrees(turns[:, 2]), 30 * np.arange(100), atol=0.01)


def tumble(count, seed):
    """Rotations that change their axis as they go, far more than a full turn in all."""
    random = np.random.default_rng(seed)
    rotation, rate = np.eye(3), random.normal(size=3)
    rotations = []
    for _ in range(count):
        rotations.append(rotation)
        rate = 0.9 * rate + 0.3 * random.normal(size=3)
        rotation = turning.rotation_of(0.35 * rate / max(1, np.linalg.norm(rate))) @ rotation
    return rotations


def wheel_on_a_turning_axle(count):
    return [turning.rotation_of((0, 0, 0.02 * k)) @ turning.rotation_of((0.5 * k, 0, 0)) for k in range(count)]


@pytest.mark.parametrize("rotations", [tumble(400, 1), tumble(400, 2), tumble(400, 3), wheel_on_a_turning_axle(400)])
def test_what_changes_its_axis_turns_the_short_way(rotations):
    keys = turning.turn_keys(rotations)
    times = np.array([k for k, _ in keys])
    assert np.all(np.diff(times) >= 0) and set(times) == set(range(len(rotations)))
    for k, turn in keys:
        assert angle_between(turning.rotation_of(turn), rotations[k]) < 1e-4
    for k in range(len(rotations) - 1):
        step = angle_between(rotations[k], rotations[k + 1])
        for share in (0.25, 0.5, 0.75):
            straight = rotations[k] @ turning.rotation_of(share * turning.turn_of(rotations[k].T @ rotations[k + 1]))
            assert angle_between(between(keys, k + share), straight) < 0.15 * step + 1e-3, k


def test_the_library_joins_the_keys():
    """Held particles that spin by 20 degrees a key are halfway there between keys, in any of three turns."""
    keys = turning.turn_keys(spin((0, 1, 0), 20 * np.arange(55)))
    motion = filigree.RigidMotion([k / 30 for k, _ in keys], degrees=[np.degrees(turn) for _, turn in keys])
    cube = filigree.make("wavy-cube", resolution=4, amplitude=0)
    body = filigree.Body(cube, "rubber", particles=60)
    simulation = filigree.Simulation(
        [body], pins=[filigree.Pin(0, range(len(body.rest)), motion)], gravity=(0, 0, 0), frames_per_second=60)
    followed = simulation.attach(0, cube.vertices)
    for frame in range(1, 108):
        simulation.step()
        expected = cube.vertices @ turning.rotation_of((0, np.radians(10 * frame), 0)).T
        assert np.abs(followed.pose().positions - expected).max() < 1e-3, frame
