# Runs in Blender: shows meshes that point caches move, one beside the other, and renders one moment of them.
# Usage: blender -b --factory-startup --python-exit-code 1 -P show.py -- PICTURE.png FRAME MESH.ply CACHE.pc2 [MESH CACHE]...
#        environment: WIDTH (of the picture, 960) and SAMPLES (of a pixel, 48); BLEND, a file to save the scene to
# A cache is played by the Mesh Cache modifier with its own settings: nothing needs turning, as the mesh and its cache
# lie in the same coordinates. y is up.
import os
import sys

import bpy
import numpy as np
from mathutils import Vector

APART = 1.25  # widths, from one mesh to the next
COLORS = [(0.16, 0.33, 0.62), (0.62, 0.47, 0.32), (0.35, 0.5, 0.35)]


def add_moving_mesh(mesh_path, cache_path, number):
    bpy.ops.import_mesh.ply(filepath=mesh_path)
    mesh = bpy.context.object
    cache = mesh.modifiers.new('Mesh Cache', 'MESH_CACHE')
    cache.cache_format = 'PC2'
    cache.filepath = os.path.abspath(cache_path)
    cache.frame_start = 0
    material = bpy.data.materials.new(f'colour {number}')
    material.use_nodes = True
    surface = material.node_tree.nodes['Principled BSDF']
    surface.inputs['Base Color'].default_value = (*COLORS[number % len(COLORS)], 1)
    surface.inputs['Roughness'].default_value = 0.55
    mesh.data.materials.append(material)
    smooth = len(mesh.data.vertices) > 2000  # the driver's facets are worth seeing
    mesh.data.polygons.foreach_set('use_smooth', [smooth] * len(mesh.data.polygons))
    return mesh


def positions_now(mesh):
    moved = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    positions = np.empty(3 * len(moved.vertices), np.float32)
    moved.vertices.foreach_get('co', positions)
    return positions.reshape(-1, 3)


def look_at(thing, target):
    """Turns a camera or light, which look along -z, with y up."""
    thing.rotation_euler = (Vector(target) - thing.location).to_track_quat('-Z', 'Y').to_euler()


def light_the_scene(centre, size):
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new('World')
    scene.world.use_nodes = True
    scene.world.node_tree.nodes['Background'].inputs['Color'].default_value = (0.85, 0.9, 1, 1)
    scene.world.node_tree.nodes['Background'].inputs['Strength'].default_value = 0.45
    sun = bpy.data.objects.new('Sun', bpy.data.lights.new('Sun', 'SUN'))
    sun.data.energy, sun.data.angle = 2.2, 0.12
    sun.location = Vector(centre) + size * Vector((0.6, 1.4, 0.9))
    look_at(sun, centre)
    bpy.context.collection.objects.link(sun)


def add_ground(height, size):
    bpy.ops.mesh.primitive_plane_add(size=200 * size, rotation=(-1.5707963, 0, 0), location=(0, height, 0))
    material = bpy.data.materials.new('ground')
    material.use_nodes = True
    material.node_tree.nodes['Principled BSDF'].inputs['Base Color'].default_value = (0.62, 0.64, 0.66, 1)
    bpy.context.object.data.materials.append(material)


def add_camera(centre, width, height, aspect):
    camera = bpy.data.objects.new('Camera', bpy.data.cameras.new('Camera'))
    camera.data.angle = 0.3
    away = 1.15 * max(width, height * aspect) / (2 * np.tan(camera.data.angle / 2)) + width / 4
    camera.location = Vector(centre) + Vector((0, 0.22, 1)).normalized() * away
    camera.data.clip_end, camera.data.clip_start = 100 * away, away / 100
    # Looks along -z of its own with y up: in a scene whose y is up that is a turn about x alone.
    camera.rotation_euler = (-np.arctan(0.22), 0, 0)
    bpy.context.collection.objects.link(camera)
    bpy.context.scene.camera = camera


def main():
    picture, frame, *files = sys.argv[sys.argv.index('--') + 1:]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = 24
    meshes = [add_moving_mesh(mesh, cache, i) for i, (mesh, cache) in enumerate(zip(files[::2], files[1::2]))]
    scene.frame_set(int(frame))
    boxes = [(positions.min(axis=0), positions.max(axis=0)) for positions in map(positions_now, meshes)]
    spread = APART * max(high[0] - low[0] for low, high in boxes)
    for i, mesh in enumerate(meshes):
        mesh.location.x = i * spread
    low, high = np.min([b[0] for b in boxes], axis=0), np.max([b[1] for b in boxes], axis=0)
    high[0] += spread * (len(meshes) - 1)
    size = float(np.linalg.norm(high - low))
    centre = tuple(float(c) for c in (low + high) / 2)
    add_ground(float(low[1]), size)
    light_the_scene(centre, size)
    width = int(os.environ.get('WIDTH', 960))
    scene.render.resolution_x, scene.render.resolution_y = width, width * 9 // 16
    add_camera(centre, float(high[0] - low[0]), float(high[1] - low[1]), 16 / 9)

    scene.render.engine = 'CYCLES'  # needs no display, unlike Workbench and Eevee
    scene.cycles.samples = int(os.environ.get('SAMPLES', 48))
    scene.cycles.use_denoising = False
    scene.view_settings.view_transform = 'Standard'
    scene.render.image_settings.file_format = 'PNG'
    scene.render.filepath = os.path.abspath(picture)
    if 'BLEND' in os.environ:
        bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(os.environ['BLEND']))
    bpy.ops.render.render(write_still=True)


main()
