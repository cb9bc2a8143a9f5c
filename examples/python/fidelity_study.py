# %% [markdown]
# # A fidelity study
# How much driver does a mesh need? The error of restored bends and twists over the driver's vertices, from positions
# alone and with gradients, as a plot.

# %%
import matplotlib.pyplot as plt

import filigree

mesh = filigree.make("wavy-sphere", resolution=64)
sizes = [50, 100, 200, 400, 800, 1600, 3200]
warps = {"bend of 90 degrees": filigree.bend(mesh, "z", 90), "twist of 180 degrees": filigree.twist(mesh, "z", 180)}
full = {name: warp(mesh) for name, warp in warps.items()}

# %%
errors = {}
for size in sizes:
    model = filigree.strip(mesh, base=size)
    restorer = filigree.Restorer(model)
    for name, warp in warps.items():
        pose = warp(model)
        for source, given in (("positions", pose.positions), ("with gradients", pose)):
            error = filigree.compare(restorer.mesh(given), full[name], samples=0)["rms"]
            errors.setdefault((name, source), []).append(error)

# %%
figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
for (name, source), values in errors.items():
    color = "C0" if "bend" in name else "C1"
    axes.loglog(sizes, values, "-o" if source == "positions" else "--s", color=color, label=f"{name}, {source}", markersize=4)
axes.set_xlabel(f"vertices of the driver (of {len(mesh.vertices):,})")
axes.set_ylabel("rms error / diagonal")
axes.grid(True, which="both", alpha=0.25)
axes.legend(frameon=False)
figure.savefig("fidelity.png", dpi=120)

# %% [markdown]
# More driver, less error; and `strip` finds the smallest that is good enough.

# %%
for values in errors.values():
    assert values[-1] < values[0] / 10
model = filigree.strip(mesh, fidelity=1e-4)
print(model, model.report["fidelity"])
