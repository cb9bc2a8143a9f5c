# %% [markdown]
# # A body with a force of one's own
# A jelly that a whirl stirs, worked out in numpy from where its particles are, before every frame.

# %%
import numpy

import filigree

mesh = filigree.make("wavy-cube", resolution=48)
model = filigree.strip(mesh, base=1200)
body = filigree.Body(mesh, "jelly", particles=2000)
floor = filigree.Obstacle.plane((0, -0.53, 0), friction=1)
held = numpy.flatnonzero(body.rest[:, 1] < body.rest[:, 1].min() + 1e-4)
simulation = filigree.Simulation([body], obstacles=[floor], pins=[filigree.Pin(0, held)])
driver = simulation.attach(0, model)


def whirl(positions):
    """N on each particle: around the y axis, stronger further up."""
    height = positions[:, 1] + 0.5
    return (9 * height * body.mass)[:, None] * numpy.cross([0, 1, 0], positions)


# %%
poses = []
for frame in range(60):
    simulation.set_forces(0, whirl(simulation.positions(0)))
    simulation.step()
    poses.append(driver.pose())

# %% [markdown]
# The top has turned, and the bottom is held.

# %%
positions = simulation.positions(0)
top = body.rest[:, 1] > 0.45
before, after = body.rest[top], positions[top]
turn = numpy.degrees(
    numpy.arctan2(
        (before[:, 2] * after[:, 0] - before[:, 0] * after[:, 2]).sum(),
        (before[:, 0] * after[:, 0] + before[:, 2] * after[:, 2]).sum(),
    )
)
print(f"the top is turned by {turn:.0f} degrees")
assert abs(positions[held] - body.rest[held]).max() < 1e-5
assert turn > 10

# %%
twisted = filigree.restore(model, poses[-1])
filigree.write_picture(filigree.render(twisted, width=640, height=480, passes=8), "whirl.png")
filigree.write_model(model, "whirl.fil", poses=filigree.PoseSequence(poses, 60))
