"""Matrices of models and bodies, and derivatives, for solvers of others. Put onto the classes by `filigree/__init__.py`."""

import weakref
from typing import NamedTuple, Optional

import numpy

from . import _core


def numbers_of(given, name):
    """An array of float64; raises UsageError for what is none."""
    try:
        array = numpy.asarray(given)
        if array.dtype.kind not in "fiu" and array.size:
            raise ValueError
        return array.astype(float)
    except (ValueError, TypeError, OverflowError):
        raise _core.UsageError(f"{name} has to be an array of numbers.") from None


class SparseMatrix(NamedTuple):
    """A sparse matrix as its entries, which unpack: rows, columns, values, shape. Equal places add up.

    `matrix @ x` multiplies; `tocsr()` gives scipy's form, which is faster for many products and goes into its solvers.

    Examples
    --------
    >>> matrix = filigree.SparseMatrix(numpy.array([0, 1]), numpy.array([1, 1]), numpy.array([2.0, 3.0]), (2, 2))
    >>> matrix @ [1, 10]
    array([20., 30.])
    >>> matrix.toarray().tolist()
    [[0.0, 2.0], [0.0, 3.0]]
    """

    rows: numpy.ndarray
    columns: numpy.ndarray
    values: numpy.ndarray
    shape: tuple

    def __matmul__(self, x):
        x = numbers_of(x, "x")
        if x.ndim not in (1, 2) or x.shape[0] != self.shape[1]:
            raise _core.MismatchError(f"The matrix has {self.shape[1]} columns and cannot be multiplied with {x.shape}.")
        try:
            return self.tocsr() @ x
        except ImportError:
            pass
        columns = x.reshape(len(x), -1)
        sums = [
            numpy.bincount(self.rows, self.values * columns[self.columns, k], self.shape[0])
            for k in range(columns.shape[1])
        ]
        return numpy.stack(sums, axis=1).reshape(self.shape[:1] + x.shape[1:])

    def matvec(self, x):
        """The product with a vector, (n,): what scipy.sparse.linalg.aslinearoperator asks for."""
        return self @ x

    def rmatvec(self, x):
        """The product of the transposed matrix with a vector, (m,)."""
        return self.T @ x

    @property
    def T(self):
        """The transposed matrix."""
        return SparseMatrix(self.columns, self.rows, self.values, self.shape[::-1])

    @property
    def dtype(self):
        """Of the values."""
        return self.values.dtype

    @property
    def nnz(self):
        """Number of entries, those of equal places counted one by one."""
        return len(self.values)

    def tocoo(self):
        """As scipy.sparse.coo_matrix. Raises ImportError where scipy is not installed."""
        from scipy.sparse import coo_matrix

        return coo_matrix((self.values, (self.rows, self.columns)), shape=self.shape)

    def tocsr(self):
        """As scipy.sparse.csr_matrix. Raises ImportError where scipy is not installed."""
        return self.tocoo().tocsr()

    def toarray(self):
        """As a full array."""
        full = numpy.zeros(self.shape)
        numpy.add.at(full, (self.rows, self.columns), self.values)
        return full

    def __repr__(self):
        return f"<filigree.SparseMatrix: {self.shape[0]} x {self.shape[1]}, {self.nnz} entries>"


class Bindings(NamedTuple):
    """How vertices hang on the driver: vertex p has the driver vertices `cells[p]` with `weights[p]`, which sum to 1.

    With m = sum b_i c_i over the three, `offsets[p]` is p - m at rest, model units. A pose takes p to
    sum b_i (c_i' + A_i (p - (m + c_i) / 2)), with positions c_i' and gradients A_i.
    """

    cells: numpy.ndarray
    weights: numpy.ndarray
    offsets: numpy.ndarray


class PoseDerivative(NamedTuple):
    """Derivatives of a number by a pose: by positions, (d, 3), and by gradients, (d, 3, 3), or None."""

    positions: numpy.ndarray
    gradients: Optional[numpy.ndarray]


