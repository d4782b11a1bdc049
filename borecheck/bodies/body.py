"""A body as a closed surface: the nearest shape that is shipped, scaled.

Shapes are shipped for every 2.5 kg/m2. One is stretched along the body to the height,
and across it, by one factor for width and depth, to exactly the mass; so what was
closed and free of self-contact stays so, and girths are known without measuring.
"""

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.bodies.spec import BodySpec
from borecheck.bodies.table import DENSITY, GIRTHS, KEYS
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh

NOT_MODELLED = (
    "the patient: a body of that sex, height and body mass index stands for them"
)


@dataclass(frozen=True, eq=False)
class Body:
    """A body on a flat couch, supine, head towards +x.

    Attributes:
        spec: What was asked for.
        mesh: Its surface in the scanner's frame, the middle of the waist at the
            isocentre, [m].
        waist: Girth, [m].
        hip: Girth, [m].
        sole: Where the soles are, x, [m].
        crown: Where the crown is, x, [m].
        couch: Height of the couch's top, z, [m].
    """

    spec: BodySpec
    mesh: TriangleMesh
    waist: float
    hip: float
    sole: float
    crown: float
    couch: float

    def to_json(self) -> dict[str, Any]:
        """What is said of it, plain values for `json.dumps`."""
        volume = self.volume
        low, high = self.mesh.bounds
        waist, hip = table_girths(self.spec.sex, self.spec.bmi)
        return {
            "body": str(self.spec),
            "height_m": self.crown - self.sole,
            "volume_m3": volume,
            "density_kg_m3": DENSITY,
            "mass_kg": DENSITY * volume,
            "bmi": DENSITY * volume / (self.crown - self.sole) ** 2,
            "waist_m": self.waist,
            "hip_m": self.hip,
            "table": {"waist_m": waist, "hip_m": hip},
            "couch_z_m": self.couch,
            "size_m": [float(x) for x in high - low],
            "triangles": len(self.mesh.triangles),
        }

    @property
    def volume(self) -> float:
        """[m3]."""
        return enclosed(self.mesh.vertices, self.mesh.triangles)


def make_body(spec: BodySpec) -> Body:
    """The body that is asked for."""
    shape = _shape(spec)
    length = shape["crown_m"] - shape["sole_m"]
    vertices, triangles = _surface(shape["file"])
    along = spec.height / length
    # its volume as shipped grows by `along` once and by `across` twice
    across = float(
        np.sqrt(spec.mass / DENSITY / (enclosed(vertices, triangles) * along))
    )
    scaled = vertices * [along, across, across]
    half = 0.5 * _depth_at_waist(scaled)
    return Body(
        spec,
        TriangleMesh("body", scaled - [0.0, 0.0, half], triangles),
        across * shape["waist_m"],
        across * shape["hip_m"],
        along * shape["sole_m"],
        along * shape["crown_m"],
        float(scaled[:, 2].min() - half),
    )


def table_girths(sex: str, bmi: float) -> tuple[float, float]:
    """Waist and hips of the table at a body mass index, [m]."""
    waist, hip = (float(np.interp(bmi, KEYS, row)) for row in GIRTHS[sex])
    return waist, hip


def manifest() -> dict[str, Any]:
    """What is shipped, and where it comes from."""
    text = (files("borecheck.bodies") / "shapes" / "manifest.json").read_text("utf-8")
    found: dict[str, Any] = json.loads(text)
    return found


def _shape(spec: BodySpec) -> dict[str, Any]:
    """The record of the nearest shape that is shipped."""
    nearest = min(KEYS, key=lambda bmi: abs(bmi - spec.bmi))
    wanted = (spec.sex, nearest, spec.arms)
    found = (r for r in _records() if (r["sex"], r["bmi"], r["arms"]) == wanted)
    return next(found)


@cache
def _records() -> tuple[dict[str, Any], ...]:
    return tuple(manifest()["bodies"])


def _surface(name: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    file = files("borecheck.bodies") / "shapes" / name
    with file.open("rb") as opened, np.load(opened, allow_pickle=False) as arrays:
        packed, triangles = arrays["vertices"], arrays["triangles"]
    return manifest()["unit_m"] * packed.astype(np.float64), triangles.astype(np.int64)


def enclosed(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> float:
    """Volume of what a closed surface winds about, [m3]."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6.0)


def _depth_at_waist(vertices: NDArray[np.float64]) -> float:
    """From the couch to the front, there where the waist is (x = 0), [m]."""
    near = np.abs(vertices[:, 0]) < 0.05
    return float(vertices[near, 2].max())
