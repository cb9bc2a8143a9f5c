"""What users of libigl and trimesh look for: of surfaces, and of meshes as objects. `filigree/__init__.py` puts it there."""

from typing import NamedTuple

import numpy

from . import _core
from ._matrices import SparseMatrix


class ClosestPoints(NamedTuple):
    """The points of a surface closest to others: one row each.

    points : ndarray, float64 (n, 3)
        World coordinates.
    distances : ndarray, float64 (n,)
        Model units.
    faces, triangles : ndarray, uint32 (n,)
        The face, and the triangle of `mesh.triangles`.
    barycentric : ndarray, float64 (n, 3)
        Weights of the triangle's corners.
    """

    points: numpy.ndarray
    distances: numpy.ndarray
    faces: numpy.ndarray
    triangles: numpy.ndarray
    barycentric: numpy.ndarray


def closest_points(mesh, points, *, threads=0):
    """The point of a surface closest to each of the points: libigl's point_mesh_squared_distance, trimesh's closest_point.

    Parameters
    ----------
    mesh : Mesh, an object with vertices and faces, or (V, F)
    points : array_like, (n, 3)
        World coordinates, finite as 32-bit numbers.

    Returns
    -------
    ClosestPoints

    Raises
    ------
    UnsuitableError
        No faces.
    UsageError
        A point that is not finite as a 32-bit number.

    Examples
    --------
    >>> found = filigree.closest_points(filigree.make("wavy-plane", amplitude=0), [[0.1, 0.2, 3]])
    >>> found.distances.round(6), found.points.round(6).tolist()
    (array([3.]), [[0.1, 0.2, 0.0]])
    """
    return ClosestPoints(*_core._closest_points(mesh, points, threads))


def winding_numbers(mesh, points, *, accuracy=0.01, threads=0):
    """How often a surface goes round each point: 1 inside a closed mesh, 0 outside, between them where it is open.

    Parameters
    ----------
    mesh : Mesh, an object with vertices and faces, or (V, F)
    points : array_like, (n, 3)
        World coordinates.
    accuracy : float
        The largest error, about, 0.0001 to 0.1.

    Returns
    -------
    ndarray of float32, (n,)

    Examples
    --------
    >>> filigree.winding_numbers(filigree.make("torus"), [[0, 0, 1], [0.385, 0, 0]]).round(1) == [0, 1]
    array([ True,  True])
    """
    return _core._winding_numbers(mesh, points, accuracy, threads)


def signed_distance(mesh, points, *, method="auto", threads=0):
    """Distance of points from a surface, negative inside, as libigl has it (trimesh: positive inside).

    Parameters
    ----------
    mesh : Mesh, an object with vertices and faces, or (V, F)
    points : array_like, (n, 3)
        World coordinates.
    method : str
        How inside is told: see `InsideTest`.

    Returns
    -------
    ndarray of float64, (n,)
        Model units.

    Raises
    ------
    UnsuitableError
        No faces.

    Examples
    --------
    >>> filigree.signed_distance(filigree.make("torus"), [[0, 0, 0], [0.385, 0, 0]]).round(2).tolist()
    [0.34, -0.03]
    """
    mesh = _core._mesh_of(mesh)
    distances = _core._closest_points(mesh, points, threads)[1]
    return numpy.where(_core.contains(mesh, points, method=method, threads=threads), -distances, distances)


def normals(mesh):
    """Unit normals of the vertices, by the faces' area vectors, float32 (n, 3); 0 at vertices without faces.

    Parameters
    ----------
    mesh : Mesh, an object with vertices and faces, or (V, F)
        `Mesh.normals` are those that came with a mesh.

    Examples
    --------
    >>> filigree.normals(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))[0].tolist()
    [0.0, 0.0, 1.0]
    """
    return _core._vertex_normals(mesh)


def face_normals(mesh):
    """Unit normals of the faces, float64 (m, 3); 0 for faces without area.

    Parameters
    ----------
    mesh : Mesh, an object with vertices and faces, or (V, F)
    """
    vectors = _core._area_vectors(mesh)
    lengths = numpy.linalg.norm(vectors, axis=1)
    return vectors / numpy.where(lengths > 0, lengths, 1)[:, None]


