# %% [markdown]
# # Restoring inside of PyTorch and JAX
# The adjoint of restoring is all that back-propagation needs: a network that moves the driver is trained on the whole
# mesh. Here the parameters are the driver's positions themselves. Parts whose library is missing are skipped.

# %%
import numpy

import filigree

mesh = filigree.make("wavy-sphere", resolution=24)
model = filigree.strip(mesh, base=150)
restorer = filigree.Restorer(model)
wanted = filigree.bend(mesh, "z", 50)(mesh).vertices
start = model.driver.vertices


def numpy_descent(steps=60, rate=0.3):
    """The same by hand: gradient descent on the mean squared distance, preconditioned by how much hangs on a vertex."""
    positions = start.astype(float)
    load = restorer.adjoint(numpy.ones((len(restorer), 3))).positions[:, :1]
    for _ in range(steps):
        away = restorer.positions(positions) - wanted
        positions -= rate * restorer.adjoint(away, positions).positions / load
    return numpy.sqrt((away**2).sum(axis=1).mean()) / mesh.diagonal


before = numpy.sqrt(((mesh.vertices - wanted) ** 2).sum(axis=1).mean()) / mesh.diagonal
after = numpy_descent()
print(f"numpy: rms {before:.1e} before, {after:.1e} after 60 steps")
assert after < before / 5

# %%
try:
    import torch
except ImportError:
    print("torch: skipped, as it is not installed")
else:

    class Restore(torch.autograd.Function):
        @staticmethod
        def forward(context, positions):
            context.positions = positions.detach().cpu().numpy()
            return torch.from_numpy(restorer.positions(context.positions))

        @staticmethod
        def backward(context, vertices):
            pulled = restorer.adjoint(vertices.numpy(), context.positions).positions
            return torch.from_numpy(pulled.astype(numpy.float32))

    positions = torch.from_numpy(start.copy()).requires_grad_(True)
    goal = torch.from_numpy(wanted.copy())
    optimiser = torch.optim.Adam([positions], lr=0.01)
    for step in range(150):
        optimiser.zero_grad()
        loss = ((Restore.apply(positions) - goal) ** 2).sum(dim=1).mean()
        loss.backward()
        optimiser.step()
    after = float(loss) ** 0.5 / mesh.diagonal
    print(f"torch: rms {before:.1e} before, {after:.1e} after 150 steps")
    assert after < before / 5

# %%
try:
    import jax
except ImportError:
    print("jax: skipped, as it is not installed")
else:
    shape = jax.ShapeDtypeStruct(wanted.shape, numpy.float32)
    driver_shape = jax.ShapeDtypeStruct(start.shape, numpy.float32)

    @jax.custom_vjp
    def restore(positions):
        return jax.pure_callback(lambda p: restorer.positions(numpy.asarray(p)), shape, positions)

    def pull(positions, vertices):
        def adjoint(p, v):
            return restorer.adjoint(numpy.asarray(v), numpy.asarray(p)).positions.astype(numpy.float32)

        return (jax.pure_callback(adjoint, driver_shape, positions, vertices),)

    restore.defvjp(lambda positions: (restore(positions), positions), pull)
    loss_of = jax.jit(jax.value_and_grad(lambda p: ((restore(p) - wanted) ** 2).sum(axis=1).mean()))
    load = restorer.adjoint(numpy.ones((len(restorer), 3))).positions[:, :1] / len(restorer)
    positions = jax.numpy.asarray(start)
    for step in range(60):
        loss, slope = loss_of(positions)
        positions -= 0.15 * slope / load
    after = float(loss) ** 0.5 / mesh.diagonal
    print(f"jax: rms {before:.1e} before, {after:.1e} after 60 steps")
    assert after < before / 5
