"""Flesh: a character that an armature moves as soft matter. The result is a mesh of its own, which follows a fitted driver."""

import os
import tempfile

import bpy
import numpy as np
from mathutils.kdtree import KDTree

from . import baking, fitting, meshes, simulating
from .jobs import JobOperator
from .library import filigree

_TO_Z_UP = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], float)  # from glTF
_SAME = 1e-4  # of the diagonal: how near a vertex of the exported skin is to the one that it was made of


class FiligreeFlesh(bpy.types.PropertyGroup):
    stiffness: bpy.props.FloatProperty(
        name="Stiffness", default=15000, min=100, soft_max=1e6, description="Young's modulus, Pa: 5,000 wobbles, 50,000 holds")
    damping: bpy.props.FloatProperty(name="Damping", default=3, min=0, soft_max=30, description="Of motion beside the animation, 1/s")
    particles: bpy.props.IntProperty(name="Particles", default=3000, min=64, soft_max=50000, description="That fill the mesh, about")
    joints: bpy.props.IntProperty(
        name="Joints", default=300, min=12, soft_max=5000, description="Vertices of the driver that follows the flesh, about")
    loop: bpy.props.BoolProperty(name="Loop", description="The frames of the scene are a cycle: the flesh ends as it begins")
    soft_group: bpy.props.StringProperty(
        name="Soft", description="Vertex group: where its weight is 1, the bones hold little. Empty: all is held alike")


def armature_of(high):
    """The armature that moves a mesh."""
    for modifier in high.modifiers:
        if modifier.type == "ARMATURE" and modifier.object is not None and modifier.show_viewport:
            return modifier.object
    raise filigree.UsageError(f"{high.name} has no Armature modifier that is on: bones are needed. Fit takes other modifiers.")


def exported_skin(context, high, armature):
    """The mesh with its armature and what the armature does in the frames of the scene, as a skin of Filigree's."""
    selected, active = list(context.selected_objects), context.view_layer.objects.active
    with tempfile.TemporaryDirectory(prefix="filigree-") as folder:
        path = os.path.join(folder, "character.glb")
        try:
            for other in selected:
                other.select_set(False)
            for one in (high, armature):
                one.select_set(True)
            bpy.ops.export_scene.gltf(
                filepath=path, export_format="GLB", use_selection=True, export_animations=True, export_frame_range=True,
                export_force_sampling=True, export_nla_strips=False, export_skins=True, export_morph=False, export_materials="NONE")
        finally:
            for one in context.selected_objects:
                one.select_set(False)
            for other in selected:
                other.select_set(True)
            context.view_layer.objects.active = active
        return filigree.read_skin(path)


def vertices_of_skin(high, skin):
    """For each vertex of `high` one of the skin's mesh, which was made of it; and for each of the skin's one of `high`."""
    ours = meshes.moved(meshes.vertices_of(high.data), high.matrix_world)
    theirs = meshes.moved(np.asarray(skin.mesh.world_vertices), _TO_Z_UP)
    most = _SAME * np.linalg.norm(np.ptp(ours, axis=0))
    maps = []
    for points, wanted in ((theirs, ours), (ours, theirs)):
        tree = KDTree(len(points))
        for number, point in enumerate(points):
            tree.insert(point, number)
        tree.balance()
        found = [tree.find(point) for point in wanted]
        maps.append((np.array([number for _, number, _ in found]), max(apart for _, _, apart in found)))
    if maps[0][1] > most:
        raise filigree.UnsuitableError(
            f"{high.name}: the exported skin is {maps[0][1]:.2g} away from the mesh; apply what stands above the Armature "
            "modifier, and put the armature into the rest pose in which the mesh was bound.")
    return maps[0][0], maps[1][0]


class FILIGREE_OT_flesh(JobOperator, bpy.types.Operator):
    """Make soft matter of the active mesh, which an armature moves in the frames of the scene. The result is a mesh beside it,
    which needs neither armature nor physics"""

    bl_idname = "filigree.flesh"
    bl_label = "Flesh"

    def run(self, context):
        high, scene, settings = context.object, context.scene, context.scene.filigree_flesh
        armature, frames = armature_of(high), simulating.frame_range(scene)
        path, rate = baking.cache_path(high).removesuffix(".pc2") + "_flesh_driver.pc2", simulating.frame_rate(scene)
        options = {key: getattr(settings, key) for key in ("particles", "stiffness", "damping")}
        group = high.vertex_groups.get(settings.soft_group) if settings.soft_group else None
        if settings.soft_group and group is None:
            raise filigree.UsageError(f"{high.name} has no vertex group {settings.soft_group!r}, which the panel Flesh names as Soft.")
        before = scene.frame_current
        skin = exported_skin(context, high, armature)
        scene.frame_set(before)
        of_ours, of_theirs = vertices_of_skin(high, skin)
        if group is not None:
            options["loose"] = meshes.group_weights(high.data, group.index)[of_theirs]
        to_high = np.array(high.matrix_world.inverted_safe(), float) @ _TO_Z_UP
        mesh, loop, joints = meshes.filigree_mesh(high.data), settings.loop, settings.joints

        def compute(progress):
            flesh = filigree.Flesh(skin, progress=progress, **options)
            positions, said = flesh.simulate(0, loop=loop, frames_per_second=rate, progress=progress)
            shown = np.stack([meshes.moved(frame[of_ours], to_high) for frame in positions])
            shown = shown[np.minimum(np.arange(len(frames)), len(shown) - 1)]  # a loop has a rate of its own
            most = max(12, min(joints, len(mesh.vertices) // 4))
            return filigree.fit(mesh, shown, base=most, frames_per_second=rate, progress=progress), said

        (model, poses), said = yield compute
        soft = bpy.data.objects.new(f"{high.name} flesh", high.data.copy())
        soft.matrix_world = high.matrix_world
        meshes.link_beside(soft, high)
        fitting.follow_fitted(soft, model, poses, frames, path)
        high.hide_set(True)
        high.hide_render = True
        least, most = said["volume"]
        self.report({"INFO"}, (
            f"{soft.name}: volume {least:.3f} to {most:.3f} of the bind pose's (skin {said['skin_volume'][0]:.3f} to "
            f"{said['skin_volume'][1]:.3f}), {100 * said['furthest']:.2g} % of the diagonal from the skin at most; "
            f"{len(model.driver_vertices):,} driver vertices follow it to {model.report['rms']:.1e} (rms). {high.name} is hidden"))


def register():
    bpy.utils.register_class(FiligreeFlesh)
    bpy.types.Scene.filigree_flesh = bpy.props.PointerProperty(type=FiligreeFlesh)
    bpy.utils.register_class(FILIGREE_OT_flesh)


def unregister():
    bpy.utils.unregister_class(FILIGREE_OT_flesh)
    del bpy.types.Scene.filigree_flesh
    bpy.utils.unregister_class(FiligreeFlesh)