class GradientOperator(NamedTuple):
    """How gradients are estimated from positions: `apply(positions)` gives what `Restorer.gradients` does.

    matrix : SparseMatrix, (3 d, d)
        Times positions, (d, 3): row 3 i + k is column k of the gradient of driver vertex i, less `constant`.
    constant : ndarray, float64 (3 d, 3)
        Added to that. Not zero where rounding or missing neighbours ask for it.
    is_linear : ndarray of bool, (d,)
        Where that is the whole estimate. Elsewhere the neighbours lie in a plane or on a line, and `apply` completes the
        gradient across it, which is not linear: by the deformed normal, as long as the root of the area ratio.
    """

    matrix: SparseMatrix
    constant: numpy.ndarray
    is_linear: numpy.ndarray
    line: numpy.ndarray
    normal: numpy.ndarray
    shares: numpy.ndarray

    def apply(self, positions):
        """Gradients, float64 (d, 3, 3), of positions, (d, 3)."""
        linear = (self.matrix @ numpy.asarray(positions, float) + self.constant).reshape(-1, 3, 3).transpose(0, 2, 1)
        return self._completed(linear, numpy.flatnonzero(~self.is_linear))

    def adjoint(self, positions, gradients):
        """Derivatives by positions, float64 (d, 3), from those by gradients, (d, 3, 3), at positions."""
        by_linear = numpy.array(gradients, float)
        flat = numpy.flatnonzero(~self.is_linear)
        if len(flat):
            linear = (self.matrix @ numpy.asarray(positions, float) + self.constant).reshape(-1, 3, 3).transpose(0, 2, 1)
            by_linear[flat] = self._completion_adjoint(linear[flat], flat, by_linear[flat])
        return self.matrix.T @ by_linear.transpose(0, 2, 1).reshape(-1, 3)

    def _completed(self, linear, flat):
        whole = numpy.array(linear)
        whole[flat] = self._complete(linear[flat], flat)
        return whole

    def _complete(self, a, flat):
        beside_line, off_plane = self.shares[flat].T[:, :, None, None]
        on_line = numpy.flatnonzero(beside_line[:, 0, 0] > 0)
        if len(on_line):
            turned = _turned_with_line(a[on_line], self.line[flat][on_line])
            a = a.copy()
            a[on_line] += beside_line[on_line] * (turned - a[on_line])
        return a + off_plane * (_with_normal_column(a, self.normal[flat]) - a)

    def _completion_adjoint(self, a, flat, by_whole):
        """By central differences of nine numbers: right to nine digits."""
        scale = numpy.maximum(numpy.linalg.norm(a, axis=(1, 2)), 1e-12)[:, None, None]
        by_linear = numpy.empty_like(a)
        for row in range(3):
            for column in range(3):
                step = numpy.zeros_like(a)
                step[:, row, column] = 1e-5 * scale[:, 0, 0]
                change = (self._complete(a + step, flat) - self._complete(a - step, flat)) / (2e-5 * scale)
                by_linear[:, row, column] = numpy.einsum("nij,nij->n", change, by_whole)
        return by_linear


def _with_normal_column(a, normal):
    """a with what it does to the unit vector `normal` replaced by the deformed normal, times the root of the area ratio."""
    least = numpy.eye(3)[numpy.argmin(numpy.abs(normal), axis=1)]
    t = numpy.cross(normal, least)
    t /= numpy.linalg.norm(t, axis=1)[:, None]
    b = numpy.cross(normal, t)
    across = numpy.cross(numpy.einsum("nij,nj->ni", a, t), numpy.einsum("nij,nj->ni", a, b))
    area = numpy.linalg.norm(across, axis=1)[:, None]
    column = across / numpy.sqrt(numpy.where(area > 0, area, 1))
    return a + (column - numpy.einsum("nij,nj->ni", a, normal))[:, :, None] * normal[:, None, :]


