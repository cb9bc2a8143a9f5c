"""Models in a Blender file: the bytes of a .fil as a property of a text block, which objects refer to.

So they are saved, copied, appended and undone with the file, and nothing beside it can get lost. A text block and not
the mesh itself: Blender copies a mesh with its properties in every frame that it changes.
"""

import uuid

import bpy
import numpy as np

from .library import filigree

_BYTES, _KEY = "filigree_model", "filigree_key"
_models = {}  # key -> model; read from the file when first asked for
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
    for known in [k for k in _restorers if k[0] == key]:
        del _restorers[known]


def forget_all():
    _models.clear()
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
