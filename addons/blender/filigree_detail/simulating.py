"""Simulate: the active mesh as one of Filigree's bodies, whose motion is baked into its driver."""

import bpy

from . import baking, meshes, models, obstacles
from .jobs import JobOperator
from .library import filigree


def _materials():
    """Those that a driver can follow: what melts, parts and joins is for `filigree simulate`."""
    if filigree is None:
        return [("rubber", "rubber", "")]
    return [(name, name, does) for name, does in filigree.materials().items() if filigree.Material(name).model != "mpm"]


class FiligreeBody(bpy.types.PropertyGroup):
    material: bpy.props.EnumProperty(name="Material", items=_materials())
    particles: bpy.props.IntProperty(
        name="Particles", default=4000, min=50, soft_max=100000, description="That fill the mesh, about")
    soft_group: bpy.props.StringProperty(
        name="Soft", description="Vertex group: where its weight is 1, the stiffness is multiplied by Softness. Empty: all is alike")
    softness: bpy.props.FloatProperty(
        name="Softness", default=0.1, min=0.001, max=1000, soft_max=10,
        description="Stiffness where the vertex group's weight is 1, as a multiple of the material's; above 1 it is stiffer")
    obstacles: bpy.props.PointerProperty(
        name="Obstacles", type=bpy.types.Collection,
        description="What the body touches: the meshes of this collection, with their motion. A flat one is a ground without end")
    pieces: bpy.props.IntProperty(name="Pieces", default=24, min=2, soft_max=200, description="That the body may break into")
    strength: bpy.props.FloatProperty(
        name="Strength", default=0, min=0, description="Stress at which cracks begin, Pa; 0: a hundredth of the material's stiffness")


def fields_of(body, high):
    """What varies within the body: by the vertex group that it names."""
    if not body.soft_group:
        return {}
    group = high.vertex_groups.get(body.soft_group)
    if group is None:
        raise filigree.UsageError(f"{high.name} has no vertex group {body.soft_group!r}, which the panel Body names as Soft.")
    return {"stiffness": 1 + (body.softness - 1) * meshes.group_weights(high.data, group.index)}


def frame_range(scene):
    return range(scene.frame_start, scene.frame_end + 1)


def frame_rate(scene):
    return scene.render.fps / scene.render.fps_base


def gravity(scene):
    return tuple(scene.gravity) if scene.use_gravity else (0, 0, 0)


class FILIGREE_OT_simulate(JobOperator, bpy.types.Operator):
    """Let the active mesh fall, bounce or slump from where it is at the first frame, and bake that into its driver"""

    bl_idname = "filigree.simulate"
    bl_label = "Simulate"

    def run(self, context):
        high, scene, body = context.object, context.scene, context.scene.filigree_body
        driver = high.filigree.driver
        if high.filigree.model is None or driver is None:
            raise filigree.UsageError("Make a driver first: the body moves it.")
        path = baking.cache_path(driver)
        frames, to_world = frame_range(scene), high.matrix_world.copy()
        touched = obstacles.gather(context, body.obstacles, frames)
        mesh = meshes.filigree_mesh(high.data, to_world)
        points = meshes.moved(models.model_of(high.filigree).driver.vertices, to_world)
        options = {"gravity": gravity(scene), "frames_per_second": frame_rate(scene)}
        material, particles, fields = body.material, body.particles, fields_of(body, high)

        def compute(progress):
            made = filigree.Body(mesh, material, particles=particles, fields=fields, progress=progress)
            simulation = filigree.Simulation([made], obstacles=[o.for_simulation() for o in touched], **options)
            followed, poses = simulation.attach(0, points), [points]
            for frame in range(1, len(frames)):
                simulation.step()
                poses.append(followed.pose().positions)
                if progress and progress("simulate", frame / len(frames)) is False:
                    raise filigree.Cancelled("Cancelled.")
            return poses

        poses = yield compute
        bake_driver(driver, path, poses, frames)
        self.report({"INFO"}, f"{len(poses)} frames of {particles:,} particles in {path}")


def bake_driver(driver, path, poses, frames):
    """The driver plays `poses`, arrays of places in the world."""
    to_driver = driver.matrix_world.inverted_safe()
    with baking.PointCache(path, len(poses[0]), frames[0], len(poses)) as cache:
        for pose in poses:
            cache.write(meshes.moved(pose, to_driver))
    baking.play_cache(driver, path, frames[0])


def register():
    bpy.utils.register_class(FiligreeBody)
    bpy.types.Scene.filigree_body = bpy.props.PointerProperty(type=FiligreeBody)
    bpy.utils.register_class(FILIGREE_OT_simulate)


def unregister():
    bpy.utils.unregister_class(FILIGREE_OT_simulate)
    del bpy.types.Scene.filigree_body
    bpy.utils.unregister_class(FiligreeBody)
