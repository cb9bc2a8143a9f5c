#!/usr/bin/env python3
"""Writes a stylised face with four morph targets and two clips, Talk and No, as a GLB that any viewer plays.

    python3 face.py [face.glb] [--fine]

Its targets open the jaw, smile, and close both eyes; no joint moves it. The alpha of its vertex colours says how firm the
matter is: 1 on the skull, 0 on cheeks, double chin and nose. `filigree flesh face.glb -o soft.glb --soft-from color.a
--soft-values 1 0` reads that. --fine: about 46,000 vertices instead of 17,000. Needs numpy, and walking_man.py beside it.
"""
import sys

import numpy as np
import walking_man as kit
from walking_man import X, Y, Z, rotation, times

# %% Its surface: metres, y up, it looks along z
EYES = np.array([[-0.043, 0.024, 0.082], [0.043, 0.024, 0.082]])
EYE, MOUTH, CHIN_HINGE = 0.028, np.array([0, -0.066, 0.1]), np.array([0, -0.015, -0.01])
OPEN_LOW, OPEN_HIGH, OPEN_WIDE = np.radians([-24, 28, 58])  # of the eyes, seen from their middles
# A rim of skin moves with the eyes: what is white lies behind the lids when they are shut.
RIM_LOW, RIM_HIGH, RIM_WIDE, LID_HIGH = np.radians([-34, 36, 72, 86])
HEAD = [  # ends and radii of capsules
    ((0, 0.045, -0.03), (0, 0.03, 0.0), 0.105), ((-0.02, -0.02, 0.02), (0.02, -0.02, 0.02), 0.085),
    ((0, -0.095, 0.045), (0, -0.09, 0.055), 0.036), ((-0.035, -0.112, 0.005), (0.035, -0.112, 0.005), 0.045),
    ((0, -0.12, -0.04), (0, -0.22, -0.05), 0.062), ((0, 0.0, 0.098), (0, -0.022, 0.118), 0.017),
]
for s in (-1, 1):
    HEAD += [((0.058 * s, -0.05, 0.045), (0.06 * s, -0.045, 0.048), 0.05),
             ((0.108 * s, -0.01, -0.02), (0.122 * s, 0.03, -0.03), 0.016),
             ((0.022 * s, 0.064, 0.082), (0.062 * s, 0.066, 0.066), 0.012)]
LIPS = [((-0.022, -0.053, 0.098), (0.022, -0.053, 0.098), 0.009), ((-0.018, -0.082, 0.094), (0.018, -0.082, 0.094), 0.01)]


def union(distances, blend):
    least = distances.min(-1, keepdims=True)
    return least[..., 0] - blend * np.log(np.exp((least - distances) / blend).sum(-1))


def face_distance(points):
    of = lambda capsules: np.stack([kit.capsule_distance(points, *c) for c in capsules], -1)
    head = union(of(HEAD), 0.012)
    balls = np.linalg.norm(points[..., None, :] - EYES, axis=-1) - EYE
    head = union(np.stack([head, *np.moveaxis(balls, -1, 0), *np.moveaxis(of(LIPS), -1, 0)], -1), 0.003)
    slot = points * [1, 1.9, 0.55] - MOUTH * [1, 1.9, 0.55]  # the mouth, a little open
    mouth = np.linalg.norm(slot, axis=-1) / 1.4 - 0.0165
    return -union(np.stack([-head, mouth], -1), 0.002)


def smooth(t):
    t = np.clip(t, 0, 1)
    return t * t * (3 - 2 * t)


def eye_angles(places, eye):
    """Upwards and sideways, and how far from the middle."""
    way = places - eye
    return np.arctan2(way[:, 1], way[:, 2]), np.arctan2(way[:, 0], way[:, 2]), np.linalg.norm(way, axis=1)


