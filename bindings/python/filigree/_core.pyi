# What the compiled part has: names and types alone. The docstrings are its own, and a test holds both against each other.
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Protocol, Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._matrices import Bindings, GradientOperator, PoseDerivative, SparseMatrix
from ._notebook import View
from ._results import Fitted, Momentum, Remeshed, Warped

_Floats = NDArray[np.float32]
_Doubles = NDArray[np.float64]
_Ids = NDArray[np.uint32]
_Bools = NDArray[np.bool_]
_Bytes = NDArray[np.uint8]
_Keyed = Union[float, tuple[ArrayLike, ArrayLike]]
_Labels = tuple[list[str], _Ids]
_Report = dict[str, Any]
_Path = Union[str, PathLike[str]]
_Progress = Callable[[str, float], Any]

class _HasFaces(Protocol):
    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...

class _HasTriangles(Protocol):
    @property
    def vertices(self) -> Any: ...
    @property
    def triangles(self) -> Any: ...

_MeshLike = Union[Mesh, _HasFaces, _HasTriangles, tuple[ArrayLike, ArrayLike]]
_BoxLike = Union[_MeshLike, Model, ArrayLike]
_PoseLike = Union[Pose, ArrayLike]
_PosesLike = Union[PoseSequence, Sequence[_PoseLike], ArrayLike]

class Error(Exception):
    code: int

class BadFileError(Error, ValueError):
    code: int

class Cancelled(Error):
    code: int

class FiligreeWarning(UserWarning): ...

class MismatchError(Error, ValueError):
    code: int

class NotFoundError(Error, FileNotFoundError):
    code: int

class OutOfMemoryError(Error, MemoryError):
    code: int

class UnsuitableError(Error, ValueError):
    code: int

class UnsupportedError(Error, NotImplementedError):
    code: int

class UnwritableError(Error, OSError):
    code: int

class UsageError(Error, ValueError):
    code: int

class Actor:
    def __init__(
        self,
        body: Body,
        *,
        move: ArrayLike = ...,
        axis: ArrayLike = ...,
        degrees: float = 0.0,
        velocity: ArrayLike = ...,
        spin: ArrayLike | None = None,
        spin_degrees: ArrayLike | None = None,
        may_sleep: bool = True,
    ) -> None: ...

class Attachment:
    def pose(self) -> Pose: ...
    def renewal(self) -> _Floats: ...
    def __len__(self) -> int: ...

class Body:
    def __init__(
        self,
        mesh: _MeshLike,
        material: Material | str = 'rubber',
        *,
        particles: int | None = None,
        spacing: float | None = None,
        scale: float = 1.0,
        size: float | None = None,
        fields: Mapping[str, ArrayLike] = ...,
        separate: bool = False,
        threads: int = 0,
        progress: _Progress | None = None,
    ) -> None: ...
    @property
    def material(self) -> Material: ...
    @property
    def scale(self) -> float: ...
    @property
    def spacing(self) -> float: ...
    @property
    def cell_centres(self) -> _Floats: ...
    @property
    def fields(self) -> dict[str, _Floats]: ...
    def with_fields(self, fields: Mapping[str, ArrayLike]) -> Body: ...
    @property
    def rest(self) -> _Floats: ...
    @property
    def mass(self) -> _Floats: ...
    @property
    def volume(self) -> _Floats: ...
    @property
    def report(self) -> _Report: ...
    def particles_near(self, points: ArrayLike) -> _Ids: ...
    def __len__(self) -> int: ...
    @property
    def cells(self) -> _Ids: ...
    @property
    def corners(self) -> _Doubles: ...
    @property
    def cell_volumes(self) -> _Doubles: ...
    def energies(self, positions: ArrayLike, *, threads: int = 0) -> _Doubles: ...
    def energy(self, positions: ArrayLike) -> float: ...
    def forces(self, positions: ArrayLike, *, threads: int = 0) -> _Doubles: ...
    def hessian_product(self, positions: ArrayLike, directions: ArrayLike, *, threads: int = 0) -> _Doubles: ...
    def stiffness_matrix(self, positions: ArrayLike | None = None) -> SparseMatrix: ...
    def mass_matrix(self) -> SparseMatrix: ...
    def interpolation(self, points: ArrayLike) -> SparseMatrix: ...

