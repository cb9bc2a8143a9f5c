"""A detailed mesh falls on the ground as a cushion: Blender's cloth moves the driver, the mesh follows and is baked.

Usage: blender -b --addons filigree_detail -P cushion.py -- MESH FOLDER [FRAMES]
Writes FOLDER/cushion.blend with its caches, and FOLDER/cushion.png: the driver, and the mesh that follows, as they land.
Environment: VERTICES of the driver (600), ENGINE (CYCLES; BLENDER_EEVEE needs a display), WIDTH and SAMPLES of the picture.
"""

import math
import os
import sys

import bpy
from mathutils import Euler, Matrix, Vector

DROP, TILT = 0.35, 0.35  # m; radians, so that it lands on an edge
LANDED = 0.7  # s: when the picture is taken


def read(path):
    """A mesh file as an object a metre large, tilted, above the ground."""
    if path.lower().endswith(".obj"):
        bpy.ops.wm.obj_import(filepath=path)
    elif bpy.app.version < (4, 0):
        bpy.ops.import_mesh.ply(filepath=path)
    else:
        bpy.ops.wm.ply_import(filepath=path)
    high = bpy.context.object
    high.data.transform(Euler((0, TILT, 0)).to_matrix().to_4x4() @ high.matrix_world)
    high.matrix_world = Matrix()
    corners = [Vector(c) for c in high.bound_box]
    low = Vector(min(c[k] for c in corners) for k in range(3))
    size = Vector(max(c[k] for c in corners) for k in range(3)) - low
    high.data.transform(Matrix.Translation((0, 0, DROP)) @ Matrix.Scale(1 / max(size), 4) @ Matrix.Translation(-low - Vector((size.x / 2, size.y / 2, 0))))
    return high


def volume(mesh):
    mesh.calc_loop_triangles()
    at = mesh.vertices
    return sum(at[a].co.dot(at[b].co.cross(at[c].co)) for a, b, c in (t.vertices for t in mesh.loop_triangles)) / 6


def make_cushion(driver, frames):
    cloth = driver.modifiers.new("Cloth", "CLOTH")
    settings = cloth.settings
    settings.quality = 8
    settings.mass = 1 / len(driver.data.vertices)
    settings.air_damping = 0  # else the air carries a light driver
    settings.tension_stiffness = settings.compression_stiffness = 20
    settings.shear_stiffness = 15
    settings.bending_stiffness = 1
    settings.use_internal_springs = True  # across the inside, so that legs stay legs
    settings.internal_tension_stiffness = settings.internal_compression_stiffness = 4
    settings.use_pressure = settings.use_pressure_volume = True
    settings.uniform_pressure_force = 0
    settings.target_volume = volume(driver.data)
    settings.pressure_factor = 0.1
    cloth.collision_settings.distance_min = 0.015
    cloth.collision_settings.collision_quality = 4
    cloth.point_cache.frame_start, cloth.point_cache.frame_end = 1, frames
    bpy.ops.ptcache.bake_all(bake=True)


def colored(obj, color):
    material = bpy.data.materials.new(obj.name)
    material.use_nodes = True
    surface = material.node_tree.nodes["Principled BSDF"]
    surface.inputs["Base Color"].default_value = (*color, 1)
    surface.inputs["Roughness"].default_value = 0.55
    obj.data.materials.clear()
    obj.data.materials.append(material)


def make_ground():
    bpy.ops.mesh.primitive_plane_add(size=60)
    ground = bpy.context.object
    ground.modifiers.new("Collision", "COLLISION")
    ground.collision.thickness_outer, ground.collision.cloth_friction = 0.02, 15
    colored(ground, (0.62, 0.64, 0.66))


def picture(path, high, driver):
    """The driver where it is, and the mesh beside it."""
    scene = bpy.context.scene
    driver.hide_render, driver.display_type = False, "SOLID"
    high.filigree.object_motion = False  # so that it may stand elsewhere
    high.location.x = 1.25
    colored(driver, (0.16, 0.33, 0.62))
    colored(high, (0.62, 0.47, 0.32))
    driver.data.polygons.foreach_set("use_smooth", [False] * len(driver.data.polygons))
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.85, 0.9, 1, 1)
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.45
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle, sun.rotation_euler = 2.4, 0.12, (0.6, 0.35, 0)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.angle, camera.location, camera.rotation_euler = 0.3, (0.62, -7.4, 1.9), (math.radians(78), 0, 0)
    for obj in (sun, camera):
        scene.collection.objects.link(obj)
    scene.camera = camera
    width = int(os.environ.get("WIDTH", 960))
    scene.render.resolution_x, scene.render.resolution_y = width, width * 9 // 16
    scene.render.engine = os.environ.get("ENGINE", "CYCLES")
    scene.cycles.samples = scene.eevee.taa_render_samples = int(os.environ.get("SAMPLES", 48))
    scene.cycles.use_denoising = False
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


def main():
    mesh, folder, *rest = sys.argv[sys.argv.index("--") + 1:]
    folder, frames = os.path.abspath(folder), int(rest[0]) if rest else 48
    os.makedirs(folder, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="filigree_detail")
    scene = bpy.context.scene
    scene.frame_end = frames
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "cushion.blend"))
    make_ground()
    high = read(os.path.abspath(mesh))
    bpy.ops.filigree.make_driver(vertices=int(os.environ.get("VERTICES", 600)))
    make_cushion(high.filigree.driver, frames)
    bpy.ops.filigree.bake()
    bpy.ops.wm.save_mainfile()
    bpy.ops.filigree.free_bake()  # for the picture, the mesh itself follows
    scene.frame_set(min(frames, round(1 + LANDED * scene.render.fps)))
    picture(os.path.join(folder, "cushion.png"), high, high.filigree.driver)


main()