# %% Its targets
def targets(places):
    """By name, how the vertices move."""
    x, y, z = places.T
    front = smooth((z + 0.03) / 0.07)
    turn = np.radians(17)
    lips = np.clip((np.abs(x) - 0.03) / 0.05, 0, 1)  # between them it tears, beside them it stretches
    below = smooth((MOUTH[1] + 0.006 + 0.02 * lips - y) / (0.014 + 0.06 * lips)) * front * smooth((y + 0.19) / 0.05)
    arm = places - CHIN_HINGE
    turned = np.stack([x, np.cos(turn) * arm[:, 1] - np.sin(turn) * arm[:, 2],
                       np.sin(turn) * arm[:, 1] + np.cos(turn) * arm[:, 2]], -1) + CHIN_HINGE * [0, 1, 1]
    moves = {"Jaw": below[:, None] * (turned - places)}

    smile = np.zeros_like(places)
    for s in (-1, 1):
        corner = np.exp(-0.5 * (np.linalg.norm((places - [0.03 * s, -0.066, 0.092]) / [1, 1, 1.5], axis=1) / 0.014) ** 2)
        cheek = np.exp(-0.5 * (np.linalg.norm(places - [0.066 * s, -0.03, 0.08], axis=1) / 0.022) ** 2)
        smile += corner[:, None] * [0.014 * s, 0.013, -0.008] + cheek[:, None] * [0.005 * s, 0.008, 0.007]
    moves["Smile"] = smile

    for name, eye in zip(("BlinkRight", "BlinkLeft"), EYES):
        up, side, far = eye_angles(places, eye)
        wide = np.clip(1 - (side / RIM_WIDE) ** 2, 0, 1) ** 0.5
        high, top = RIM_HIGH * wide, LID_HIGH * np.maximum(wide, 0.3)
        low = RIM_LOW * wide
        shut = low + 0.1 * (high - low)
        t = np.where(up <= high, (up - low) / np.maximum(high - low, 1e-6), 1 + (up - high) / np.maximum(top - high, 1e-6))
        goes = np.where(t <= 1, low + t * (shut - low), shut + (t - 1) * (top - shut))
        near = smooth((1.45 * EYE - far) / (0.3 * EYE)) * (t > 0) * (t < 2) * (wide > 0) * (places[:, 2] > eye[2])
        radius = np.hypot(places[:, 1] - eye[1], places[:, 2] - eye[2])
        # The lid goes over the ball; what was open folds behind it, so that no rim of it is seen between both lids.
        lid = 1 - 0.15 * smooth(t / 0.3) + 0.18 * smooth((t - 0.85) / 0.2)
        there = np.stack([x, eye[1] + lid * radius * np.sin(goes), eye[2] + lid * radius * np.cos(goes)], -1)
        moves[name] = near[:, None] * (there - places)
    return moves


def colors(places):
    """RGB, linear, and how firm the matter is."""
    x, y, z = places.T
    paint = np.tile([0.80, 0.45, 0.30], (len(places), 1))
    rosy = np.zeros(len(places))
    for s in (-1, 1):
        rosy = np.maximum(rosy, np.exp(-0.5 * (np.linalg.norm(places - [0.07 * s, -0.045, 0.07], axis=1) / 0.03) ** 2))
    paint += rosy[:, None] * [0.1, -0.15, -0.1]
    lips = union(np.stack([kit.capsule_distance(places, *c) for c in LIPS], -1), 0.002) < 0.0035
    paint[lips] = [0.6, 0.12, 0.12]
    inside = np.linalg.norm((places - MOUTH) * [1, 1.9, 0.55], axis=1) / 1.4 < 0.0165 + 1e-3
    paint[inside & (z < 0.1)] = [0.12, 0.01, 0.015]
    for eye in EYES:
        up, side, far = eye_angles(places, eye)
        wide = np.clip(1 - (side / OPEN_WIDE) ** 2, 0, 1) ** 0.5
        ball = (far < 1.04 * EYE) & (up > OPEN_LOW * wide) & (up < OPEN_HIGH * wide) & (z > eye[2])
        paint[ball] = [0.9, 0.9, 0.88]
        from_pupil = np.hypot(up - np.radians(6), side)
        paint[ball & (from_pupil < 0.36)] = [0.08, 0.2, 0.28]
        paint[ball & (from_pupil < 0.17)] = [0.01, 0.01, 0.01]
    brow = np.abs(y - 0.068 + (np.abs(x) - 0.042) ** 2 / 0.042) < 0.005
    paint[brow & (np.abs(np.abs(x) - 0.042) < 0.026) & (z > 0.05)] = [0.12, 0.06, 0.03]

    loose = np.zeros(len(places))
    for middle, size in (((-0.09, -0.06, 0.065), 0.06), ((0.09, -0.06, 0.065), 0.06), ((0, -0.145, 0.03), 0.06),
                         ((0, -0.02, 0.13), 0.022)):
        loose = np.maximum(loose, smooth(2 * (1 - np.linalg.norm(places - np.array(middle), axis=1) / size) + 0.25))
    loose[y < -0.19] = 0
    return np.concatenate([paint, 1 - loose[:, None]], 1)