class Flesh:
    def __init__(
        self,
        skin: Skin,
        *,
        particles: int = 5000,
        stiffness: float = 15000.0,
        poisson_ratio: float = 0.47,
        density: float = 1000.0,
        core: float = 0.5,
        frequency: float = 10.0,
        surface_frequency: float = 1.0,
        damping: float = 3.0,
        soft: Sequence[str] = (),
        strength: float = 0.02,
        loose: ArrayLike | None = None,
        through: Sequence[tuple[str, str]] = (),
        separate: bool = False,
        scale: float | None = None,
        sculpted_gravity: bool = True,
        clips: Sequence[str | int] | None = None,
        threads: int = 0,
        progress: _Progress | None = None,
    ) -> None: ...
    @property
    def body(self) -> Body: ...
    @property
    def scale(self) -> float: ...
    @property
    def softness(self) -> _Floats: ...
    @property
    def frequency(self) -> _Floats: ...
    @property
    def leash(self) -> _Floats: ...
    def targets(self, clip: str | int, seconds: float) -> tuple[_Floats, _Floats]: ...
    def stretches(self, clip: str | int, seconds: float) -> _Floats | None: ...
    def export(
        self,
        path: _Path,
        clips: Sequence[str | int] | None = None,
        *,
        loop: bool = False,
        ground: bool = False,
        self_contact: bool = True,
        frames_per_second: float = 60.0,
        joints: int = 300,
        key_rate: float | None = 30.0,
        compress: bool = False,
        threads: int = 0,
        progress: _Progress | None = None,
    ) -> tuple[Model, dict[str, PoseSequence], dict[str, Any]]: ...
    def simulate(
        self,
        clip: str | int,
        *,
        loop: bool = False,
        ground: bool = False,
        self_contact: bool = True,
        frames_per_second: float = 60.0,
        threads: int = 0,
        progress: _Progress | None = None,
    ) -> tuple[_Doubles, dict[str, Any]]: ...

class Force:
    def __init__(
        self,
        body: int,
        newtons: ArrayLike,
        times: ArrayLike | None = None,
        *,
        particles: ArrayLike = ...,
    ) -> None: ...

class FracturedMesh:
    @property
    def mesh(self) -> Mesh: ...
    @property
    def pieces(self) -> int: ...
    @property
    def piece_of_face(self) -> _Ids: ...
    @property
    def piece_of_vertex(self) -> _Ids: ...
    @property
    def is_inside(self) -> _Bools: ...
    @property
    def report(self) -> _Report: ...
    def piece(self, piece: int) -> Mesh: ...
    def exploded(self, distance: float) -> Mesh: ...

class Hand:
    def __init__(
        self,
        body: int,
        point: ArrayLike,
        target: ArrayLike,
        times: ArrayLike | None = None,
        *,
        stiffness: float = 0.0,
        begin: float = 0.0,
        end: float | None = None,
    ) -> None: ...

class HandleRegion:
    def __init__(
        self,
        *,
        vertices: ArrayLike | None = None,
        box: _BoxLike | None = None,
        sphere: tuple[ArrayLike, float] | None = None,
        move: ArrayLike = ...,
        axis: ArrayLike = ...,
        degrees: float = 0.0,
        centre: ArrayLike | None = None,
        name: str = '',
    ) -> None: ...
    def part(self, fraction: float) -> HandleRegion: ...

class HandleSolver:
    def __init__(
        self,
        mesh: _MeshLike,
        handles: ArrayLike,
        *,
        threads: int = 0,
        progress: _Progress | None = None,
    ) -> None: ...
    def solve(
        self,
        targets: ArrayLike,
        *,
        iterations: int = 200,
        tolerance: float = 1e-05,
        smoothness: float = 0.03,
        threads: int = 0,
        progress: _Progress | None = None,
    ) -> Pose: ...
    def reset(self) -> None: ...

