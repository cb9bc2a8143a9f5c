"""Writes flag.obj and flag.pc2, the flag of docs/fitting.md, for the pictures of docs/studio.md: 40,401 vertices, 72 frames."""

import filigree
import numpy

flag = filigree.make("wavy-plane", resolution=200, amplitude=0)
rest = numpy.array(flag.world_vertices)
frames = []
for t in numpy.arange(72) / 24:
    s, y = rest[:, 0] - rest[:, 0].min(), rest[:, 1]
    wave = 0.09 * numpy.sin(8 * s - 9 * t + 2 * y) + 0.03 * numpy.sin(19 * s - 14 * t - 4 * y)
    move = numpy.stack([0 * s, -0.1 * s * s, wave], axis=1)
    frames.append(rest + numpy.minimum(1, s / 0.4)[:, None] * move)
filigree.write_mesh(flag, "flag.obj")
filigree.write_animation(flag, frames, "flag.pc2")
