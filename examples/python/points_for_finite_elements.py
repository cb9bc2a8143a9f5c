# %% [markdown]
# # Points inside, for a finite-element code
# Cubic elements of a mesh from lattice points, a stiffness problem solved on them (heat here, to be short), and the
# answer carried back to the mesh's vertices.

# %%
import numpy

import filigree

mesh = filigree.make("torus", resolution=32)
spacing = 0.02
middles = filigree.sample(mesh, spacing=spacing)  # of the elements
print(len(middles), "elements")
volume = len(middles) * spacing**3
assert abs(volume / filigree.info(mesh)["volume"] - 1) < 0.02

# %% [markdown]
# Elements that share a face are neighbours.

# %%
cells = numpy.rint((middles - middles.min(0)) / spacing).astype(int)
number = {tuple(cell): i for i, cell in enumerate(cells)}
pairs = numpy.array(
    [(i, number[j]) for i, c in enumerate(cells) for j in map(tuple, c + numpy.eye(3, dtype=int)) if j in number]
)

# %% [markdown]
# Steady heat: one side of the ring is held at 1, the other at 0. Conjugate gradients on the graph's Laplacian.

# %%
free = abs(middles[:, 0]) < 0.35
heat = numpy.where(middles[:, 0] > 0, 1.0, 0.0)


def laplacian(x):
    flow = x[pairs[:, 0]] - x[pairs[:, 1]]
    out = numpy.bincount(pairs[:, 0], flow, len(x)) - numpy.bincount(pairs[:, 1], flow, len(x))
    return out * free


residual = -laplacian(heat)
direction = residual.copy()
for step in range(500):
    pushed = laplacian(direction)
    share = residual @ residual / (direction @ pushed)
    heat += share * direction
    rest = residual - share * pushed
    if numpy.abs(rest).max() < 1e-8:
        break
    direction = rest + (rest @ rest) / (residual @ residual) * direction
    residual = rest
print(step, "rounds")
assert numpy.abs(laplacian(heat)).max() < 1e-6
assert abs(numpy.median(heat[abs(middles[:, 0]) < spacing]) - 0.5) < 0.02

# %%
nearest = numpy.array([((middles - v) ** 2).sum(1).argmin() for v in mesh.vertices])
picture = filigree.render(mesh, scalars=heat[nearest], up="z", width=640, height=480, passes=8)
filigree.write_picture(picture, "heat.png")
