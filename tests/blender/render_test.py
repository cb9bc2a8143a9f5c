"""What a render sees is what the viewport shows, also of drivers that are hidden from renders, between frames, in other
view layers and scenes. Seen by a render engine of our own, which draws nothing and keeps the vertices it is given."""

import bpy
import numpy as np

import filigree
from filigree_detail import meshes
from stage import add, begin, bend, largest, restored, run_all, shown


class Probe(bpy.types.RenderEngine):
    bl_idname, bl_label = "FILIGREE_PROBE", "Probe"
    seen = []  # (view layer, frame, object's name, vertices)
    subframes = ()

    def render(self, depsgraph):
        frame = depsgraph.scene.frame_current
        for subframe in (0.0, *self.subframes):
            if self.subframes:
                self.frame_set(frame, subframe)
            for instance in depsgraph.object_instances:
                if instance.object.original.filigree.driver is not None:
                    Probe.seen.append((depsgraph.view_layer.name, frame + subframe, instance.object.name,
                                       meshes.vertices_of(instance.object.data)))


bpy.utils.register_class(Probe)


def rendered(**options):
    Probe.seen, Probe.subframes = [], options.pop("subframes", ())
    scene = bpy.context.scene
    scene.render.engine = "FILIGREE_PROBE"
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.filepath = bpy.app.tempdir
    scene.camera = scene.camera or bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.ops.render.render(**options)
    return Probe.seen


def animated_ball():
    """A ball whose driver bends more with every frame."""
    begin()
    high = add(filigree.make("wavy-sphere", resolution=40), "ball")
    bpy.ops.filigree.make_driver(vertices=300)
    modifier = bend(high.filigree.driver, 0)
    for frame, angle in ((1, 0.0), (5, 1.6)):
        modifier.angle = angle
        modifier.keyframe_insert("angle", frame=frame)
    bpy.context.scene.frame_end = 5
    return high


def shown_at(high, frame, subframe=0.0):
    bpy.context.scene.frame_set(int(frame), subframe=subframe)
    return shown(high)


def test_a_still_of_a_hidden_driver():
    high = animated_ball()
    assert high.filigree.driver.hide_render
    bpy.context.scene.frame_set(4)
    [(_, frame, _, seen)] = rendered()
    assert frame == 4 and largest(seen, shown_at(high, 4)) == 0
    assert largest(seen, meshes.vertices_of(high.data)) > 0.05
    high.filigree.driver.hide_viewport = True  # hidden there as well
    bpy.context.scene.frame_set(5)
    [(_, _, _, seen)] = rendered()
    high.filigree.driver.hide_viewport = False
    assert largest(seen, shown_at(high, 5)) == 0


def test_an_animation():
    high = animated_ball()
    frames = rendered(animation=True)
    assert [f for _, f, _, _ in frames] == [1, 2, 3, 4, 5]
    for _, frame, _, seen in frames:
        assert largest(seen, shown_at(high, frame)) <= 1e-6


def test_between_frames_for_motion_blur():
    high = animated_ball()
    bpy.context.scene.frame_set(3)
    moments = rendered(subframes=(0.25, 0.5))
    assert len(moments) == 3
    for _, moment, _, seen in moments:
        assert largest(seen, shown_at(high, 3, moment - 3)) <= 1e-6
    assert largest(moments[0][3], moments[2][3]) > 1e-3


def test_renders_have_the_finest_level():
    high = animated_ball()
    high.filigree.viewport_level = 1
    bpy.context.scene.frame_set(4)
    [(_, _, _, seen)] = rendered()
    high.filigree.viewport_level = -1
    assert largest(seen, shown_at(high, 4)) == 0


def test_view_layers_and_scenes():
    high = animated_ball()
    bpy.context.scene.view_layers.new("second")
    bpy.context.scene.frame_set(4)
    seen = rendered()
    assert sorted(layer for layer, _, _, _ in seen) == ["ViewLayer", "second"]
    expected = shown_at(high, 4)
    assert all(largest(v, expected) <= 1e-6 for _, _, _, v in seen)
    other = bpy.data.scenes.new("other")
    for obj in bpy.context.scene.objects:
        other.collection.objects.link(obj)
    bpy.context.window.scene = other
    bpy.context.scene.frame_set(2)
    [(_, frame, _, seen)] = rendered()
    assert frame == 2 and largest(seen, shown_at(high, 2)) <= 1e-6


def test_the_mesh_hangs_on_every_kind_of_driver():
    begin()
    high = add(filigree.make("wavy-sphere", resolution=40), "ball")
    bpy.ops.filigree.make_driver(vertices=300)
    driver, scene = high.filigree.driver, bpy.context.scene
    rest = shown(high)
    lattice = bpy.data.objects.new("lattice", bpy.data.lattices.new("lattice"))
    scene.collection.objects.link(lattice)
    lattice.data.points[0].co_deform.x -= 1
    driver.modifiers.new("Lattice", "LATTICE").object = lattice
    assert largest(shown(high), rest) > 0.01 and largest(shown(high), restored(high)) == 0
    driver.modifiers.clear()
    driver.shape_key_add(name="Basis")
    key = driver.shape_key_add(name="Long")
    for point in key.data:
        point.co.x *= 2
    key.value = 1
    assert largest(shown(high), rest * [2, 1, 1]) < 1e-5
    key.value = 0
    armature = bpy.data.armatures.new("bones")
    rig = bpy.data.objects.new("rig", armature)
    scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.edit_bones.new("bone")
    bone.tail.z = 1
    bpy.ops.object.mode_set(mode="OBJECT")
    driver.vertex_groups.new(name="bone").add(range(len(driver.data.vertices)), 1, "REPLACE")
    driver.modifiers.new("Armature", "ARMATURE").object = rig
    rig.pose.bones["bone"].location.x = 1
    assert abs((shown(high) - rest).mean(axis=0) - [1, 0, 0]).max() < 1e-4
    driver.modifiers.clear()
    driver.modifiers.new("Cloth", "CLOTH")
    scene.frame_set(1)
    scene.frame_set(2)
    scene.frame_set(10)
    for frame in range(1, 8):
        scene.frame_set(frame)
    assert shown(high)[:, 2].mean() < rest[:, 2].mean() - 0.01  # it falls
    assert largest(shown(high), restored(high)) == 0


run_all(globals())
