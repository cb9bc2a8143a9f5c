"""A fit follows what modifiers did without them, is baked and saved, and leaves small."""

import os
import tempfile

import bpy
import numpy as np

import filigree
from filigree_detail import baking, meshes
from stage import activate, add, begin, bend, largest, refused, run_all, shown

folder = tempfile.TemporaryDirectory(prefix="filigree-blender-")
FIRST, LAST = 3, 10


def in_a_file():
    begin()
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder.name, "fit.blend"))
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.frame_current = FIRST, LAST, 5


def moving_ball():
    """A bumpy ball that a modifier bends and that turns as an object. Returns it and what is shown of it in each frame."""
    high = add(filigree.make("wavy-sphere", resolution=24), "ball")
    modifier = bend(high, 0)
    for frame, angle in ((FIRST, 0.0), (LAST, 1.6)):
        modifier.angle = angle
        modifier.keyframe_insert("angle", frame=frame)
        high.rotation_euler.z = angle
        high.keyframe_insert("rotation_euler", frame=frame)
    frames = []
    for frame in range(FIRST, LAST + 1):
        bpy.context.scene.frame_set(frame)
        frames.append(shown(high).copy())
    bpy.context.scene.frame_set(5)
    return high, frames


def rms(high, frames):
    """How far what is shown is from `frames`, root of the mean square, of the diagonal at rest."""
    squares = []
    for frame, expected in zip(range(FIRST, LAST + 1), frames):
        bpy.context.scene.frame_set(frame)
        squares.append(((shown(high) - expected) ** 2).sum(axis=1).mean())
    return np.sqrt(np.mean(squares)) / np.linalg.norm(np.ptp(meshes.vertices_of(high.data), axis=0))


def test_the_modifiers_can_go():
    in_a_file()
    high, frames = moving_ball()
    assert bpy.ops.filigree.fit(error=3e-4) == {"FINISHED"} and bpy.context.scene.frame_current == 5
    high.modifiers.remove(high.modifiers["Bend"])
    assert 12 <= len(high.filigree.driver.data.vertices) < len(high.data.vertices) / 4
    assert rms(high, frames) < 3e-4, rms(high, frames)
    refused(bpy.ops.filigree.fit, "Unbind first")
    # Saved and opened, it still follows.
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    high = bpy.data.objects["ball"]
    assert rms(high, frames) < 3e-4
    activate(high)
    assert bpy.ops.filigree.bake() == {"FINISHED"} and baking.BAKED in high.modifiers
    assert rms(high, frames) < 3e-4
    # What moves the driver besides is followed too.
    bpy.ops.filigree.free_bake()
    before = shown(high).copy()
    high.filigree.driver.location.z = 0.5
    assert largest(shown(high), before + np.float32([0, 0, 0.5])) < 2e-2


def test_it_leaves_small():
    in_a_file()
    high, frames = moving_ball()
    bpy.ops.filigree.fit(error=3e-4)
    glb, fil = (os.path.join(folder.name, "ball" + ending) for ending in (".glb", ".fil"))
    for path in (glb, fil):
        assert bpy.ops.filigree.export(filepath=path) == {"FINISHED"}
    assert len(filigree.read_poses(fil)) == len(frames) and os.path.getsize(fil) < 0.2 * sum(f.nbytes for f in frames)
    skin = filigree.read_skin(glb)  # z is up in Blender, y in glTF
    name, seconds = skin.clips[0]
    turned = meshes.moved(frames[-1], high.matrix_world)[:, [0, 2, 1]] * np.float32([1, 1, -1])
    played = skin.positions(0, seconds)
    assert np.abs(np.array([played.min(0) - turned.min(0), played.max(0) - turned.max(0)])).max() < 5e-3, (played.min(0), turned.min(0))
    refused(bpy.ops.filigree.export, ".glb or .fil", filepath=os.path.join(folder.name, "ball.xyz"))


def test_what_cannot_be_fitted_says_why():
    begin()
    high = add(filigree.make("wavy-sphere", resolution=12), "ball")
    refused(bpy.ops.filigree.fit, "Save the file first")
    in_a_file()
    high = add(filigree.make("wavy-sphere", resolution=12), "ball")
    refused(bpy.ops.filigree.fit, "does not move")
    high.modifiers.new("Subdivision", "SUBSURF")
    refused(bpy.ops.filigree.fit, "Frame 3", "Switch off")
    assert bpy.context.scene.frame_current == 5 and high.filigree.model is None
    refused(bpy.ops.filigree.export, "follows no driver", filepath=os.path.join(folder.name, "none.glb"))


run_all(globals())
