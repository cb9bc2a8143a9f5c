# %% [markdown]
# # Strip, bend, restore
# Take the detail off a mesh, let something move what is left, put the detail back.

# %%
import filigree

mesh = filigree.make("wavy-sphere")  # or filigree.read_mesh("scan.ply"), or any object with vertices and faces
model = filigree.strip(mesh)
print(model)

# %%
bend = filigree.bend(mesh, "z", 60)
bent = filigree.restore(model, bend(model))
filigree.write_mesh(bent, "bent.ply")

# %% [markdown]
# How far is that from bending every vertex?

# %%
error = filigree.compare(bent, bend(mesh))["rms"]
print(f"{error:.1e} of the diagonal")
assert error < 1e-3
