# %% [markdown]
# # A rest shape that sags into the scan
# A scan shows a soft thing as its weight has bent it. Simulated with the scan as its rest shape, it would sag again.
# Wanted is the shape that it has without weight: the one that gravity bends into the scan. The energy of the body, its
# forces and its stiffness matrix give the equilibrium of any rest shape by Newton's method.

# %%
import matplotlib.pyplot as plt
import numpy
from scipy.sparse.linalg import spsolve

import filigree

scan = filigree.make("cylinder", resolution=16, length=5, size=0.06)  # 0.3 m long, along x
gravity = numpy.array([0, -9.81, 0])
jelly = filigree.Material("jelly", young_modulus=1.5e6)


def equilibrium(rest):
    """Where a body with these vertices at rest, held at its end, comes to rest under its weight."""
    body = filigree.Body(scan.with_vertices(rest), jelly, spacing=0.015)
    free = numpy.repeat(body.rest[:, 0] > body.rest[:, 0].min() + 0.02, 3)
    weight = body.mass[:, None] * gravity
    x = body.rest.astype(float)
    for step in range(50):
        pull = (body.forces(x) + weight).ravel()[free]
        if numpy.abs(pull).max() < 1e-9:
            break
        stiffness = body.stiffness_matrix(x).tocsr()[free][:, free]
        way = spsolve(stiffness, pull)
        x.ravel()[free] += way * min(1, 0.5 * body.spacing / numpy.abs(way).max())
    return body.interpolation(rest) @ x


# %% [markdown]
# What the scan lies away from where the rest shape sags to is added to the rest shape, until nothing is left.

# %%
target = scan.world_vertices
rest, misses = target.copy(), []
for step in range(7):
    sagged = equilibrium(rest)
    misses.append(numpy.linalg.norm(sagged - target, axis=1).max())
    rest += target - sagged
print("largest distance from the scan, mm:", ", ".join(f"{1000 * miss:.3g}" for miss in misses))

# %%
figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained", width_ratios=(2, 1))
for places, label, color in ((target, "scan", "0.2"), (equilibrium(target), "scan, sagged once more", "C3")):
    axes[0].plot(*places[:, :2].T, ".", color=color, markersize=2, label=label)
axes[0].plot(*rest[:, :2].T, ".", color="C0", markersize=2, label="rest shape found")
axes[0].set_aspect("equal")
axes[0].set_xlabel("x, m")
axes[0].set_ylabel("y, m")
axes[0].set_ylim(-0.07, 0.13)
axes[0].legend(frameon=False, markerscale=5, loc="upper left")
axes[1].semilogy(range(len(misses)), 1000 * numpy.array(misses), "o-")
axes[1].set_xlabel("round")
axes[1].set_ylabel("largest distance from the scan, mm")
axes[1].grid(True, which="both", alpha=0.25)
figure.savefig("rest_shape.png", dpi=120)

# %%
assert misses[0] > 0.01  # it did sag by a centimetre and more
assert misses[-1] < 0.02 * misses[0]
