"""A robot or a scanner as data: what a package that brings one fills in."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from borecheck.core.units import parse_angle, parse_length
from borecheck.errors import UsageError

LEVELS = ("coarse", "middle", "fine")

ROLES = ("scanner", "couch", "patient", "other")


@dataclass(frozen=True)
class Argument:
    """An argument of a xacro file.

    Attributes:
        default: The text xacro gets when the user says nothing.
        meaning: One line for `borecheck robots`, with the source of the default.
        choices: The allowed texts, or empty for any quantity.
        quantity: "length" or "angle": the user may type a unit; xacro gets SI.
        shapes: Whether meshes depend on it, so that they are generated for it.
    """

    default: str
    meaning: str
    choices: tuple[str, ...] = ()
    quantity: str | None = None
    shapes: bool = False

    def value(self, name: str, text: str) -> str:
        """The text for xacro, checked against the choices, in SI.

        Raises:
            UsageError: Not among the choices, or no such quantity.
        """
        if self.quantity is not None:
            parse = parse_length if self.quantity == "length" else parse_angle
            text = repr(parse(text))
        if self.choices and text not in self.choices:
            number = _same_number(text, self.choices)
            if number is None:
                listed = ", ".join(self.choices)
                raise UsageError(f"argument {name}={text} is none of {listed}")
            text = number
        return text


def _same_number(text: str, choices: Sequence[str]) -> str | None:
    """The choice that is the same number (`90` for `+90`), if there is one."""
    try:
        value = float(text)
    except ValueError:
        return None
    for choice in choices:
        try:
            if abs(float(choice) - value) < 1e-12:
                return choice
        except ValueError:
            continue
    return None


@dataclass(frozen=True)
class JointMap:
    """Bridge between the paper's joint variable and a joint of the URDF.

    q_urdf = sign * q_paper + offset; `source` says where that is read from.
    """

    name: str
    sign: float = 1.0
    offset: float = 0.0
    source: str = ""


@dataclass(frozen=True)
class Solutions:
    """What the inverse hook of a robot gives for a needle.

    Attributes:
        configurations: Those within the limits, each (joints,); may be empty.
        rejected: One line for every other branch: which limits it breaks, by how much.
        complete: Whether there are no others with that insertion, turns of a joint
            about the needle's own axis left aside.
    """

    configurations: tuple[NDArray[np.float64], ...]
    rejected: tuple[str, ...]
    complete: bool = False

    def __repr__(self) -> str:
        found, others = len(self.configurations), len(self.rejected)
        why = f": {self.rejected[0]}" if self.rejected and not found else ""
        return f"<Solutions: {found} within the limits, {others} rejected{why}>"


@dataclass(frozen=True, kw_only=True)
class Description:
    """What robots and scanners have in common.

    Attributes:
        name: As typed on the command line.
        title: One line for people.
        xacro: The file the URDF is made from.
        arguments: Arguments of the xacro file by name (mesh_dir is not among them).
        meshes: Hook `build(level, arguments) -> {file stem: TriangleMesh}`; empty if
            the file names its meshes itself, or is drawn with primitives.
        shipped: Folder with the coarse meshes of the default arguments, where the
            hook makes meshes.
        not_modelled: What no verdict about it covers, a phrase each.
        source: The publication, as a key of docs/references.md.
    """

    name: str
    title: str
    xacro: Path
    arguments: Mapping[str, Argument] = field(default_factory=dict)
    meshes: str = ""
    shipped: Path | None = None
    not_modelled: tuple[str, ...]
    source: str


@dataclass(frozen=True, kw_only=True)
class RobotDescription(Description):
    """A needle robot.

    Attributes:
        home: Joint positions [m] or [rad] by URDF joint, clear of its own scanner.
        scanner: The scanner it is drawn for.
        needle_link: The link that may enter the patient along a plan's corridor.
        needle_radius: Half the needle's thickness, [m]: the corridor is so wide.
        tool_frame: The frame at the needle tip, z along the needle.
        base_frame: The frame that coincides with the scanner's frame.
        allowed_contacts: Pairs of links that may touch, with the reason.
        joints: The paper's joint variables in order, with the bridge to the URDF.
        frames: The paper's frame names and their links in the URDF.
        forward: Hook `forward(q (n,), **arguments) -> {frame: T_world_frame (4, 4)}`
            of the closed form (q of the paper), or None.
        inverse: Hook `inverse(tip (3,), direction (3,), insertion, **arguments)`
            that gives `Solutions`, or an object of that form; or None.
        dimensions: Hook `dimensions(**arguments) -> {name: value}` of the closed form.
        family: Hook `family(**arguments)` of a redundant arm: all configurations for a
            needle by coordinates of their own; or None.
        about_target: Hook `about_target(**arguments)` that gives the robot's chart of
            needle directions and bounds about a target, see docs/directions.md; or
            None.
        closed_form_arguments: Names of the xacro arguments the closed form takes.
        insertion_joint: The joint that drives the needle, or None.
    """

    home: Mapping[str, float] = field(default_factory=dict)
    scanner: str | None = None
    needle_link: str | None = None
    needle_radius: float = 0.0
    tool_frame: str | None = None
    base_frame: str | None = None
    allowed_contacts: tuple[tuple[str, str, str], ...] = ()
    joints: tuple[JointMap, ...] = ()
    frames: Mapping[str, str] = field(default_factory=dict)
    forward: str | None = None
    inverse: str | None = None
    dimensions: str | None = None
    family: str | None = None
    about_target: str | None = None
    closed_form_arguments: tuple[str, ...] = ()
    insertion_joint: str | None = None


@dataclass(frozen=True, kw_only=True)
class ScannerDescription(Description):
    """A scanner with its couch and patient.

    Attributes:
        roles: Role of every link that has geometry: scanner, couch, patient, other.
        joints: Joint positions [m] or [rad] a scene stands at by default; joints
            are set like arguments (`--scene-arg couch_travel=0.2m`).
        points: Named points (frames in the URDF) and what they are.
    """

    roles: Mapping[str, str] = field(default_factory=dict)
    joints: Mapping[str, float] = field(default_factory=dict)
    points: Mapping[str, str] = field(default_factory=dict)
