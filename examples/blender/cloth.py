"""A cloth falls over a ball: Blender's cloth moves it, Fit finds a small driver that follows, and the cloth modifier goes.

Usage: blender -b --addons filigree_detail -P cloth.py -- FOLDER [FRAMES]
Writes FOLDER/cloth.blend, FOLDER/cloth.glb and FOLDER/cloth.fil, and FOLDER/cloth.png: the cloth, the fitted driver, and the mesh
that follows it. Environment: CELLS along a side (100), ERROR of the fit (1e-3), WIDTH and SAMPLES of the picture.
"""

import math
import os
import sys

import bpy

RADIUS = 0.45  # m, of the ball


def make_cloth(cells):
    """A sheet of 2 x 2 m above the ball."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=cells, y_subdivisions=cells, size=2, location=(0, 0, 0))
    sheet = bpy.context.object
    sheet.name = "cloth"
    for vertex in sheet.data.vertices:
        vertex.co.z = 1.35
    sheet.data.polygons.foreach_set("use_smooth", [True] * len(sheet.data.polygons))
    return sheet


def let_it_fall(sheet, frames):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=RADIUS, location=(0.1, 0.05, 0.8), segments=48, ring_count=24)
    ball = bpy.context.object
    ball.modifiers.new("Collision", "COLLISION")
    ball.collision.thickness_outer, ball.collision.cloth_friction = 0.02, 20
    cloth = sheet.modifiers.new("Cloth", "CLOTH")
    settings = cloth.settings
    settings.quality, settings.mass, settings.air_damping = 6, 0.3, 1
    settings.tension_stiffness = settings.compression_stiffness = settings.shear_stiffness = 15
    settings.bending_stiffness = 5
    cloth.collision_settings.distance_min = 0.015
    cloth.point_cache.frame_start, cloth.point_cache.frame_end = 1, frames
    bpy.context.view_layer.objects.active = sheet
    sheet.select_set(True)
    bpy.ops.ptcache.bake_all(bake=True)
    ball.hide_render = True


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
    camera.data.angle, camera.location, camera.rotation_euler = 0.66, (2.4, -11.5, 2.6), (math.radians(81), 0, 0)
    for obj in (sun, camera):
        scene.collection.objects.link(obj)
    scene.camera = camera
    width = int(os.environ.get("WIDTH", 1200))
    scene.render.resolution_x, scene.render.resolution_y = width, width // 4
    scene.render.engine = "CYCLES"
    scene.cycles.samples = int(os.environ.get("SAMPLES", 24))
    scene.cycles.use_denoising = False
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


def main():
    folder, *rest = sys.argv[sys.argv.index("--") + 1:]
    folder, frames = os.path.abspath(folder), int(rest[0]) if rest else 40
    os.makedirs(folder, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="filigree_detail")
    scene = bpy.context.scene
    scene.frame_end = frames
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "cloth.blend"))
    sheet = make_cloth(int(os.environ.get("CELLS", 100)))
    let_it_fall(sheet, frames)
    scene.frame_set(frames)
    cloth = copy_as_shown(sheet, "cloth", (0, 0, 0))
    bpy.ops.filigree.fit(error=float(os.environ.get("ERROR", 1e-3)))
    sheet.modifiers.remove(sheet.modifiers["Cloth"])
    for ending in (".glb", ".fil"):
        bpy.ops.filigree.export(filepath=os.path.join(folder, "cloth" + ending))
    bpy.ops.wm.save_mainfile()
    scene.frame_set(frames)
    driver = copy_as_shown(sheet.filigree.driver, "driver", (2.4, 0, 0))
    follows = copy_as_shown(sheet, "follows", (4.8, 0, 0))
    sheet.hide_render = True
    driver.data.polygons.foreach_set("use_smooth", [False] * len(driver.data.polygons))
    for obj, color in ((cloth, (0.5, 0.5, 0.52)), (driver, (0.16, 0.33, 0.62)), (follows, (0.62, 0.3, 0.22))):
        colored(obj, color)
    picture(os.path.join(folder, "cloth.png"))


main()
