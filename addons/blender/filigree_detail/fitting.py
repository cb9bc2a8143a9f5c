"""Fit: a driver and its poses that follow what the modifiers of the active mesh do, so that these can go; and Export."""

import json
import os
import struct

import bpy
import numpy as np

from . import baking, binding, follow, meshes, models, simulating
from .jobs import JobOperator
from .library import filigree

_TO_Y_UP = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float)  # as glTF has it


def shown_frames(context, high, frames):
    """What the modifiers and shape keys of `high` make of it in each frame, (f, n, 3) in its own space. A generator: it
    yields how far it is, and returns the array."""
    scene, count = context.scene, len(high.data.vertices)
    shown = np.empty((len(frames), count, 3), np.float32)
    before = scene.frame_current
    try:
        for number, frame in enumerate(frames):
            scene.frame_set(frame)
            mesh = high.evaluated_get(context.evaluated_depsgraph_get()).data
            if len(mesh.vertices) != count:
                raise filigree.UnsuitableError(
                    f"Frame {frame}: the modifiers make {len(mesh.vertices):,} vertices of {count:,}. Switch off those that add "
                    "or merge vertices, such as Subdivision, and fit again; they can be switched on afterwards.")
            shown[number] = meshes.vertices_of(mesh)
            yield ("capture", (number + 1) / len(frames))
    finally:
        scene.frame_set(before)
    return shown


def size_text(count):
    return f"{count / 1e6:.3g} MB" if count >= 1e6 else f"{count / 1e3:.3g} kB"


def follow_fitted(high, model, poses, frames, path):
    """From now on a new driver plays `poses`, and `high` follows it. What moved the mesh before is switched off."""
    driver = bpy.data.objects.new(f"{high.name} driver", meshes.blender_mesh(model.driver, f"{high.name} driver"))
    meshes.link_beside(driver, high)
    driver.parent = high  # the object's own motion stays with it
    driver.display_type, driver.hide_render = "WIRE", True
    for modifier in high.modifiers:
        modifier.show_viewport = modifier.show_render = False
    bpy.context.view_layer.update()
    binding.follow_driver(high, driver, model)
    models.keep_poses(high.filigree.model, poses, frames)
    with baking.PointCache(path, len(model.driver_vertices), frames[0], len(frames)) as cache:
        for pose in poses:
            cache.write(pose.positions)
    baking.play_cache(driver, path, frames[0])
    follow.follow(high, bpy.context.evaluated_depsgraph_get())


class FILIGREE_OT_fit(JobOperator, bpy.types.Operator):
    """Find the smallest driver that follows what the modifiers of the active mesh do in the frames of the scene. The modifiers
    are switched off, and can be removed"""

    bl_idname = "filigree.fit"
    bl_label = "Fit"

    error: bpy.props.FloatProperty(
        name="Error", default=1e-4, min=1e-6, max=0.1, precision=6,
        description="Largest root of the mean squared distance of all vertices and frames, as a fraction of the diagonal")

    def run(self, context):
        high = context.object
        if high.filigree.model is not None:
            raise filigree.UsageError("The mesh follows a driver already: Unbind first.")
        path = baking.cache_path(high).removesuffix(".pc2") + "_driver.pc2"
        frames = simulating.frame_range(context.scene)
        shown = yield from shown_frames(context, high, frames)
        mesh, error, rate = meshes.filigree_mesh(high.data), self.error, simulating.frame_rate(context.scene)
        if not np.ptp(shown, axis=0).any():
            raise filigree.UnsuitableError(
                f"{high.name} does not move in the frames {frames[0]} to {frames[-1]}: nothing is to be fitted.")
        fitted = yield lambda progress: filigree.fit(mesh, shown, error=error, frames_per_second=rate, progress=progress)
        model, poses = fitted
        report = model.report
        follow_fitted(high, model, poses, frames, path)
        kept = 4 * 12 * len(poses) * len(model.driver_vertices)
        self.report({"INFO"}, (
            f"{len(high.data.vertices):,} vertices follow {len(model.driver_vertices):,}: {report['rms']:.2g} of the diagonal off "
            f"(rms), {report['max']:.2g} at most (frame {frames[0] + report['max_frame']}); poses of {size_text(kept)} for "
            f"positions of {size_text(shown.nbytes)}"))


