"""Fracture: the active mesh as a body that breaks; its pieces are a new mesh that follows a baked driver."""

import os
import tempfile

import bpy

from . import baking, binding, meshes, obstacles, simulating
from .jobs import JobOperator
from .library import filigree


def _scene_file(folder, mesh, body, touched, frames, rate, gravity):
    """Writes what happens as a scene of Filigree's (docs/scenes.md). Returns its path."""
    filigree.write_mesh(mesh, os.path.join(folder, "body.ply"))
    lines = [
        "[simulation]", f"frames = {max(1, len(frames) - 1)}", f"frames_per_second = {rate!r}",
        "[world]", f"gravity = {[float(x) for x in gravity]}",
        "[[body]]", 'mesh = "body.ply"', f'material = "{body["material"]}"', f"particles = {body['particles']}",
        "[[fracture]]", f"pieces = {body['pieces']}",
    ]
    if body["strength"] > 0:
        lines.append(f"strength = {body['strength']!r}")
    path = os.path.join(folder, "scene.toml")
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")
        for number, obstacle in enumerate(touched):
            file.write(obstacle.for_scene(folder, number))
    return path


class FILIGREE_OT_fracture(JobOperator, bpy.types.Operator):
    """Let a body of the active mesh move and break from where it is at the first frame. Its pieces are a new mesh"""

    bl_idname = "filigree.fracture"
    bl_label = "Fracture"

    def run(self, context):
        high, scene, settings = context.object, context.scene, context.scene.filigree_body
        name = f"{high.name} pieces"
        path = baking.cache_path(high).removesuffix(".pc2") + "_pieces.pc2"
        frames, rate = simulating.frame_range(scene), simulating.frame_rate(scene)
        touched = obstacles.gather(context, settings.obstacles, frames)
        mesh = meshes.filigree_mesh(high.data, high.matrix_world)
        body = {key: getattr(settings, key) for key in ("material", "particles", "pieces", "strength")}
        gravity = simulating.gravity(scene)

        def compute(progress):
            with tempfile.TemporaryDirectory(prefix="filigree-") as folder:
                run = filigree.SceneRun(_scene_file(folder, mesh, body, touched, frames, rate, gravity), progress=progress)
                run.advance_to(len(frames) - 1, progress=progress)
                return run.model(0), run.poses(0).positions + run.origin

        model, poses = yield compute
        pieces = bpy.data.objects.new(name, meshes.blender_mesh(model.mesh, name))
        driver = bpy.data.objects.new(f"{name} driver", meshes.blender_mesh(model.driver, f"{name} driver"))
        for made in (pieces, driver):
            meshes.link_beside(made, high)
        for material in high.data.materials:
            pieces.data.materials.append(material)
        driver.display_type, driver.hide_render = "WIRE", True
        binding.follow_driver(pieces, driver, model)
        simulating.bake_driver(driver, path, poses, frames)
        high.hide_set(True)
        high.hide_render = True
        self.report({"INFO"}, f"{len(poses)} frames in {path}; the whole mesh is hidden")


def register():
    bpy.utils.register_class(FILIGREE_OT_fracture)


def unregister():
    bpy.utils.unregister_class(FILIGREE_OT_fracture)
