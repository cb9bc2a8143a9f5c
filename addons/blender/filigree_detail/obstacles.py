"""What bodies touch: the mesh objects of a Blender collection, in the world's metres, with their motion."""

from dataclasses import dataclass, field

import numpy as np

from . import meshes
from .library import filigree
from .turning import turn_keys


@dataclass
class Obstacle:
    name: str
    mesh: object  # in the world at the first frame
    plane: tuple = None  # (point, normal) of a flat mesh: solid below it, everywhere
    times: list = field(default_factory=list)  # s; of keys, none where it stands still; two equal ones are one rotation, named twice
    moves: list = field(default_factory=list)  # m
    turns: list = field(default_factory=list)  # degrees: axis times angle, about `pivot`; they count full turns
    pivot: tuple = (0, 0, 0)

    def for_simulation(self):
        motion = filigree.RigidMotion(self.times, move=self.moves, degrees=self.turns, centre=self.pivot) if self.times else filigree.RigidMotion()
        if self.plane:
            return filigree.Obstacle.plane(*self.plane, motion=motion)
        return filigree.Obstacle.mesh(self.mesh, motion=motion)

    def for_scene(self, folder, number):
        """Its table in a scene file; a mesh is written beside it."""
        lines = ["[[obstacle]]"]
        if self.plane:
            lines += ['shape = "ground"', f"point = {_row(self.plane[0])}", f"normal = {_row(self.plane[1])}"]
        else:
            name = f"obstacle{number}.ply"
            filigree.write_mesh(self.mesh, f"{folder}/{name}")
            lines += ['shape = "mesh"', f'mesh = "{name}"']
        if self.times:
            lines += [f"move = {_keys(self.times, self.moves)}", f"turn = {_keys(self.times, self.turns)}", f"pivot = {_row(self.pivot)}"]
        return "\n".join(lines) + "\n"


def _row(numbers):
    return "[" + ", ".join(repr(float(x)) for x in numbers) + "]"


def _keys(times, rows):
    return "[" + ", ".join(f"{{ time = {float(t)!r}, value = {_row(r)} }}" for t, r in zip(times, rows)) + "]"


def _plane_of(mesh):
    """Point and normal of a flat mesh, None of another."""
    points = mesh.world_vertices
    middle = points.mean(axis=0)
    _, spread, axes = np.linalg.svd(points - middle, full_matrices=False)
    if len(points) < 3 or spread[2] > 1e-5 * spread[0]:
        return None
    corners = points[mesh.triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    normal = axes[2] if np.dot(facing, axes[2]) >= 0 else -axes[2]
    return tuple(middle), tuple(normal)


def gather(context, collection, frames):
    """The obstacles of a collection over `frames`. Shapes are those of the first frame; places follow the animation."""
    if collection is None:
        return []
    objects = [o for o in collection.all_objects if o.type == "MESH" and o != context.object]
    scene, before, rate = context.scene, context.scene.frame_current, context.scene.render.fps / context.scene.render.fps_base
    matrices = {o.name: [] for o in objects}
    made = []
    try:
        for frame in frames:
            scene.frame_set(frame)
            depsgraph = context.evaluated_depsgraph_get()
            for obj in objects:
                evaluated = obj.evaluated_get(depsgraph)
                if frame == frames[0]:
                    mesh = meshes.filigree_mesh(evaluated.data, evaluated.matrix_world)
                    if len(mesh.triangles):
                        made.append(Obstacle(obj.name, mesh, _plane_of(mesh)))
                matrices[obj.name].append(evaluated.matrix_world.copy())
    finally:
        scene.frame_set(before)
    for obstacle in made:
        _set_motion(obstacle, matrices[obstacle.name], rate)
    return made


def _set_motion(obstacle, matrices, rate):
    first, start = matrices[0].inverted_safe(), matrices[0].to_translation()
    if all(np.allclose(m, matrices[0], atol=1e-7) for m in matrices):
        return
    rotations = [np.array((matrix @ first).to_quaternion().to_matrix()) for matrix in matrices]
    for frame, turn in turn_keys(rotations):
        obstacle.times.append(frame / rate)
        obstacle.moves.append(tuple(matrices[frame].to_translation() - start))
        obstacle.turns.append(tuple(np.degrees(turn)))
    obstacle.pivot = tuple(start)
