"""Geometry nodes of ours: one that puts the restored positions on a mesh, one that keeps a driver evaluated."""

import bpy

from . import meshes, models

MODIFIER = "Filigree"
_FOLLOW, _ANCHOR = "Filigree follow", "Filigree anchor"


def _group(name, inputs):
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    sockets = [(kind, label, "INPUT") for kind, label in inputs] + [("NodeSocketGeometry", "Geometry", "OUTPUT")]
    for kind, label, way in sockets:
        if hasattr(group, "interface"):  # from Blender 4.0 on
            group.interface.new_socket(label, in_out=way, socket_type=kind)
        else:
            (group.inputs if way == "INPUT" else group.outputs).new(kind, label)
    return group


def _inputs(group):
    return [s for s in group.interface.items_tree if s.in_out == "INPUT"] if hasattr(group, "interface") else group.inputs


def _follow_group():
    """The mesh with the positions of a carrier, vertex for vertex; in the viewport a coarser object, where there is one.
    So a frame changes the carrier's bare vertices, and Blender need not copy the mesh itself."""
    group = bpy.data.node_groups.get(_FOLLOW)
    if group is not None:
        return group
    group = _group(_FOLLOW, (("NodeSocketGeometry", "Geometry"), ("NodeSocketObject", "Carrier"), ("NodeSocketBool", "Coarse"),
                             ("NodeSocketObject", "Level")))
    new, link = group.nodes.new, group.links.new

    def output(node, kind):
        return next(s for s in node.outputs if s.enabled and s.type == kind)

    def inputs(node, kind):
        return [s for s in node.inputs if s.enabled and s.type == kind]

    taken, given = new("NodeGroupInput"), new("NodeGroupOutput")
    carrier, level = new("GeometryNodeObjectInfo"), new("GeometryNodeObjectInfo")
    sample, put = new("GeometryNodeSampleIndex"), new("GeometryNodeSetPosition")
    viewport, both, switch = new("GeometryNodeIsViewport"), new("FunctionNodeBooleanMath"), new("GeometryNodeSwitch")
    sample.data_type, sample.domain, switch.input_type = "FLOAT_VECTOR", "POINT", "GEOMETRY"
    link(taken.outputs["Carrier"], carrier.inputs["Object"])
    link(carrier.outputs["Geometry"], sample.inputs["Geometry"])
    link(new("GeometryNodeInputPosition").outputs[0], inputs(sample, "VECTOR")[0])
    link(new("GeometryNodeInputIndex").outputs[0], sample.inputs["Index"])
    link(taken.outputs["Geometry"], put.inputs["Geometry"])
    link(output(sample, "VECTOR"), put.inputs["Position"])
    link(taken.outputs["Coarse"], both.inputs[0])
    link(viewport.outputs[0], both.inputs[1])
    link(taken.outputs["Level"], level.inputs["Object"])
    link(both.outputs[0], inputs(switch, "BOOLEAN")[0])
    for source, choice in zip((put.outputs[0], level.outputs["Geometry"]), inputs(switch, "GEOMETRY")):
        link(source, choice)
    link(output(switch, "GEOMETRY"), given.inputs[0])
    return group


def _set_input(modifier, label, value):
    modifier[next(s.identifier for s in _inputs(modifier.node_group) if s.name == label)] = value


def follow_by_nodes(high):
    """The modifier that shows the restored shape, first in the stack. Made where it is missing."""
    modifier = high.modifiers.get(MODIFIER) or high.modifiers.new(MODIFIER, "NODES")
    modifier.node_group = _follow_group()
    modifier.show_viewport = modifier.show_render = True
    _set_input(modifier, "Carrier", high.filigree.carrier)
    _set_input(modifier, "Coarse", high.filigree.level_object is not None and high.filigree.enabled)
    _set_input(modifier, "Level", high.filigree.level_object)
    at = high.modifiers.find(MODIFIER)
    if at > 0:
        with bpy.context.temp_override(object=high):
            bpy.ops.object.modifier_move_to_index(modifier=MODIFIER, index=0)
    return high.modifiers[MODIFIER]


def make_carrier(high):
    """An object of bare vertices, in no scene: the modifier names it. At first they are those of the mesh."""
    carrier = bpy.data.objects.new(f"{high.name} carrier", bpy.data.meshes.new(f"{high.name} carrier"))
    meshes.set_vertices(carrier.data, meshes.vertices_of(high.data))
    return carrier


def make_anchor(high, driver):
    """An empty mesh whose nodes name the driver. A render evaluates what is shown and what that depends on: with this a
    driver hidden from renders too. Were it the detailed mesh that depends on the driver, it would be evaluated twice a
    frame, before and after we restore."""
    group = bpy.data.node_groups.get(_ANCHOR)
    if group is None:
        group = _group(_ANCHOR, (("NodeSocketGeometry", "Geometry"), ("NodeSocketObject", "Driver")))
        group.links.new(group.nodes.new("NodeGroupInput").outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    anchor = bpy.data.objects.new(f"{high.name} anchor", bpy.data.meshes.new(f"{high.name} anchor"))
    anchor.hide_select = True
    modifier = anchor.modifiers.new(MODIFIER, "NODES")
    modifier.node_group = group
    _set_input(modifier, "Driver", driver)
    return anchor


def show_level(high):
    """Makes or removes the object that the viewport shows instead of the finest level."""
    settings = high.filigree
    model = models.model_of(settings) if settings.model else None
    wanted = model is not None and 0 <= settings.viewport_level < model.finest_level
    remove_object(settings.level_object)
    settings.level_object = None
    if wanted:
        made = meshes.blender_mesh(model.level(settings.viewport_level), f"{high.name} level {settings.viewport_level}")
        for material in high.data.materials:
            made.materials.append(material)
        settings.level_object = bpy.data.objects.new(made.name, made)
        settings.level_object["filigree_level"] = settings.viewport_level
    if settings.model is not None:
        follow_by_nodes(high)


def remove_object(obj):
    if obj is not None:
        mesh = obj.data
        bpy.data.objects.remove(obj)
        if mesh.users == 0:
            bpy.data.meshes.remove(mesh)