def _turned_with_line(a, t):
    """a with what it does across t replaced by the least rotation that takes t to a t, scaled as a t is."""
    moved = numpy.einsum("nij,nj->ni", a, t)
    stretch = numpy.linalg.norm(moved, axis=1)[:, None]
    start = t / numpy.linalg.norm(t, axis=1)[:, None]
    end = moved / numpy.where(stretch > 0, stretch, 1)
    cosine = numpy.sum(start * end, axis=1)
    v = numpy.cross(start, end)
    cross = numpy.zeros((len(t), 3, 3))
    cross[:, [2, 0, 1], [1, 2, 0]] = v
    cross[:, [1, 2, 0], [2, 0, 1]] = -v
    factor = 1 / numpy.where(cosine > -1 + 1e-12, 1 + cosine, 1)
    turn = numpy.eye(3) + cross + factor[:, None, None] * (cross @ cross)
    across = numpy.eye(3) - t[:, :, None] * t[:, None, :]
    return moved[:, :, None] * t[:, None, :] + stretch[:, :, None] * (turn @ across)


def rest_pose(model):
    """The pose at rest: the driver's positions, and gradients that are the identity.

    Parameters
    ----------
    model : Model

    Returns
    -------
    Pose

    Examples
    --------
    >>> model = filigree.strip(filigree.make("bar", resolution=8))
    >>> filigree.rest_pose(model)
    <filigree.Pose: 57 vertices with gradients>
    """
    positions = model.driver.vertices
    return _core.Pose(positions, numpy.broadcast_to(numpy.eye(3, dtype=numpy.float32), (len(positions), 3, 3)))


def bindings(self):
    """How each vertex of `mesh` hangs on the driver: Bindings of cells, uint32 (n, 3), weights and offsets, float64 (n, 3)."""
    cells, weights, hermite = _core._vertex_bonds(self)
    driver = self.driver.vertices.astype(float)
    corners = driver[cells]
    middle = numpy.einsum("nk,nkx->nx", weights, corners)
    return Bindings(cells, weights, hermite[:, 0] - (middle - corners[:, 0]) / 2)


def _level_vertices(model, level):
    """Vertices of the finest level that a level has."""
    count = len(model.mesh.vertices)
    return numpy.arange(count) if level is None else model.level_vertices(level)


def prolongation(self, level=None):
    """The weights of the driver's vertices for each vertex of a level, as a matrix.

    Takes values at driver vertices, (d,) or (d, k), to the level's vertices, linearly within each driver triangle. Rows
    sum to 1. Of positions it gives the points of the driver's surface that vertices hang on, without their detail.

    Parameters
    ----------
    level : int, optional
        0 (the driver) to `finest_level`; None: the finest.

    Returns
    -------
    SparseMatrix
        (n, d).
    """
    cells, weights, _ = _core._vertex_bonds(self)
    chosen = _level_vertices(self, level)
    rows = numpy.repeat(numpy.arange(len(chosen)), 3)
    return SparseMatrix(rows, cells[chosen].ravel(), weights[chosen].ravel(), (len(chosen), len(self.driver.vertices)))


