"""Arrays between Blender's meshes, numpy and Filigree."""

import bpy
import numpy as np

from .library import filigree

def vertices_of(mesh):
    """Positions of a mesh's vertices in its object's space, float32 (n, 3)."""
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def filigree_mesh(mesh, matrix=None):
    """A Blender mesh as one of Filigree's, moved by `matrix` (4x4) where there is one."""
    corners = np.empty(len(mesh.loops), np.uint32)
    mesh.loops.foreach_get("vertex_index", corners)
    starts = np.empty(len(mesh.polygons), np.uint32)
    mesh.polygons.foreach_get("loop_start", starts)
    vertices = vertices_of(mesh)
    if matrix is not None:
        vertices = moved(vertices, matrix)
    return filigree.Mesh(vertices, corners, np.append(starts, len(corners)))


def group_weights(mesh, group):
    """Weights of a vertex group by its index, 0 where a vertex is not in it: float32 (n,)."""
    weights = np.zeros(len(mesh.vertices), np.float32)
    for vertex in mesh.vertices:
        for element in vertex.groups:
            if element.group == group:
                weights[vertex.index] = element.weight
    return weights


def moved(points, matrix):
    """Points (n, 3) by a 4x4 matrix, float32."""
    m = np.array(matrix, np.float64)
    return (points @ m[:3, :3].T + m[:3, 3]).astype(np.float32)


def blender_mesh(mesh, name):
    """One of Filigree's meshes as a new Blender mesh: vertices and faces."""
    made = bpy.data.meshes.new(name)
    vertices = mesh.world_vertices.astype(np.float32)
    offsets = mesh.face_offsets.astype(np.int32)
    made.vertices.add(len(vertices))
    made.vertices.foreach_set("co", vertices.reshape(-1))
    made.loops.add(len(mesh.corners))
    made.loops.foreach_set("vertex_index", mesh.corners.astype(np.int32))
    made.polygons.add(len(offsets) - 1)
    made.polygons.foreach_set("loop_start", offsets[:-1])
    if bpy.app.version < (4, 1):  # later ones know it from the starts
        made.polygons.foreach_set("loop_total", np.diff(offsets))
    made.polygons.foreach_set("use_smooth", np.ones(len(offsets) - 1, bool))
    made.update(calc_edges=True)
    return made


def set_attribute(mesh, name, values, kind, field):
    """Writes one value a vertex; the attribute is made where it is missing or of another kind."""
    attribute = mesh.attributes.get(name)
    if attribute is not None and (attribute.domain != "POINT" or attribute.data_type != kind):
        mesh.attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = mesh.attributes.new(name, kind, "POINT")
    attribute.data.foreach_set(field, np.ascontiguousarray(values, np.float32).reshape(-1))
    mesh.update_tag()


def set_vertices(mesh, positions):
    """Writes positions (n, 3); a mesh of another number of vertices gets new ones, and loses its faces."""
    if len(mesh.vertices) != len(positions):
        mesh.clear_geometry()
        mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(positions, np.float32).reshape(-1))
    mesh.update_tag()


def link_beside(obj, other):
    """Puts an object into the collections that another is in."""
    for collection in other.users_collection or (bpy.context.scene.collection,):
        if obj.name not in collection.objects:
            collection.objects.link(obj)
