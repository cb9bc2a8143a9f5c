# Runs in Blender: imports a GLB, plays it, and compares every vertex with a point cache of ours.
# Usage: blender -b --factory-startup --python-exit-code 1 -P blender.py -- FILE.glb REFERENCE.pc2 RATE LIMIT FRAME...
# Prints lines of JSON that begin with "compared". Vertices that Blender does not keep (of no face) are not compared.
import json
import struct
import sys

import bpy
import numpy as np

np.bool = bool  # the importer of Blender 3.4 asks for a name that numpy 1.24 has dropped


def read_pc2(path):
    with open(path, 'rb') as file:
        data = file.read()
    points, frames = struct.unpack_from('<i', data, 16)[0], struct.unpack_from('<i', data, 28)[0]
    return np.frombuffer(data, '<f4', 3 * points * frames, 32).reshape(frames, points, 3).astype(np.float64)


def world_positions(mesh_object):
    evaluated = mesh_object.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get('co', positions)
    evaluated.to_mesh_clear()
    matrix = np.array(evaluated.matrix_world, np.float64)
    return positions.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def y_up(positions):
    """Blender's z is up, glTF's is y: (x, y, z) there is (x, -z, y) here."""
    return np.stack([positions[:, 0], positions[:, 2], -positions[:, 1]], axis=1)


def main():
    glb, pc2, rate, limit, *frames = sys.argv[sys.argv.index('--') + 1:]
    rate, limit = float(rate), float(limit)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = int(np.ceil(rate)), np.ceil(rate) / rate
    if 'FINISHED' not in bpy.ops.import_scene.gltf(filepath=glb, import_shading='SMOOTH'):
        sys.exit('the import failed')
    meshes = [o for o in bpy.data.objects if o.type == 'MESH' and o.find_armature()]
    if len(meshes) != 1:
        sys.exit(f'{len(meshes)} skinned meshes where one is expected')
    reference = read_pc2(pc2)
    count = reference.shape[1]
    kept = world_positions(meshes[0]).shape[0]
    if kept < count:
        sys.exit(f'Blender has {kept} vertices, the reference {count}')
    diagonal = np.linalg.norm(reference[0].max(axis=0) - reference[0].min(axis=0))
    bones = len(meshes[0].find_armature().data.bones)
    worst = 0
    for frame in map(int, frames or range(len(reference))):
        scene.frame_set(frame)
        away = np.linalg.norm(y_up(world_positions(meshes[0]))[:count] - reference[frame], axis=1) / diagonal
        worst = max(worst, away.max())
        print('compared', json.dumps({'frame': frame, 'largest': float(away.max()), 'vertex': int(away.argmax()),
                                      'rms': float(np.sqrt((away ** 2).mean())), 'bones': bones, 'vertices': kept}))
    if not worst <= limit:
        sys.exit(f'{worst:.2e} of the diagonal is above {limit:.0e}')


main()
