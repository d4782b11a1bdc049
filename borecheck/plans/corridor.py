"""Where the needle may be in the patient: along the plan's line, down to its target."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.solid import Side, side_of, undecided
from borecheck.geometry.triangles.topology import Topology

Array = NDArray[np.float64]

# The needle leaves a hole in the skin that is a little wider than itself, and a mesh
# of the skin is off by about this much where triangles are large. Assumed.
SLACK = 2e-3


@dataclass(frozen=True)
class Stray:
    """The needle is in the patient where it should not be, or that cannot be told."""

    reason: str
    certain: bool


@dataclass(frozen=True, eq=False)
class Corridor:
    """A cylinder along a needle plan.

    Attributes:
        entry: Planned point on the skin, (3,), scanner's frame, [m].
        target: Planned tip, (3,).
        radius: Half the needle's width, [m].
        slack: Allowed beside the cylinder and beyond its ends, [m].
    """

    entry: Array
    target: Array
    radius: float
    slack: float = SLACK

    def __repr__(self) -> str:
        entry, target = (
            "(" + ", ".join(f"{round(1e3 * x, 1) + 0.0:g}" for x in point) + ")"
            for point in (self.entry, self.target)
        )
        wide = f"{1e3 * self.radius:g} mm round, {1e3 * self.slack:g} mm slack"
        return f"<Corridor {entry} to {target} mm, {wide}>"

    @cached_property
    def length(self) -> float:
        """From entry to target, [m]."""
        return float(np.linalg.norm(self.target - self.entry))

    @cached_property
    def direction(self) -> Array:
        """Of the line, into the patient; length 1."""
        return np.asarray((self.target - self.entry) / self.length, dtype=np.float64)

    def coordinates(self, points: Array) -> tuple[Array, Array]:
        """Depth of points (k, 3) along the line from the entry, and distance aside."""
        from_entry = points - self.entry
        depth = from_entry @ self.direction
        aside = np.linalg.norm(from_entry - np.outer(depth, self.direction), axis=1)
        return depth, aside

    def along_and_across(self, points: Array) -> Array:
        """Points (..., 3) by depth along the line and place across it, (..., 3)."""
        aside = np.eye(3)[np.abs(self.direction).argmin()]
        u = np.cross(self.direction, aside)
        u /= np.linalg.norm(u)
        axes = np.array([self.direction, u, np.cross(self.direction, u)])
        return np.asarray((points - self.entry) @ axes.T, dtype=np.float64)

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Which of the points (k, 3) lie in the corridor."""
        depth, aside = self.coordinates(points)
        return (
            (depth >= -self.slack)
            & (depth <= self.length + self.slack)
            & (aside <= self.radius + self.slack)
        )

    def allows(
        self, needle: TriangleMesh, patient: TriangleMesh, pairs: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """Which contacts are the planned puncture.

        A pair counts as planned only where the two triangles really meet within the
        corridor: the ends of their common segment are looked at, not the triangles,
        which may be large.

        Args:
            needle: The needle, placed.
            patient: The patient, placed.
            pairs: Triangle numbers in contact, (k, 2).

        Returns:
            (k,) bool.
        """
        allowed = np.zeros(len(pairs), dtype=bool)
        for k, (i, j) in enumerate(pairs):
            points = common_points(needle.corners[i], patient.corners[j])
            # a segment has two ends; one of them alone says nothing of the other
            allowed[k] = len(points) > 1 and bool(self.holds(points).all())
        return allowed

    def stray(
        self, needle: TriangleMesh, patient: TriangleMesh, topology: Topology
    ) -> Stray | None:
        """Where the needle is in the patient, but not in the corridor; None: nowhere.

        Surfaces say where the needle goes in, not where its tip is. All crossings
        must be known to lie in the corridor; what is inside of each triangle is then
        spanned by crossings and corners, so it is enough to look at the corners.

        Args:
            needle: The needle, placed.
            patient: The patient, placed.
            topology: The patient's.
        """
        corners = np.unique(needle.corners.reshape(-1, 3), axis=0)
        aside = corners[~self.holds(corners)]
        low, high = patient.bounds
        near = ((aside >= low) & (aside <= high)).all(axis=1)
        if topology.is_closed:
            sides = [side_of(point, patient, topology) for point in aside[near]]
            inside = aside[near][[side is Side.INSIDE for side in sides]]
            if len(inside):
                return self._stray_named(inside, needle, patient)
            if Side.UNDECIDED in sides:
                return Stray(undecided(needle.name, patient.name), certain=False)
            return None
        behind = (aside - self.entry) @ (self.target - self.entry) < 0.0
        # what is behind the entry crosses nothing, so one point outside will do for it
        all_near = bool(behind.any() and near[behind].all())
        if not (near[~behind].any() or all_near):
            return None
        reason = f"{patient.name} is open: how far {needle.name} is in cannot be told"
        return Stray(reason, certain=False)

    def _stray_named(
        self, inside: Array, needle: TriangleMesh, patient: TriangleMesh
    ) -> Stray:
        depth, _ = self.coordinates(inside)
        beyond = float(depth.max()) - self.length
        where = f"{1e3 * beyond:.1f} mm beyond the target"
        if beyond <= self.slack:
            where = "aside of its line"
        return Stray(
            f"{needle.name} is in {patient.name} outside the plan's corridor, {where}",
            certain=True,
        )


def common_points(first: Array, second: Array) -> Array:
    """Points where edges of one triangle cross the other one's plane within it, (k, 3).

    They span the segment that two crossing triangles share. Rounded; coplanar
    triangles give no points, so that such a contact is never taken as planned.
    """
    found = [
        *_edge_crossings(first, second),
        *_edge_crossings(second, first),
    ]
    return np.array(found).reshape(-1, 3)


def _edge_crossings(edges_of: Array, triangle: Array) -> list[Array]:
    a, b, c = triangle
    normal = _cross(b - a, c - a)
    size = float(np.abs(triangle - a).max()) or 1.0
    side = (edges_of - a) @ normal
    found = []
    for i in range(3):
        p, q = side[i], side[(i + 1) % 3]
        # a corner on the plane counts for both its edges
        if (p > 0.0 and q > 0.0) or (p < 0.0 and q < 0.0) or p == q:
            continue
        point = edges_of[i] + (edges_of[(i + 1) % 3] - edges_of[i]) * (p / (p - q))
        if _is_in(point, a, b, c, normal, 1e-9 * size):
            found.append(point)
    return found


def _is_in(
    point: Array, a: Array, b: Array, c: Array, normal: Array, tolerance: float
) -> bool:
    length = float(np.linalg.norm(normal))
    for p, q in ((a, b), (b, c), (c, a)):
        inward = float(_cross(q - p, point - p) @ normal)
        if inward < -tolerance * length * float(np.linalg.norm(q - p)):
            return False
    return True


def _cross(u: Array, v: Array) -> Array:
    """As `np.cross` of two vectors, which takes twenty times as long."""
    a, b, c = (float(x) for x in u)
    x, y, z = (float(x) for x in v)
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])
