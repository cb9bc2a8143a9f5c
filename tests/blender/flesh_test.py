"""A mesh that an armature bends becomes flesh beside itself."""

import os
import tempfile

import bpy
import numpy as np

import filigree
from filigree_detail import baking, meshes
from stage import activate, add, begin, refused, run_all, shown

folder = tempfile.TemporaryDirectory(prefix="filigree-blender-")
LAST = 20


def bending_tube():
    """A tube with two bones, of which the upper one bends and comes back. Returns it."""
    begin()
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder.name, "flesh.blend"))
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    tube = filigree.make("cylinder", resolution=12, length=4)
    high = add(tube, "tube")
    long = int(np.argmax(np.ptp(meshes.vertices_of(high.data), axis=0)))
    turn = {0: (0, 1, 0), 1: (1, 0, 0), 2: (0, 0, 0)}[long]  # to stand upright
    high.rotation_euler = [np.pi / 2 * t for t in turn]
    bpy.ops.object.transform_apply(rotation=True)
    low, top = meshes.vertices_of(high.data)[:, 2].min(), meshes.vertices_of(high.data)[:, 2].max()
    armature = bpy.data.objects.new("bones", bpy.data.armatures.new("bones"))
    scene.collection.objects.link(armature)
    activate(armature)
    bpy.ops.object.mode_set(mode="EDIT")
    bones, middle = armature.data.edit_bones, (low + top) / 2
    for name, head, tail in (("lower", low, middle), ("upper", middle, top)):
        bone = bones.new(name)
        bone.head, bone.tail = (0, 0, head), (0, 0, tail)
    bones["upper"].parent = bones["lower"]
    bpy.ops.object.mode_set(mode="OBJECT")
    for name in ("lower", "upper"):
        group = high.vertex_groups.new(name=name)
        for vertex in high.data.vertices:
            share = np.clip(0.5 + (vertex.co.z - middle) / (0.2 * (top - low)), 0, 1)
            group.add([vertex.index], share if name == "upper" else 1 - share, "REPLACE")
    high.modifiers.new("Armature", "ARMATURE").object = armature
    bone = armature.pose.bones["upper"]
    bone.rotation_mode = "XYZ"
    for frame, angle in ((1, 0.0), (8, 0.9), (LAST, 0.0)):
        bone.rotation_euler.x = angle
        bone.keyframe_insert("rotation_euler", frame=frame)
    activate(high)
    scene.filigree_flesh.particles, scene.filigree_flesh.joints = 300, 60
    return high


def swing(soft):
    """How far the last frame, in which the bones are back, is from the first."""
    ends = []
    for frame in (1, LAST):
        bpy.context.scene.frame_set(frame)
        ends.append(shown(soft).copy())
    return np.linalg.norm(ends[1] - ends[0], axis=1).mean()


def test_a_character_becomes_flesh():
    high = bending_tube()
    scene = bpy.context.scene
    skinned = []
    for frame in range(1, LAST + 1):
        scene.frame_set(frame)
        skinned.append(shown(high).copy())
    scene.frame_set(3)
    assert bpy.ops.filigree.flesh() == {"FINISHED"} and scene.frame_current == 3
    soft = bpy.data.objects["tube flesh"]
    assert high.hide_get() and not soft.modifiers.get("Armature") and soft.filigree.driver is not None
    diagonal = np.linalg.norm(np.ptp(skinned[0], axis=0))
    apart = []
    for frame in range(1, LAST + 1):
        scene.frame_set(frame)
        moved = shown(soft)
        assert moved.shape == skinned[0].shape and np.isfinite(moved).all()
        apart.append(float(np.linalg.norm(moved - skinned[frame - 1], axis=1).mean() / diagonal))
    assert apart[0] < 0.01, apart  # it begins where the skin is,
    assert 0.002 < max(apart) < 0.2, apart  # and swings about it
    followed = shown(soft).copy()
    activate(soft)
    assert bpy.ops.filigree.bake() == {"FINISHED"} and baking.BAKED in soft.modifiers
    assert np.abs(shown(soft) - followed).max() < 1e-5 * diagonal
    bpy.ops.filigree.free_bake()
    assert np.abs(shown(soft) - followed).max() < 1e-5 * diagonal


def test_a_group_says_where_it_is_soft():
    high = bending_tube()
    bpy.context.scene.filigree_flesh.soft_group = "belly"
    refused(bpy.ops.filigree.flesh, "no vertex group 'belly'")
    group = high.vertex_groups.new(name="belly")
    group.add([v.index for v in high.data.vertices], 1, "REPLACE")
    bpy.ops.filigree.flesh()
    loose = swing(bpy.data.objects["tube flesh"])
    high = bending_tube()
    bpy.context.scene.filigree_flesh.soft_group = ""
    bpy.ops.filigree.flesh()
    assert loose > 1.2 * swing(bpy.data.objects["tube flesh"]), loose


def test_what_has_no_bones_is_refused():
    high = bending_tube()
    high.modifiers["Armature"].show_viewport = False
    refused(bpy.ops.filigree.flesh, "no Armature modifier")


run_all(globals())
