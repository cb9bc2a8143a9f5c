# Renders one picture; run by scripts/pictures inside Blender.
# Arguments after "--": the picture's name, the folder with the meshes, the PNG to write, samples a pixel.
import sys

import bpy
from mathutils import Euler, Vector

NAME, FOLDER, OUTPUT, SAMPLES = sys.argv[sys.argv.index("--") + 1:]

CLAY, STEEL, INK, PAPER = (0.60, 0.25, 0.10), (0.36, 0.50, 0.66), (0.02, 0.04, 0.08), (0.88, 0.88, 0.90)


def material(color, roughness=0.45):
    made = bpy.data.materials.new("material")
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1)
    shader.inputs["Roughness"].default_value = roughness
    return made


def read(name, color=CLAY, at=(0, 0, 0), smooth=True):
    bpy.ops.wm.obj_import(filepath=f"{FOLDER}/{name}.obj", forward_axis="Y", up_axis="Z")
    thing = bpy.context.selected_objects[0]
    thing.data.materials.clear()
    thing.data.materials.append(material(color))
    thing.data.polygons.foreach_set("use_smooth", [smooth] * len(thing.data.polygons))
    thing.location = at
    return thing


def draw_edges(thing, thickness):
    wire = thing.copy()
    wire.data = thing.data.copy()
    wire.data.materials.clear()
    wire.data.materials.append(material(INK, 0.8))
    modifier = wire.modifiers.new("edges", "WIREFRAME")
    modifier.thickness = thickness
    modifier.offset = 0
    bpy.context.collection.objects.link(wire)
    return wire


def sun(toward, strength, softness):
    """Parallel light, the same on every panel; `softness` in radians blurs its shadows."""
    bpy.ops.object.light_add(type="SUN")
    lamp = bpy.context.object
    lamp.data.energy, lamp.data.angle = strength, softness
    lamp.rotation_euler = Vector(toward).to_track_quat("-Z", "Y").to_euler()


def wall(y):
    bpy.ops.mesh.primitive_plane_add(size=200, location=(0, y, 0), rotation=(1.5707963, 0, 0))
    bpy.context.object.data.materials.append(material(PAPER, 1))


def label(text, at, size):
    bpy.ops.object.text_add(location=at, rotation=(1.5707963, 0, 0))
    thing = bpy.context.object
    thing.data.body, thing.data.size, thing.data.align_x = text, size, "CENTER"
    shade = material(INK)
    shade.node_tree.nodes["Principled BSDF"].inputs["Specular"].default_value = 0
    thing.data.materials.append(shade)
    thing.visible_shadow = False


def smooth_noise(scene):
    """Averages neighbours of the same surface; Debian's Blender has no denoiser of its own."""
    layer = scene.view_layers[0]
    layer.use_pass_normal = layer.use_pass_diffuse_color = True
    scene.use_nodes = True
    nodes, link = scene.node_tree.nodes, scene.node_tree.links.new
    passes = nodes["Render Layers"].outputs
    surface = nodes.new("CompositorNodeMixRGB")
    surface.blend_type = "ADD"
    blur = nodes.new("CompositorNodeBilateralblur")
    blur.iterations, blur.sigma_space, blur.sigma_color = 3, 3, 0.06
    link(passes["Normal"], surface.inputs[1])
    link(passes["DiffCol"], surface.inputs[2])
    link(passes["Image"], blur.inputs["Image"])
    link(surface.outputs[0], blur.inputs["Determinator"])
    link(blur.outputs[0], nodes["Composite"].inputs["Image"])


def render(width, height, units_wide, centre=(0, 0, 0)):
    """A camera in front (looking along y), orthographic, `units_wide` of the scene across the picture."""
    sun((0.7, 0.9, -0.6), 2.1, 0.5)
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = Vector(centre) - Vector((0, 30, 0)), (1.5707963, 0, 0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", units_wide
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
    scene.world.node_tree.nodes["Background"].inputs[1].default_value = 0.55
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = int(SAMPLES), False, 2
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.image_settings.color_mode, scene.render.image_settings.compression = "RGB", 100
    smooth_noise(scene)
    scene.render.filepath = OUTPUT
    bpy.ops.render.render(write_still=True)


def main_job():
    panels = [("mesh", CLAY, "a detailed mesh"), ("driver", STEEL, "stripped to its driver"),
              ("moved", STEEL, "the driver, moved"), ("restored", CLAY, "the detail, restored")]
    for i, (name, color, text) in enumerate(panels):
        x = 3.1 * (i - 1.5)
        is_driver = color == STEEL
        thing = read(name, color, (x + (0.1 if i > 1 else 0), 0, 0.18), smooth=not is_driver)
        if is_driver:
            draw_edges(thing, 0.018)
        label(text, (x, -3, -1.76), 0.21)
    wall(1.0)
    render(1360, 425, 13, (0, 0, -0.02))


def fidelity():
    rest, driver = read("mesh"), read("driver")
    moved = read("moved")
    wrap = rest.modifiers.new("wrap", "SURFACE_DEFORM")
    wrap.target = driver
    bpy.context.view_layer.objects.active = rest
    bpy.ops.object.surfacedeform_bind(modifier="wrap")
    if not wrap.is_bound:
        sys.exit("Blender cannot bind the mesh to this driver")
    driver.data.vertices.foreach_set("co", [x for v in moved.data.vertices for x in v.co])
    driver.data.update()
    for thing in (driver, moved):
        thing.hide_render = True
    panels = [(rest, "Blender's Surface Deform"), (read("restored"), "Filigree, same driver"), (read("full"), "every vertex deformed")]
    for i, (thing, text) in enumerate(panels):
        x = 2.7 * (i - 1)
        thing.location = (x + 0.1, 0, 0.14)
        label(text, (x, -3, -1.75), 0.17)
    wall(1.0)
    render(1120, 504, 8.4, (0, 0, -0.02))


def reference_levels():
    panels = [("mesh", "all detail"), ("one-removed", "one level removed"), ("three-removed", "three removed"),
              ("stretched", "stretched"), ("restored", "detail returned")]
    tilt = Euler((0.45, 0, 0)).to_matrix() @ Euler((0, 0, 0.5)).to_matrix()
    x = 0
    for name, text in panels:
        half = 1.2 if name in ("stretched", "restored") else 0.84
        x += half
        thing = read(name, at=(x, 0, 0.12), smooth=False)
        thing.rotation_euler = tilt.to_euler()
        label(text, (x, -3, -1.1), 0.16)
        x += half
    wall(1.1)
    render(1360, 400, x, (x / 2, 0, -0.12))


bpy.ops.object.select_all(action="SELECT")
bpy.ops.object.delete()
globals()[NAME.replace("-", "_")]()