# %% Its motion
def hump(phase, at, wide):
    return smooth(1 - np.abs(phase - at) / wide)


def talk(phase):
    """Weights by target, and how the head turns; phase 0 .. 1. It speaks, smiles, and says no."""
    jaw = 0.75 * hump(phase, 0.11, 0.05) + hump(phase, 0.21, 0.055) + 0.6 * hump(phase, 0.3, 0.045)
    smile = smooth((phase - 0.36) / 0.07) * smooth((0.66 - phase) / 0.1)
    blink = hump(phase, 0.05, 0.035) + hump(phase, 0.42, 0.035)
    nod = 9 * hump(phase, 0.17, 0.07) - 7 * hump(phase, 0.44, 0.07) + 7 * hump(phase, 0.54, 0.06)
    weights, turn = no(np.clip((phase - 0.62) / 0.34, 0, 1))
    weights["BlinkLeft"] = weights["BlinkRight"] = max(weights["BlinkLeft"], blink)
    return weights | {"Jaw": max(jaw, weights["Jaw"]), "Smile": smile}, times(rotation(X, nod), turn)


def no(phase):
    """It says no, with both eyes shut."""
    swing = 32 * np.sin(2 * np.pi * 3.5 * phase) * np.sin(np.pi * phase) ** 0.6
    shut = float(smooth(phase / 0.1) * smooth((0.98 - phase) / 0.12))
    weights = {"BlinkLeft": shut, "BlinkRight": shut, "Jaw": 0.15 * shut}
    return weights, times(rotation(Y, swing), rotation(Z, 0.25 * swing))


def write_face(path, places, quads, clips):
    moves, file = targets(places), kit.Glb()
    for name, pose_at, seconds, keys in clips:
        poses = [pose_at(phase) for phase in np.linspace(0, 1, keys)]
        weights = [weights.get(target, 0) for weights, _ in poses for target in moves]
        file.add_clip(name, seconds * np.linspace(0, 1, keys),
                      [(0, "weights", weights, "SCALAR"), (0, "rotation", [turn for _, turn in poses], "VEC4")])
    surface = kit.add_surface(file, places, quads, colors(places), {})
    surface["targets"] = [{"POSITION": file.add(move.astype(np.float32), "VEC3", 5126, True, 34962)}
                          for move in moves.values()]
    mesh = {"name": "Face", "primitives": [surface], "weights": [0.0] * len(moves),
            "extras": {"targetNames": list(moves)}}
    file.save(path, [{"name": "Face", "mesh": 0}], [0], mesh, (1, 1, 1))
    print(f"{path}: {len(places):,} vertices, targets {', '.join(moves)}, clips {' and '.join(c[0] for c in clips)}")


def main():
    paths = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
    kit.body_distance = face_distance
    step = 0.003 if "--fine" in sys.argv else 0.005
    places, quads = kit.surface_net(step, low=(-0.17, -0.32, -0.17), high=(0.17, 0.18, 0.17))
    clips = [("Talk", talk, 4.6, 139), ("No", no, 1.6, 65)]
    write_face(paths[0] if paths else "face.glb", places, quads, clips)


if __name__ == "__main__":
    main()