def areas(mesh):
    """Areas of the faces, square model units, float64 (m,).

    Parameters
    ----------
    mesh : Mesh, an object with vertices and faces, or (V, F)

    Examples
    --------
    >>> float(filigree.areas(filigree.make("wavy-plane", amplitude=0)).sum().round(6))
    1.0
    """
    return numpy.linalg.norm(_core._area_vectors(mesh), axis=1)


def volume(mesh):
    """The volume that a closed mesh has by the way its faces look, cubic model units: negative where they look inwards.

    Parameters
    ----------
    mesh : Mesh, an object with vertices and faces, or (V, F)
        Of an open mesh: what the faces and cones from the middle of their box enclose.

    Examples
    --------
    >>> round(filigree.volume(filigree.make("wavy-cube", amplitude=0)), 6)
    1.0
    """
    mesh = _core._mesh_of(mesh)
    if len(mesh.vertices) == 0:
        return 0.0
    places = mesh.vertices.astype(float)
    places -= (places.min(axis=0) + places.max(axis=0)) / 2
    triangles = places[mesh.triangles]
    return float(numpy.einsum("ni,ni->", triangles[:, 0], numpy.cross(triangles[:, 1], triangles[:, 2])) / 6)


def _half_edges(mesh):
    """From and to of each corner's edge, int64 (c, 2)."""
    corners, offsets = mesh.corners.astype(numpy.int64), mesh.face_offsets.astype(numpy.int64)
    if len(corners) == 0:
        return numpy.empty((0, 2), numpy.int64)
    following = numpy.arange(1, len(corners) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    return numpy.stack([corners, corners[following]], axis=1)


def edges(mesh):
    """The edges, each once, int64 (e, 2): the lower vertex first, ascending.

    Parameters
    ----------
    mesh : Mesh, an object with vertices and faces, or (V, F)

    Examples
    --------
    >>> filigree.edges(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).tolist()
    [[0, 1], [0, 2], [1, 2]]
    """
    return numpy.unique(numpy.sort(_half_edges(_core._mesh_of(mesh)), axis=1), axis=0)


def adjacency(mesh):
    """Which vertices an edge joins: a symmetric SparseMatrix (n, n) of ones.

    Parameters
    ----------
    mesh : Mesh, an object with vertices and faces, or (V, F)
    """
    mesh = _core._mesh_of(mesh)
    pairs = edges(mesh)
    rows, columns = numpy.concatenate([pairs, pairs[:, ::-1]]).T
    count = len(mesh.vertices)
    return SparseMatrix(rows, columns, numpy.ones(len(rows)), (count, count))


def boundary(mesh):
    """The loops of edges that have a face on one side only, each an array of vertices in the faces' direction.

    Parameters
    ----------
    mesh : Mesh, an object with vertices and faces, or (V, F)

    Returns
    -------
    list of ndarray of int64
        The longest first; of a closed mesh none.

    Examples
    --------
    >>> [len(loop) for loop in filigree.boundary(filigree.make("wavy-plane", resolution=4))]
    [16]
    """
    half = _half_edges(_core._mesh_of(mesh))
    _, first, counts = numpy.unique(numpy.sort(half, axis=1), axis=0, return_index=True, return_counts=True)
    open_edges = half[first[counts == 1]]
    following = {}
    for start, end in open_edges.tolist():
        following.setdefault(start, []).append(end)
    loops = []
    while following:
        start = vertex = next(iter(following))
        loop = []
        while vertex in following:
            loop.append(vertex)
            ends = following[vertex]
            vertex, ends = ends[-1], ends[:-1]
            if ends:
                following[loop[-1]] = ends
            else:
                del following[loop[-1]]
            if vertex == start:
                break
        loops.append(numpy.array(loop))
    return sorted(loops, key=lambda loop: (-len(loop), loop[0]))


def _colors(mesh):
    """As they came: without alpha where that is 1 everywhere. None: there are none."""
    return mesh.colors[:, :3] if mesh.colors is not None and (mesh.colors[:, 3] == 1).all() else mesh.colors


def _of_vertices(mesh, chosen, faces, offsets):
    """A mesh of some vertices of another, with their colours and scalars."""
    return _core.Mesh(
        mesh.world_vertices[chosen],
        faces,
        offsets,
        colors=None if mesh.colors is None else _colors(mesh)[chosen],
        scalars={name: values[chosen] for name, values in mesh.scalars.items()},
    )


def split(mesh):
    """The connected parts as meshes, the one with most faces first; vertices without faces are in none.

    Parameters
    ----------
    mesh : Mesh, an object with vertices and faces, or (V, F)
        Parts hang together by vertices. Colours and scalars go along; normals, uvs and names do not.

    Returns
    -------
    list of Mesh

    Examples
    --------
    >>> torus = filigree.make("torus", resolution=8)
    >>> filigree.split(filigree.concatenate([torus, torus]))
    [<filigree.Mesh: 128 vertices, 128 faces>, <filigree.Mesh: 128 vertices, 128 faces>]
    """
    mesh = _core._mesh_of(mesh)
    part_of, offsets = _core._parts(mesh), mesh.face_offsets.astype(numpy.int64)
    sizes = numpy.diff(offsets)
    part_of_face = part_of[mesh.corners[offsets[:-1]]] if len(sizes) else part_of[:0]
    parts = []
    for part in numpy.unique(part_of_face):
        kept = part_of_face == part
        corners = mesh.corners[numpy.repeat(kept, sizes)]
        chosen, faces = numpy.unique(corners, return_inverse=True)
        parts.append(_of_vertices(mesh, chosen, faces, numpy.concatenate([[0], numpy.cumsum(sizes[kept])])))
    return sorted(parts, key=lambda one: -(len(one.face_offsets) - 1))


def concatenate(meshes):
    """Meshes as one: vertices and faces behind each other, in the order given.

    Parameters
    ----------
    meshes : sequence of Mesh, objects with vertices and faces, or (V, F)
        Colours, and scalars by name, are kept where all of them have them; normals, uvs and names are not.

    Returns
    -------
    Mesh

    Examples
    --------
    >>> torus = filigree.make("torus", resolution=8)
    >>> filigree.concatenate([torus, torus])
    <filigree.Mesh: 256 vertices, 256 faces>
    """
    meshes = [_core._mesh_of(mesh) for mesh in meshes]
    if not meshes:
        raise _core.UsageError("meshes has to hold a mesh.")
    starts = numpy.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    corners = [mesh.corners.astype(numpy.int64) + start for mesh, start in zip(meshes, starts)]
    corner_starts = numpy.cumsum([0] + [len(mesh.corners) for mesh in meshes])
    offsets = [mesh.face_offsets[1:].astype(numpy.int64) + start for mesh, start in zip(meshes, corner_starts)]
    names = set.intersection(*(set(mesh.scalars) for mesh in meshes))
    return _core.Mesh(
        numpy.concatenate([mesh.world_vertices for mesh in meshes]),
        numpy.concatenate(corners),
        numpy.concatenate([[0], *offsets]),
        colors=numpy.concatenate([mesh.colors for mesh in meshes]) if all(m.colors is not None for m in meshes) else None,
        scalars={name: numpy.concatenate([mesh.scalars[name] for mesh in meshes]) for name in sorted(names)},
    )


def parts_of(self):
    """The connected parts as meshes: `filigree.split`."""
    return split(self)


def is_equal(self, other):
    """Whether two meshes have the same vertices, faces and attributes, to the bit."""
    if not isinstance(other, _core.Mesh):
        return NotImplemented
    return self is other or self.__getstate__() == other.__getstate__()


def hash_of(self):
    """Of equal meshes equal: by the counts and the first vertices."""
    return hash((len(self.vertices), len(self.corners), self.vertices[:256].tobytes()))


def length(self):
    """Number of vertices."""
    return len(self.vertices)


def copy(self):
    """The mesh itself: a mesh never changes. `with_vertices` makes others."""
    return self


def put_onto_classes():
    mesh = _core.Mesh
    mesh.__eq__ = is_equal
    mesh.__hash__ = hash_of
    mesh.__len__ = length
    mesh.copy = copy
    mesh.split = parts_of
    mesh.vertex_normals = property(normals, doc="Unit normals by the faces around each vertex, float32 (n, 3).")
    mesh.face_normals = property(face_normals, doc="Unit normals of the faces, float64 (m, 3).")
    mesh.areas = property(areas, doc="Areas of the faces, square model units, float64 (m,).")
    mesh.area = property(lambda self: float(areas(self).sum()), doc="Of all faces, square model units.")
    mesh.volume = property(volume, doc="What the faces enclose, cubic model units; negative where they look inwards.")
    mesh.edges = property(edges, doc="The edges, each once, int64 (e, 2).")