class HeatSource:
    def __init__(
        self,
        centre: ArrayLike,
        radius: float,
        power: ArrayLike,
        times: ArrayLike | None = None,
        *,
        move: ArrayLike | None = None,
    ) -> None: ...

class InsideTest:
    def __init__(
        self,
        mesh: _MeshLike,
        *,
        method: str = 'auto',
        overlap: str = 'parity',
        accuracy: float = 0.01,
        eye: ArrayLike | None = None,
        threads: int = 0,
        progress: _Progress | None = None,
    ) -> None: ...
    def contains(self, points: ArrayLike, *, threads: int = 0, progress: _Progress | None = None) -> _Bools: ...

class Material:
    def __init__(self, name: str = 'rubber', **changes: float | str) -> None: ...
    @property
    def model(self) -> str: ...
    @property
    def density(self) -> float: ...
    @property
    def young_modulus(self) -> float: ...
    @property
    def poisson_ratio(self) -> float: ...
    @property
    def damping(self) -> float: ...
    @property
    def internal_damping(self) -> float: ...
    @property
    def bending(self) -> float: ...
    @property
    def yield_stress(self) -> float: ...
    @property
    def creep_time(self) -> float: ...
    @property
    def temperature(self) -> float: ...
    @property
    def melting_from(self) -> float: ...
    @property
    def melting_to(self) -> float: ...
    @property
    def viscosity(self) -> float: ...
    @property
    def heating(self) -> float: ...
    @property
    def conductivity(self) -> float: ...
    @property
    def specific_heat(self) -> float: ...
    @property
    def latent_heat(self) -> float: ...
    def __eq__(self, other: object) -> bool: ...
    __hash__: None  # type: ignore[assignment]

class Mesh:
    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike | Sequence[Sequence[int]] = ...,
        face_offsets: ArrayLike | None = None,
        *,
        normals: ArrayLike | None = None,
        normal_corners: ArrayLike | None = None,
        uvs: ArrayLike | None = None,
        uv_corners: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        scalars: Mapping[str, ArrayLike] = ...,
    ) -> None: ...
    @property
    def vertices(self) -> _Floats: ...
    @property
    def origin(self) -> _Doubles: ...
    @property
    def world_vertices(self) -> _Doubles: ...
    @property
    def faces(self) -> _Ids | None: ...
    @property
    def corners(self) -> _Ids: ...
    @property
    def face_offsets(self) -> _Ids: ...
    @property
    def triangles(self) -> _Ids: ...
    @property
    def normals(self) -> _Floats | None: ...
    @property
    def normal_corners(self) -> _Ids | None: ...
    @property
    def uvs(self) -> _Floats | None: ...
    @property
    def uv_corners(self) -> _Ids | None: ...
    @property
    def colors(self) -> _Floats | None: ...
    @property
    def scalars(self) -> dict[str, _Floats]: ...
    @property
    def objects(self) -> _Labels | None: ...
    @property
    def groups(self) -> _Labels | None: ...
    @property
    def materials(self) -> _Labels | None: ...
    @property
    def bounds(self) -> _Doubles: ...
    @property
    def diagonal(self) -> float: ...
    def with_vertices(self, vertices: ArrayLike) -> Mesh: ...
    @property
    def vertex_normals(self) -> _Floats: ...
    @property
    def face_normals(self) -> _Doubles: ...
    @property
    def areas(self) -> _Doubles: ...
    @property
    def area(self) -> float: ...
    @property
    def volume(self) -> float: ...
    @property
    def edges(self) -> NDArray[np.int64]: ...
    def split(self) -> list[Mesh]: ...
    def copy(self) -> Mesh: ...
    def plot(self, **how: Any) -> View: ...
    def __eq__(self, other: object) -> bool: ...
    def __hash__(self) -> int: ...
    def __len__(self) -> int: ...

