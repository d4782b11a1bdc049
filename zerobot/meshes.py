"""Surfaces of Zerobot's parts, at three levels of detail.

The STL data of the real robot are not published. These parts are shaped after the
text of [Matsuno2020]: a base with column, three linear stages, an end-effector about
900 mm long made of thin beams, a parallel mechanism that keeps the drives away from
the scan plane, a needle holder with an upper cover, a needle 1.1 mm thick. All
dimensions but the needle's diameter are assumed (urdf/zerobot/README.md).

Every part is drawn in its own link's frame: x forward (towards the gantry), y left,
z up, at q = 0. Where a part consists of several bodies they stand 0.1 mm apart, so
that no surface cuts another.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf

from borecheck.plugin import TriangleMesh
from borecheck_models.shapes import Detail, box, cylinder, joined, revolved

Corner = tuple[float, float, float]

GAP = 1e-4  # between bodies of one part, [m]

NEEDLE_DIAMETER = 1.1e-3  # "approximately 1.1 mm", [Matsuno2020] section 4.3
NEEDLE_POINT = 3e-3  # length of the needle's point, assumed

PIVOT_DROP = 0.06  # tilt axis below the arm's axis, l2
ROD_LENGTH = 0.84  # between the axes of crank and needle holder
CRANK = 0.05  # from the tilt axis to a rod, up or down
ROD_SIDE = 0.047  # rods beside the arm's mid-plane


@dataclass(frozen=True)
class Level:
    """Fineness of the stages, of the end-effector and of the needle."""

    stages: Detail
    arm: Detail
    needle: Detail


LEVELS = {
    "coarse": Level(Detail(inf, 8, 1), Detail(inf, 8, 1), Detail(inf, 6, 1)),
    "middle": Level(Detail(0.06, 20, 2), Detail(0.014, 12, 2), Detail(0.003, 6, 1)),
    "fine": Level(Detail(0.0215, 48, 4), Detail(0.006, 28, 3), Detail(0.001, 10, 1)),
}


def build(level: str, arguments: Mapping[str, str]) -> dict[str, TriangleMesh]:
    """The meshes of all parts, each in its link's frame.

    Args:
        level: "coarse", "middle" or "fine": about 2, 20 and 100 thousand triangles.
        arguments: Xacro arguments; `needle_length` [m] is the only one that shapes.

    Returns:
        Mesh by file stem, which is the link's name; closed, outward, [m].
    """
    detail = LEVELS[level]
    stages = {"base": _base, "lift": _lift, "slide": _slide, "cross": _cross}
    tools: dict[str, Callable[[Detail], list[TriangleMesh]]] = {
        "arm": _arm,
        "crank": _crank,
        "rod_a": _rod,
        "rod_b": _rod,
        "holder": _holder,
        "carriage": _carriage,
    }
    parts = {name: shape(detail.stages) for name, shape in stages.items()}
    parts |= {name: shape(detail.arm) for name, shape in tools.items()}
    parts["needle"] = [_needle(float(arguments["needle_length"]), detail.needle)]
    return {name: joined(name, bodies) for name, bodies in parts.items()}


def _base(detail: Detail) -> list[TriangleMesh]:
    """Foot plate on feet, column, control cabinet; the floor is at z = -1.26."""
    feet = [
        cylinder((x, y, -1.26), (x, y, -1.245 - GAP), 0.035, detail)
        for x in (-0.48, 0.08)
        for y in (-0.95, -0.49)
    ]
    return [
        *feet,
        box((-0.55, -1.02, -1.245), (0.15, -0.42, -1.19), detail, 0.012),
        box((-0.31, -0.86, -1.19 + GAP), (-0.07, -0.72, 0.46), detail, 0.015),
        box((-0.32, -0.87, 0.46 + GAP), (-0.06, -0.718, 0.485), detail, 0.008),
        box((-0.52, -0.98, -1.19 + GAP), (-0.31 - GAP, -0.60, -0.70), detail, 0.02),
        *_rails((-0.26, -0.235), (-0.72 + GAP, -0.708), (-0.60, 0.44), detail),
        *_rails((-0.145, -0.12), (-0.72 + GAP, -0.708), (-0.60, 0.44), detail),
    ]


def _lift(detail: Detail) -> list[TriangleMesh]:
    """Stage of q1: a shoe on the column and the beam that carries q2 along x."""
    return [
        box((-0.28, -0.705, -0.12), (-0.10, -0.685, 0.12), detail),
        box((-0.50, -0.685 + GAP, -0.05), (0.16, -0.605, 0.05), detail, 0.008),
        cylinder((-0.60, -0.645, 0.0), (-0.50 - GAP, -0.645, 0.0), 0.035, detail),
        *_rails((-0.48, 0.14), (-0.605 + GAP, -0.597), (0.015, 0.03), detail),
        *_rails((-0.48, 0.14), (-0.605 + GAP, -0.597), (-0.03, -0.015), detail),
    ]


def _slide(detail: Detail) -> list[TriangleMesh]:
    """Stage of q2: a shoe on the beam of q1 and the beam that carries q3 along y."""
    return [
        box((-0.23, -0.594, -0.06), (-0.11, -0.575, 0.06), detail),
        box((-0.21, -0.575 + GAP, -0.04), (-0.13, 0.34, 0.04), detail, 0.008),
        cylinder((-0.17, 0.34 + GAP, 0.0), (-0.17, 0.41, 0.0), 0.03, detail),
        *_rails((-0.13 + GAP, -0.122), (-0.33, 0.33), (0.012, 0.026), detail),
        *_rails((-0.13 + GAP, -0.122), (-0.33, 0.33), (-0.026, -0.012), detail),
    ]


def _cross(detail: Detail) -> list[TriangleMesh]:
    """Stage of q3: plate, bearing and motor of the arm's roll q4."""
    return [
        box((-0.119, -0.065, -0.06), (-0.104, 0.065, 0.06), detail),
        cylinder((-0.104 + GAP, 0.0, 0.0), (-0.003, 0.0, 0.0), 0.05, detail),
        box((-0.10, -0.035, 0.055), (-0.02, 0.035, 0.12), detail, 0.01),
    ]