def gradient_operator(self):
    """How the gradients of a pose are estimated from its positions, as a GradientOperator.

    Cost O(driver). Of a solid shape's driver the estimate is linear nearly everywhere, of a flat sheet's nowhere.

    Examples
    --------
    >>> model = filigree.strip(filigree.make("wavy-sphere", resolution=16), base=100)
    >>> estimate = model.gradient_operator()
    >>> bent = filigree.bend(model, "z", 40)(model).positions
    >>> numpy.abs(estimate.apply(bent) - filigree.Restorer(model).gradients(bent)).max() < 1e-5
    True
    """
    starts, neighbours, weights, constant, line, normal, shares = _core._gradient_terms(self)
    count = len(line)
    counts = numpy.diff(starts).astype(numpy.int64)
    vertex = numpy.repeat(numpy.arange(count), counts)
    rows = (3 * vertex[:, None] + numpy.arange(3)).ravel()
    columns = numpy.repeat(neighbours.astype(numpy.int64), 3)
    own_rows = numpy.arange(3 * count)
    own = -numpy.bincount(rows, weights.ravel(), 3 * count)  # c_j' - c_i'
    matrix = SparseMatrix(
        numpy.concatenate([rows, own_rows]),
        numpy.concatenate([columns, own_rows // 3]),
        numpy.concatenate([weights.ravel(), own]),
        (3 * count, count),
    )
    # As what misses at rest was measured.
    return GradientOperator(
        matrix, constant.transpose(0, 2, 1).reshape(-1, 3).astype(float), shares[:, 1] == 0, line, normal, shares
    )


def stacked(self):
    """The pose as one array for `Restorer.matrix`, float64 (4 d, 3): of each vertex its position, then the columns of its gradient.

    Raises UsageError for a pose without gradients: `Pose(positions, restorer.gradients(positions))` has them.
    """
    if self.gradients is None:
        raise _core.UsageError("The pose has no gradients: stack Pose(positions, restorer.gradients(positions)).")
    rows = numpy.empty((len(self), 4, 3))
    rows[:, 0] = self.positions
    rows[:, 1:] = self.gradients.transpose(0, 2, 1)
    return rows.reshape(-1, 3)


def from_stacked(rows):
    """The pose of an array as `stacked` gives it, (4 d, 3)."""
    rows = numbers_of(rows, "rows")
    if rows.ndim != 2 or rows.shape[1] != 3 or len(rows) % 4:
        raise _core.UsageError(f"rows has the shape {rows.shape}; a stacked pose has (4 d, 3).")
    rows = rows.reshape(-1, 4, 3)
    return _core.Pose(rows[:, 0], rows[:, 1:].transpose(0, 2, 1))


def matrix(self):
    """The matrix that restores: times `pose.stacked()`, (4 d, 3), it gives the positions of the level's vertices, (n, 3).

    Restoring is linear in positions and gradients together, and this matrix depends on the rest shape alone. Twelve
    entries a vertex. With it least squares, smoothing and sensitivities are calls of scipy.

    Returns
    -------
    SparseMatrix
        (n, 4 d), of float64.

    Examples
    --------
    >>> model = filigree.strip(filigree.make("wavy-sphere", resolution=16), base=100)
    >>> restorer = filigree.Restorer(model)
    >>> pose = filigree.bend(model, "z", 40)(model)
    >>> numpy.abs(restorer.matrix() @ pose.stacked() - restorer.positions(pose)).max() < 1e-6
    True
    """
    model = self.model
    cells, weights, hermite = _core._vertex_bonds(model)
    chosen = _level_vertices(model, self.level)
    cells, weights, hermite = cells[chosen].astype(numpy.int64), weights[chosen], hermite[chosen]
    count = len(chosen)
    values = numpy.empty((count, 3, 4))
    values[:, :, 0] = weights
    values[:, :, 1:] = weights[:, :, None] * hermite
    columns = 4 * cells[:, :, None] + numpy.arange(4)
    rows = numpy.repeat(numpy.arange(count), 12)
    return SparseMatrix(rows, columns.ravel(), values.ravel(), (count, 4 * len(model.driver.vertices)))


_operators: "weakref.WeakKeyDictionary" = weakref.WeakKeyDictionary()


def _operator_of(restorer):
    """Made once for each restorer, in scipy's form where that is there."""
    if restorer not in _operators:
        operator = restorer.model.gradient_operator()
        try:
            forward, back = operator.matrix.tocsr(), operator.matrix.T.tocsr()
        except ImportError:
            forward, back = operator.matrix, operator.matrix.T
        _operators[restorer] = operator._replace(matrix=_Products(forward, back))
    return _operators[restorer]


class _Products(NamedTuple):
    forward: object
    back: object

    def __matmul__(self, x):
        return self.forward @ x

    @property
    def T(self):
        return self.back


def adjoint(self, vertices, pose=None, *, threads=0):
    """From the derivative of a number by the restored vertices to its derivative by the pose.

    The transposed matrix of `matrix`, without that matrix: as fast as restoring. What back-propagation needs.

    Parameters
    ----------
    vertices : array_like, (n, 3)
        dL / d position of each vertex of the level.
    pose : Pose or array_like (d, 3), optional
        Where it was restored, if its gradients were estimated: they follow the positions then, and what they pass on is
        added. A pose with gradients, or None: gradients are given by the caller.
    threads : int
        0: all of the processor's. The same bytes for any.

    Returns
    -------
    PoseDerivative
        float32 positions (d, 3) and gradients (d, 3, 3), [vertex, row, column]; with estimated gradients float64
        positions, and None.

    Raises
    ------
    MismatchError
        Another number of vertices than the level's.

    Examples
    --------
    >>> model = filigree.strip(filigree.make("wavy-sphere", resolution=16), base=100)
    >>> restorer = filigree.Restorer(model)
    >>> pull = restorer.adjoint(numpy.ones((len(restorer), 3)))
    >>> pull.positions.shape, pull.gradients.shape
    ((100, 3), (100, 3, 3))
    """
    positions, gradients = self._adjoint(vertices, threads)
    if pose is None or getattr(pose, "gradients", None) is not None:
        return PoseDerivative(positions, gradients)
    at = pose.positions if isinstance(pose, _core.Pose) else _core.Pose(pose).positions
    if len(at) != len(positions):
        raise _core.MismatchError(f"The pose has {len(at)} vertices, and the driver has {len(positions)}.")
    return PoseDerivative(positions + _operator_of(self).adjoint(at, gradients), None)


def energy(self, positions):
    """Elastic energy of a body of 'fem', J: the sum of `energies`, whose parameters and errors it has."""
    return float(self.energies(positions).sum())


def stiffness_matrix(self, positions=None):
    """The second derivative of the elastic energy of a body of 'fem', N/m: SparseMatrix (3 p, 3 p), symmetric.

    Parameters
    ----------
    positions : array_like, (p, 3), optional
        m; None: at rest, where it is positive semidefinite.

    Notes
    -----
    Row 3 i + k is coordinate k of particle i. Entries of neighbouring cells at one place add up. `hessian_product`
    multiplies without the matrix.
    """
    blocks = _core._hessian_blocks(self, self.rest if positions is None else positions)
    ids = (3 * self.cells.astype(numpy.int64)[:, :, None] + numpy.arange(3)).reshape(len(blocks), 24)
    shape = numpy.broadcast_shapes((len(blocks), 24, 1), (len(blocks), 1, 24))
    rows = numpy.broadcast_to(ids[:, :, None], shape).ravel()
    columns = numpy.broadcast_to(ids[:, None, :], shape).ravel()
    return SparseMatrix(rows, columns, blocks.ravel(), (3 * len(self), 3 * len(self)))


def mass_matrix(self):
    """The masses of the particles, kg, three times each: a diagonal SparseMatrix (3 p, 3 p), as simulations have them."""
    each = numpy.arange(3 * len(self))
    return SparseMatrix(each, each, numpy.repeat(self.mass.astype(float), 3), (len(each), len(each)))


def interpolation(self, points):
    """Weights with which particles of a body of 'fem' or 'springs' carry points: eight a point, trilinear in its cell.

    Parameters
    ----------
    points : array_like, (n, 3)
        Of the body at rest, m; outside of all cells the nearest cell is continued.

    Returns
    -------
    SparseMatrix
        (n, p): times positions of the particles, (p, 3), it gives where the points are.

    Raises
    ------
    UnsuitableError
        A body of another model.
    """
    starts, particles, weights = _core._interpolation(self, points)
    count = len(starts) - 1
    rows = numpy.repeat(numpy.arange(count), numpy.diff(starts.astype(numpy.int64)))
    return SparseMatrix(rows, particles.astype(numpy.int64), weights.astype(float), (count, len(self)))


def put_onto_classes():
    _core.Model.bindings = property(bindings)
    _core.Model.prolongation = prolongation
    _core.Model.gradient_operator = gradient_operator
    _core.Pose.stacked = stacked
    _core.Pose.from_stacked = staticmethod(from_stacked)
    _core.Restorer.matrix = matrix
    _core.Restorer.adjoint = adjoint
    _core.Body.energy = energy
    _core.Body.stiffness_matrix = stiffness_matrix
    _core.Body.mass_matrix = mass_matrix
    _core.Body.interpolation = interpolation
