"""Restoring when Blender says that something moved: each frame of the viewport and of renders, and each pose between."""

import bpy
import numpy as np
from bpy.app.handlers import persistent

from . import meshes, models, nodes
from .library import filigree


def followers(scene):
    """The objects of a scene that follow a driver."""
    return [o for o in scene.objects
            if o.type == "MESH" and (o.filigree.model or o.filigree.driver) and nodes.MODIFIER in o.modifiers]


def _separate_copies(objects):
    """A copied object has the carrier of the one it was copied from: it gets one of its own, and a level of its own."""
    owned = set()
    for high in objects:
        settings = high.filigree
        if settings.carrier in owned:
            settings.carrier, settings.level_object = nodes.make_carrier(high), None
            nodes.show_level(high)
        owned.add(settings.carrier)


def set_at_rest(high):
    """Shows the mesh's own shape."""
    if high.filigree.carrier is not None:
        meshes.set_vertices(high.filigree.carrier.data, meshes.vertices_of(high.data))


def driver_pose(high, depsgraph):
    """Where the driver's vertices are in the space of `high`, (d, 3), or a sentence that says why it is not known."""
    driver = high.filigree.driver
    if driver is None:
        return "The driver was deleted: choose another and Update, or Unbind"
    if driver.name not in depsgraph.scene.objects:
        return f"{driver.name} is not in this scene: Update brings it here"
    evaluated = driver.evaluated_get(depsgraph)
    mesh = evaluated.data
    model = models.model_of(high.filigree)
    count = len(model.driver_vertices)
    if len(mesh.vertices) != count:
        return (f"{driver.name} has {len(mesh.vertices):,} vertices, {count:,} were bound: remove what adds or merges "
                "vertices, or Update")
    pose = meshes.vertices_of(mesh)
    if high.filigree.object_motion:
        to_high = high.evaluated_get(depsgraph).matrix_world.inverted_safe() @ evaluated.matrix_world
        pose = meshes.moved(pose, to_high)
    return pose if np.isfinite(pose).all() else f"{driver.name} has vertices at no finite place"


def restore(high, pose, level=None):
    """Positions of `high`'s vertices for a pose of its driver (or its positions), (n, 3). Of an older file's model the driver's may stand behind them."""
    restorer, out = models.restorer_of(high.filigree, level)
    return restorer.positions(pose, out=out)


def _place(high, depsgraph):
    """Restores one object. Returns a sentence where it could not; then the mesh is at rest."""
    settings = high.filigree
    model = models.model_of(settings)
    if model is None:
        return "The text block with the detail is gone: Update binds again"
    count = len(high.data.vertices)
    if count != settings.model.get("filigree_vertices", count):
        return f"{high.name} has {count:,} vertices, {settings.model['filigree_vertices']:,} were bound: Update"
    pose = driver_pose(high, depsgraph)
    if isinstance(pose, str):
        return pose
    fitted = models.fitted_pose(settings, depsgraph.scene.frame_current_final, pose)
    pose = pose if fitted is None else fitted
    level_object = settings.level_object
    if level_object is not None and depsgraph.mode == "VIEWPORT":
        level = level_object.get("filigree_level")
        meshes.set_vertices(level_object.data, restore(high, pose, level))
    else:
        meshes.set_vertices(settings.carrier.data, restore(high, pose)[:count])
    return ""


def follow(high, depsgraph):
    """Restores `high` as its driver is now, and says in its panel what is in the way."""
    settings = high.filigree
    if not settings.enabled or settings.carrier is None or high.mode == "EDIT":
        return
    try:
        message = _place(high, depsgraph)
    except filigree.Error as error:
        message = str(error)
    if message and (not settings.message or len(settings.carrier.data.vertices) != len(high.data.vertices)):
        set_at_rest(high)
    if message != settings.message:
        settings.message = message


def refresh(high, context):
    """After a setting was changed."""
    if filigree is None or not (high.filigree.model or high.filigree.driver):
        return
    nodes.follow_by_nodes(high)
    if not high.filigree.enabled:
        set_at_rest(high)
    else:
        follow(high, context.evaluated_depsgraph_get())


@persistent
def _on_frame(scene, depsgraph=None):
    depsgraph = depsgraph or bpy.context.evaluated_depsgraph_get()
    for high in followers(scene):
        follow(high, depsgraph)


@persistent
def _on_update(scene, depsgraph):
    """Between frames: where a driver or the object itself was touched. Our own write does not count: Blender evaluates
    it in the same update, without another call."""
    touched = {u.id.original for u in depsgraph.updates if isinstance(u.id, bpy.types.Object)}
    if not touched:
        return
    objects = followers(scene)
    _separate_copies(objects)
    for high in objects:
        if high.filigree.driver in touched or (high in touched and high.filigree.object_motion):
            follow(high, depsgraph)


@persistent
def _on_load(_):
    models.forget_all()
    for scene in bpy.data.scenes:
        for high in followers(scene):
            high.filigree.message = ""


@persistent
def _on_undo(scene):
    _on_frame(scene)


_HANDLERS = (("frame_change_post", _on_frame), ("depsgraph_update_post", _on_update), ("load_post", _on_load),
             ("undo_post", _on_undo), ("redo_post", _on_undo))


def register():
    if filigree is None:
        return
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    for name, handler in _HANDLERS:
        listed = getattr(bpy.app.handlers, name)
        if handler in listed:
            listed.remove(handler)
    models.forget_all()
