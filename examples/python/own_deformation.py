# %% [markdown]
# # A deformation of one's own
# Any function from points to points is a warp. Applied to the driver alone and restored, it should give what it does to
# every vertex: here both, their difference, and what was expected of it beforehand.

# %%
import matplotlib.pyplot as plt
import numpy

import filigree


def swirl(points):
    """Turns about z by an angle that grows outwards and with the height."""
    angle = 1.5 * numpy.hypot(points[:, 0], points[:, 1]) + 0.8 * points[:, 2]
    c, s = numpy.cos(angle), numpy.sin(angle)
    x, y, z = points.T
    return numpy.stack([c * x - s * y, s * x + c * y, z + 0.15 * numpy.sin(4 * x)], axis=1)


mesh = filigree.make("wavy-sphere", resolution=64)
model = filigree.strip(mesh, base=800)
warp = filigree.Warp(swirl)  # its gradients by differences; Warp(swirl, gradient) takes exact ones
pose = warp(model)

# %%
restored, full = filigree.restore(model, pose), warp(mesh)
alone = filigree.restore(model, pose.positions)
wrong = filigree.vertex_distances(restored, full) / mesh.diagonal
print(f"rms {filigree.compare(restored, full)['rms']:.1e} of the diagonal with gradients, "
      f"{filigree.compare(alone, full)['rms']:.1e} from positions alone; "
      f"expected {filigree.expected_error(model, pose)['rms']:.1e}")  # fmt: skip

# %%
figure = plt.figure(figsize=(10, 3.6), layout="constrained")
colors = numpy.log10(numpy.maximum(wrong, 1e-7))
for k, (shown, title, values) in enumerate((
    (model.driver, f"driver at rest, {len(pose)} vertices", None),
    (restored, "restored", None),
    (full, "every vertex moved; the difference", colors),
)):  # fmt: skip
    axes = figure.add_subplot(1, 3, k + 1, projection="3d")
    drawn = axes.plot_trisurf(*shown.vertices.T, triangles=shown.triangles, linewidth=0, color="#c8a27e")
    if values is not None:
        drawn.set_array(values[shown.triangles].mean(axis=1))
        figure.colorbar(drawn, ax=axes, shrink=0.6, label="log10 distance / diagonal")
    axes.set_title(title, fontsize=9)
    axes.set_box_aspect((1, 1, 1), zoom=1.3)
    axes.set_axis_off()
figure.savefig("own_deformation.png", dpi=120)

# %%
assert filigree.compare(restored, full)["rms"] < 1e-3
