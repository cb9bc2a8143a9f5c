# %% [markdown]
# # A driver moved by numpy
# A travelling wave, frame by frame: only the driver is moved, and the restorer writes into an array that is there.

# %%
import numpy

import filigree

mesh = filigree.make("cylinder", resolution=48, length=6, size=0.5)
model = filigree.strip(mesh, base=600, max_edge=0.06)  # flat as it is, it would keep edges as long as itself
rest = model.driver.vertices.astype(float)


def wave(points, time):
    """Positions, and their derivative: what a small vector at each point becomes."""
    phase = 3 * points[:, 0] - 4 * time
    positions = points + numpy.outer(0.25 * numpy.sin(phase), [0, 1, 0])
    gradients = numpy.tile(numpy.eye(3), (len(points), 1, 1))
    gradients[:, 1, 0] = 0.75 * numpy.cos(phase)
    return positions, gradients


# %%
restorer = filigree.Restorer(model)
frames = numpy.empty((24, len(restorer), 3), numpy.float32)
for k, frame in enumerate(frames):
    restorer.positions(*wave(rest, k / 12), out=frame)

# %% [markdown]
# The same wave of every vertex is what the restored frames should be.

# %%
full = numpy.array([wave(mesh.vertices.astype(float), k / 12)[0] for k in range(24)])
error = numpy.sqrt(((frames - full) ** 2).sum(2).mean()) / mesh.diagonal
print(f"{error:.1e} of the diagonal")
assert error < 1e-3

# %%
filigree.write_animation(mesh, frames, "wave.pc2", frames_per_second=24)
filigree.write_picture(filigree.render(mesh.with_vertices(frames[10]), width=640, height=480, passes=8), "wave.png")
