"""Surfaces of CRANE's parts, at three levels of detail.

No drawing of the robot is published. These parts follow the text of [CRANE] section
III: a gross stage outside the bore, a thin tube, in-bore links of less than 16 cm^2 in
cross-section, an insertion mechanism with a guide bushing and two needle clutches. All
dimensions but those of Table IV are assumed (urdf/crane/README.md).

Every part is drawn as it stands at q = 0, x along the arm, y to its left, z up, from
the origin of its own joint's frame, and then turned into that frame. Bodies of one part
stand 0.1 mm apart, so that no surface cuts another.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from borecheck.plugin import BorecheckError, TriangleMesh
from borecheck_models.shapes import Detail, box, cylinder, joined, lofted, revolved

Array = NDArray[np.float64]

GAP = 1e-4  # between bodies of one part, [m]

TUBE_RADIUS = 0.019  # carbon tube, outer diameter 38 mm, assumed after its precursor
TUBE_START = -0.93  # where the slide holds the tube, from the pitch axis, assumed
LINK = 0.07  # Table IV, rows 6 and 7
OFFSET = 0.03  # Table IV, row 7: the needle's side
LINE = 0.01  # Table IV, row 8: the needle above the axis of q7
GUIDE = 0.02  # Table IV, row 8: the end of the guide bushing

NEEDLE_RADIUS = 0.915e-3  # 15 gauge, section VI-B2
NEEDLE_POINT = 3e-3  # length of the needle's point, assumed
CLUTCHES = 0.09  # of the needle behind frame 8, for the two clutches, assumed
FLOOR = -0.998  # 2 mm above the floor, 1 m below the isocentre, assumed
RAIL_HEIGHT = -0.262  # of the couch's side rails below the isocentre, assumed

_X, _Y, _Z = np.eye(3)
# Axes of each joint's frame at q = 0, as columns, in the base's axes (kinematics.py).
AXES: Mapping[str, Array] = {
    "W": np.column_stack([_X, _Y, _Z]),
    "1": np.column_stack([_X, _Z, -_Y]),
    "2": np.column_stack([_Y, -_X, _Z]),
    "3": np.column_stack([_Y, _Z, _X]),
    "4": np.column_stack([_Z, -_Y, _X]),
    "5": np.column_stack([_X, -_Z, _Y]),
    "6": np.column_stack([_X, _Y, _Z]),
    "7": np.column_stack([_Z, _X, _Y]),
    "8": np.column_stack([_Z, -_Y, _X]),
}


@dataclass(frozen=True)
class Level:
    """Fineness of the stages, of what goes into the bore, and of the needle."""

    stage: Detail
    arm: Detail
    needle: Detail


LEVELS = {
    "coarse": Level(Detail(inf, 10, 1), Detail(inf, 12, 1), Detail(inf, 6, 1)),
    "middle": Level(Detail(0.06, 24, 2), Detail(0.012, 28, 2), Detail(0.003, 8, 1)),
    "fine": Level(Detail(0.03, 48, 3), Detail(0.005, 64, 3), Detail(0.001, 12, 1)),
}


def build(level: str, arguments: Mapping[str, str]) -> dict[str, TriangleMesh]:
    """The meshes of all parts, each in its link's frame.

    Args:
        level: "coarse", "middle" or "fine".
        arguments: Xacro arguments; `stand`, `needle_length` and `needle_ahead` shape.

    Returns:
        Mesh by file stem, which is the link's name; closed, outward, [m].

    Raises:
        BorecheckError: A needle that the guide and its clutches cannot hold.
    """
    detail = LEVELS[level]
    length = float(arguments["needle_length"])
    ahead = float(arguments["needle_ahead"])
    _refuse_needle(length, ahead)
    stage: dict[str, tuple[str, Callable[[Detail], list[TriangleMesh]]]] = {
        "trolley": ("1", _trolley),
        "mast": ("2", _mast),
        "slide": ("3", _slide),
    }
    arm: dict[str, tuple[str, Callable[[Detail], list[TriangleMesh]]]] = {
        "tube": ("4", _tube),
        "back": ("5", _back),
        "mid": ("6", _mid),
        "tip": ("7", _tip),
        "carriage": ("8", _carriage),
    }
    parts = {"portal": ("W", _portal(detail.stage, arguments["stand"]))}
    parts |= {name: (f, shape(detail.stage)) for name, (f, shape) in stage.items()}
    parts |= {name: (f, shape(detail.arm)) for name, (f, shape) in arm.items()}
    parts["needle"] = ("8", [_needle(detail.needle, length, ahead)])
    return {
        name: joined(name, bodies).moved(_turned_into(frame))
        for name, (frame, bodies) in parts.items()
    }


def _refuse_needle(length: float, ahead: float) -> None:
    """What the xacro file refuses too, before a mesh is made of it."""
    if not 0.1 <= length <= 0.25:
        raise BorecheckError(
            f"argument needle_length={length:g}: it must lie between 0.1 and 0.25 m"
        )
    if not 0.0 <= ahead <= length - CLUTCHES:
        raise BorecheckError(
            f"argument needle_ahead={ahead:g}: of a needle of {length:g} m it is 0 to "
            f"{length - CLUTCHES:.3g} m, as two clutches hold {CLUTCHES} m"
        )


def _turned_into(frame: str) -> Array:
    T = np.eye(4)
    T[:3, :3] = AXES[frame].T
    return T


def _portal(detail: Detail, stand: str) -> list[TriangleMesh]:
    """Two posts beside the couch and the beam over it, of the stage across (q1)."""
    foot = FLOOR if stand == "floor" else RAIL_HEIGHT
    bodies = [box((-1.26, -0.56, 0.47), (-1.14, 0.56, 0.60), detail, 0.01)]
    for side in (-1.0, 1.0):
        low, high = sorted((side * 0.46, side * 0.54))
        bodies.append(
            box(
                (-1.25, low, foot + 0.04 + GAP), (-1.15, high, 0.47 - GAP), detail, 0.01
            )
        )
        # on the floor a foot as long as the reach asks for; on the couch a clamp
        inner = 0.44 if stand == "floor" else 0.22
        low, high = sorted((side * inner, side * 0.56))
        ahead = -0.80 if stand == "floor" else -1.12
        bodies.append(box((-1.40, low, foot), (ahead, high, foot + 0.04), detail, 0.01))
    return bodies


def _trolley(detail: Detail) -> list[TriangleMesh]:
    """Rides across on the beam's front face and guides the mast."""
    return [box((-1.139, -0.08, 0.46), (-1.12, 0.08, 0.61), detail, 0.004)]


