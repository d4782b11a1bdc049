"""What a certificate states: bodies, pairs, passages, and the motion of a chain.

Read from its document by `verify.read_statement`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.verify.chain import WORLD, Chain
from borecheck.verify.distance import GroupedMesh
from borecheck.verify.solid import connected_corners, is_closed

Array = NDArray[np.float64]

# The clearance must exceed margin and displacement by this: more than rounding, [m].
RESERVE = 1e-9
# Lengths may be recorded this much beside what is derived here: rounding, [m].
ROUNDING = 1e-10
# What a passage and the plan it belongs to must both state.
CORRIDOR = ("entry", "target", "radius_m", "slack_m")


@dataclass(frozen=True, eq=False)
class Surface:
    """One body of the certificate with its mesh."""

    name: str
    role: str
    frame: int
    T_frame_mesh: Array
    mesh: GroupedMesh

    @cached_property
    def box(self) -> Array:
        """Corners of the box of what its triangles use, (8, 3)."""
        used = self.mesh.corners.reshape(-1, 3)
        ends = (used.min(axis=0), used.max(axis=0))
        return np.array([[ends[b >> k & 1][k] for k in range(3)] for b in range(8)])

    @cached_property
    def size(self) -> float:
        """No corner is farther from the frame's origin than this, [m]."""
        far = float(np.linalg.norm(self.mesh.corners, axis=2).max())
        return far + float(np.linalg.norm(self.T_frame_mesh[:3, 3]))

    @cached_property
    def closed(self) -> bool:
        """Whether it bounds a solid."""
        return is_closed(self.mesh.vertices, self.mesh.triangles)

    @cached_property
    def one_corner_each(self) -> Array:
        """A corner of every connected part."""
        return connected_corners(self.mesh.vertices, self.mesh.triangles)

    def placed(self, placements: list[Array]) -> Array:
        """T_world_mesh, from T_world_frame of every frame."""
        if self.frame == WORLD:
            return self.T_frame_mesh
        return np.asarray(placements[self.frame] @ self.T_frame_mesh)


@dataclass(frozen=True, eq=False)
class Pair:
    """Two surfaces that are said to stay apart: the indices, and rows of intervals."""

    moving: int
    standing: int
    margin: float
    intervals: Array


@dataclass(frozen=True, eq=False)
class Passage:
    """A needle and its patient: the indices, corridor, and rows of intervals.

    Those of `intervals` are said to keep to the corridor, those `beside` to stay apart
    as any pair must.
    """

    moving: int
    standing: int
    entry: Array
    target: Array
    radius: float
    slack: float
    intervals: Array
    beside: Array = field(default_factory=lambda: np.zeros((0, 5)))

    def as_pair(self, margin: float) -> Pair:
        """What is said of it where it stays apart."""
        return Pair(self.moving, self.standing, margin, self.beside)


@dataclass(frozen=True, eq=False)
class Statement:
    """A certificate, taken apart."""

    document: Mapping[str, Any]
    waypoints: Array
    chain: Chain
    margin: float
    bodies: tuple[Surface, ...]
    parts: int
    pairs: tuple[Pair, ...]
    passages: tuple[Passage, ...]
    allowed: Mapping[tuple[int, int], str]

    @property
    def end(self) -> float:
        """When the motion ends, in waypoints."""
        return len(self.waypoints) - 1.0
