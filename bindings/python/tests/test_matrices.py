"""Matrices multiply to what the library gives; derivatives agree with differences."""

import numpy
import pytest

import filigree

scipy_sparse = pytest.importorskip("scipy.sparse")


@pytest.fixture(scope="module")
def restorer(model):
    return filigree.Restorer(model)


@pytest.fixture(scope="module")
def sheet():
    return filigree.strip(filigree.make("wavy-plane", resolution=30, amplitude=1e-4), base=60, max_edge=0.2)


@pytest.fixture(scope="module")
def body():
    return filigree.Body(filigree.make("bar", resolution=6), "jelly", particles=150, size=0.4)


@pytest.fixture(scope="module")
def moved(body):
    return body.rest + 0.03 * body.spacing * numpy.random.default_rng(2).normal(size=body.rest.shape)


def close(a, b, tolerance):
    assert numpy.abs(numpy.asarray(a) - b).max() <= tolerance * max(numpy.abs(b).max(), 1e-30)


def test_bindings_are_the_formula(model, pose, restorer):
    cells, weights, offsets = model.bindings
    assert cells.shape == weights.shape == offsets.shape == (len(restorer), 3)
    close(weights.sum(axis=1), 1, 1e-12)
    rest = model.driver.vertices.astype(float)
    middle = numpy.einsum("nk,nkx->nx", weights, rest[cells])
    close(middle + offsets, model.mesh.vertices, 1e-6)
    arms = model.mesh.vertices[:, None] - (middle[:, None] + rest[cells]) / 2
    moved = pose.positions[cells] + numpy.einsum("nkij,nkj->nki", pose.gradients[cells], arms)
    close(numpy.einsum("nk,nkx->nx", weights, moved), restorer.positions(pose), 2e-6)


def test_the_restore_matrix(restorer, pose):
    matrix = restorer.matrix()
    rows, columns, values, shape = matrix
    assert shape == (len(restorer), 4 * len(pose)) and len(rows) == len(columns) == len(values) == 12 * len(restorer)
    close(matrix @ pose.stacked(), restorer.positions(pose), 2e-6)
    close(matrix.tocsr() @ pose.stacked(), restorer.positions(pose), 2e-6)
    back = filigree.Pose.from_stacked(pose.stacked())
    assert (back.positions == pose.positions).all() and (back.gradients == pose.gradients).all()


def test_the_matrix_without_scipy(restorer, pose, monkeypatch):
    matrix = restorer.matrix()
    wanted = matrix @ pose.stacked()
    monkeypatch.setattr(filigree.SparseMatrix, "tocsr", lambda self: (_ for _ in ()).throw(ImportError()))
    close(matrix @ pose.stacked(), wanted, 1e-12)
    close(matrix @ pose.stacked()[:, 0], wanted[:, 0], 1e-12)
    with pytest.raises(filigree.MismatchError, match="columns"):
        matrix @ numpy.zeros(3)


@pytest.mark.parametrize("options", [{}, {"driver": "own"}], ids=["plain", "own driver"])
def test_matrices_of_other_models(mesh, options):
    if options.get("driver"):
        options = {"driver": filigree.make("wavy-sphere", resolution=6, amplitude=0)}
    model = filigree.strip(mesh, **(options if "driver" in options else {**options, "base": 200}))
    restorer = filigree.Restorer(model)
    pose = filigree.twist(mesh, "z", 50)(model)
    close(restorer.matrix() @ pose.stacked(), restorer.positions(pose), 1e-5)
    close(model.prolongation().toarray().sum(axis=1), 1, 1e-6)


def test_levels_are_prolongations(mesh):
    model = filigree.strip(mesh, levels=2)
    bend = filigree.bend(mesh, "z", 40)(model)
    for level in range(model.finest_level + 1):
        ids = model.level_vertices(level)
        assert (model.mesh.vertices[ids] == model.level(level).vertices).all()
        part = filigree.Restorer(model, level=level)
        close(part.matrix() @ bend.stacked(), part.positions(bend), 2e-6)
        weights = model.prolongation(level)
        assert weights.shape == (len(ids), len(model.driver_vertices))
        linear = model.driver.vertices @ [1.0, 2.0, 3.0]  # exact of the points that vertices hang on
        middle = weights @ model.driver.vertices.astype(float)
        close(weights @ linear, middle @ [1.0, 2.0, 3.0], 1e-6)
    close(model.prolongation(0).toarray(), numpy.eye(len(model.driver_vertices)), 1e-6)
    with pytest.raises(filigree.UsageError, match="no level 9"):
        model.level_vertices(9)