def _arm(detail: Detail) -> list[TriangleMesh]:
    """Drive box, cover of the drives, two carbon tubes, the fork of the tilt axis."""
    tubes = [
        cylinder((-0.79 + GAP, y, 0.0), (-0.018 - GAP, y, 0.0), 0.011, detail)
        for y in (-0.020, 0.020)
    ]
    fork = [
        box((-0.018, y - 0.004, -0.075), (0.018, y + 0.004, 0.012), detail)
        for y in (-0.020, 0.020)
    ]
    braces = [
        box((x - 0.01, -0.0075, -0.006), (x + 0.01, 0.0075, 0.006), detail)
        for x in (-0.55, -0.30)
    ]
    return [
        cylinder((-0.90, 0.0, 0.0), (-0.886, 0.0, 0.0), 0.04, detail),
        box((-0.886 + GAP, -0.03, -0.10), (-0.79, 0.03, 0.04), detail, 0.008),
        box((-0.875, -0.05, 0.04 + GAP), (-0.62, 0.05, 0.165), detail, 0.012),
        *tubes,
        *braces,
        *fork,
    ]


def _crank(detail: Detail) -> list[TriangleMesh]:
    """Shaft through the drive box with a lever for each rod; origin on its axis."""
    shaft = cylinder((0.0, -0.034 + GAP, 0.0), (0.0, 0.034 - GAP, 0.0), 0.008, detail)
    return [shaft, *_levers(detail)]


def _rod(detail: Detail) -> list[TriangleMesh]:
    """A level rod from the crank's lever to the needle holder's, with two eyes."""
    eyes = [
        cylinder((x, -0.0045, 0.0), (x, 0.0045, 0.0), 0.009, detail)
        for x in (0.0, ROD_LENGTH)
    ]
    ends = (0.0099, 0.0, 0.0), (ROD_LENGTH - 0.0099, 0.0, 0.0)
    return [cylinder(*ends, 0.004, detail), *eyes]


def _holder(detail: Detail) -> list[TriangleMesh]:
    """What tilts by q5: hub, levers, rail of the needle carriage, upper cover."""
    pins = [
        cylinder((0.0, side * 0.0146, 0.0), (0.0, side * (0.034 - GAP), 0.0), r, detail)
        for side, r in ((-1.0, 0.006), (1.0, 0.006))
    ]
    skirts = [
        box((0.02, min(a, b), 0.045), (0.067 - GAP, max(a, b), 0.076 - GAP), detail)
        for a, b in ((0.037, 0.045), (-0.037, -0.045))
    ]
    return [
        cylinder((0.0, -0.0145, 0.0), (0.0, 0.0145, 0.0), 0.0125, detail),
        *pins,
        *_levers(detail),
        box((0.014, -0.012, -0.160), (0.026, 0.012, 0.03), detail),
        box((0.014, -0.0065, 0.03 + GAP), (0.026, 0.0065, 0.076 - GAP), detail),
        box((0.014, -0.045, 0.076), (0.075, 0.045, 0.084), detail, 0.003),
        box((0.067, -0.045, 0.03), (0.075, 0.045, 0.076 - GAP), detail),
        *skirts,
    ]


def _levers(detail: Detail) -> list[TriangleMesh]:
    """One lever up on the left for rod a, one down on the right for rod b."""
    end = CRANK + 0.008
    return [
        box((-0.008, 0.034, -0.010), (0.008, 0.040, end), detail),
        box((-0.008, -0.040, -end), (0.008, -0.034, 0.010), detail),
    ]


def _carriage(detail: Detail) -> list[TriangleMesh]:
    """What q6 drives along the needle: slider, stem and the clamp of the needle."""
    return [
        box((0.0275, -0.0135, -0.022), (0.064, 0.0135, 0.022), detail, 0.002),
        cylinder((0.05, 0.0, -0.066 + GAP), (0.05, 0.0, -0.022 - GAP), 0.009, detail),
        cylinder((0.05, 0.0, -0.08), (0.05, 0.0, -0.066), 0.012, detail),
    ]


def _needle(length: float, detail: Detail) -> TriangleMesh:
    """The needle, its tip at the origin, 0.1 mm short of the clamp."""
    radius = NEEDLE_DIAMETER / 2.0
    top = length - GAP
    point = min(NEEDLE_POINT, 0.5 * top)
    return revolved([(0.0, 0.0), (radius, point), (radius, top), (0.0, top)], detail)


def _rails(
    x: tuple[float, float],
    y: tuple[float, float],
    z: tuple[float, float],
    detail: Detail,
) -> list[TriangleMesh]:
    lower, upper = zip(x, y, z, strict=True)
    return [box(lower, upper, detail)]
