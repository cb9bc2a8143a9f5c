"""Geometry nodes of ours: one that puts the restored positions on a mesh, one that keeps a driver evaluated."""

import bpy

from .meshes import POSITION

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


def _set_position(group, geometry):
    """Moves vertices to the attribute; the socket with the moved geometry."""
    attribute, put = group.nodes.new("GeometryNodeInputNamedAttribute"), group.nodes.new("GeometryNodeSetPosition")
    attribute.data_type = "FLOAT_VECTOR"
    attribute.inputs["Name"].default_value = POSITION
    group.links.new(geometry, put.inputs["Geometry"])
    group.links.new(next(s for s in attribute.outputs if s.enabled and s.type == "VECTOR"), put.inputs["Position"])
    return put.outputs[0]


def _follow_group():
    """The mesh at its restored positions; in the viewport a coarser object at its own, where there is one."""
    group = bpy.data.node_groups.get(_FOLLOW)
    if group is not None:
        return group
    group = _group(_FOLLOW, (("NodeSocketGeometry", "Geometry"), ("NodeSocketBool", "Coarse"), ("NodeSocketObject", "Level")))
    new, link = group.nodes.new, group.links.new
    taken, given = new("NodeGroupInput"), new("NodeGroupOutput")
    viewport, both, level = new("GeometryNodeIsViewport"), new("FunctionNodeBooleanMath"), new("GeometryNodeObjectInfo")
    switch = new("GeometryNodeSwitch")
    switch.input_type = "GEOMETRY"
    link(taken.outputs["Coarse"], both.inputs[0])
    link(viewport.outputs[0], both.inputs[1])
    link(taken.outputs["Level"], level.inputs["Object"])
    link(both.outputs[0], next(s for s in switch.inputs if s.enabled and s.type == "BOOLEAN"))
    choices = [s for s in switch.inputs if s.enabled and s.type == "GEOMETRY"]
    link(_set_position(group, taken.outputs["Geometry"]), choices[0])
    link(_set_position(group, level.outputs["Geometry"]), choices[1])
    link(next(s for s in switch.outputs if s.enabled), given.inputs[0])
    return group


def _set_input(modifier, label, value):
    modifier[next(s.identifier for s in _inputs(modifier.node_group) if s.name == label)] = value


def follow_by_nodes(high):
    """The modifier that shows the restored shape, first in the stack. Made where it is missing."""
    modifier = high.modifiers.get(MODIFIER) or high.modifiers.new(MODIFIER, "NODES")
    modifier.node_group = _follow_group()
    modifier.show_viewport = modifier.show_render = True
    _set_input(modifier, "Coarse", high.filigree.level_object is not None)
    _set_input(modifier, "Level", high.filigree.level_object)
    at = high.modifiers.find(MODIFIER)
    if at > 0:
        with bpy.context.temp_override(object=high):
            bpy.ops.object.modifier_move_to_index(modifier=MODIFIER, index=0)
    return high.modifiers[MODIFIER]


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
