"""A CT gantry with couch and torso phantom as data, and its meshes."""

from collections.abc import Mapping
from dataclasses import dataclass

from borecheck.plugin import Argument, ScannerDescription, TriangleMesh
from borecheck_models import data_folder
from borecheck_models.scanners.gantry import couch_top, gantry, stand
from borecheck_models.scanners.torso import torso
from borecheck_models.shapes import Detail, box, joined


@dataclass(frozen=True)
class Level:
    """Rings around the bore, and the fineness of everything else."""

    around: int
    edge: float
    couch: Detail
    torso: Detail


LEVELS = {
    "coarse": Level(64, 0.085, Detail(0.16, 32, 1), Detail(0.05, 32, 1)),
    "middle": Level(200, 0.0195, Detail(0.03, 80, 2), Detail(0.0148, 96, 1)),
    "fine": Level(448, 0.0086, Detail(0.013, 176, 3), Detail(0.0066, 208, 1)),
}


def build(level: str, arguments: Mapping[str, str]) -> dict[str, TriangleMesh]:
    """The meshes of gantry, stand, couch and torso, each in its link's frame.

    Args:
        level: "coarse", "middle", "fine": about 10, 100 and 500 thousand triangles.
        arguments: Xacro arguments; bore, depth and girth [m] shape the meshes.

    Returns:
        Mesh by file stem, which is the link's name; closed, outward, [m].
    """
    detail = LEVELS[level]
    bore, depth = float(arguments["bore"]), float(arguments["depth"])
    bodies = {
        "gantry": [gantry(bore / 2.0, depth, detail.around, detail.edge)],
        "stand": stand(detail.couch),
        "couch_base": [
            box((-2.05, -0.22, -0.98), (-0.95, 0.22, -0.45), detail.couch, 0.03)
        ],
        "couch_lift": [
            box((-1.85, -0.17, -0.30), (-1.05, 0.17, -0.07), detail.couch, 0.02)
        ],
        "couch": [couch_top(detail.couch)],
        "torso": [torso(float(arguments["girth"]), detail.torso)],
    }
    return {name: joined(name, parts) for name, parts in bodies.items()}


_FOLDER = data_folder("scanners", "ct_gantry")

DESCRIPTION = ScannerDescription(
    name="ct_gantry",
    title="CT gantry with couch and torso phantom",
    xacro=_FOLDER / "ct_gantry.urdf.xacro",
    arguments={
        "bore": Argument(
            "0.78",
            "diameter of the bore's throat; 0.70 to 0.85 m are on the market",
            choices=("0.70", "0.78", "0.80", "0.85"),
            quantity="length",
            shapes=True,
        ),
        "depth": Argument(
            "0.95",
            "from front cover to rear cover; assumed",
            choices=("0.90", "0.95", "1.00"),
            quantity="length",
            shapes=True,
        ),
        "tilt": Argument(
            "0",
            "of the gantry about y through the isocentre, within +-30 deg",
            quantity="angle",
        ),
        "girth": Argument(
            "0.95",
            "largest girth of the torso phantom, 0.6 to 1.6 m; assumed",
            quantity="length",
            shapes=True,
        ),
        "couch": Argument("yes", "whether the couch is there", choices=("yes", "no")),
        "patient": Argument(
            "yes", "whether the torso phantom is there", choices=("yes", "no")
        ),
    },
    meshes="borecheck_models.scanners.ct_gantry:build",
    shipped=_FOLDER / "meshes" / "coarse",
    not_modelled=(
        "a particular maker's housing",
        "head, arms and legs of the patient, breathing",
        "sag of the couch, mattress, straps",
        "floor, cables, contrast injector, displays",
    ),
    source="assumed",
    roles={
        "gantry": "scanner",
        "stand": "scanner",
        "couch_base": "couch",
        "couch_lift": "couch",
        "couch": "couch",
        "torso": "patient",
    },
    joints={"couch_height": 0.0, "couch_travel": 0.0},
    points={
        "P1": "bore wall near the front rim, upper left (+y), assumed",
        "P2": "front cover above the rim, assumed",
        "P3": "bore wall near the front rim, upper right (-y), assumed",
    },
)
