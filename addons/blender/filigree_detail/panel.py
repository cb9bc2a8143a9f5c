"""The panel in the 3D viewport's sidebar."""

import bpy

from . import binding, models, simulating
from .library import filigree, missing


class _Panel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Filigree"


def _warnings(context, high):
    """Sentences an artist should read before a render."""
    settings = high.filigree
    if settings.message:
        yield settings.message
    driver = settings.driver
    if driver is None:
        return
    for modifier in driver.modifiers:
        cache = getattr(modifier, "point_cache", None)
        if cache is not None and not cache.is_baked:
            yield f"{modifier.name} of {driver.name} is not baked: renders in the background stand still"
    if high.data.shape_keys is not None and not models.has_poses(settings):
        yield "Shape keys of the detailed mesh itself are not seen: put them on the driver"


def _lines(layout, sentence, width=44):
    """A sentence over as many lines as it takes."""
    column, line = layout.column(align=True), ""
    for word in sentence.split():
        if line and len(line) + len(word) >= width:
            column.label(text=line)
            line = ""
        line = f"{line} {word}".strip()
    column.label(text=line)


class FILIGREE_PT_detail(_Panel, bpy.types.Panel):
    bl_idname = "FILIGREE_PT_detail"
    bl_label = "Filigree Detail"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        if filigree is None:
            _lines(layout, missing)
            return
        high = context.object
        if high is None or high.type != "MESH":
            layout.label(text="Select a detailed mesh")
            return
        if not (high.filigree.model or high.filigree.driver):
            self._draw_unbound(layout, context)
        else:
            self._draw_bound(layout, context, high)

    def _draw_unbound(self, layout, context):
        window = context.window_manager
        layout.prop(window, "filigree_vertices")
        layout.operator("filigree.make_driver", icon="MOD_DECIM").vertices = window.filigree_vertices
        layout.operator("filigree.bind", icon="LINKED")
        layout.separator()
        layout.prop(window, "filigree_error")
        layout.operator("filigree.fit", icon="MOD_MESHDEFORM").error = window.filigree_error

    def _draw_bound(self, layout, context, high):
        settings = high.filigree
        layout.prop(settings, "driver")
        if binding.BAKED in high.modifiers:
            layout.label(text="Plays its bake", icon="FILE_CACHE")
            layout.operator("filigree.free_bake", icon="X")
            return
        layout.prop(settings, "enabled")
        layout.prop(settings, "object_motion")
        layout.prop(settings, "viewport_level")
        for sentence in _warnings(context, high):
            box = layout.box()
            box.alert = True
            _lines(box, sentence)
        row = layout.row(align=True)
        row.operator("filigree.update", icon="FILE_REFRESH")
        row.operator("filigree.unbind", icon="UNLINKED")
        layout.operator("filigree.bake", icon="REC")
        layout.operator("filigree.export", icon="EXPORT")
        layout.operator("filigree.show_error", icon="SHADERFX")


class FILIGREE_PT_body(_Panel, bpy.types.Panel):
    bl_idname = "FILIGREE_PT_body"
    bl_label = "Body"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return filigree is not None and context.object is not None and context.object.type == "MESH"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        body = context.scene.filigree_body
        for name in ("material", "particles", "obstacles"):
            layout.prop(body, name)
        layout.prop_search(body, "soft_group", context.object, "vertex_groups")
        if body.soft_group:
            layout.prop(body, "softness")
        layout.operator("filigree.simulate", icon="PHYSICS")
        for name in ("pieces", "strength"):
            layout.prop(body, name)
        layout.operator("filigree.fracture", icon="MOD_EXPLODE")


class FILIGREE_PT_flesh(_Panel, bpy.types.Panel):
    bl_idname = "FILIGREE_PT_flesh"
    bl_label = "Flesh"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return FILIGREE_PT_body.poll(context)

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        flesh = context.scene.filigree_flesh
        for name in ("stiffness", "damping", "particles", "joints", "loop"):
            layout.prop(flesh, name)
        layout.prop_search(flesh, "soft_group", context.object, "vertex_groups")
        layout.operator("filigree.flesh", icon="ARMATURE_DATA")


_CLASSES = (FILIGREE_PT_detail, FILIGREE_PT_body, FILIGREE_PT_flesh)


def register():
    bpy.types.WindowManager.filigree_vertices = bpy.props.IntProperty(
        name="Driver Vertices", default=1000, min=4, soft_max=20000, description="Vertices of the driver, about")
    bpy.types.WindowManager.filigree_error = bpy.props.FloatProperty(
        name="Error", default=1e-4, min=1e-6, max=0.1, precision=6,
        description="Largest error of a fit: root of the mean square, as a fraction of the diagonal")
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
    del bpy.types.WindowManager.filigree_error
    del bpy.types.WindowManager.filigree_vertices
