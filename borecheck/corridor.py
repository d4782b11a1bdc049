"""Where the needle may be in the patient: along the plan's line, down to its target."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.mesh import TriangleMesh

Array = NDArray[np.float64]

# The needle leaves a hole in the skin that is a little wider than itself, and a mesh
# of the skin is off by about this much where triangles are large. Assumed.
SLACK = 2e-3


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

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Which of the points (k, 3) lie in the corridor."""
        along = self.target - self.entry
        length = float(np.linalg.norm(along))
        direction = along / length
        from_entry = points - self.entry
        depth = from_entry @ direction
        aside = np.linalg.norm(from_entry - np.outer(depth, direction), axis=1)
        return (
            (depth >= -self.slack)
            & (depth <= length + self.slack)
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
            allowed[k] = len(points) > 0 and bool(self.holds(points).all())
        return allowed


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
    normal = np.cross(b - a, c - a)
    size = float(np.abs(triangle - a).max()) or 1.0
    side = (edges_of - a) @ normal
    found = []
    for i in range(3):
        p, q = side[i], side[(i + 1) % 3]
        if (p > 0.0) == (q > 0.0) or p == q:
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
        inward = float(np.cross(q - p, point - p) @ normal)
        if inward < -tolerance * length * float(np.linalg.norm(q - p)):
            return False
    return True