def _mast(detail: Detail) -> list[TriangleMesh]:
    """The upright stage (q2), and the rail of the stage along the arm (q3)."""
    return [
        box((-1.119, -0.05, 0.16 + GAP), (-1.02, 0.05, 1.00), detail, 0.008),
        box((-1.119, -0.045, 0.06), (-0.30, 0.045, 0.16), detail, 0.008),
    ]


def _slide(detail: Detail) -> list[TriangleMesh]:
    """Carriage under the rail, with the trunnion's drive and the cables' motors."""
    end = TUBE_START
    return [
        box((end - 0.14, -0.05, -0.03), (end, 0.05, 0.055), detail, 0.006),
        cylinder((end + GAP, 0, 0), (end + 0.03, 0, 0), 0.027, detail),
    ]


def _tube(detail: Detail) -> list[TriangleMesh]:
    """Turns with q4: the carbon tube, drawn solid, and the fork of the pitch axis."""
    start = TUBE_START + 0.03 + 5e-4
    return [
        cylinder((start, 0, 0), (-0.036, 0, 0), TUBE_RADIUS, detail),
        *_fork(detail, -0.036 + GAP, 0.012, "y"),
    ]


def _back(detail: Detail) -> list[TriangleMesh]:
    """Turns with q5: hub in the tube's fork, bar, fork of the yaw axis."""
    return [
        _hub(detail, 0.0, "y"),
        box((0.0107, -0.008, -0.009), (0.049, 0.008, 0.009), detail, 0.002),
        *_fork(detail, 0.049 + GAP, LINK + 0.010, "z"),
    ]