def test_gradients_are_an_operator(model, sheet, restorer):
    for of, least in ((model, 0.9), (sheet, 0)):
        estimate = of.gradient_operator()
        assert estimate.is_linear.mean() >= least
        rng = numpy.random.default_rng(1)
        positions = filigree.bend(of, "x", 50)(of).positions + 1e-3 * rng.normal(size=of.driver.vertices.shape)
        close(estimate.apply(positions), filigree.Restorer(of).gradients(positions), 2e-5)
    assert not sheet.gradient_operator().is_linear.any()


def test_a_line_of_points_has_gradients():
    line = filigree.Mesh(numpy.linspace([0, 0, 0], [1, 0.5, 0.2], 40))
    model = filigree.strip(line, base=10)
    estimate = model.gradient_operator()
    moved = model.driver.vertices @ numpy.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]]) * 1.5
    close(estimate.apply(moved), filigree.Restorer(model).gradients(moved), 1e-4)


def test_the_adjoint_is_the_transposed_matrix(restorer, pose):
    pull = numpy.random.default_rng(3).normal(size=(len(restorer), 3))
    wanted = (restorer.matrix().T @ pull.astype(numpy.float32)).reshape(-1, 4, 3)
    found = restorer.adjoint(pull, pose)
    close(found.positions, wanted[:, 0], 1e-6)
    close(found.gradients, wanted[:, 1:].transpose(0, 2, 1), 1e-6)
    one = restorer.adjoint(pull, threads=1)
    assert one.positions.tobytes() == found.positions.tobytes() and one.gradients.tobytes() == found.gradients.tobytes()
    with pytest.raises(filigree.MismatchError, match="derivative is of 3"):
        restorer.adjoint(numpy.zeros((3, 3)))


def test_the_adjoint_of_a_level(mesh):
    model = filigree.strip(mesh, levels=2)
    restorer = filigree.Restorer(model, level=1)
    pull = numpy.random.default_rng(4).normal(size=(len(restorer), 3)).astype(numpy.float32)
    close(restorer.adjoint(pull).positions, (restorer.matrix().T @ pull).reshape(-1, 4, 3)[:, 0], 1e-6)


@pytest.mark.parametrize("which", ["solid", "sheet"])
def test_the_adjoint_of_estimated_gradients(which, model, sheet):
    of = model if which == "solid" else sheet
    restorer, estimate, matrix = filigree.Restorer(of), of.gradient_operator(), filigree.Restorer(of).matrix().tocsr()
    rng = numpy.random.default_rng(5)
    at = filigree.bend(of, "x", 50)(of).positions.astype(float)
    pull = rng.normal(size=(len(restorer), 3)).astype(numpy.float32)

    def value(positions):  # in double, as the library's is in float
        rows = numpy.concatenate([positions[:, None], estimate.apply(positions).transpose(0, 2, 1)], axis=1)
        return (pull * (matrix @ rows.reshape(-1, 3))).sum()

    found, none = restorer.adjoint(pull, at)
    assert none is None
    direction = rng.normal(size=at.shape)
    step = 1e-6
    change = (value(at + step * direction) - value(at - step * direction)) / (2 * step)
    assert abs((found * direction).sum() - change) <= 1e-6 * numpy.abs(found * direction).sum()


def test_energies_are_the_simulations(body, moved):
    simulation = filigree.Simulation([body], gravity=(0, 0, 0))
    simulation.set_positions(0, moved)
    at = simulation.positions(0)
    assert body.energy(at) == pytest.approx(simulation.energy()["elastic"], rel=1e-6)
    assert body.energies(at).shape == (len(body.cells),) and body.energy(body.rest) == pytest.approx(0, abs=1e-12)


def test_forces_are_the_simulations(body, moved):
    simulation = filigree.Simulation(
        [body], gravity=(0, 0, 0), frames_per_second=1e6, contacts_within_bodies=False, automatic_rigid=False
    )
    simulation.set_positions(0, moved)
    at = simulation.positions(0)
    simulation.step()
    forces = simulation.velocities(0) * 1e6 * body.mass[:, None]
    close(forces, body.forces(at), 2e-2)  # of a step of a microsecond