class Model:
    @property
    def mesh(self) -> Mesh: ...
    @property
    def driver(self) -> Mesh: ...
    @property
    def driver_vertices(self) -> _Ids: ...
    @property
    def source_order(self) -> _Ids: ...
    @property
    def across_gap(self) -> _Ids: ...
    @property
    def facing_away(self) -> _Ids: ...
    @property
    def finest_level(self) -> int: ...
    @property
    def report(self) -> _Report: ...
    def level(self, level: int) -> Mesh: ...
    def tobytes(self) -> bytes: ...
    @staticmethod
    def frombytes(bytes: bytes) -> Model: ...
    def fidelity(self, *, threads: int = 0, progress: _Progress | None = None) -> dict[str, float]: ...
    @property
    def bindings(self) -> Bindings: ...
    def level_vertices(self, level: int) -> _Ids: ...
    def prolongation(self, level: int | None = None) -> SparseMatrix: ...
    def gradient_operator(self) -> GradientOperator: ...
    def plot(self, **how: Any) -> View: ...

class Obstacle:
    @staticmethod
    def plane(
        point: ArrayLike = ...,
        normal: ArrayLike = ...,
        *,
        motion: RigidMotion = ...,
        friction: float = 0.5,
        restitution: float = 0.5,
        stiffness: float = 1.0,
        temperature: _Keyed = 293.0,
        heat_transfer: float = 0.0,
    ) -> Obstacle: ...
    @staticmethod
    def ball(
        centre: ArrayLike,
        radius: float,
        *,
        motion: RigidMotion = ...,
        friction: float = 0.5,
        restitution: float = 0.5,
        stiffness: float = 1.0,
        temperature: _Keyed = 293.0,
        heat_transfer: float = 0.0,
    ) -> Obstacle: ...
    @staticmethod
    def box(
        centre: ArrayLike,
        size: ArrayLike,
        *,
        motion: RigidMotion = ...,
        friction: float = 0.5,
        restitution: float = 0.5,
        stiffness: float = 1.0,
        temperature: _Keyed = 293.0,
        heat_transfer: float = 0.0,
    ) -> Obstacle: ...
    @staticmethod
    def mesh(
        mesh: _MeshLike,
        scale: float = 1.0,
        *,
        spacing: float = 0.0,
        motion: RigidMotion = ...,
        friction: float = 0.5,
        restitution: float = 0.5,
        stiffness: float = 1.0,
        temperature: _Keyed = 293.0,
        heat_transfer: float = 0.0,
        threads: int = 0,
        progress: _Progress | None = None,
    ) -> Obstacle: ...

class Pin:
    def __init__(self, body: int, particles: ArrayLike, motion: RigidMotion = ...) -> None: ...

class Pose:
    def __init__(
        self,
        positions: ArrayLike,
        gradients: ArrayLike | None = None,
    ) -> None: ...
    @property
    def positions(self) -> _Floats: ...
    @property
    def gradients(self) -> _Floats | None: ...
    def __len__(self) -> int: ...
    def stacked(self) -> _Doubles: ...
    @staticmethod
    def from_stacked(rows: ArrayLike) -> Pose: ...
    def plot(self, model: Model | None = None, **how: Any) -> View: ...

class PoseSequence:
    def __init__(
        self,
        frames: _PosesLike,
        frames_per_second: float = 60.0,
        gradients: ArrayLike | None = None,
    ) -> None: ...
    @property
    def frames_per_second(self) -> float: ...
    @property
    def positions(self) -> _Floats: ...
    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, frame: int) -> Pose: ...
    @overload
    def __getitem__(self, frames: slice) -> PoseSequence: ...

