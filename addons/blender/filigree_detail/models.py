"""Models in a Blender file: the bytes of a .fil as a property of a text block, which objects refer to.

So they are saved, copied, appended and undone with the file, and nothing beside it can get lost. A text block and not
the mesh itself: Blender copies a mesh with its properties in every frame that it changes.
"""

import uuid

import bpy
import numpy as np

from .library import filigree

_BYTES, _KEY, _POSES, _FIRST = "filigree_model", "filigree_key", "filigree_poses", "filigree_first_frame"
_SAME = 1e-4  # of the driver's diagonal: how near a driver is to a fitted pose that is the one it plays
_models = {}  # key -> model; read from the file when first asked for
_poses = {}  # key -> positions (f, d, 3) and gradients (f, d, 3, 3) that were fitted
_restorers = {}  # key and options -> restorer and the array it writes into


def store(model, name):
    """Keeps a model in the file. Returns its text block."""
    text = bpy.data.texts.new(f"{name}.fil")
    text.write(f"The detail of {name}, kept by the add-on Filigree Detail. Without this block the mesh stays at rest.\n")
    text[_BYTES] = model.tobytes()
    text[_KEY] = uuid.uuid4().hex
    _models[text[_KEY]] = model
    return text


def remove(text):
    """Drops a model from the file unless another object follows by it."""
    if text is None or any(o.filigree.model == text for o in bpy.data.objects):
        return
    forget(text)
    bpy.data.texts.remove(text)


def forget(text):
    key = text.get(_KEY)
    _models.pop(key, None)
    _poses.pop(key, None)
    for known in [k for k in _restorers if k[0] == key]:
        del _restorers[known]


def forget_all():
    _models.clear()
    _poses.clear()
    _restorers.clear()


def model_of(settings):
    """The model an object follows by, or None where the file has lost it."""
    text = settings.model
    if text is None or _BYTES not in text:
        return None
    key = text[_KEY]
    if key not in _models:
        _models[key] = filigree.Model.frombytes(text[_BYTES])
    return _models[key]


def restorer_of(settings, level=None):
    """(restorer, array (n, 3) to restore into) at a level, None: the finest; None where there is no model."""
    model = model_of(settings)
    if model is None:
        return None
    key = (settings.model[_KEY], level)
    if key not in _restorers:
        restorer = filigree.Restorer(model, level=level)
        _restorers[key] = (restorer, np.empty((len(restorer), 3), np.float32))
    return _restorers[key]


def keep_poses(text, poses, frames):
    """Keeps fitted poses, one a frame of the scene, beside the model: their gradients are better than any that positions
    tell."""
    numbers = [np.concatenate((pose.positions[:, None, :], pose.gradients), axis=1) for pose in poses]
    text[_POSES] = np.ascontiguousarray(numbers, "<f4").tobytes()
    text[_FIRST] = frames[0]


def has_poses(settings):
    return settings.model is not None and _POSES in settings.model


def fitted_pose(settings, frame, positions):
    """The fitted pose of a frame of the scene (a float), or None where there is none or the driver is elsewhere: something
    else moves it."""
    text = settings.model
    if not has_poses(settings):
        return None
    key = text[_KEY]
    if key not in _poses:
        _poses[key] = np.frombuffer(text[_POSES], "<f4").reshape(-1, len(positions), 4, 3)
    poses = _poses[key]
    at = min(max(frame - text[_FIRST], 0), len(poses) - 1)
    before = int(at)
    after, share = min(before + 1, len(poses) - 1), at - before
    numbers = (1 - share) * poses[before] + share * poses[after] if share > 0 else poses[before]
    apart = np.abs(numbers[:, 0] - positions).max()
    if apart > _SAME * np.linalg.norm(np.ptp(positions, axis=0)):
        return None
    return filigree.Pose(numbers[:, 0], numbers[:, 1:])
