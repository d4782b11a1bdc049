"""The open 0.23 T magnet of [Heikkila2010]: description, surfaces, fringe field.

Two round poles above and below the patient on a C-shaped yoke; the column is at the
head end, so that both sides of the patient are open. Only the gap and the distances of
two field lines are published.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.plugin import Argument, ScannerDescription, TriangleMesh
from borecheck_models import data_folder
from borecheck_models.scanners.head import HEAD, MELON, ellipsoid
from borecheck_models.scanners.torso import torso
from borecheck_models.shapes import Detail, box, joined, lofted, revolved

Array = NDArray[np.float64]

GAP = 1e-4  # between bodies of one part, [m]

POLE_RADIUS = 0.60  # assumed
POLE_BEVEL = 0.04  # at the gap's rim, assumed
POLE_DEPTH = 0.45  # assumed
FLOOR = -1.0  # below the image centre, assumed

TABLE_HALF_WIDTH = 0.22  # assumed
COIL = (0.127, 0.139)  # radii of the head coil's holder, open above, assumed


@dataclass(frozen=True)
class Zone:
    """A sphere about the image centre outside which the field is weaker.

    Attributes:
        name: Field strength.
        radius: [m].
        meaning: What must stay outside.
        source: Where the radius is from.
    """

    name: str
    radius: float
    meaning: str
    source: str


# Not obstacles: a warning and a condition on where the base may stand.
ZONES = (
    Zone(
        "0.5 mT", 1.5, "robot controller, ordinary devices", "[Heikkila2010] section 2"
    ),
    Zone("2 mT", 1.0, "main body of the robot", "[Heikkila2010] section 2"),
    Zone(
        "20 mT",
        0.46,
        "motors 1 and 4 failed inside it",
        "field: [Heikkila2010] section 5; radius: 1/r^3 from 2 mT at 1 m",
    ),
)


def zones_of(points: ArrayLike) -> list[tuple[str, ...]]:
    """Names of the zones that each point (n, 3) in the scanner's frame lies in."""
    distance = np.linalg.norm(np.atleast_2d(np.asarray(points, dtype=float)), axis=1)
    return [tuple(z.name for z in ZONES if d < z.radius) for d in distance]


@dataclass(frozen=True)
class Level:
    """Fineness of magnet, table and phantoms."""

    magnet: Detail
    table: Detail
    phantom: Detail


LEVELS = {
    "coarse": Level(Detail(0.15, 48, 1), Detail(0.2, 24, 1), Detail(0.05, 32, 1)),
    "middle": Level(Detail(0.03, 160, 3), Detail(0.03, 64, 2), Detail(0.015, 96, 1)),
    "fine": Level(Detail(0.012, 400, 5), Detail(0.012, 160, 3), Detail(0.006, 208, 1)),
}


def build(level: str, arguments: Mapping[str, str]) -> dict[str, TriangleMesh]:
    """The meshes of magnet, table, coil and phantoms, each in its link's frame.

    Args:
        level: "coarse", "middle", "fine": about 8, 90 and 500 thousand triangles.
        arguments: Xacro arguments; gap [m] shapes the magnet.

    Returns:
        Mesh by file stem, which is the link's name; closed, outward, [m].
    """
    detail = LEVELS[level]
    half = 0.5 * float(arguments["gap"])
    bodies = {
        "magnet": _magnet(half, detail.magnet),
        "table": _table(detail.table),
        "pedestal": [
            box((0.80, -0.20, FLOOR + 0.002), (1.60, 0.20, -0.24), detail.table, 0.03)
        ],
        "coil": [_coil(detail.table)],
        "head": [ellipsoid(HEAD, detail.phantom)],
        "melon": [ellipsoid(MELON, detail.phantom)],
        "torso": [torso(0.95, detail.phantom)],
    }
    return {name: joined(name, parts) for name, parts in bodies.items()}