class ReferenceModel:
    @property
    def mesh(self) -> Mesh: ...
    @property
    def driver(self) -> Mesh: ...
    @property
    def finest_level(self) -> int: ...
    def level(self, level: int) -> Mesh: ...
    def restore(
        self,
        pose: ArrayLike,
        *,
        law: str = 'inverse',
        level: int | None = None,
        threads: int = 0,
    ) -> Mesh: ...
    def tobytes(self) -> bytes: ...
    @staticmethod
    def frombytes(bytes: bytes) -> ReferenceModel: ...

class Restorer:
    def __init__(
        self,
        model: Model,
        *,
        level: int | None = None,
    ) -> None: ...
    def positions(
        self,
        pose: _PoseLike,
        gradients: ArrayLike | None = None,
        *,
        out: _Floats | None = None,
        world: bool = False,
        threads: int = 0,
    ) -> Any: ...
    def mesh(
        self,
        pose: _PoseLike,
        gradients: ArrayLike | None = None,
        *,
        threads: int = 0,
    ) -> Mesh: ...
    def gradients(self, pose: _PoseLike, *, threads: int = 0) -> _Floats: ...
    @property
    def model(self) -> Model: ...
    @property
    def level(self) -> int | None: ...
    def __len__(self) -> int: ...
    def matrix(self) -> SparseMatrix: ...
    def adjoint(self, vertices: ArrayLike, pose: _PoseLike | None = None, *, threads: int = 0) -> PoseDerivative: ...

class RigidMotion:
    def __init__(
        self,
        times: ArrayLike | None = None,
        *,
        move: ArrayLike | None = None,
        degrees: ArrayLike | None = None,
        centre: ArrayLike = ...,
    ) -> None: ...

class SceneRun:
    def __init__(
        self,
        path: _Path,
        *,
        checks: bool = False,
        threads: int = 0,
        progress: _Progress | None = None,
    ) -> None: ...
    def step(self, frames: int = 1) -> None: ...
    def advance_to(self, frame: int, *, progress: _Progress | None = None) -> None: ...
    @property
    def frame(self) -> int: ...
    @property
    def frames(self) -> int: ...
    @property
    def bodies(self) -> list[str]: ...
    @property
    def origin(self) -> _Doubles: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def doubt(self) -> str | None: ...
    def model(self, body: int) -> Model: ...
    def poses(self, body: int) -> PoseSequence: ...
    def mesh(self, body: int, frame: int) -> Mesh: ...
    def melting_mesh(self, frame: int, *, progress: _Progress | None = None) -> Mesh: ...
    def energy(self) -> dict[str, float]: ...
    def save(self) -> bytes: ...
    def resume(self, state: bytes) -> None: ...

