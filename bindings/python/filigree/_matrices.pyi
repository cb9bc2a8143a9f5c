from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import Model, Pose

_Doubles = NDArray[np.float64]

class SparseMatrix(NamedTuple):
    rows: NDArray[Any]
    columns: NDArray[Any]
    values: _Doubles
    shape: tuple[int, int]
    def __matmul__(self, x: ArrayLike) -> _Doubles: ...
    def matvec(self, x: ArrayLike) -> _Doubles: ...
    def rmatvec(self, x: ArrayLike) -> _Doubles: ...
    @property
    def T(self) -> SparseMatrix: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def nnz(self) -> int: ...
    def tocoo(self) -> Any: ...
    def tocsr(self) -> Any: ...
    def toarray(self) -> _Doubles: ...

class Bindings(NamedTuple):
    cells: NDArray[np.uint32]
    weights: _Doubles
    offsets: _Doubles

class PoseDerivative(NamedTuple):
    positions: NDArray[Any]
    gradients: NDArray[np.float32] | None

class GradientOperator(NamedTuple):
    matrix: SparseMatrix
    constant: _Doubles
    is_linear: NDArray[np.bool_]
    line: _Doubles
    normal: _Doubles
    shares: _Doubles
    def apply(self, positions: ArrayLike) -> _Doubles: ...
    def adjoint(self, positions: ArrayLike, gradients: ArrayLike) -> _Doubles: ...

def rest_pose(model: Model) -> Pose: ...
def put_onto_classes() -> None: ...
