#!/usr/bin/env python3
"""Writes a creature with a fat belly, long ears and a tail that leaps and lands on its feet, as a GLB.

    python3 creature.py [creature.glb] [--fine]

Its vertices are painted: pink where the matter is loose, on its belly, ears and tail. `filigree flesh creature.glb -o
soft.glb --soft-from color.g --soft-values 1 0.55` reads that. Needs numpy, and walking_man.py beside it.
"""
import sys

import numpy as np
import walking_man as kit
from walking_man import X, Y, Z, rotation, times

# %% Its joints
kit.JOINTS = [
    ("Body", None, (0, 0.4, -0.05),
     [((0, 0.44, -0.1), (0, 0.42, 0.08), 0.16), ((0, 0.36, -0.02), (0, 0.36, 0.04), 0.17)]),
    ("Chest", "Body", (0, 0.48, 0.12), [((0, 0.5, 0.14), (0, 0.53, 0.16), 0.13)]),
    ("Head", "Chest", (0, 0.62, 0.2),
     [((0, 0.72, 0.24), (0, 0.71, 0.28), 0.125), ((0, 0.67, 0.36), (0, 0.67, 0.4), 0.05)]),
    ("Tail", "Body", (0, 0.5, -0.25), [((0, 0.5, -0.26), (0, 0.56, -0.36), 0.04)]),
    ("TailEnd", "Tail", (0, 0.57, -0.38), [((0, 0.58, -0.39), (0, 0.7, -0.46), 0.05)]),
]
for side, s in (("Left", 1), ("Right", -1)):
    kit.JOINTS += [
        (side + "Ear", "Head", (0.08 * s, 0.82, 0.22), [((0.08 * s, 0.84, 0.22), (0.13 * s, 0.96, 0.18), 0.035)]),
        (side + "EarEnd", side + "Ear", (0.14 * s, 0.98, 0.17),
         [((0.14 * s, 0.99, 0.17), (0.2 * s, 1.1, 0.12), 0.032)]),
        (side + "Thigh", "Body", (0.12 * s, 0.36, -0.14), [((0.14 * s, 0.32, -0.14), (0.15 * s, 0.22, -0.12), 0.075)]),
        (side + "Foot", side + "Thigh", (0.15 * s, 0.19, -0.13),
         [((0.15 * s, 0.17, -0.14), (0.155 * s, 0.06, -0.13), 0.05),
          ((0.155 * s, 0.045, -0.12), (0.16 * s, 0.045, -0.05), 0.045)]),
        (side + "Arm", "Chest", (0.11 * s, 0.42, 0.16), [((0.12 * s, 0.36, 0.17), (0.125 * s, 0.22, 0.17), 0.055)]),
        (side + "Hand", side + "Arm", (0.125 * s, 0.19, 0.17),
         [((0.125 * s, 0.16, 0.17), (0.13 * s, 0.05, 0.18), 0.042),
          ((0.13 * s, 0.042, 0.19), (0.13 * s, 0.042, 0.23), 0.042)]),
    ]
kit.NAMES = [joint[0] for joint in kit.JOINTS]


def looseness(places):
    """0 .. 1."""
    x, y, z = places.T
    belly = np.clip((0.42 - y) / 0.12, 0, 1) * np.clip((y - 0.2) / 0.05, 0, 1)
    belly *= np.clip(1 - np.abs(z) / 0.2, 0, 1) * np.clip(1.5 - np.abs(x) / 0.13, 0, 1)
    ears = np.clip((y - 0.87) / 0.08, 0, 1)
    tail = np.clip((-0.27 - z) / 0.06, 0, 1)
    return np.clip(np.maximum(np.maximum(1.6 * belly, ears), tail), 0, 1)


# %% Its motion
def leap(phase):
    crouch = np.interp(phase, [0, 0.16, 0.26, 0.34, 0.6, 0.68, 0.8, 1], [0, 1, -0.25, 0, 0, 1.1, 0.25, 0])
    air = np.interp(phase, [0.26, 0.62], [0, 1])
    high = 4 * 0.55 * air * (1 - air)
    down = max(crouch, 0)
    pose = {"Body": rotation(X, -16 * np.sin(2 * np.pi * air) - 4 * down), "Chest": rotation(X, 10 * down),
            "Head": rotation(X, -12 * down + 10 * np.sin(2 * np.pi * air)), "Tail": rotation(X, -25 * down)}
    for side in ("Left", "Right"):
        pose[side + "Thigh"] = rotation(X, -55 * down + 45 * np.sin(np.pi * air) * (0.6 - air))
        pose[side + "Foot"] = rotation(X, 75 * down)
        pose[side + "Arm"] = rotation(X, 45 * down - 60 * np.sin(np.pi * air) * (0.4 - air))
        pose[side + "Hand"] = rotation(X, -70 * down)
    return pose, np.array([0, high - 0.12 * down, 0.9 * air])


def shake(phase):
    """As a wet dog does."""
    swing = 24 * np.sin(2 * np.pi * 5 * phase) * np.sin(np.pi * phase) ** 0.7
    pose = {"Body": rotation(Z, 0.6 * swing), "Chest": rotation(Z, 0.5 * swing),
            "Head": times(rotation(Z, swing), rotation(Y, swing))}
    for side in ("Left", "Right"):
        for limb in ("Thigh", "Arm"):
            pose[side + limb] = rotation(Z, -(0.6 if limb == "Thigh" else 1.1) * swing)
    return pose, np.zeros(3)


def main():
    paths = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
    step = 0.007 if "--fine" in sys.argv else 0.014
    places, quads = kit.surface_net(step, low=(-0.35, -0.05, -0.6), high=(0.35, 1.25, 0.55))
    colors = np.ones((len(places), 3)) - looseness(places)[:, None] * np.array([0, 0.45, 0.3])
    clips = [("Leap", leap, 1.8, 55), ("Shake", shake, 1.5, 61)]
    path = paths[0] if paths else "creature.glb"
    kit.write_character(path, "Creature", places, quads, clips, (0.6, 0.75, 0.5), colors)


if __name__ == "__main__":
    main()