class Simulation:
    def __init__(
        self,
        bodies: Sequence[Body | Actor],
        *,
        gravity: ArrayLike = ...,
        obstacles: Sequence[Obstacle] = ...,
        pins: Sequence[Pin] = ...,
        forces: Sequence[Force] = ...,
        hands: Sequence[Hand] = ...,
        wind: ArrayLike = ...,
        air_density: float = 0.0,
        air_temperature: _Keyed = 293.0,
        air_heat_transfer: float = 0.0,
        heat_sources: Sequence[HeatSource] = ...,
        heat_pace: float = 1.0,
        friction: float = 0.3,
        restitution: float = 0.7,
        frames_per_second: float = 60.0,
        mode: str = 'auto',
        most_substeps: int = 500,
        contacts_between_bodies: bool = True,
        contacts_within_bodies: bool = True,
        automatic_rigid: bool = True,
        threads: int = 0,
    ) -> None: ...
    def step(self, frames: int = 1) -> _Report: ...
    def inverted(self, body: int) -> dict[str, Any]: ...
    @property
    def frame(self) -> int: ...
    @property
    def time(self) -> float: ...
    @property
    def bodies(self) -> list[Body | None]: ...
    def add_body(self, body: Body | Actor) -> int: ...
    def remove_body(self, body: int) -> None: ...
    def has_body(self, body: int) -> bool: ...
    def set_obstacle(
        self,
        obstacle: int,
        *,
        move: ArrayLike = ...,
        axis: ArrayLike = ...,
        degrees: float = 0.0,
        matrix: ArrayLike | None = None,
        velocity: ArrayLike = ...,
        spin: ArrayLike | None = None,
        spin_degrees: ArrayLike | None = None,
    ) -> None: ...
    def move_obstacle(
        self,
        obstacle: int,
        *,
        move: ArrayLike = ...,
        axis: ArrayLike = ...,
        degrees: float = 0.0,
        matrix: ArrayLike | None = None,
    ) -> None: ...
    def obstacle_pose(self, obstacle: int) -> _Doubles: ...
    def contact_events(self) -> list[dict[str, Any]]: ...
    def cast_ray(
        self, origin: ArrayLike, direction: ArrayLike, *, reach: float | None = None, ignore: int | None = None
    ) -> dict[str, Any] | None: ...
    def set_may_sleep(self, body: int, may_sleep: bool) -> None: ...
    def is_asleep(self, body: int) -> bool: ...
    def wake(self, body: int) -> None: ...
    def why_rigid(self, body: int) -> str: ...
    def positions(self, body: int) -> _Floats: ...
    def velocities(self, body: int) -> _Floats: ...
    def set_positions(self, body: int, positions: ArrayLike) -> None: ...
    def set_velocities(self, body: int, velocities: ArrayLike) -> None: ...
    def set_forces(self, body: int, newtons: ArrayLike | None) -> None: ...
    def set_follow(
        self,
        body: int,
        frequency: ArrayLike | None,
        positions: ArrayLike | None = None,
        velocities: ArrayLike | None = None,
        *,
        damping: ArrayLike = 3.0,
        leash: ArrayLike | None = None,
        leash_frequency: float = 20.0,
        most_acceleration: float = 100.0,
        stretches: ArrayLike | None = None,
    ) -> None: ...
    def set_targets(
        self,
        body: int,
        positions: ArrayLike,
        velocities: ArrayLike,
        accelerations: ArrayLike | None = None,
        stretches: ArrayLike | None = None,
    ) -> None: ...
    def set_hands(self, hands: Sequence[Hand]) -> None: ...
    def set_air(self, temperature: _Keyed, heat_transfer: float) -> None: ...
    def set_heat_sources(self, heat_sources: Sequence[HeatSource]) -> None: ...
    def matter(self, body: int) -> dict[str, _Floats]: ...
    def heat(self) -> float: ...
    def attach(self, body: int, what: Model | ArrayLike) -> Attachment: ...
    def energy(self) -> dict[str, float]: ...
    def momentum(self) -> Momentum: ...
    def save(self) -> bytes: ...
    def restore(self, state: bytes) -> None: ...

class Skin:
    @property
    def mesh(self) -> Mesh: ...
    @property
    def joints(self) -> list[str]: ...
    @property
    def parents(self) -> list[int | None]: ...
    @property
    def clips(self) -> list[tuple[str, float]]: ...
    def transforms(self, clip: str | int, seconds: float) -> _Doubles: ...
    def positions(self, clip: str | int, seconds: float) -> _Doubles: ...

class Warp:
    def __init__(
        self, function: Callable[[_Doubles], ArrayLike], gradient: Callable[[_Doubles], ArrayLike] | None = None
    ) -> None: ...
    def __matmul__(self, other: Warp) -> Warp: ...
    def __call__(self, what: Any, *, threads: int = 0) -> Any: ...
    def warp(self, points: ArrayLike, *, threads: int = 0) -> Warped: ...
    def unwarp(self, places: ArrayLike, guesses: ArrayLike | None = None) -> _Doubles: ...

