"""What is not exact, and by how much: the file that `--uncertainty` reads.

JSON with up to three blocks, `joints` (by joint), `dimensions` (by the robot's xacro
arguments: calibration offsets, lengths) and `registration` (x, y, z, rx, ry, rz of the
robot in the scanner's frame, about the isocentre). Each block either lists standard
deviations, `{"q1": "0.1mm", "q4": "0.05deg"}`, or names and a covariance in SI,
`{"names": ["q1", "q2"], "covariance": [[1e-8, 0], [0, 1e-8]]}`.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.units import parse_angle, parse_length
from borecheck.errors import BorecheckError, InputError, UnknownNameError, UsageError
from borecheck.robots.robot import Robot

Array = NDArray[np.float64]

BLOCKS = ("joints", "dimensions", "registration")
REGISTRATION = ("x", "y", "z", "rx", "ry", "rz")
ANGLES = ("rx", "ry", "rz")

MAX_BYTES = 1_000_000

# A covariance typed with six digits is symmetric and not negative to that.
COVARIANCE_TOLERANCE = 1e-6


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
        scale = np.abs(covariance).max(initial=0.0) * COVARIANCE_TOLERANCE
        if np.abs(covariance - covariance.T).max(initial=0.0) > scale:
            raise UsageError("covariance is not symmetric")
        if n and np.linalg.eigvalsh(covariance).min() < -scale:
            raise UsageError("covariance has a negative eigenvalue")
        covariance.setflags(write=False)
        object.__setattr__(self, "covariance", covariance)


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
        blocks = [self.joints, self.dimensions, self.registration]
        total = np.zeros((len(self.names), len(self.names)))
        start = 0
        for block in blocks:
            end = start + len(block.names)
            total[start:end, start:end] = block.covariance
            start = end
        return total


def read_uncertainty(path: str | Path, robot: Robot) -> Uncertainty:
    """The uncertainties of a file, checked against the robot's names.

    Raises:
        InputError: The file cannot be used; one line that says where and why.
    """
    document = _document(Path(path))
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
        if set(given) != {"names", "covariance"}:
            raise UsageError(f"{where} needs names and covariance, and nothing else")
        names = given["names"]
        if not isinstance(names, list):
            raise UsageError(f"{where}: names is no list")
        _check_names(names, kinds, where)
        try:
            covariance = np.array(given["covariance"], dtype=np.float64)
        except (ValueError, TypeError) as error:
            raise UsageError(f"{where}: covariance is no matrix of numbers") from error
        return Block(tuple(names), covariance.reshape(covariance.shape or (1,)))
    _check_names(list(given), kinds, where)
    sizes = [_size(value, kinds[name], name) for name, value in given.items()]
    return Block(tuple(given), np.diag(np.square(sizes)) if sizes else np.zeros((0, 0)))


def _check_names(names: list[Any], kinds: Mapping[str, bool], where: str) -> None:
    for name in names:
        if name not in kinds:
            kind = {"joints": "joint", "dimensions": "argument"}.get(where, "direction")
            raise UnknownNameError(kind, str(name), kinds)


def _size(value: Any, is_angle: bool, name: str) -> float:
    if isinstance(value, str):
        size = parse_angle(value) if is_angle else parse_length(value)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        size = float(value)
    else:
        raise UsageError(f"{name}: {value!r} is no standard deviation")
    if not (math.isfinite(size) and size >= 0.0):
        raise UsageError(f"{name}: a standard deviation is 0 or more, not {value!r}")
    return size


def _document(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from error
    if len(content) > MAX_BYTES:
        raise InputError(path, f"is larger than {MAX_BYTES} bytes")
    try:
        document = json.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise InputError(path, f"no JSON: {error}") from error
    if not isinstance(document, dict):
        raise InputError(path, "is no JSON object")
    return document
