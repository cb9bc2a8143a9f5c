#!/usr/bin/env python3
"""Writes a heavy man with a skeleton and two clips, Walk and Jump, as a GLB that any viewer plays.

    python3 walking_man.py [man.glb] [--fine] [--relief]

His body is a smooth union of capsules around the bones, meshed by surface nets; weights fall off with the distance from
the bones. --fine: about 60,000 vertices instead of 8,000. --relief: about 130,000, with bumps on his skin. Needs numpy.
Feed the file to `filigree flesh`. creature.py makes another character with the same functions.
"""
import json
import struct
import sys

import numpy as np

# %% His joints
# Name, parent, where it is, and what hangs on it: ends and radii of capsules, metres, y up, facing z.
JOINTS = [
    ("Hips", None, (0, 0.95, 0), [((-0.08, 0.92, 0), (0.08, 0.92, 0), 0.145)]),
    ("Spine", "Hips", (0, 1.05, 0), [((0, 1.05, 0.07), (0, 1.12, 0.07), 0.2)]),
    ("Chest", "Spine", (0, 1.25, 0),
     [((-0.1, 1.38, 0), (0.1, 1.38, 0), 0.145), ((0, 1.25, 0.02), (0, 1.36, 0.02), 0.16)]),
    ("Neck", "Chest", (0, 1.5, 0), [((0, 1.5, 0), (0, 1.58, 0.01), 0.065)]),
    ("Head", "Neck", (0, 1.6, 0.01),
     [((0, 1.66, 0.02), (0, 1.74, 0.02), 0.1), ((0, 1.64, 0.12), (0, 1.65, 0.125), 0.022)]),
]
for side, s in (("Left", 1), ("Right", -1)):
    JOINTS += [
        (side + "UpLeg", "Hips", (0.12 * s, 0.9, 0), [((0.135 * s, 0.85, 0), (0.15 * s, 0.55, 0), 0.09)]),
        (side + "Leg", side + "UpLeg", (0.155 * s, 0.5, 0), [((0.155 * s, 0.48, 0), (0.16 * s, 0.12, -0.015), 0.062)]),
        (side + "Foot", side + "Leg", (0.16 * s, 0.09, -0.02),
         [((0.16 * s, 0.06, -0.03), (0.175 * s, 0.05, 0.14), 0.05)]),
        (side + "Arm", "Chest", (0.2 * s, 1.42, 0), [((0.2 * s, 1.42, 0), (0.45 * s, 1.4, 0), 0.06)]),
        (side + "ForeArm", side + "Arm", (0.47 * s, 1.4, 0), [((0.48 * s, 1.4, 0), (0.68 * s, 1.4, 0), 0.05)]),
        (side + "Hand", side + "ForeArm", (0.71 * s, 1.4, 0), [((0.72 * s, 1.4, 0), (0.83 * s, 1.4, 0), 0.045)]),
    ]
NAMES = [joint[0] for joint in JOINTS]


# %% His surface
def capsule_distance(points, a, b, radius):
    a, b = np.array(a, float), np.array(b, float)
    along = b - a
    part = np.clip((points - a) @ along / max(along @ along, 1e-12), 0, 1)
    return np.linalg.norm(points - a - part[..., None] * along, axis=-1) - radius


def joint_distances(points):
    return np.stack([np.min([capsule_distance(points, *c) for c in joint[3]], axis=0) for joint in JOINTS], axis=-1)


def body_distance(points):
    blend = 0.022  # m: how softly limbs join
    d = joint_distances(points)
    least = d.min(-1, keepdims=True)
    return least[..., 0] - blend * np.log(np.exp((least - d) / blend).sum(-1))


