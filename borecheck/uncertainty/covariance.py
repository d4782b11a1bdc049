"""What is not exact, and by how much: the file that `--uncertainty` reads.

JSON with up to three blocks, `joints` (by joint), `dimensions` (by the robot's xacro
arguments: calibration offsets, lengths) and `registration` (x, y, z, rx, ry, rz of the
robot in the scanner's frame, about the isocentre). Each block either lists standard
deviations, `{"q1": "0.1mm", "q4": "0.05deg"}`, or names and a covariance in SI,
`{"names": ["q1", "q2"], "covariance": [[1e-8, 0], [0, 1e-8]]}`.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.units import parse_angle, parse_length
from borecheck.errors import BorecheckError, InputError, UnknownNameError, UsageError
from borecheck.robots.robot import Robot
from borecheck.uncertainty.json_object import number, read_object

Array = NDArray[np.float64]

BLOCKS = ("joints", "dimensions", "registration")
REGISTRATION = ("x", "y", "z", "rx", "ry", "rz")
ANGLES = ("rx", "ry", "rz")

# Correlations of a covariance typed with six digits are symmetric and not negative to
# that. Of the covariance itself nothing like it holds: metres stand beside radians.
CORRELATION_TOLERANCE = 1e-6

# Larger standard deviations are a mistaken unit: no robot stands so, [m] and [rad].
LARGEST_LENGTH, LARGEST_ANGLE = 1.0, math.pi


@dataclass(frozen=True, eq=False)
class Block:
    """Some quantities and their covariance.

    Attributes:
        names: The quantities.
        covariance: (n, n), symmetric, not negative, SI units squared; read-only.
    """

    names: tuple[str, ...] = ()
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def __post_init__(self) -> None:
        covariance = np.array(self.covariance, dtype=np.float64)
        n = len(self.names)
        if len(set(self.names)) < n:
            raise UsageError(f"a name stands twice: {', '.join(self.names)}")
        if covariance.shape != (n, n):
            raise UsageError(f"covariance {covariance.shape} of {n} names")
        if not np.isfinite(covariance).all():
            raise UsageError("covariance holds a number that is not finite")
        _check_covariance(covariance)
        covariance.setflags(write=False)
        object.__setattr__(self, "covariance", covariance)


def _check_covariance(covariance: Array) -> None:
    """Refuses what is no covariance, each quantity measured in its own size."""
    variance = np.diag(covariance)
    if (variance < 0.0).any():
        raise UsageError("covariance has a negative variance on its diagonal")
    size = np.sqrt(variance)
    exact = size == 0.0
    if covariance[exact].any() or covariance[:, exact].any():
        raise UsageError("covariance: a quantity of variance 0 varies with another")
    size[exact] = 1.0
    correlation = covariance / size[:, None] / size
    if np.abs(correlation - correlation.T).max(initial=0.0) > CORRELATION_TOLERANCE:
        raise UsageError("covariance is not symmetric")
    if np.abs(correlation).max(initial=0.0) > 1.0 + CORRELATION_TOLERANCE:
        raise UsageError("covariance has a correlation beyond 1")
    if np.linalg.eigvalsh(correlation).min(initial=0.0) < -CORRELATION_TOLERANCE:
        raise UsageError("covariance has a negative eigenvalue")


def square_root(covariance: Array) -> Array:
    """A matrix A (n, k) with A A^T = covariance; k: in how many ways it varies."""
    size = np.sqrt(np.diag(covariance))
    scale = np.where(size > 0.0, size, 1.0)
    values, vectors = np.linalg.eigh(covariance / scale[:, None] / scale)
    kept = values > CORRELATION_TOLERANCE * 1e-6
    return np.asarray(size[:, None] * vectors[:, kept] * np.sqrt(values[kept]))


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Normal errors with mean zero, independent between the blocks.

    Attributes:
        joints: By joint of the URDF, [m] or [rad].
        dimensions: By xacro argument of the robot, [m] or [rad].
        registration: Of the robot's placement in the scanner's frame.
    """

    joints: Block = field(default_factory=Block)
    dimensions: Block = field(default_factory=Block)
    registration: Block = field(default_factory=Block)

    @property
    def names(self) -> tuple[str, ...]:
        """All quantities, joints first, then dimensions, then registration."""
        return (*self.joints.names, *self.dimensions.names, *self.registration.names)

    @property
    def covariance(self) -> Array:
        """Of all quantities together, (n, n)."""
        return _block_diagonal([block.covariance for block in self.blocks])

    @property
    def blocks(self) -> tuple[Block, Block, Block]:
        """Joints, dimensions, registration."""
        return self.joints, self.dimensions, self.registration

    @property
    def root(self) -> Array:
        """A matrix A (n, k) with A A^T = covariance, block by block.

        Errors are A z with z standard normal, (k,).
        """
        return _block_diagonal([square_root(block.covariance) for block in self.blocks])


