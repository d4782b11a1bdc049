"""What a validation is asked to do."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from borecheck.errors import UnknownNameError, UsageError
from borecheck.robots.urdf.reach import Roots

PROFILES = ("kinematics", "collision", "dynamics")


@dataclass(frozen=True)
class RemoteCentre:
    """A point that stays where it is while some joints turn.

    Attributes:
        frame: The link that carries the point.
        point: The point in that frame, [m].
        joints: The joints that turn about it.
        tolerance: How far it may move, [m].
    """

    frame: str
    joints: tuple[str, ...]
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        _check_declared(self, ("frame",), ("point",))


@dataclass(frozen=True)
class ToolAxis:
    """A line that passes through a fixed point while some joints turn."""

    frame: str
    joints: tuple[str, ...]
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    through: tuple[float, float, float] = (0.0, 0.0, 0.0)
    base: str | None = None
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        words = ("frame",) if self.base is None else ("frame", "base")
        _check_declared(self, words, ("axis", "through"))
        if not any(self.axis):
            raise UsageError("axis is 0 0 0")


@dataclass(frozen=True)
class Loop:
    """Two frames that coincide for every configuration (a closed mechanism)."""

    first: str
    second: str
    tolerance: float = 1e-6

    def __post_init__(self) -> None:
        _check_declared(self, ("first", "second"), ())


def _check_declared(
    declared: Any, words: Sequence[str], vectors: Sequence[str]
) -> None:
    """Whether the fields are what they are said to be; each error names its field."""
    for name in words:
        value = getattr(declared, name)
        if not isinstance(value, str):
            raise UsageError(f"{name} is {value!r}, not the name of a link")
    for name in vectors:
        value = getattr(declared, name)
        if len(_items(value)) != 3 or len(_numbers(value)) != 3:
            raise UsageError(f"{name} is {_shown(value)}, not three numbers")
    joints = getattr(declared, "joints", ())
    if isinstance(joints, str) or not all(isinstance(j, str) for j in _items(joints)):
        raise UsageError(f"joints is {_shown(joints)}, not a list of names")
    if not any(number >= 0.0 for number in _numbers((declared.tolerance,))):
        raise UsageError(f"tolerance is {declared.tolerance!r}, not a length in m")


def _items(value: Any) -> tuple[Any, ...]:
    """What is in a list, tuple or array; what is none of them is wrong by itself."""
    is_one = isinstance(value, str) or not hasattr(value, "__len__")
    return (None,) if is_one else tuple(value)


def _numbers(values: Any) -> list[float]:
    """The finite numbers in a list."""
    found = [v for v in _items(values) if isinstance(v, Real)]
    return [float(v) for v in found if math.isfinite(v)]


def _shown(value: Any) -> str:
    return str(list(value)) if isinstance(value, tuple) else repr(value)


@dataclass(frozen=True)
class Options:
    """What a validation is asked to do.

    Attributes:
        profile: Which severities hold: kinematics, collision or dynamics.
        arguments: Values of xacro arguments.
        package_paths: Roots for `package://` and `$(find)`.
        allow_outside: Whether the file may read beyond its folder tree and the roots.
        select: Codes or beginnings of codes to report; all if empty.
        ignore: Codes or beginnings of codes to leave out.
        meshes: Whether mesh files are read.
        run: Whether the robot is loaded and moved in Pinocchio and yourdfpy.
        load_meshes: Whether Pinocchio and Coal load the collision meshes, too.
        containment: Whether containment or signed distance will be asked for: then
            an open mesh is an error.
        self_intersection: Whether meshes are searched for crossing faces.
        self_contact: How many configurations are sampled for self-contact; 0: none.
        samples: Random configurations for comparing kinematics.
        seed: Of the random configurations.
        frames: Frames that must exist.
        links: Links that must have collision geometry.
        remote_centres: Declared remote centres.
        tool_axes: Declared tool axes.
        loops: Declared loop closures.
        closed_form: `f({joint: position}) -> {frame: T_root_frame (4, 4)}`.
        reference: Another file of the same robot, compared joint by joint.
        srdf: A file whose names are checked against the robot.
    """

    profile: str = "collision"
    arguments: Mapping[str, str] = field(default_factory=dict)
    package_paths: tuple[Path, ...] = ()
    allow_outside: bool = False
    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    meshes: bool = True
    run: bool = True
    load_meshes: bool = False
    containment: bool = False
    self_intersection: bool = False
    self_contact: int = 0
    samples: int = 20
    seed: int = 0
    frames: tuple[str, ...] = ()
    links: tuple[str, ...] = ()
    remote_centres: tuple[RemoteCentre, ...] = ()
    tool_axes: tuple[ToolAxis, ...] = ()
    loops: tuple[Loop, ...] = ()
    closed_form: Callable[[Mapping[str, float]], Mapping[str, Any]] | None = None
    reference: Path | None = None
    srdf: Path | None = None

    def __post_init__(self) -> None:
        if self.profile not in PROFILES:
            raise UnknownNameError("profile", self.profile, PROFILES)
        for name in ("samples", "seed", "self_contact"):
            check_count(name, getattr(self, name))

    @property
    def roots(self) -> Roots:
        """Where files that the robot names may lie."""
        return Roots(self.package_paths, self.allow_outside)

    def wants(self, code: str) -> bool:
        """Whether findings of this code are to be reported."""
        if self.ignore and code.startswith(self.ignore):
            return False
        return not self.select or code.startswith(self.select)


def check_count(name: str, value: object) -> None:
    """Whether a number counts something.

    Raises:
        UsageError: It is no whole number, or below 0.
    """
    is_number = isinstance(value, Integral) and not isinstance(value, bool)
    if not (is_number and int(value) >= 0):  # type: ignore[call-overload]
        raise UsageError(f"{name} is {value!r}, not a whole number from 0 on")
