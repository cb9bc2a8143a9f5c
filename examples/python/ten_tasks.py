# %% [markdown]
# # Ten tasks of libigl's and trimesh's users
# Each in as few lines as it takes. Meshes come as (V, F), as libigl has them; docs/python.md has the lines beside those of
# libigl and trimesh.

# %%
import numpy

import filigree

filigree.write_mesh(filigree.make("wavy-sphere", resolution=32), "scan.ply")
P = numpy.random.default_rng(1).uniform(-0.6, 0.6, (500, 3))

# %% [markdown]
# 1. Read a file, say how large it is and whether it is closed.

# %%
said = filigree.info(mesh := filigree.read_mesh("scan.ply"))
print(said["vertices"], said["box"]["max"] - said["box"]["min"], said["closed"])
V, F = mesh.world_vertices, mesh.triangles

# %% [markdown]
# 2. Normals, areas, volume.

# %%
N = filigree.normals((V, F))
A = filigree.areas((V, F))
print(filigree.volume((V, F)), A.sum())
assert abs(filigree.volume((V, F)) / said["volume"] - 1) < 1e-4 and N.shape == V.shape

# %% [markdown]
# 3. Closest points. 4. Signed distances, of open meshes as well.

# %%
C = filigree.closest_points((V, F), P).points
S = filigree.signed_distance((V, F[: len(F) - 40]), P)
assert numpy.isclose(numpy.abs(S), filigree.closest_points((V, F[: len(F) - 40]), P).distances).all()
assert numpy.allclose(numpy.linalg.norm(C - P, axis=1), filigree.closest_points((V, F), P).distances, atol=1e-6)

# %% [markdown]
# 5. Boundaries and adjacency. 6. Parts, and all of them as one again.

# %%
loops = filigree.boundary((V, F[: len(F) - 40]))
degree = filigree.adjacency((V, F)) @ numpy.ones(len(V))
parts = filigree.split(filigree.concatenate([(V, F), (V + 2, F)]))
assert len(loops) >= 1 and degree.min() >= 3 and len(parts) == 2

# %% [markdown]
# 7. Points inside, evenly and in random places.

# %%
points = filigree.sample((V, F), count=1000, pattern="poisson")
assert filigree.contains((V, F), points).all()

# %% [markdown]
# 8. A light mesh that carries the full one through a deformation.

# %%
model = filigree.strip((V, F), base=300)
pose = filigree.Warp(lambda p: p * [1, 1, 1.5] + [0.1, 0, 0] * numpy.sin(5 * p[:, 2:]))(model)
carried = filigree.restore(model, pose)
assert len(carried) == len(V)

# %% [markdown]
# 9. Handles that are pulled, as rigid as possible, with the detail.

# %%
top, bottom = (filigree.HandleRegion(box=V[mask], move=(0, 0, h)) for mask, h in ((V[:, 2] > 0.4, 0.3), (V[:, 2] < -0.4, 0)))
pulled = filigree.restore(model, filigree.move_by_handles(model, [top, bottom]))
assert pulled.bounds[1][2] > mesh.bounds[1][2] + 0.2

# %% [markdown]
# 10. Dropped as a soft body for half a second.

# %%
body = filigree.Body((V, F), "rubber", particles=600, size=0.2)
simulation = filigree.Simulation([body], obstacles=[filigree.Obstacle.plane((0, -0.15, 0))])
driver = simulation.attach(0, model)
simulation.step(30)
dropped = filigree.restore(model, driver.pose())
assert -0.16 < dropped.vertices[:, 1].min() * body.scale < -0.101  # it has fallen, and the floor holds it
