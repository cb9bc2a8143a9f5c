"""A flag in Blender's wind: cloth moves it, Fit finds a small driver that follows the cloth, and the cloth goes.

Usage: blender -b --addons filigree_detail -P flag.py -- FOLDER [FRAMES]
Writes FOLDER/flag.blend, FOLDER/flag.glb and FOLDER/flag.fil, and FOLDER/flag.png: the cloth, the fitted driver, and the mesh
that follows it. Environment: CELLS along a side (100), ERROR of the fit (5e-4), WIDTH and SAMPLES of the picture.
"""

import math
import os
import sys

import bpy

ASPECT = 1.5


def make_flag(cells):
    """A sheet of ASPECT x 1 m that stands upright, its left edge pinned."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=round(ASPECT * cells), y_subdivisions=cells, size=1)
    flag = bpy.context.object
    flag.name = "flag"
    for vertex in flag.data.vertices:
        x, y, _ = vertex.co
        vertex.co = (ASPECT * (x + 0.5), 0, y + 1.2)
    pole = flag.vertex_groups.new(name="pole")
    pole.add([v.index for v in flag.data.vertices if v.co.x < 1e-4], 1, "REPLACE")
    flag.data.polygons.foreach_set("use_smooth", [True] * len(flag.data.polygons))
    return flag


def let_it_wave(flag, frames):
    cloth = flag.modifiers.new("Cloth", "CLOTH")
    settings = cloth.settings
    settings.quality, settings.mass, settings.air_damping = 5, 0.15, 1
    settings.tension_stiffness = settings.compression_stiffness = 15
    settings.bending_stiffness = 0.5
    settings.vertex_group_mass = "pole"
    cloth.point_cache.frame_start, cloth.point_cache.frame_end = 1, frames
    bpy.ops.object.effector_add(type="WIND", location=(-2, -0.6, 1.7), rotation=(0, math.radians(90), math.radians(15)))
    wind = bpy.context.object
    wind.field.strength, wind.field.noise, wind.field.flow = 250, 0.5, 0.5
    bpy.context.view_layer.objects.active = flag
    flag.select_set(True)
    bpy.ops.ptcache.bake_all(bake=True)


def colored(obj, color):
    material = bpy.data.materials.new(obj.name)
    material.use_nodes = True
    surface = material.node_tree.nodes["Principled BSDF"]
    surface.inputs["Base Color"].default_value = (*color, 1)
    surface.inputs["Roughness"].default_value = 0.6
    obj.data.materials.clear()
    obj.data.materials.append(material)


def copy_as_shown(obj, name, place):
    """What is shown of an object now, as a mesh of its own."""
    shown = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    made = bpy.data.objects.new(name, bpy.data.meshes.new_from_object(shown))
    made.location = place
    bpy.context.scene.collection.objects.link(made)
    return made


def picture(path):
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.9, 0.93, 1, 1)
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.5
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle, sun.rotation_euler = 2.6, 0.1, (0.9, 0.5, 0)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.angle, camera.location, camera.rotation_euler = 0.62, (2.5, -8.6, 1.7), (math.radians(90), 0, 0)
    for obj in (sun, camera):
        scene.collection.objects.link(obj)
    scene.camera = camera
    width = int(os.environ.get("WIDTH", 1200))
    scene.render.resolution_x, scene.render.resolution_y = width, width * 5 // 16
    scene.render.engine = "CYCLES"
    scene.cycles.samples = int(os.environ.get("SAMPLES", 24))
    scene.cycles.use_denoising = False
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


def main():
    folder, *rest = sys.argv[sys.argv.index("--") + 1:]
    folder, frames = os.path.abspath(folder), int(rest[0]) if rest else 60
    os.makedirs(folder, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="filigree_detail")
    scene = bpy.context.scene
    scene.frame_end = frames
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "flag.blend"))
    flag = make_flag(int(os.environ.get("CELLS", 100)))
    let_it_wave(flag, frames)
    scene.frame_set(frames)
    cloth = copy_as_shown(flag, "cloth", (0, 0, 0))
    bpy.ops.filigree.fit(error=float(os.environ.get("ERROR", 5e-4)))
    flag.modifiers.remove(flag.modifiers["Cloth"])
    for ending in (".glb", ".fil"):
        bpy.ops.filigree.export(filepath=os.path.join(folder, "flag" + ending))
    bpy.ops.wm.save_mainfile()
    scene.frame_set(frames)
    driver = copy_as_shown(flag.filigree.driver, "driver", (1.75, 0, 0))
    follows = copy_as_shown(flag, "follows", (3.5, 0, 0))
    flag.hide_render = True
    driver.data.polygons.foreach_set("use_smooth", [False] * len(driver.data.polygons))
    for obj, color in ((cloth, (0.5, 0.5, 0.52)), (driver, (0.16, 0.33, 0.62)), (follows, (0.62, 0.3, 0.22))):
        colored(obj, color)
    picture(os.path.join(folder, "flag.png"))


main()