def surface_net(step, low=(-1.0, -0.1, -0.35), high=(1.0, 1.95, 0.45)):
    """A closed mesh of the zero set of body_distance: a vertex a cell, a quad an edge that crosses it."""
    low, high = np.array(low), np.array(high)
    counts = np.ceil((high - low) / step).astype(int)
    grid = np.stack(np.meshgrid(*[low[k] + step * np.arange(counts[k]) for k in range(3)], indexing="ij"), -1)
    value = np.stack([body_distance(plane) for plane in grid])
    inside = value < 0
    sums, crossings = np.zeros(tuple(counts - 1) + (3,)), np.zeros(tuple(counts - 1))
    corners = [(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    cut = lambda array, o: array[o[0] : o[0] + counts[0] - 1, o[1] : o[1] + counts[1] - 1, o[2] : o[2] + counts[2] - 1]
    for o in corners:
        for axis in range(3):
            if o[axis]:
                continue
            p = tuple(o[k] + (k == axis) for k in range(3))
            a, b = cut(value, o), cut(value, p)
            crosses = (a < 0) != (b < 0)
            t = np.where(crosses, a / np.where(crosses, a - b, 1), 0)
            sums += np.where(crosses[..., None], np.array(o) + t[..., None] * np.eye(3)[axis], 0)
            crossings += crosses
    has = crossings > 0
    number = np.full(has.shape, -1)
    number[has] = np.arange(has.sum())
    places = low + step * (np.argwhere(has) + sums[has] / crossings[has][:, None])
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        first = np.moveaxis(inside, (axis, u, v), (0, 1, 2))
        cells = np.moveaxis(number, (axis, u, v), (0, 1, 2))
        i, j, k = np.nonzero(first[:-1, 1:-1, 1:-1] != first[1:, 1:-1, 1:-1])
        quad = np.stack([cells[i, j, k], cells[i, j + 1, k], cells[i, j + 1, k + 1], cells[i, j, k + 1]], -1)
        out = first[:-1, 1:-1, 1:-1][i, j, k]
        faces.append(np.where(out[:, None], quad, quad[:, ::-1]))
    return places, np.concatenate(faces)


def bumps(places):
    """The surface with bumps, 3 mm high and 4 cm apart, which end at his hands, feet and face."""
    slope = np.stack([body_distance(places + 1e-3 * np.eye(3)[k]) - body_distance(places - 1e-3 * np.eye(3)[k])
                      for k in range(3)], -1)
    normals = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    x, y, z = 2 * np.pi * places.T / 0.04
    wave = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    joint = joint_distances(places)
    bare = [NAMES.index(name) for name in NAMES if name[-4:] in ("Head", "Hand", "Foot")]
    near = np.clip((joint[:, bare].min(1) - 0.01) / 0.05, 0, 1)
    return places + normals * (0.003 * np.tanh(1.5 * wave) * near * near * (3 - 2 * near))[:, None]


# %% His motion
def rotation(axis, degrees):
    half = np.radians(degrees) / 2
    return np.array([*(np.sin(half) * np.array(axis, float)), np.cos(half)])


def times(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return np.array([aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
                     aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz])


X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)
HANG = {"LeftArm": rotation(Z, -72), "RightArm": rotation(Z, 72)}  # from the bind pose


def walk(phase):
    """Rotations by joint, and the hips' shift; phase 0 .. 1."""
    turn = 2 * np.pi * phase
    pose, hips = dict(HANG), np.array([0.02 * np.sin(turn), -0.02 + 0.025 * np.cos(2 * turn), 0])
    for side, s in (("Left", 0.0), ("Right", np.pi)):
        swing = np.sin(turn + s)
        pose[side + "UpLeg"] = rotation(X, -26 * swing)
        pose[side + "Leg"] = rotation(X, 8 + 38 * max(0, np.cos(turn + s)) ** 2)
        pose[side + "Foot"] = rotation(X, -6 - 12 * np.cos(turn + s))
        pose[side + "Arm"] = times(rotation(X, 26 * swing), HANG[side + "Arm"])
        pose[side + "ForeArm"] = rotation(Y, (-25 - 12 * np.cos(turn + s)) * (1 if side == "Left" else -1))
    pose["Hips"] = rotation(Y, 5 * np.sin(turn))
    pose["Spine"] = rotation(Z, 3 * np.sin(turn))
    pose["Chest"] = rotation(Y, -9 * np.sin(turn))
    return pose, hips


def jump(phase):
    crouch = np.interp(phase, [0, 0.2, 0.32, 0.4, 0.62, 0.7, 0.8, 1], [0, 1, -0.1, 0, 0, 0.9, 0.3, 0])
    air = np.interp(phase, [0.32, 0.62], [0, 1])
    height = 4 * 0.35 * air * (1 - air)
    pose = dict(HANG)
    for side, s in (("Left", 1), ("Right", -1)):
        pose[side + "UpLeg"] = rotation(X, -60 * crouch)
        pose[side + "Leg"] = rotation(X, 105 * max(crouch, 0))
        pose[side + "Foot"] = rotation(X, -45 * crouch)
        lift = 50 * crouch - 120 * min(max(height, 0), 0.3) / 0.3
        pose[side + "Arm"] = times(rotation(X, lift), HANG[side + "Arm"])
    pose["Spine"] = rotation(X, 25 * max(crouch, 0))
    leg = 0.9 * (1 - np.cos(np.radians(52 * max(crouch, 0))))
    return pose, np.array([0, height - 0.45 * leg, 0])


# %% The file
class Glb:
    """What a GLB is made of: accessors with their bytes, and clips."""

    def __init__(self):
        self.chunks, self.views, self.accessors, self.animations = [], [], [], []

    def add(self, array, kind, component, bounds=False, target=None):
        data = np.ascontiguousarray(array).tobytes()
        offset = sum(map(len, self.chunks))
        self.chunks.append(data + b"\0" * (-len(data) % 4))
        view = {"buffer": 0, "byteOffset": offset, "byteLength": len(data)}
        self.views.append(view | ({"target": target} if target else {}))
        accessor = {"bufferView": len(self.views) - 1, "componentType": component, "count": len(array), "type": kind}
        if bounds:
            flat = np.asarray(array).reshape(len(array), -1)
            accessor |= {"min": flat.min(0).tolist(), "max": flat.max(0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def add_clip(self, name, moments, channels):
        """channels: of each its node, what it moves, its values and their kind."""
        clock = self.add(moments.astype(np.float32), "SCALAR", 5126, True)
        clip = {"name": name, "samplers": [], "channels": []}
        for node, path, values, kind in channels:
            values = np.array(values, np.float32)
            clip["samplers"].append({"input": clock, "output": self.add(values, kind, 5126)})
            clip["channels"].append({"sampler": len(clip["samplers"]) - 1, "target": {"node": node, "path": path}})
        self.animations.append(clip)

    def save(self, path, nodes, roots, mesh, skin_color, more=None):
        look = {"baseColorFactor": [*skin_color, 1], "metallicFactor": 0, "roughnessFactor": 0.6}
        binary = b"".join(self.chunks)
        document = {
            "asset": {"version": "2.0", "generator": "Filigree's examples"},
            "scene": 0,
            "scenes": [{"nodes": roots}],
            "nodes": nodes,
            "meshes": [mesh],
            "materials": [{"name": "Skin", "pbrMetallicRoughness": look}],
            "animations": self.animations,
            "bufferViews": self.views,
            "accessors": self.accessors,
            "buffers": [{"byteLength": len(binary)}],
        } | (more or {})
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        with open(path, "wb") as file:
            file.write(struct.pack("<III", 0x46546C67, 2, 12 + 8 + len(text) + 8 + len(binary)))
            file.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
            file.write(struct.pack("<II", len(binary), 0x004E4942) + binary)


def add_surface(file, places, quads, colors, attributes):
    """The primitive of a mesh. colors: of the vertices, linear, three or four numbers each, or None."""
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    attributes = {"POSITION": file.add(places.astype(np.float32), "VEC3", 5126, True, 34962)} | attributes
    if colors is not None:
        attributes["COLOR_0"] = file.add(colors.astype(np.float32), f"VEC{colors.shape[1]}", 5126, target=34962)
    indices = file.add(triangles.astype(np.uint32).reshape(-1), "SCALAR", 5125, target=34963)
    return {"attributes": attributes, "indices": indices, "material": 0}


def write_character(path, name, places, quads, clips, skin_color, colors=None):
    """clips: of each its name, a function of the phase that gives rotations by joint and the shift of the first joint,
    its seconds and its number of keys. colors: of the vertices, linear, (n, 3)."""
    distance = joint_distances(places)
    weight = np.exp(-np.maximum(distance - distance.min(1, keepdims=True), 0) / 0.02)
    best = np.argsort(-weight, axis=1)[:, :4]
    of_best = np.take_along_axis(weight, best, 1)
    of_best[of_best < 0.02] = 0
    of_best /= of_best.sum(1, keepdims=True)
    best[of_best == 0] = 0

    where = {joint[0]: np.array(joint[2], float) for joint in JOINTS}
    nodes = [{"name": name, "mesh": 0, "skin": 0}]
    first = len(nodes)
    for joint, parent, place, _ in JOINTS:
        nodes.append({"name": joint, "translation": (where[joint] - (where[parent] if parent else 0)).tolist()})
    for number, (joint, parent, _, _) in enumerate(JOINTS):
        if parent:
            nodes[first + NAMES.index(parent)].setdefault("children", []).append(first + number)
    binds = np.tile(np.eye(4, dtype=np.float32), (len(JOINTS), 1, 1))
    for number, joint in enumerate(NAMES):
        binds[number, 3, :3] = -where[joint]  # columns first

    file = Glb()
    for clip, pose_at, seconds, keys in clips:
        moments = np.linspace(0, 1, keys)
        poses = [pose_at(phase) for phase in moments]
        channels = [(first + number, "rotation", [pose.get(joint, rotation(X, 0)) for pose, _ in poses], "VEC4")
                    for number, joint in enumerate(NAMES)]
        channels.append((first, "translation", [where[NAMES[0]] + shift for _, shift in poses], "VEC3"))
        file.add_clip(clip, seconds * moments, channels)
    surface = add_surface(file, places, quads, colors,
                          {"JOINTS_0": file.add(best.astype(np.uint8), "VEC4", 5121, target=34962),
                           "WEIGHTS_0": file.add(of_best.astype(np.float32), "VEC4", 5126, target=34962)})
    skin = {"joints": list(range(first, first + len(JOINTS))), "skeleton": first,
            "inverseBindMatrices": file.add(binds, "MAT4", 5126)}
    file.save(path, nodes, [0, first], {"name": name, "primitives": [surface]}, skin_color, {"skins": [skin]})
    names = " and ".join(clip[0] for clip in clips)
    print(f"{path}: {len(places):,} vertices, {len(JOINTS)} joints, clips {names}")


def main():
    paths = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
    step = 0.006 if "--relief" in sys.argv else 0.009 if "--fine" in sys.argv else 0.022
    places, quads = surface_net(step)
    if "--relief" in sys.argv:
        places = bumps(places)
    clips = [("Walk", walk, 1.1, 34), ("Jump", jump, 1.6, 49)]
    write_character(paths[0] if paths else "man.glb", "Man", places, quads, clips, (0.72, 0.47, 0.36))


if __name__ == "__main__":
    main()