def _magnet(half_gap: float, detail: Detail) -> list[TriangleMesh]:
    """Two poles, the column behind the head, the arms of the C."""
    outer = half_gap + POLE_DEPTH
    straight = Detail(detail.edge, detail.segments, detail.arc)
    lower = _pole(half_gap, outer, detail)
    upper = TriangleMesh("pole", lower.vertices * (1.0, -1.0, -1.0), lower.triangles)
    return [
        lower,
        upper,
        box((-1.10, -0.45, -outer), (-0.70, 0.45, outer), straight, 0.05),
        box((-1.10, -0.40, outer + GAP), (0.30, 0.40, outer + 0.25), straight, 0.05),
        box((-1.10, -0.40, FLOOR), (0.30, 0.40, -outer - GAP), straight, 0.05),
    ]


def _pole(half_gap: float, outer: float, detail: Detail) -> TriangleMesh:
    """The lower pole; its rim towards the gap is rounded."""
    steps = np.linspace(0.0, 0.5 * pi, 2 * detail.arc + 1)
    rim = [
        (
            POLE_RADIUS - POLE_BEVEL * (1.0 - float(np.cos(a))),
            -half_gap - POLE_BEVEL * (1.0 - float(np.sin(a))),
        )
        for a in steps
    ]
    profile = [(0.0, -outer), (POLE_RADIUS, -outer), *rim, (0.0, -half_gap)]
    return revolved(profile, detail)


def _table(detail: Detail) -> list[TriangleMesh]:
    """The table top, its surface at z = 0, from the head (x = -0.2) to the feet."""
    return [
        box(
            (-0.20, -TABLE_HALF_WIDTH, -0.05),
            (1.80, TABLE_HALF_WIDTH, 0.0),
            detail,
            0.015,
        )
    ]


def _coil(detail: Detail) -> TriangleMesh:
    """The head holder with its coil: half a ring under the head, open above."""
    inner, outer = COIL
    angles = np.linspace(1.04 * pi, 1.96 * pi, max(detail.segments // 2, 12) + 1)
    section = [(inner, -0.05), (outer, -0.05), (outer, 0.05), (inner, 0.05)]
    rings = np.array(
        [[(x, r * np.cos(a), r * np.sin(a)) for r, x in section] for a in angles]
    )
    return lofted(rings, (rings[0].mean(axis=0), rings[-1].mean(axis=0)))


_FOLDER = data_folder("scanners", "mri_open_magnet")

DESCRIPTION = ScannerDescription(
    name="mri_open_magnet",
    title="Open 0.23 T magnet with table, head coil and head phantom",
    xacro=_FOLDER / "mri_open_magnet.urdf.xacro",
    arguments={
        "gap": Argument(
            "0.44",
            "between the poles; 44 cm in [Heikkila2010] section 2",
            choices=("0.44", "0.46", "0.50", "0.60"),
            quantity="length",
            shapes=True,
        ),
        "phantom": Argument(
            "head", "what is operated on", choices=("head", "melon", "none")
        ),
        "body": Argument("yes", "whether the torso is there", choices=("yes", "no")),
        "table": Argument("yes", "whether the table is there", choices=("yes", "no")),
        "coil": Argument(
            "yes", "whether the head coil is there", choices=("yes", "no")
        ),
        "zones": Argument(
            "no",
            "whether field lines are drawn (never obstacles)",
            choices=("yes", "no"),
        ),
    },
    meshes="borecheck_models.scanners.mri_open_magnet:build",
    shipped=_FOLDER / "meshes" / "coarse",
    not_modelled=(
        "a particular maker's housing",
        "face, neck, arms and legs of the patient, breathing",
        "magnetic field: the zones are named distances, never obstacles",
        "floor, cables, drapes, optical tracker, surgical staff",
    ),
    source="Heikkila2010",
    roles={
        "magnet": "scanner",
        "table": "couch",
        "pedestal": "couch",
        "coil": "scanner",
        "head": "patient",
        "melon": "patient",
        "torso": "patient",
    },
    joints={"table_height": 0.0, "table_travel": 0.0},
    points={
        "crown": "top of the head, normal outwards (z)",
        "temple_left": "+y side of the head, normal outwards (z)",
        "temple_right": "-y side of the head, normal outwards (z)",
        "forehead": "towards the upper pole, normal outwards (z)",
    },
)
