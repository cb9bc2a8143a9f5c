# %% [markdown]
# # Fitting a cache
# An animation of every vertex, as another program left it, becomes a driver with poses: `fit` finds the smallest that
# keeps an error. Restoring is linear in the poses, so least squares of one's own are a matrix and scipy.

# %%
import numpy
from scipy.sparse.linalg import lsqr

import filigree

mesh = filigree.make("wavy-sphere", resolution=32)
rest = mesh.world_vertices
frames = numpy.array([rest * (1 + 0.2 * numpy.sin(0.4 * k + 3 * rest[:, 2:])) for k in range(20)])

# %%
model, poses = filigree.fit(mesh, frames, error=3e-4)
report = model.report
kept, cache = len(model.driver.vertices) * 12 * 4, len(mesh) * 3 * 4  # bytes a frame: positions and gradients
print(f"{model}: rms {report['rms']:.1e}, {cache / kept:.1f} times smaller than the cache")
assert report["rms"] <= 3e-4

# %% [markdown]
# The pose of one frame by hand: the matrix M of restoring takes a stacked pose to the vertices.

# %%
restorer = filigree.Restorer(model)
matrix = restorer.matrix().tocsr()
stacked = numpy.stack([lsqr(matrix, frames[7][:, k], damp=1e-3, x0=poses[7].stacked()[:, k])[0] for k in range(3)], axis=1)
by_hand = restorer.positions(filigree.Pose.from_stacked(stacked))
rms = numpy.sqrt(((by_hand - frames[7]) ** 2).sum(axis=1).mean()) / mesh.diagonal
print(f"frame 7 by hand: rms {rms:.1e}")
assert rms <= 1.05 * report["max"]

# %%
filigree.write_model(model, "fitted.fil", poses=poses)