def bend(
    box: _BoxLike, axis: str | ArrayLike | None, degrees: float | None = None, *, radians: float | None = None
) -> Warp: ...
def chain(*warps: Warp | Sequence[Warp]) -> Warp: ...
def compare(
    a: _MeshLike | ArrayLike,
    b: _MeshLike | ArrayLike,
    *,
    samples: int = 100000,
    threads: int = 0,
    progress: _Progress | None = None,
) -> _Report: ...
def contains(
    mesh: _MeshLike,
    points: ArrayLike,
    *,
    method: str = 'auto',
    overlap: str = 'parity',
    accuracy: float = 0.01,
    threads: int = 0,
    progress: _Progress | None = None,
) -> _Bools: ...
def distances_to_surface(a: _MeshLike | ArrayLike, b: _MeshLike, *, threads: int = 0, progress: _Progress | None = None) -> _Floats: ...
def edge_strains(a: _MeshLike, rest: _MeshLike) -> _Floats: ...
def expected_error(model: Model, pose: _PoseLike, *, threads: int = 0) -> _Report: ...
def export(
    model: Model,
    path: _Path,
    poses: _PosesLike | None = None,
    *,
    frames_per_second: float = 60.0,
    motion: str | None = None,
    key_rate: float | None = None,
    interpolation: str = 'linear',
    influences: int = 3,
    full_precision: bool = False,
    compress: bool = False,
    key_error: float = 1e-05,
    all_levels: bool = False,
    normals: bool = True,
    morph_normals: bool = False,
    level: int | None = None,
    materials_beside: _Path = '',
    threads: int = 0,
    progress: _Progress | None = None,
) -> _Report: ...
def fit(
    mesh: _MeshLike,
    positions: ArrayLike,
    *,
    error: float = 0.0001,
    max_error: float | None = None,
    base: int | None = None,
    rest_frame: int | str | None = None,
    frames_per_second: float = 60.0,
    sound_gradients: bool = False,
    threads: int = 0,
    progress: _Progress | None = None,
) -> Fitted: ...
def fracture(
    mesh: _MeshLike,
    pieces: int = 20,
    *,
    pattern: str = 'even',
    at: ArrayLike | None = None,
    grain: ArrayLike | None = None,
    stretch: float = 6.0,
    clump: int = 1,
    roughness: float = 0.5,
    edge: float | None = None,
    smallest: float = 0.01,
    seed: int = 1,
    threads: int = 0,
    progress: _Progress | None = None,
) -> FracturedMesh: ...
def info(what: Model | _MeshLike, *, threads: int = 0) -> _Report: ...
def make(
    shape: str,
    *,
    resolution: int = 64,
    frequency: float = 5.0,
    amplitude: float = 0.04,
    size: float = 1.0,
    length: float = 4.0,
    thickness: float = 0.3,
) -> Mesh: ...
def materials() -> dict[str, str]: ...
def move_by_handles(
    what: Model | _MeshLike,
    handles: Sequence[HandleRegion],
    *,
    threads: int = 0,
    progress: _Progress | None = None,
) -> Any: ...
def rbf(centres: ArrayLike, displacements: ArrayLike) -> Warp: ...
def read_handles(path: _Path) -> list[HandleRegion]: ...
def read_mesh(path: _Path, *, threads: int = 0, progress: _Progress | None = None) -> Mesh: ...
def read_model(path: _Path, *, threads: int = 0, progress: _Progress | None = None) -> Model: ...
def read_picture(path: _Path) -> _Bytes: ...
def read_poses(
    path: _Path,
    model: Model | None = None,
    *,
    frames_per_second: float | None = None,
    animation: str = '',
    up: str = '',
    threads: int = 0,
    progress: _Progress | None = None,
) -> PoseSequence: ...
def read_skin(
    path: _Path,
    *,
    mesh: _MeshLike | None = None,
    by_surface: bool = False,
    frames_per_second: float | None = None,
    patches: int = 400,
    threads: int = 0,
    progress: _Progress | None = None,
) -> Skin: ...
def remesh(
    mesh: _MeshLike,
    quads: int = 50000,
    *,
    levels: int | None = None,
    feature_angle: float = 40.0,
    small_parts: str = 'remove',
    wrap: str = 'auto',
    max_distance: float | None = None,
    attributes: bool = True,
    threads: int = 0,
    progress: _Progress | None = None,
) -> Remeshed: ...
def render(
    what: Any,
    *,
    width: int = 960,
    height: int = 720,
    view: str = 'iso',
    up: str | None = None,
    eye: ArrayLike | None = None,
    target: ArrayLike | None = None,
    field_of_view: float = 30.0,
    color: ArrayLike | None = None,
    background: ArrayLike | None = None,
    transparent: bool = False,
    ground: bool = True,
    edges: bool = False,
    surface: bool = True,
    point_radius: float = 0.0,
    scalars: ArrayLike | None = None,
    range: ArrayLike | None = None,
    map: str = 'sequential',
    passes: int = 0,
    threads: int = 0,
    progress: _Progress | None = None,
) -> _Bytes: ...
def restore(
    model: Model,
    pose: _PoseLike,
    gradients: ArrayLike | None = None,
    *,
    level: int | None = None,
    threads: int = 0,
) -> Mesh: ...
def sample(
    mesh: _MeshLike,
    *,
    spacing: float | None = None,
    count: int | None = None,
    pattern: str = 'lattice',
    origin: ArrayLike | None = None,
    method: str = 'auto',
    overlap: str = 'parity',
    accuracy: float = 0.01,
    seed: int = 1,
    frustum: Sequence[int] | None = None,
    eye: ArrayLike | None = None,
    threads: int = 0,
    progress: _Progress | None = None,
) -> _Doubles: ...
def smooth_random(box: _BoxLike, amplitude: float, seed: int = 1) -> Warp: ...
def squeeze(box: _BoxLike, axis: str | ArrayLike | None, factor: float) -> Warp: ...
def stretch(box: _BoxLike, axis: str | ArrayLike | None, factor: float) -> Warp: ...
def strip(
    mesh: _MeshLike,
    *,
    driver: _MeshLike | None = None,
    base: int | None = None,
    levels: int | None = None,
    error: float | None = None,
    fidelity: float | None = None,
    fidelity_from: str = 'positions',
    max_edge: float | None = None,
    reorder: bool = False,
    threads: int = 0,
    progress: _Progress | None = None,
) -> Model: ...
def strip_reference(
    mesh: _MeshLike,
    *,
    base: int | None = None,
    levels: int | None = None,
    references: int = 3,
    threads: int = 0,
    progress: _Progress | None = None,
) -> ReferenceModel: ...
def taper(box: _BoxLike, axis: str | ArrayLike | None, factor: float) -> Warp: ...
def target_velocities(before: ArrayLike, now: ArrayLike, after: ArrayLike, frames_per_second: float) -> _Floats: ...
def twist(
    box: _BoxLike, axis: str | ArrayLike | None, degrees: float | None = None, *, radians: float | None = None
) -> Warp: ...
def vertex_distances(a: _MeshLike | ArrayLike, b: _MeshLike | ArrayLike, *, threads: int = 0) -> _Floats: ...
def write_animation(
    mesh: _MeshLike,
    positions: ArrayLike,
    path: _Path,
    *,
    frames_per_second: float = 60.0,
    morph_normals: bool = False,
    threads: int = 0,
    progress: _Progress | None = None,
) -> _Report: ...
def write_mesh(
    mesh: _MeshLike,
    path: _Path,
    *,
    format: str | None = None,
    ascii: bool = False,
    big_endian: bool = False,
    materials_beside: _Path = '',
    threads: int = 0,
    progress: _Progress | None = None,
) -> None: ...
def write_model(
    model: Model,
    path: _Path,
    *,
    poses: _PosesLike | None = None,
    threads: int = 0,
    progress: _Progress | None = None,
) -> None: ...
def pack(
    model: Model,
    path: _Path,
    *,
    bits: int = 14,
    surface: bool = False,
    keep_order: bool = False,
    profile: str = 'compact',
    poses: _PosesLike | None = None,
    threads: int = 0,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def write_picture(picture: _Bytes, path: _Path) -> None: ...
