"""Turns as keys that straight lines join: numpy alone, so that it is tested outside Blender too.

A turn is an axis times an angle in radians. One rotation has many of them, a full turn apart, and a body that spins has
to go on counting: 340, 360, 380 degrees, never back to 20.
"""

import numpy as np

FULL = 2 * np.pi
_ASTRAY = 0.1  # of a step: how far its middle may lie beside the shortest way from key to key


def rotation_of(turn):
    """The 3 x 3 matrix of a turn (Rodrigues)."""
    turn = np.asarray(turn, dtype=float)
    angle = np.linalg.norm(turn)
    if angle == 0:
        return np.eye(3)
    x, y, z = turn / angle
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across


def turn_of(rotation):
    """The shortest turn of a 3 x 3 rotation matrix: at most half a turn."""
    rotation = np.asarray(rotation, dtype=float)
    twice_sine = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    length = np.linalg.norm(twice_sine)
    angle = np.arctan2(length, np.trace(rotation) - 1)
    if length > 1e-3:
        return twice_sine * (angle / length)
    if angle < 1:
        return twice_sine / 2
    # Near half a turn the axis is in the symmetric part: 2 a a^T - 1. Its sign is that of the small rest.
    squares = (rotation + rotation.T) / 2 + np.eye(3)
    axis = squares[:, np.argmax(np.diag(squares))]
    axis = axis / np.linalg.norm(axis)
    return axis * (-angle if np.dot(axis, twice_sine) < 0 else angle)


def nearest_turn(rotation, before):
    """Of all turns that a rotation is, the one nearest to the turn `before`."""
    shortest = turn_of(rotation)
    angle = np.linalg.norm(shortest)
    axis = shortest / angle if angle > 1e-9 else _axis_of(before)
    return axis * (angle + FULL * np.round((np.dot(axis, before) - angle) / FULL))


def _axis_of(turn):
    length = np.linalg.norm(turn)
    return turn / length if length > 0 else np.array([1.0, 0, 0])


def _goes_straight(before, after):
    """Whether halfway between two turns lies what halfway between their rotations is."""
    start = rotation_of(before)
    step = turn_of(start.T @ rotation_of(after))
    aside = turn_of((start @ rotation_of(step / 2)).T @ rotation_of((np.asarray(before) + after) / 2))
    return np.linalg.norm(aside) <= _ASTRAY * np.linalg.norm(step) + 1e-6


def turn_keys(rotations):
    """Keys of (number of the rotation, turn) that, joined by straight lines, turn from each rotation to the next the short way.

    Turns go on counting through full turns. Where an axis changes so much that a straight line would leave the way, the
    rotation before has a second key: the same rotation as its shortest turn.
    """
    keys = []
    for k, rotation in enumerate(rotations):
        if not keys:
            keys.append((k, turn_of(rotation)))
            continue
        turn = nearest_turn(rotation, keys[-1][1])
        if not _goes_straight(keys[-1][1], turn):
            shortest = turn_of(rotations[k - 1])
            if np.linalg.norm(keys[-1][1] - shortest) > 1:  # a full turn away: another key of the same rotation
                keys.append((k - 1, shortest))
                turn = nearest_turn(rotation, shortest)
        keys.append((k, turn))
    return keys