def poses_of(context, high, frames):
    """The poses that `high` follows in some frames; a generator as shown_frames."""
    scene, before, poses = context.scene, context.scene.frame_current, []
    try:
        for number, frame in enumerate(frames):
            scene.frame_set(frame)
            pose = follow.driver_pose(high, context.evaluated_depsgraph_get())
            if isinstance(pose, str):
                raise filigree.MismatchError(f"Frame {frame}: {pose}")
            poses.append(models.fitted_pose(high.filigree, scene.frame_current_final, pose) or filigree.Pose(pose))
            yield ("capture", (number + 1) / len(frames))
    finally:
        scene.frame_set(before)
    with_gradients = [pose.gradients is not None for pose in poses]
    return poses if all(with_gradients) or not any(with_gradients) else [filigree.Pose(pose.positions) for pose in poses]


def turn_glb(path, matrix):
    """Puts the nodes of a GLB under one with a matrix (4x4); skinned meshes stay above, as their joints move them."""
    with open(path, "rb") as file:
        data = file.read()
    length = struct.unpack_from("<I", data, 12)[0]
    gltf, rest = json.loads(data[20:20 + length]), data[20 + length:]
    for scene in gltf["scenes"]:
        skinned = [node for node in scene["nodes"] if "skin" in gltf["nodes"][node]]
        others = [node for node in scene["nodes"] if node not in skinned]
        gltf["nodes"].append({"name": "Filigree", "children": others, "matrix": [float(x) for x in np.array(matrix).T.flat]})
        scene["nodes"] = [len(gltf["nodes"]) - 1, *skinned]
    text = json.dumps(gltf, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    part = f"{path}.part"
    with open(part, "wb") as file:
        file.write(struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest)
    os.replace(part, path)


class FILIGREE_OT_export(JobOperator, bpy.types.Operator):
    """Write the mesh with the motion of its driver in few bytes: a skin for viewers and engines (.glb), or a packed model of
    Filigree's (.fil)"""

    bl_idname = "filigree.export"
    bl_label = "Export"

    filepath: bpy.props.StringProperty(name="File", subtype="FILE_PATH", description="Its ending says the format: .glb or .fil")
    filter_glob: bpy.props.StringProperty(default="*.glb;*.fil", options={"HIDDEN"})

    def invoke(self, context, event):
        if not bpy.app.background and not self.filepath:
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}
        return super().invoke(context, event)

    def run(self, context):
        high, path = context.object, bpy.path.abspath(self.filepath)
        if high.filigree.model is None:
            raise filigree.UsageError("The mesh follows no driver: make one, or fit one, first.")
        kind = os.path.splitext(path)[1].lower()
        if kind not in (".glb", ".fil"):
            raise filigree.UsageError(f"{path or 'The file'}: give a name that ends in .glb or .fil.")
        model, rate = models.model_of(high.filigree), simulating.frame_rate(context.scene)
        poses = yield from poses_of(context, high, simulating.frame_range(context.scene))
        sequence = filigree.PoseSequence(poses, rate)
        if kind == ".fil":
            yield lambda progress: filigree.pack(model, path, poses=sequence, progress=progress)
            said = ""
        else:
            written = yield lambda progress: filigree.export(model, path, sequence, progress=progress)
            turn_glb(path, _TO_Y_UP @ np.array(high.matrix_world, float))
            said = f"; {written['error_at_keys']:.1e} of the diagonal off at most"
        self.report({"INFO"}, f"{path}: {size_text(os.path.getsize(path))}, {len(poses)} frames{said}")


_CLASSES = (FILIGREE_OT_fit, FILIGREE_OT_export)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