def _block_diagonal(blocks: Sequence[Array]) -> Array:
    shapes = np.array([block.shape for block in blocks])
    total = np.zeros(shapes.sum(axis=0))
    row, column = 0, 0
    for block in blocks:
        rows, columns = block.shape
        total[row : row + rows, column : column + columns] = block
        row, column = row + rows, column + columns
    return total


def read_uncertainty(path: str | Path, robot: Robot) -> Uncertainty:
    """The uncertainties of a file, checked against the robot's names.

    Raises:
        InputError: The file cannot be used; one line that says where and why.
    """
    document = read_object(Path(path))
    try:
        return from_document(document, robot)
    except BorecheckError as error:
        raise InputError(path, str(error)) from error


def from_document(document: Mapping[str, Any], robot: Robot) -> Uncertainty:
    """The uncertainties that a JSON object states.

    Raises:
        UnknownNameError: A block, joint, argument or direction that does not exist.
        UsageError: A size that is none, or a covariance that cannot be one.
    """
    for name in document:
        if name not in BLOCKS:
            raise UnknownNameError("uncertainty", name, BLOCKS)
    angles = {
        "joints": {j.name: j.is_angle for j in robot.model.free_joints},
        "dimensions": _arguments(robot),
        "registration": {name: name in ANGLES for name in REGISTRATION},
    }
    blocks = {
        name: _block(document[name], kinds, name)
        for name, kinds in angles.items()
        if name in document
    }
    if not any(block.names for block in blocks.values()):
        raise UsageError(f"no uncertainty is given (blocks: {', '.join(BLOCKS)})")
    return Uncertainty(**blocks)


def _arguments(robot: Robot) -> dict[str, bool]:
    """The robot's arguments that are quantities, and whether each is an angle."""
    if robot.description is None:
        return dict.fromkeys(robot.arguments, False)
    return {
        name: argument.quantity == "angle"
        for name, argument in robot.description.arguments.items()
        if argument.quantity is not None
    }


def _block(given: Any, kinds: Mapping[str, bool], where: str) -> Block:
    if not isinstance(given, dict):
        raise UsageError(f"{where} is no object")
    if "covariance" in given:
        names, covariance = _matrix_block(given, where)
        _check_names(names, kinds, where)
    else:
        names = list(given)
        _check_names(names, kinds, where)
        sizes = [_size(value, kinds[name], name) for name, value in given.items()]
        covariance = np.diag(np.square(sizes)) if sizes else np.zeros((0, 0))
    block = Block(tuple(names), covariance)
    for name, variance in zip(names, np.diag(block.covariance), strict=True):
        _check_size(math.sqrt(variance), kinds[name], f"{where}: {name}")
    return block


def _matrix_block(given: Mapping[str, Any], where: str) -> tuple[list[str], Array]:
    if set(given) != {"names", "covariance"}:
        raise UsageError(f"{where} needs names and covariance, and nothing else")
    names, rows = given["names"], given["covariance"]
    if not isinstance(names, list) or not all(isinstance(n, str) for n in names):
        raise UsageError(f"{where}: names is no list of names")
    if not isinstance(rows, list) or not all(isinstance(row, list) for row in rows):
        raise UsageError(f"{where}: covariance is no matrix of numbers")
    if any(len(row) != len(names) for row in rows) or len(rows) != len(names):
        raise UsageError(
            f"{where}: covariance is not of {len(names)} by {len(names)} numbers, as "
            f"there are {len(names)} names"
        )
    numbers = [[number(x, f"{where}: covariance") for x in row] for row in rows]
    return names, np.array(numbers, dtype=np.float64).reshape(len(names), len(names))


def _check_names(names: list[str], kinds: Mapping[str, bool], where: str) -> None:
    for name in names:
        if name not in kinds:
            kind = {"joints": "joint", "dimensions": "argument"}.get(where, "direction")
            raise UnknownNameError(kind, name, kinds)


def _size(value: Any, is_angle: bool, name: str) -> float:
    if isinstance(value, str):
        size = parse_angle(value) if is_angle else parse_length(value)
    else:
        size = number(value, name)
    if not (math.isfinite(size) and size >= 0.0):
        raise UsageError(f"{name}: a standard deviation is 0 or more, not {value!r}")
    _check_size(size, is_angle, name)
    return size


def _check_size(size: float, is_angle: bool, name: str) -> None:
    largest, unit = (LARGEST_ANGLE, "rad") if is_angle else (LARGEST_LENGTH, "m")
    if size > largest:
        raise UsageError(
            f"{name}: a standard deviation of {size:.3g} {unit} is beyond "
            f"{largest:.3g} {unit}: is its unit right? Bare numbers are metres, radians"
        )