def _mid(detail: Detail) -> list[TriangleMesh]:
    """Turns with q6: hub in the fork, bar, bearing of the tip's shaft to the left."""
    return [
        _hub(detail, 0.0, "z"),
        box((0.0107, -0.008, -0.008), (0.0585, 0.008, 0.008), detail, 0.002),
        cylinder((LINK, -0.009, 0), (LINK, 0.0145, 0), 0.0108, detail),
    ]


def _tip(detail: Detail) -> list[TriangleMesh]:
    """Turns with q7: side plate, guide bushing, brake clutch, rail of the insertion."""
    plate = (-0.0150, -0.0100)
    return [
        box((-0.088, plate[0], -0.006), (GUIDE, plate[1], 0.030), detail, 0.002),
        _ring(detail, 0.004, GUIDE, 0.0022, 0.0075, LINE),
        _ring(detail, -0.086, -0.072, 0.0022, 0.0070, LINE),
        box((-0.086, plate[1] + GAP, 0.0190), (0.002, 0.004, 0.0250), detail),
    ]


def _carriage(detail: Detail) -> list[TriangleMesh]:
    """Moves with q8 along the rail: the driving needle clutch, drawn in frame 8."""
    return [_ring(detail, -0.0905, -0.0785, 0.0014, 0.0070, 0.0)]


def _needle(detail: Detail, length: float, ahead: float) -> TriangleMesh:
    """The whole needle as gripped, along x of the arm at q = 0, from frame 8."""
    profile = [
        (0.0, ahead - length),
        (NEEDLE_RADIUS, ahead - length),
        (NEEDLE_RADIUS, ahead - NEEDLE_POINT),
        (0.0, ahead),
    ]
    return revolved(profile, detail).moved(_along_x(0.0))


def _hub(detail: Detail, x: float, axis: str) -> TriangleMesh:
    """A short cylinder about a joint's axis, 18 mm wide, which holds its pulley."""
    half = 0.009 * (_Y if axis == "y" else _Z)
    at = np.array([x, 0.0, 0.0])
    return cylinder(at - half, at + half, 0.0105, detail)


def _fork(detail: Detail, start: float, end: float, axis: str) -> list[TriangleMesh]:
    """A cross-piece and two cheeks beside the hub of the next joint, 28 mm wide."""
    yoke = start + 0.006
    if axis == "y":
        cross = box((start, -0.014, -0.010), (yoke, 0.014, 0.010), detail, 0.002)
    else:
        cross = box((start, -0.010, -0.014), (yoke, 0.010, 0.014), detail, 0.002)
    cheeks = []
    for side in (-1.0, 1.0):
        low, high = sorted((side * 0.0100, side * 0.0140))
        if axis == "y":
            lower, upper = (yoke + GAP, low, -0.010), (end, high, 0.010)
        else:
            lower, upper = (yoke + GAP, -0.010, low), (end, 0.010, high)
        cheeks.append(box(lower, upper, detail, 0.001))
    return [cross, *cheeks]


def _ring(
    detail: Detail, start: float, end: float, inner: float, outer: float, height: float
) -> TriangleMesh:
    """A bushing along x about the needle's line: the needle passes without touching.

    The outer polygon goes around its circle, the inner one within the hole's wall: a
    coarse bushing has a little more matter than the true one, never less.
    """
    n = detail.segments
    angles = np.arange(n) * (2.0 * np.pi / n)
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(n)])
    around = outer / np.cos(np.pi / n)
    rings = [
        radius * circle + z * _Z
        for radius, z in ((around, start), (around, end), (inner, end), (inner, start))
    ]
    return lofted(np.array(rings)).moved(_along_x(height))


def _along_x(height: float) -> Array:
    """Z of a solid of revolution becomes x; its axis lies `height` above the x axis."""
    T = np.eye(4)
    T[:3, :3] = np.column_stack([_Y, _Z, _X])
    T[2, 3] = height
    return T
