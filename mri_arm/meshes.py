"""Surfaces of the MRI arm's parts, at three levels of detail.

The outline of the real arm is not published but in photographs. These parts follow the
text of [Heikkila2010] section 2: a base on the floor, motors at the joints and those of
the last two at the third link, a forearm of 1000 mm in carbon, a wrist with a joystick,
a biopsy needle of 150 mm. All other dimensions are assumed (urdf/mri_arm/README.md).

Every part is drawn in its own joint's frame: x to the right, y the way the forearm
reaches, z up, at q = 0; carriage and needle in frame E, z along the needle. Bodies of
one part stand 0.1 mm apart, so that no surface cuts another.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from borecheck.plugin import TriangleMesh
from borecheck_models.shapes import Detail, box, cylinder, joined, revolved

Array = NDArray[np.float64]

GAP = 1e-4  # between bodies of one part, [m]

UPPER_ARM = 0.45  # axis 2 to axis 3
FOREARM = 1.0  # elbow to wrist, section 2
FLANGE = 0.10  # wrist to flange

NEEDLE_RADIUS = 1.05e-3  # a 14 G biopsy needle is 2.1 mm thick, assumed
NEEDLE_POINT = 4e-3  # length of the needle's point, assumed
RAIL_LENGTH = 0.14  # of the insertion axis, assumed
HUB = (0.008, 0.028)  # where the needle's hub lies behind the tip end of the flange


@dataclass(frozen=True)
class Level:
    """Fineness of the body, of forearm and wrist, and of the needle."""

    body: Detail
    arm: Detail
    needle: Detail


LEVELS = {
    "coarse": Level(Detail(inf, 12, 1), Detail(inf, 12, 1), Detail(inf, 6, 1)),
    "middle": Level(Detail(0.04, 32, 2), Detail(0.016, 24, 2), Detail(0.003, 8, 1)),
    "fine": Level(Detail(0.018, 72, 4), Detail(0.007, 56, 3), Detail(0.001, 12, 1)),
}


def build(level: str, arguments: Mapping[str, str]) -> dict[str, TriangleMesh]:
    """The meshes of all parts, each in its link's frame.

    Args:
        level: "coarse", "middle" or "fine": about 1, 15 and 100 thousand triangles.
        arguments: Xacro arguments; `needle_length` [m] and `needle_mount` shape.

    Returns:
        Mesh by file stem, which is the link's name; closed, outward, [m].
    """
    detail = LEVELS[level]
    length = float(arguments["needle_length"])
    square = arguments["needle_mount"] == "square"
    body: dict[str, Callable[[Detail], list[TriangleMesh]]] = {
        "base": _base,
        "turret": _turret,
        "upper_arm": _upper_arm,
        "elbow": _elbow,
    }
    arm: dict[str, Callable[[Detail], list[TriangleMesh]]] = {
        "forearm": _forearm,
        "wrist": _wrist,
    }
    parts = {name: shape(detail.body) for name, shape in body.items()}
    parts |= {name: shape(detail.arm) for name, shape in arm.items()}
    parts["hand"] = _hand(detail.arm, length, square)
    parts["carriage"] = [_carriage(detail.arm, length)]
    parts["needle"] = [_needle(detail.needle, length)]
    return {name: joined(name, bodies) for name, bodies in parts.items()}


def _base(detail: Detail) -> list[TriangleMesh]:
    """Work top on two props and the column of axis 1; the floor is at z = 0."""
    props = [
        box((x - 0.05, -0.25, 0.002), (x + 0.05, 0.25, 0.10), detail, 0.01)
        for x in (-0.22, 0.22)
    ]
    return [
        *props,
        box((-0.30, -0.30, 0.10 + GAP), (0.30, 0.30, 0.14), detail, 0.01),
        cylinder((0, 0, 0.14 + GAP), (0, 0, 0.40), 0.10, detail),
        box((-0.09, -0.28, 0.14 + GAP), (0.09, -0.12, 0.32), detail, 0.015),
    ]


def _turret(detail: Detail) -> list[TriangleMesh]:
    """Turns with q1: a turntable, two cheeks with the motor of axis 2."""
    cheeks = [
        box((min(a, b), -0.05, -0.10 + GAP), (max(a, b), 0.05, 0.05), detail, 0.008)
        for a, b in ((0.056, 0.076), (-0.056, -0.076))
    ]
    return [
        cylinder((0, 0, -0.199), (0, 0, -0.10), 0.095, detail),
        *cheeks,
        cylinder((0.076 + GAP, 0, 0), (0.17, 0, 0), 0.04, detail),
    ]


def _upper_arm(detail: Detail) -> list[TriangleMesh]:
    """Turns with q2: from the hub of axis 2 to the hub of axis 3."""
    return [
        cylinder((-0.052, 0, 0), (0.052, 0, 0), 0.045, detail),
        box((-0.034, -0.04, 0.0472), (0.034, 0.04, UPPER_ARM - 0.0472), detail, 0.01),
        cylinder((-0.034, 0, UPPER_ARM), (0.034, 0, UPPER_ARM), 0.044, detail),
    ]


def _elbow(detail: Detail) -> list[TriangleMesh]:
    """Turns with q3: cheeks, bearing of the forearm, motors of joints 3 to 6 behind."""
    cheeks = [
        box((min(a, b), -0.06, -0.045), (max(a, b), 0.06, 0.045), detail, 0.005)
        for a, b in ((0.038, 0.054), (-0.038, -0.054))
    ]
    return [
        *cheeks,
        box((-0.054, -0.28, -0.045), (0.054, -0.06 - GAP, 0.055), detail, 0.012),
        cylinder((0, 0.06 + GAP, 0), (0, 0.16, 0), 0.052, detail),
        cylinder((-0.13, 0, 0), (-0.054 - GAP, 0, 0), 0.035, detail),
    ]


def _forearm(detail: Detail) -> list[TriangleMesh]:
    """Turns with q4: the long carbon tube and the fork of axis 5."""
    cheeks = [
        box((min(a, b), 0.935, -0.022), (max(a, b), 1.022, 0.022), detail, 0.004)
        for a, b in ((0.031, 0.041), (-0.031, -0.041))
    ]
    return [
        cylinder((0, 0.16 + GAP, 0), (0, 0.905, 0), 0.034, detail),
        box((-0.041, 0.905 + GAP, -0.028), (0.041, 0.935 - GAP, 0.028), detail, 0.004),
        *cheeks,
    ]


def _wrist(detail: Detail) -> list[TriangleMesh]:
    """Turns with q5: hub in the fork, bearing of axis 6."""
    return [
        cylinder((-0.030, 0, 0), (0.030, 0, 0), 0.024, detail),
        cylinder((0, 0.0249, 0), (0, 0.05, 0), 0.021, detail),
    ]


def _hand(detail: Detail, length: float, square: bool) -> list[TriangleMesh]:
    """Turns with q6: flange, joystick, rail of the insertion axis."""
    end = FLANGE - 0.015 if square else FLANGE
    T_hand_E = np.eye(4)
    if square:
        T_hand_E[:3, :3] = np.diag([1.0, -1.0, -1.0])
        T_hand_E[:3, 3] = 0.0, FLANGE, -length
        bracket = box((-0.030, end + GAP, -0.03), (-0.018, 0.0935, 0.03), detail)
    else:
        T_hand_E[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
        T_hand_E[:3, 3] = 0.0, FLANGE + length, 0.0
        bracket = box((-0.030, end + GAP, -0.02), (-0.018, end + 0.006, 0.02), detail)
    start = -length - 0.01 if square else -length + 0.0065
    rail = box(
        (-0.030, -0.006, start),
        (-0.018, 0.006, -length + RAIL_LENGTH),
        detail,
    )
    return [
        cylinder((0, 0.05 + GAP, 0), (0, end, 0), 0.024, detail),
        bracket,
        rail.moved(T_hand_E),
        cylinder((0.0252, 0.068, 0), (0.085, 0.068, 0), 0.009, detail),
    ]


def _carriage(detail: Detail, length: float) -> TriangleMesh:
    """Hub of the needle on the rail; drawn in frame E."""
    return box(
        (-0.0175, -0.008, -length + HUB[0]), (0.008, 0.008, -length + HUB[1]), detail
    )


def _needle(detail: Detail, length: float) -> TriangleMesh:
    """The free needle, its tip at the origin of frame E."""
    back = -length + HUB[1] + GAP
    profile = [
        (0.0, back),
        (NEEDLE_RADIUS, back),
        (NEEDLE_RADIUS, -NEEDLE_POINT),
        (0.0, 0.0),
    ]
    return revolved(profile, detail)
