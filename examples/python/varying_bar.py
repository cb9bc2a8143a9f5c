# %% [markdown]
# # Matter that varies within a body
# A bar is held at one end and pulled at the other. One half of it is as stiff as the material, the other half more. The bar
# has to be as much longer as theory says: half of it by F L / (2 E A), the other half by as much over its factor.

# %%
import numpy

import filigree

LENGTH, SIDE, NEWTONS = 1.0, 0.25, 300.0
material = filigree.Material("rubber", young_modulus=1e6, poisson_ratio=0.3, damping=60)
mesh = filigree.make("bar", resolution=8, length=4, size=SIDE)
plain = filigree.Body(mesh, material, spacing=SIDE / 4)
held = numpy.flatnonzero(plain.rest[:, 0] < -LENGTH / 2 + 1e-4)
pulled = numpy.flatnonzero(plain.rest[:, 0] > LENGTH / 2 - 1e-4)

# %% [markdown]
# ## By cells
# `with_fields` takes one multiple of the material's value a cell; `cells` says where they are.

# %%
print("stiff half   longer by, m   theory, m   measured / theory   substeps a frame")
errors = []
for factor in (1, 3, 10):
    body = plain.with_fields({"stiffness": numpy.where(plain.cell_centres[:, 0] > 0, factor, 1)})
    simulation = filigree.Simulation(
        [body],
        gravity=(0, 0, 0),
        pins=[filigree.Pin(0, held)],
        forces=[filigree.Force(0, (NEWTONS, 0, 0), particles=pulled)],
    )
    substeps = simulation.step(40)["substeps"]
    longer = (simulation.positions(0)[pulled, 0] - body.rest[pulled, 0]).mean()
    theory = NEWTONS * LENGTH / (material.young_modulus * SIDE**2) * (0.5 + 0.5 / factor)
    errors.append(longer / theory - 1)
    print(f"{factor:6} x {longer:16.6f} {theory:12.6f} {longer / theory:15.4f} {substeps:16}")
assert max(map(abs, errors)) < 0.03

# %% [markdown]
# ## By vertices
# `Body` takes one multiple a vertex of the mesh, and spreads them inwards. Here the bar becomes three times as heavy from its
# left end to its right one, so its centre of mass moves.

# %%
x = mesh.vertices[:, 0]
heavy = filigree.Body(mesh, material, spacing=SIDE / 4, fields={"density": 2 + 2 * x / LENGTH})
centre = (heavy.mass[:, None] * heavy.rest).sum(0) / heavy.mass.sum()
print(f"centre of mass at x = {centre[0]:.4f} m; theory {LENGTH / 12:.4f} m")
assert abs(centre[0] - LENGTH / 12) < 0.01
