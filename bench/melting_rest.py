"""How much the surface of frozen melt moves from frame to frame once it lies still, in cells of the field's grid.

Run with the module of a build: PYTHONPATH=build/release/python python3 bench/melting_rest.py [PARTICLES]
A wavy ball of wax melts on a hot plate to a half, the plate cools, the puddle sets (a minute).
"""

import sys
import tempfile
from pathlib import Path

import filigree

SIZE, FRAMES, CELL = 0.1, 240, 0.8  # m; frames; cells a spacing, as the field has them
PARTICLES = int(sys.argv[1]) if len(sys.argv) > 1 else 3000
SCENE = f"""[simulation]
frames = {FRAMES}
frames_per_second = 60
[world]
heat_pace = 300
[[body]]
shape = "wavy-sphere"
size = {SIZE}
resolution = 24
material = "wax"
particles = {PARTICLES}
centre = [0, 0.07, 0]
[[obstacle]]
shape = "ground"
friction = 0.6
temperature = [{{ time = 1.2, value = 420 }}, {{ time = 1.3, value = 250 }}]
heat_transfer = 3000
"""

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "wax.toml"
    path.write_text(SCENE)
    run = filigree.SceneRun(path)
    run.advance_to(FRAMES)
    volume = filigree.info(run.mesh(0, 0))["volume"]
    cell = CELL * (volume / PARTICLES) ** (1 / 3)
    surfaces = [run.melting_mesh(frame) for frame in range(FRAMES + 1)]

new = (surfaces[-1].scalars["origin"] < 0).mean()
moved = [filigree.distances_to_surface(b, a) / cell for a, b in zip(surfaces[-21:], surfaces[-20:])]
print(f"new vertices at the end  {100 * new:.0f} %")
print(f"from frame to frame      {max(m.max() for m in moved):.4f} cells at most, {sum(m.mean() for m in moved) / len(moved):.5f} on average")
below = -surfaces[-1].world_vertices[:, 1].min() * CELL / cell
print(f"below the plate          {below:.1f} spacings of the particles at the end")