def test_forces_are_minus_the_energys_derivative(body, moved):
    direction = numpy.random.default_rng(6).normal(size=moved.shape)
    for at in (moved, body.rest.astype(float), body.rest * [1, -0.3, 1], body.rest * [1.3, 0.2, 1]):  # inverted, crushed
        step = 1e-7
        change = (body.energy(at + step * direction) - body.energy(at - step * direction)) / (2 * step)
        wanted = -(body.forces(at) * direction).sum()
        assert change == pytest.approx(wanted, rel=1e-5, abs=1e-6 * numpy.abs(body.forces(moved)).sum())


def test_hessians(body, moved):
    direction = numpy.random.default_rng(7).normal(size=moved.shape)
    for at in (moved, body.rest * [1.2, 0.3, 1] + 0.2 * (moved - body.rest)):
        step = 1e-7
        change = -(body.forces(at + step * direction) - body.forces(at - step * direction)) / (2 * step)
        close(body.hessian_product(at, direction), change, 1e-5)
        stiffness = body.stiffness_matrix(at)
        close((stiffness @ direction.ravel()).reshape(-1, 3), change, 1e-5)
    rest = body.stiffness_matrix().tocsr()
    assert abs(rest - rest.T).max() < 1e-9 * abs(rest).max()
    rigid = numpy.tile([1.0, 0, 0], len(body))
    assert numpy.abs(rest @ rigid).max() < 1e-9 * abs(rest).max()  # a body that is moved has no forces


def test_modulus_is_a_factor(body, moved):
    harder = filigree.Body(
        filigree.make("bar", resolution=6),
        filigree.Material("jelly", young_modulus=3 * body.material.young_modulus),
        particles=150,
        size=0.4,
    )
    close(harder.forces(moved), 3 * body.forces(moved), 1e-6)


def test_masses_and_volumes(body):
    close(body.mass_matrix() @ numpy.ones(3 * len(body)), numpy.repeat(body.mass, 3), 1e-6)
    assert body.cell_volumes.sum() == pytest.approx(body.report["volume"], rel=1e-6)
    assert body.cell_volumes.sum() * body.material.density == pytest.approx(float(body.mass.sum()), rel=1e-6)
    close(body.corners, body.rest, 1e-5)
    assert body.cells.max() == len(body) - 1
    sides = body.corners[body.cells][:, [1, 2, 4]] - body.corners[body.cells][:, [0]]
    close(sides, numpy.broadcast_to(body.spacing * numpy.eye(3), sides.shape), 1e-5)


def test_interpolation(body):
    points = body.corners[body.cells].mean(axis=1)
    weights = body.interpolation(points)
    close(weights @ body.rest.astype(float), points, 1e-5)
    affine = body.rest @ numpy.array([[1.1, 0.2, 0], [0, 1, 0.3], [0.1, 0, 0.9]])
    close(weights @ affine, points @ numpy.array([[1.1, 0.2, 0], [0, 1, 0.3], [0.1, 0, 0.9]]), 1e-5)


def test_refusals(body):
    bar = filigree.make("bar", resolution=4)
    springs = filigree.Body(bar, filigree.Material("jelly", model="springs"), particles=100, size=0.4)
    with pytest.raises(filigree.UnsuitableError, match="model fem"):
        springs.energies(springs.rest)
    with pytest.raises(filigree.MismatchError, match="particles"):
        body.forces(body.rest[1:])
    meshfree = filigree.Body(bar, filigree.Material("jelly", model="meshfree"), particles=100, size=0.4)
    with pytest.raises(filigree.UnsuitableError, match="springs"):
        meshfree.interpolation([[0, 0, 0]])
    with pytest.raises(filigree.UsageError, match="no gradients"):
        filigree.Pose(numpy.zeros((4, 3))).stacked()
    with pytest.raises(filigree.UsageError, match="4 d"):
        filigree.Pose.from_stacked(numpy.zeros((5, 3)))


def test_an_adjoint_of_what_is_not_finite(restorer):
    pull = numpy.ones((len(restorer), 3))
    pull[len(pull) // 2, 1] = numpy.nan
    with pytest.raises(filigree.UsageError, match="not finite"):
        restorer.adjoint(pull)
    with pytest.raises(filigree.UsageError, match="shape"):
        restorer.adjoint(numpy.ones(6))
