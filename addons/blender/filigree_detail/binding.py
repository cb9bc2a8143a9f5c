"""Make driver, Bind, Update, Unbind."""

import bpy
import numpy as np

from . import follow, meshes, models, nodes
from .jobs import JobOperator
from .library import filigree

BAKED = "Filigree baked"  # the Mesh Cache modifier that plays a bake


def follow_driver(high, driver, model):
    """From now on `high` follows `driver` by `model`; whatever it followed before is forgotten."""
    settings = high.filigree
    before = settings.model
    settings.model = models.store(model, high.name)
    settings.model["filigree_vertices"] = len(high.data.vertices)
    settings.driver = driver
    models.remove(before)
    if settings.carrier is None:
        settings.carrier = nodes.make_carrier(high)
    restore_setup(high)
    nodes.show_level(high)


def restore_setup(high):
    """Everything in the scene that following takes, made where it is missing."""
    settings = high.filigree
    scene = bpy.context.scene
    if settings.driver.name not in scene.objects:
        meshes.link_beside(settings.driver, high)
    nodes.remove_object(settings.anchor)
    settings.anchor = nodes.make_anchor(high, settings.driver)
    meshes.link_beside(settings.anchor, high)
    settings.anchor.hide_set(True)
    nodes.follow_by_nodes(high)
    baked = high.modifiers.get(BAKED)
    if baked is not None:
        high.modifiers.remove(baked)
    settings.message = ""
    scene.render.use_lock_interface = True  # Blender may not draw the mesh while a render's frame is written to it
    follow.follow(high, bpy.context.evaluated_depsgraph_get())


def _select_doubtful(high, model):
    """Selects the vertices that could not be bound well, for Edit Mode. Returns how many there are."""
    doubtful = np.union1d(model.across_gap, model.facing_away)
    chosen = np.zeros(len(high.data.vertices), bool)
    chosen[doubtful[doubtful < len(chosen)]] = True
    high.data.vertices.foreach_set("select", chosen)
    high.data.polygons.foreach_set("select", np.zeros(len(high.data.polygons), bool))
    high.data.edges.foreach_set("select", np.zeros(len(high.data.edges), bool))
    return int(chosen.sum())


class FILIGREE_OT_make_driver(JobOperator, bpy.types.Operator):
    """Take the detail off the active mesh: a light driver is made beside it, and the mesh follows it"""

    bl_idname = "filigree.make_driver"
    bl_label = "Make Driver"

    vertices: bpy.props.IntProperty(name="Vertices", default=1000, min=4, soft_max=20000, description="Vertices of the driver, about")

    def run(self, context):
        high = context.object
        mesh = meshes.filigree_mesh(high.data)
        model = yield lambda progress: filigree.strip(mesh, base=self.vertices, progress=progress)
        driver = bpy.data.objects.new(f"{high.name} driver", meshes.blender_mesh(model.driver, f"{high.name} driver"))
        meshes.link_beside(driver, high)
        driver.matrix_world = high.matrix_world
        driver.display_type = "WIRE"
        driver.hide_render = True
        follow_driver(high, driver, model)
        self.report({"INFO"}, f"{len(high.data.vertices):,} vertices follow {len(model.driver_vertices):,}")


class FILIGREE_OT_bind(JobOperator, bpy.types.Operator):
    """Let the active mesh follow the other selected mesh. Vertices that could not be bound well are selected for Edit Mode"""

    bl_idname = "filigree.bind"
    bl_label = "Bind"

    driver: bpy.props.StringProperty(name="Driver", description="Name of the light mesh; unless given, the other selected mesh")

    def run(self, context):
        high = context.object
        driver = bpy.data.objects.get(self.driver) or next(
            (o for o in context.selected_objects if o != high and o.type == "MESH"), None)
        if driver is None or driver == high or driver.type != "MESH":
            raise filigree.UsageError("Select the light mesh, then the detailed one, which is to follow it; or name the light one.")
        yield from _bind(self, high, driver)


def _bind(operator, high, driver):
    """Binds `high` to `driver`, both as they are without their modifiers."""
    if not driver.data.vertices or not high.data.vertices:
        raise filigree.UnsuitableError("There is a mesh without vertices: nothing to bind.")
    mesh = meshes.filigree_mesh(high.data)
    to_high = high.matrix_world.inverted_safe() @ driver.matrix_world if high.filigree.object_motion else None
    light = meshes.filigree_mesh(driver.data, to_high)
    model = yield lambda progress: filigree.strip(mesh, driver=light, progress=progress)
    follow_driver(high, driver, model)
    doubtful = _select_doubtful(high, model)
    said = f"{len(high.data.vertices):,} vertices follow {len(driver.data.vertices):,}"
    if doubtful:
        said += f"; {doubtful:,} could not be bound well and are selected"
    operator.report({"INFO"}, said)


class FILIGREE_OT_update(JobOperator, bpy.types.Operator):
    """Bind again to the same driver, with both meshes as they are now, and bring back what is missing from the scene"""

    bl_idname = "filigree.update"
    bl_label = "Update"

    def run(self, context):
        high = context.object
        if high.filigree.driver is None:
            raise filigree.UsageError("There is no driver: choose one in the panel, or make one.")
        yield from _bind(self, high, high.filigree.driver)


class FILIGREE_OT_unbind(bpy.types.Operator):
    """Give the mesh its rest shape back. The driver stays"""

    bl_idname = "filigree.unbind"
    bl_label = "Unbind"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "MESH" and context.mode == "OBJECT"

    def execute(self, context):
        high, settings = context.object, context.object.filigree
        for name in (nodes.MODIFIER, BAKED):
            modifier = high.modifiers.get(name)
            if modifier is not None:
                high.modifiers.remove(modifier)
        nodes.remove_object(settings.anchor)
        if sum(o.filigree.carrier == settings.carrier for o in bpy.data.objects) == 1:
            nodes.remove_object(settings.carrier)
        settings.carrier = None
        nodes.remove_object(settings.level_object)
        before, settings.model, settings.driver, settings.message = settings.model, None, None, ""
        models.remove(before)
        return {"FINISHED"}


_CLASSES = (FILIGREE_OT_make_driver, FILIGREE_OT_bind, FILIGREE_OT_update, FILIGREE_OT_unbind)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
