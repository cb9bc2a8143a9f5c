"""Show Error: how far the restored mesh is from one whose every vertex is deformed, as an attribute and as colours."""

import bpy
import numpy as np

from . import follow, meshes, models
from .jobs import JobOperator
from .library import filigree

ERROR, COLORS = "filigree_error", "filigree_error_colors"

# Modifiers that move a vertex by its place and weights alone, so that they do the same to the detailed mesh.
_DEFORMERS = {"ARMATURE", "CURVE", "LATTICE", "WARP", "WAVE"}


def _copy_modifier(modifier, to):
    made = to.modifiers.new(modifier.name, modifier.type)
    for setting in modifier.bl_rna.properties:
        if not setting.is_readonly and setting.identifier not in ("name", "type"):
            setattr(made, setting.identifier, getattr(modifier, setting.identifier))


def deform_every_vertex(high, context):
    """The detailed mesh with the driver's own modifiers, (n, 3) in the space of `high`. None where that says nothing:
    modifiers that move the driver alone (cloth, soft bodies, caches, shape keys), vertices moved by hand, or vertex
    groups that the detailed mesh does not have."""
    driver, model = high.filigree.driver, models.model_of(high.filigree)
    shown = [m for m in driver.modifiers if m.show_viewport]
    if not shown or driver.data.shape_keys is not None or any(m.type not in _DEFORMERS for m in shown):
        return None
    uses_groups = any(m.type == "ARMATURE" or getattr(m, "vertex_group", "") for m in shown)
    if uses_groups and {g.name for g in driver.vertex_groups} - {g.name for g in high.vertex_groups}:
        return None
    to_driver = driver.matrix_world.inverted_safe() @ high.matrix_world
    rest = meshes.moved(model.driver.vertices, to_driver) if high.filigree.object_motion else model.driver.vertices
    if not np.allclose(meshes.vertices_of(driver.data), rest, atol=1e-5 * model.mesh.diagonal):
        return None
    copy = high.copy()
    copy.data = high.data.copy()
    try:
        copy.modifiers.clear()
        context.scene.collection.objects.link(copy)
        copy.parent, copy.matrix_world = driver.parent, driver.matrix_world
        if high.filigree.object_motion:
            copy.data.vertices.foreach_set("co", meshes.moved(meshes.vertices_of(copy.data), to_driver).reshape(-1))
        for modifier in shown:
            _copy_modifier(modifier, copy)
        context.view_layer.update()
        deformed = meshes.vertices_of(copy.evaluated_get(context.evaluated_depsgraph_get()).data)
        return meshes.moved(deformed, to_driver.inverted_safe()) if high.filigree.object_motion else deformed
    finally:
        mesh = copy.data
        bpy.data.objects.remove(copy)
        bpy.data.meshes.remove(mesh)


def expect_error(high, pose):
    """The error that Filigree expects around each driver vertex, carried over to the mesh: (n,), model units."""
    model = models.model_of(high.filigree)
    local = filigree.expected_error(model, pose)["local_units"]
    largest = local.max()
    if largest == 0:
        return np.zeros(len(high.data.vertices), np.float32)
    # Restoring is linear in the driver's positions: what each vertex moves by is the driver's error between its corners.
    rest = model.driver.vertices
    unit = model.mesh.diagonal / largest
    raised = rest + np.outer(local * unit, [1, 0, 0])
    gradients = np.tile(np.eye(3, dtype=np.float32), (len(rest), 1, 1))
    restorer = filigree.Restorer(model)
    there = restorer.positions(raised, gradients)[:, 0] - restorer.positions(rest, gradients)[:, 0]
    return (there / unit)[: len(high.data.vertices)]


def _colors(error, range_end):
    """White where there is no error, over yellow to red at the end of the range, RGBA (n, 4)."""
    t = np.clip(error / range_end if range_end > 0 else error, 0, 1)
    stops = np.array([[1, 1, 1], [1, 0.85, 0.2], [0.9, 0.2, 0.05], [0.35, 0, 0.1]])
    rgb = np.stack([np.interp(t, np.linspace(0, 1, len(stops)), stops[:, c]) for c in range(3)], axis=1)
    return np.concatenate([rgb, np.ones((len(t), 1))], axis=1)


class FILIGREE_OT_show_error(JobOperator, bpy.types.Operator):
    """Write the error of the restored mesh at this frame to the attribute filigree_error, and show it as colours"""

    bl_idname = "filigree.show_error"
    bl_label = "Show Error"

    def run(self, context):
        high = context.object
        if high.filigree.model is None:
            raise filigree.UsageError("The mesh follows no driver: make or bind one first.")
        pose = follow.driver_pose(high, context.evaluated_depsgraph_get())
        if isinstance(pose, str):
            raise filigree.MismatchError(pose)
        count, diagonal = len(high.data.vertices), models.model_of(high.filigree).mesh.diagonal
        truth = deform_every_vertex(high, context)
        if truth is None:
            error, how = expect_error(high, pose), "expected"
        else:
            error, how = np.linalg.norm(follow.restore(high, pose)[:count] - truth, axis=1), "against every vertex deformed"
        yield ("error", 1.0)
        meshes.set_attribute(high.data, ERROR, error, "FLOAT", "value")
        meshes.set_attribute(high.data, COLORS, _colors(error, error.max()), "FLOAT_COLOR", "color")
        high.data.attributes.active_color = high.data.attributes[COLORS]
        for area in context.screen.areas if context.screen else ():
            if area.type == "VIEW_3D":
                area.spaces.active.shading.color_type = "VERTEX"
        rms = float(np.sqrt(np.mean(np.square(error, dtype=np.float64)))) / diagonal
        self.report({"INFO"}, f"Error {how}: rms {rms:.1e}, largest {error.max() / diagonal:.1e} of the diagonal")


def register():
    bpy.utils.register_class(FILIGREE_OT_show_error)


def unregister():
    bpy.utils.unregister_class(FILIGREE_OT_show_error)
