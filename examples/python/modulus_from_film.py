# %% [markdown]
# # A modulus from a film
# A bar of jelly swings, held at one end. From where points of its surface are in a film, Young's modulus is wanted. The
# motion is described by the bar's lowest modes, which the stiffness and the mass matrix give. Along each of them, mass
# times acceleration is force: linear in the modulus, as the stiffness is, and in the damping.

# %%
import matplotlib.pyplot as plt
import numpy
from scipy.sparse.linalg import eigsh

import filigree

bar = filigree.make("bar", resolution=6, length=4, size=0.05)
frames_per_second = 240
secret = filigree.Material("jelly", young_modulus=8e5)


def make_body(material):
    body = filigree.Body(bar, material, spacing=0.0125)
    return body, numpy.flatnonzero(body.rest[:, 0] < body.rest[:, 0].min() + 1e-4)


# %% [markdown]
# The film: a simulation, whose modulus is kept secret. Points are seen to a twentieth of a millimetre.

# %%
body, held = make_body(secret)
simulation = filigree.Simulation([body], pins=[filigree.Pin(0, held)], frames_per_second=frames_per_second)
seen = body.interpolation(bar.vertices)
film = []
for frame in range(120):
    simulation.step()
    film.append(seen @ simulation.positions(0).astype(float))
film = numpy.array(film) + 5e-5 * numpy.random.default_rng(1).normal(size=(120, *bar.vertices.shape))

# %% [markdown]
# A guess, wrong by a factor of five, has the same modes: all of its stiffness is proportional to the modulus.

# %%
guess, held = make_body(filigree.Material("jelly", young_modulus=4e6))
free = numpy.setdiff1d(numpy.arange(3 * len(guess)), (3 * held[:, None] + numpy.arange(3)).ravel())
stiffness, mass = (matrix.tocsr()[free][:, free] for matrix in (guess.stiffness_matrix(), guess.mass_matrix()))
squares, modes = eigsh(stiffness, 6, mass, sigma=0)
shapes = numpy.zeros((3 * len(guess), 6))
shapes[free] = modes  # of mass 1
carried = numpy.stack([(seen @ shapes[:, k].reshape(-1, 3)).ravel() for k in range(6)], axis=1)
amounts = numpy.linalg.lstsq(carried, (film - bar.vertices).reshape(len(film), -1).T, rcond=None)[0].T
force = -squares * amounts  # of mass 1; squares of angular frequencies, 1/s^2
weight = shapes.T @ (guess.mass[:, None] * [0, -9.81, 0]).ravel()

# %% [markdown]
# Accelerations by differences over four frames each way, so that what the film is wrong by counts less.

# %%
reach = 4
middle = slice(reach, -reach)
acceleration = (amounts[2 * reach :] - 2 * amounts[middle] + amounts[: -2 * reach]) * (frames_per_second / reach) ** 2
velocity = (amounts[2 * reach :] - amounts[: -2 * reach]) * frames_per_second / (2 * reach)
mode = int(numpy.argmax(numpy.ptp(amounts, axis=0)))
columns = numpy.stack([force[middle, mode], -velocity[:, mode]], axis=1)
factor, damping = numpy.linalg.lstsq(columns, acceleration[:, mode] - weight[mode], rcond=None)[0]
found = factor * guess.material.young_modulus
print(f"Young's modulus {found:.3g} Pa (in truth {secret.young_modulus:.3g}), damping {damping:.2f} 1/s")

# %%
figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
seconds = numpy.arange(len(film)) / frames_per_second
axes[0].plot(seconds, 1000 * film[:, numpy.argmax(bar.vertices[:, 0]), 1], color="0.2")
axes[0].set_ylabel("height of the free end in the film, mm")
axes[1].plot(seconds[middle], acceleration[:, mode] - weight[mode], color="0.2", label="film: acceleration less weight")
axes[1].plot(seconds[middle], columns @ [factor, damping], "--", color="C0", label=f"forces with {found:.3g} Pa")
axes[1].plot(seconds[middle], force[middle, mode], ":", color="C3", label=f"forces with {guess.material.young_modulus:.3g} Pa")
axes[1].set_ylabel("along the lowest mode")
axes[1].set_ylim(numpy.array([-1.6, 1.9]) * numpy.abs(acceleration[:, mode] - weight[mode]).max())
for each in axes:
    each.set_xlabel("s")
    each.grid(True, alpha=0.25)
axes[1].legend(frameon=False, fontsize=8, loc="upper right")
figure.savefig("modulus.png", dpi=120)

# %%
assert abs(found / secret.young_modulus - 1) < 0.05
