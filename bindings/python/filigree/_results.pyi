from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._core import Mesh, Model, PoseSequence

class Remeshed(NamedTuple):
    mesh: Mesh
    report: dict[str, Any]

class Fitted(NamedTuple):
    model: Model
    poses: PoseSequence

class Momentum(NamedTuple):
    linear: NDArray[np.float64]
    angular: NDArray[np.float64]

class Warped(NamedTuple):
    positions: NDArray[np.float64]
    gradients: NDArray[np.float64]

def put_onto_classes() -> None: ...
