"""Bake: the restored mesh as a point cache, which plays without the add-on."""

import os
import struct
import tempfile

import bpy
import numpy as np

from . import follow, meshes, models, nodes
from .binding import BAKED
from .jobs import JobOperator
from .library import filigree


class PointCache:
    """A PC2 file that is written frame by frame, beside its target; it has its name once it is whole."""

    def __init__(self, path, vertices, first_frame, frames):
        self._path = path
        os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
        handle, self._part = tempfile.mkstemp(prefix=os.path.basename(path), suffix=".part", dir=os.path.dirname(path) or ".")
        self._file = os.fdopen(handle, "wb")
        self._file.write(struct.pack("<12siiffi", b"POINTCACHE2", 1, vertices, first_frame, 1.0, frames))

    def write(self, positions):
        self._file.write(np.ascontiguousarray(positions, "<f4").tobytes())

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        self._file.close()
        if kind is None:
            os.replace(self._part, self._path)
        else:
            os.remove(self._part)


def cache_path(obj, given=""):
    """Where an object's cache goes: beside the file, in filigree/, unless it was said."""
    if given:
        return bpy.path.abspath(given)
    if not bpy.data.is_saved:
        raise filigree.UsageError("Save the file first: caches lie beside it, in the folder filigree. Or name a file.")
    return os.path.join(bpy.path.abspath("//filigree"), bpy.path.clean_name(obj.name) + ".pc2")


def play_cache(obj, path, first_frame):
    """A Mesh Cache modifier, first in the stack, that plays a PC2 from a frame on."""
    modifier = obj.modifiers.get(BAKED) or obj.modifiers.new(BAKED, "MESH_CACHE")
    modifier.cache_format = "PC2"
    modifier.filepath = bpy.path.relpath(path) if bpy.data.is_saved else path
    modifier.frame_start = first_frame
    modifier.frame_scale = 1
    with bpy.context.temp_override(object=obj):
        bpy.ops.object.modifier_move_to_index(modifier=BAKED, index=0)


class FILIGREE_OT_bake(JobOperator, bpy.types.Operator):
    """Write the mesh of every frame of the scene to a point cache and play that. It needs neither driver nor add-on"""

    bl_idname = "filigree.bake"
    bl_label = "Bake"

    filepath: bpy.props.StringProperty(name="File", subtype="FILE_PATH", description="PC2 file; unless given, filigree/NAME.pc2 beside the .blend")

    def run(self, context):
        high, scene = context.object, context.scene
        if high.filigree.model is None:
            raise filigree.UsageError("The mesh follows no driver: make or bind one first.")
        path = cache_path(high, self.filepath)
        before, count = scene.frame_current, len(high.data.vertices)
        first, last = scene.frame_start, scene.frame_end
        try:
            with PointCache(path, count, first, last - first + 1) as cache:
                for frame in range(first, last + 1):
                    scene.frame_set(frame)
                    pose = follow.driver_pose(high, context.evaluated_depsgraph_get())
                    if isinstance(pose, str):
                        raise filigree.MismatchError(f"Frame {frame}: {pose}")
                    fitted = models.fitted_pose(high.filigree, scene.frame_current_final, pose)
                    cache.write(follow.restore(high, pose if fitted is None else fitted)[:count])
                    yield ("bake", (frame - first + 1) / (last - first + 1))
        finally:
            scene.frame_set(before)
        high.filigree.enabled = False
        nodes_modifier = high.modifiers.get(nodes.MODIFIER)
        if nodes_modifier is not None:
            nodes_modifier.show_viewport = nodes_modifier.show_render = False
        play_cache(high, path, first)
        self.report({"INFO"}, f"{last - first + 1} frames in {path}")


class FILIGREE_OT_free_bake(bpy.types.Operator):
    """Follow the driver again. The cache's file stays"""

    bl_idname = "filigree.free_bake"
    bl_label = "Free Bake"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return context.object is not None and BAKED in context.object.modifiers

    def execute(self, context):
        high = context.object
        high.modifiers.remove(high.modifiers[BAKED])
        if high.filigree.model is not None:
            nodes.follow_by_nodes(high)
            high.filigree.enabled = True
        return {"FINISHED"}


_CLASSES = (FILIGREE_OT_bake, FILIGREE_OT_free_bake)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
