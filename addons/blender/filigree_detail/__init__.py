"""Filigree in Blender: a detailed mesh follows a light one, in the viewport and in every render.

What is where: `library` finds the Python module; `settings` is what a file stores; `meshes` moves arrays between
Blender and numpy; `models` keeps models in the file; `nodes` shows the restored shape; `follow` restores when Blender
says that something moved; `jobs` runs long work; `binding`, `baking`, `error_map`, `simulating` (with
`obstacles` and their `turning`), `breaking`, `fitting` and `fleshing` are the panel's buttons; `panel` draws them.
"""

bl_info = {
    "name": "Filigree Detail",
    "author": "Filigree",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "3D Viewport > Sidebar > Filigree",
    "description": "A detailed mesh follows a light one: rig, simulate or sculpt the light one",
    "category": "Animation",
}

from . import baking, binding, breaking, error_map, fitting, fleshing, follow, panel, settings, simulating

_PARTS = (settings, binding, baking, error_map, simulating, breaking, fitting, fleshing, panel, follow)


def register():
    for part in _PARTS:
        part.register()


def unregister():
    for part in reversed(_PARTS):
        part.unregister()
