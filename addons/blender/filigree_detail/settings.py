"""What is stored in a file, on each object that follows a driver."""

import bpy


def _changed(settings, context):
    from . import follow

    follow.refresh(settings.id_data, context)


def _level_changed(settings, context):
    from . import nodes

    nodes.show_level(settings.id_data)
    _changed(settings, context)


class FiligreeSettings(bpy.types.PropertyGroup):
    driver: bpy.props.PointerProperty(type=bpy.types.Object, name="Driver", description="The light mesh that is followed")
    carrier: bpy.props.PointerProperty(type=bpy.types.Object, description="Bare vertices, where they are restored to")
    anchor: bpy.props.PointerProperty(type=bpy.types.Object)
    level_object: bpy.props.PointerProperty(type=bpy.types.Object)
    model: bpy.props.PointerProperty(type=bpy.types.Text, description="Where the file keeps the detail")
    enabled: bpy.props.BoolProperty(name="Follow", default=True, update=_changed, description="Whether the mesh follows its driver")
    object_motion: bpy.props.BoolProperty(
        name="Object Motion", default=True, update=_changed,
        description="Follow the driver's place, rotation and scale as well, not only its vertices")
    viewport_level: bpy.props.IntProperty(
        name="Level", default=-1, min=-1, max=16, update=_level_changed,
        description="Level shown in the viewport, 0 the coarsest; -1 the finest. Renders have the finest")
    message: bpy.props.StringProperty()


def register():
    bpy.utils.register_class(FiligreeSettings)
    bpy.types.Object.filigree = bpy.props.PointerProperty(type=FiligreeSettings)


def unregister():
    del bpy.types.Object.filigree
    bpy.utils.unregister_class(FiligreeSettings)
