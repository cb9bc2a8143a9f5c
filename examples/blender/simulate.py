# Runs in Blender: lets a driver fall on the ground as a cushion (cloth with air in it), and writes where it went as PC2.
# Usage: blender -b --factory-startup --python-exit-code 1 -P simulate.py -- DRIVER.ply MOVED.pc2 [FRAMES]
#
# Nothing is turned on the way in or out: y is up here as in the mesh, so gravity is along -y and the ground is an xz plane.
# Blender's cloth is made for things about a metre large; the driver is scaled to that, and its cache back.
import struct
import sys

import bpy
from mathutils import Euler, Matrix, Vector

FRAMES_A_SECOND = 24
DROP = 0.35      # of the size: how far it falls
TILT = 0.35      # radians, so that it lands on an edge
MASS = 1         # kg


def read_driver(path):
    bpy.ops.import_mesh.ply(filepath=path)  # keeps the order of the vertices, and turns nothing
    driver = bpy.context.object
    corners = [Vector(corner) for corner in driver.bound_box]
    centre = sum(corners, Vector()) / 8
    size = max(driver.dimensions)
    # A metre large, tilted, above the ground.
    to_scene = Euler((0, 0, TILT)).to_matrix().to_4x4() @ Matrix.Scale(1 / size, 4) @ Matrix.Translation(-centre)
    driver.data.transform(to_scene)
    lowest = min(vertex.co.y for vertex in driver.data.vertices)
    lift = Matrix.Translation((0, DROP - lowest, 0))
    driver.data.transform(lift)
    # Back to the mesh's units, upright where it was: the ground then lies a drop below the mesh.
    from_scene = Matrix.Translation(centre) @ Matrix.Scale(size, 4) @ lift.inverted()
    return driver, from_scene


def make_cushion(driver):
    cloth = driver.modifiers.new('Cloth', 'CLOTH')
    settings = cloth.settings
    settings.quality = 8
    settings.mass = MASS / len(driver.data.vertices)
    settings.air_damping = 0
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
    return cloth


def volume(mesh):
    mesh.calc_loop_triangles()
    at = mesh.vertices
    return sum(at[a].co.dot(at[b].co.cross(at[c].co)) for a, b, c in (t.vertices for t in mesh.loop_triangles)) / 6


def make_ground():
    bpy.ops.mesh.primitive_plane_add(size=20, rotation=(-1.5707963, 0, 0))
    ground = bpy.context.object
    ground.modifiers.new('Collision', 'COLLISION')
    ground.collision.thickness_outer = 0.02
    ground.collision.cloth_friction = 15


def main():
    driver_path, cache_path, *rest = sys.argv[sys.argv.index('--') + 1:]
    frames = int(rest[0]) if rest else 2 * FRAMES_A_SECOND + 1
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = FRAMES_A_SECOND
    scene.gravity = (0, -9.81, 0)
    scene.frame_start, scene.frame_end = 0, frames - 1
    make_ground()
    driver, from_scene = read_driver(driver_path)
    cloth = make_cushion(driver)
    cloth.point_cache.frame_start, cloth.point_cache.frame_end = 0, frames - 1

    with open(cache_path, 'wb') as file:
        count = len(driver.data.vertices)
        file.write(struct.pack('<12siiffi', b'POINTCACHE2\0', 1, count, 0, 1, frames))
        for frame in range(frames):  # one after the other: the simulation goes on from the frame before
            scene.frame_set(frame)
            moved = driver.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
            if len(moved.vertices) != count:
                sys.exit('the cloth has another number of vertices than the driver')
            for vertex in moved.vertices:
                file.write(struct.pack('<3f', *(from_scene @ vertex.co)))
    print(f'{cache_path}: {frames} frames of {count} points')


main()
