"""Where needles about a target go in: bounds over cones of directions.

Seen from the target t, a ray outwards meets the skin at a distance, the needle's depth.
A cell of directions lies in a cone about its centre's ray. Which triangles the cone may
meet is told by their angle from the centre's ray, as seen from t; what follows looks at
no other triangles.

One crossing. If the skin winds once round t, and every triangle that the cone may meet
faces away from t, then each ray crosses the skin once: every crossing leaves it, and
t is inside once. Where a triangle does not face away (a fold, an arm beside the trunk,
an organ's surface), the cell is left undecided.

Depth. A ray at an angle f from the normal of a triangle whose plane is h away from t
meets that plane at h / cos(f). Over a cone of half angle a about a ray at f0, that is
between h / cos(max(f0 - a, 0)) and h / cos(f0 + a); no point of the triangle is farther
than its farthest corner. The same f bounds the needle's obliquity.

The needle's own width. Its line meets the skin at d. Skin beyond that, within the
needle's radius r of the line, is seen from t at most asin(r / d) beside it; there the
skin is one graph over directions, whose logarithm changes by no more than tan(f) per
radian. So none of it lies deeper than d exp(tan(f) asin(r / d)), and if that is within
the corridor's slack of d, nothing of the needle meets the patient before its corridor.

A target that is wrong by up to e sees every point of the skin at most asin(e / d)
elsewhere and e nearer or farther; planes are e nearer.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import surface
from borecheck.geometry.triangles.winding import ON_SURFACE, crossings
from borecheck.plans.corridor import SLACK
from borecheck.plans.skin import distance_to

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# Angles and distances are compared with this to spare: far more than rounding.
RESERVE = 1e-9

OK, FOLD, CORRIDOR = range(3)
REASONS = {
    FOLD: "the line may cross the skin more than once, or along it",
    CORRIDOR: "beside its line the needle may meet skin before the corridor",
}


@dataclass(frozen=True, eq=False)
class SkinOfCells:
    """What is known of the skin over cells.

    Attributes:
        state: OK, or why nothing is clear, (k,).
        depth: Bounds of the needle's depth, (k, 2), [m]; NaN where there is a FOLD.
        obliquity: Bounds of the angle between needle and inward normal, (k, 2), [rad].
        cell: Candidates for the cells within: their cell, (c,).
        triangle: And their triangle, (c,).
    """

    state: Ids
    depth: Array
    obliquity: Array
    cell: Ids
    triangle: Ids


class Skin:
    """The patient's surfaces as a target sees them.

    Args:
        target: Where needles end, (3,), [m].
        patients: The patient's bodies, in the same frame.
        radius: The needle's, [m].
        error: How far the target may be elsewhere, [m].

    Attributes:
        trouble: Why nothing can be told of any direction, or None.
        near: Distance of the skin from the target, [m].
    """

    def __init__(
        self,
        target: Array,
        patients: Sequence[TriangleMesh],
        radius: float,
        error: float,
    ) -> None:
        self.radius, self.error = radius, error
        self._bodies = len(patients)
        windings = [_winding(target, mesh) for mesh in patients]
        self.near = min((distance_to(mesh, target) for mesh in patients), default=0.0)
        self.trouble = self._trouble(patients, windings)
        kept = [
            _facing(mesh, target, w) for mesh, w in zip(patients, windings, strict=True)
        ]
        counts = [len(corners) for corners, _ in kept]
        self._body = np.repeat(np.arange(len(patients)), counts)
        self._holds = np.array([w != 0 for w in windings], np.bool_)[self._body]
        v = np.concatenate([np.zeros((0, 3, 3)), *(corners for corners, _ in kept)])
        self._normal = np.concatenate([np.zeros((0, 3)), *(n for _, n in kept)])
        self._plane = np.einsum("td,td->t", v[:, 0], self._normal)
        lengths = np.linalg.norm(v, axis=-1)
        self._far = lengths.max(axis=1, initial=0.0)
        self._corner = v / np.maximum(lengths, 1e-300)[..., None]
        across = np.cross(self._corner, np.roll(self._corner, -1, axis=1))
        size = np.linalg.norm(across, axis=-1, keepdims=True)
        self._edge = across / np.maximum(size, 1e-300)
        self._turn = np.where(self._triple(self._corner) >= 0.0, 1.0, -1.0)

    def _trouble(
        self, patients: Sequence[TriangleMesh], windings: Sequence[int]
    ) -> str | None:
        for mesh in patients:
            if not surface(mesh).topology.is_closed:
                return f"{mesh.name} is open: where a needle goes in cannot be told"
        if not any(windings):
            return "the target is not in the patient: wrong frame, position or unit?"
        for mesh, winding in zip(patients, windings, strict=True):
            if winding == ON_SURFACE:
                return f"the target is on the surface of {mesh.name}"
            if abs(winding) > 1:
                return f"{mesh.name} winds {abs(winding)} times round the target"
        if self.near <= 2.0 * (self.radius + self.error):
            return f"the target is {1e3 * self.near:.1f} mm below the skin: too near"
        return None

    def all_triangles(self, count: int) -> tuple[Ids, Ids]:
        """Candidates of cells of which nothing is known: cell and triangle, flat."""
        triangles = len(self._plane)
        return (
            np.repeat(np.arange(count), triangles),
            np.tile(np.arange(triangles), count),
        )

    def over(
        self, rays: Array, spread: Array, near: Array, cell: Ids, triangle: Ids
    ) -> SkinOfCells:
        """Bounds over cones about rays out of the target.

        Args:
            rays: Unit vectors, (k, 3).
            spread: Half angles of the cones, (k,), [rad].
            near: A lower bound of the skin's distance in each, (k,), [m].
            cell: Candidates, which are all that a cone may meet: their cell, (c,).
            triangle: And their triangle, (c,).
        """
        count, e = len(rays), self.error
        turned = np.arcsin(e / near)
        beside = np.arcsin(np.minimum(self.radius / (near - e), 1.0))
        core = spread + turned + RESERVE
        angle = self._angle_to(rays[cell], triangle)
        kept = angle <= core[cell] + beside[cell]
        cell, triangle, angle = cell[kept], triangle[kept], angle[kept]
        h, far = self._plane[triangle], self._far[triangle]
        steep = np.arccos(
            np.clip(np.einsum("cd,cd->c", rays[cell], self._normal[triangle]), -1, 1)
        )
        faces = self._holds[triangle] & (h > e + RESERVE)
        folded = np.zeros(count, np.bool_)
        folded[cell[~faces]] = True
        met = angle <= core[cell]
        depth = self._depths(
            count, cell[met], triangle[met], h[met], far[met], steep[met], core
        )
        folded |= ~np.isfinite(depth).all(axis=1)
        flat = np.maximum(steep[met] - spread[cell[met]], 0.0)
        tilted = np.minimum(steep[met] + spread[cell[met]], np.pi)
        obliquity = np.stack(
            [_least(count, cell[met], flat), -_least(count, cell[met], -tilted)], axis=1
        )
        leaves = self._leaves_corridor(count, cell, h, far, steep, core + beside, depth)
        state = np.where(folded, FOLD, np.where(leaves, CORRIDOR, OK))
        depth[folded] = np.nan
        obliquity[folded] = np.nan
        return SkinOfCells(state, depth, obliquity, cell, triangle)

    def _depths(
        self,
        count: int,
        cell: Ids,
        triangle: Ids,
        h: Array,
        far: Array,
        steep: Array,
        core: Array,
    ) -> Array:
        """Bounds of the depth, (count, 2): of the outermost body that is crossed."""
        e = self.error
        low = h / np.cos(np.clip(steep - core[cell], 0.0, 1.5))
        widest = steep + core[cell]
        with np.errstate(divide="ignore", invalid="ignore"):
            high = np.where(widest < 1.57, h / np.cos(np.minimum(widest, 1.57)), far)
        each = cell * self._bodies + self._body[triangle]
        slots = count * self._bodies
        least = _least(slots, each, np.minimum(low, far)).reshape(count, -1)
        most = -_least(slots, each, -np.minimum(high, far)).reshape(count, -1)
        least = np.where(np.isfinite(least), least, -np.inf)
        return np.stack(
            [least.max(axis=1) - e - RESERVE, most.max(axis=1) + e + RESERVE], axis=1
        )

    def _leaves_corridor(
        self,
        count: int,
        cell: Ids,
        h: Array,
        far: Array,
        steep: Array,
        grown: Array,
        depth: Array,
    ) -> NDArray[np.bool_]:
        e = self.error
        plane = np.maximum(h - e, RESERVE)
        tangent = np.sqrt(np.maximum(((far + e) / plane) ** 2 - 1.0, 0.0))
        widest = steep + grown[cell] + e / plane
        tangent = np.minimum(
            tangent, np.where(widest < 1.57, np.tan(np.minimum(widest, 1.57)), np.inf)
        )
        steepest = -_least(count, cell, -tangent)
        with np.errstate(invalid="ignore", over="ignore"):
            beside = np.arcsin(np.clip(self.radius / depth[:, 0], 0.0, 1.0))
            beyond = depth[:, 1] * np.expm1(np.minimum(steepest * beside, 50.0))
        return ~(beyond < SLACK - 1e-6)

    def _angle_to(self, ray: Array, triangle: Ids) -> Array:
        """Angle between rays (c, 3) and triangles as seen from the target, (c,)."""
        edge, corner = self._edge[triangle], self._corner[triangle]
        height = np.einsum("cd,ced->ce", ray, edge)
        inside = (height * self._turn[triangle, None] >= -RESERVE).all(axis=1)
        foot = ray[:, None] - height[..., None] * edge
        following = np.roll(corner, -1, axis=1)
        after = np.einsum("ced,ced->ce", np.cross(corner, foot), edge) >= 0.0
        before = np.einsum("ced,ced->ce", np.cross(foot, following), edge) >= 0.0
        to_arc = np.where(after & before, np.abs(height), np.inf)
        cosine = np.einsum("cd,ced->ce", ray, corner).max(axis=1)
        to_corner = np.arccos(np.clip(cosine, -1.0, 1.0))
        to_edge = np.arcsin(np.minimum(to_arc.min(axis=1), 1.0))
        nearest = np.where(np.isinf(to_arc).all(axis=1), np.inf, to_edge)
        return np.where(
            inside & self._before(ray, triangle), 0.0, np.minimum(nearest, to_corner)
        )

    def _before(self, ray: Array, triangle: Ids) -> NDArray[np.bool_]:
        """Whether a triangle is not wholly behind the ray's start."""
        corner = self._corner[triangle]
        return np.asarray(np.einsum("cd,ced->ce", ray, corner).max(axis=1) > 0.0)

    def entry_depths(self, rays: Array, cell: Ids, triangle: Ids) -> Array:
        """Distance at which each ray leaves the skin last, (k,); NaN: no crossing seen.

        Args:
            rays: Unit vectors, (k, 3).
            cell: Candidates: the ray of each, (c,).
            triangle: And its triangle.
        """
        ray = rays[cell]
        height = np.einsum("cd,ced->ce", ray, self._edge[triangle])
        hit = (height * self._turn[triangle, None] >= -RESERVE).all(axis=1)
        hit &= self._before(ray, triangle)
        slope = np.einsum("cd,cd->c", ray, self._normal[triangle])
        hit &= slope > RESERVE
        at = self._plane[triangle[hit]] / slope[hit]
        found = -_least(len(rays), cell[hit], -at)
        return np.where(np.isfinite(found), found, np.nan)

    def depth_along(self, directions: Array) -> Array:
        """Depth of needles along unit vectors (k, 3), (k,); NaN: no crossing seen."""
        return self.entry_depths(-directions, *self.all_triangles(len(directions)))

    @staticmethod
    def _triple(corner: Array) -> Array:
        a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]
        return np.asarray(np.einsum("td,td->t", np.cross(a, b), c))


def _winding(target: Array, mesh: TriangleMesh) -> int:
    x, y, z = (float(value) for value in target)
    return int(crossings((x, y, z), mesh.corners.reshape(-1, 9))[0])


def _facing(mesh: TriangleMesh, target: Array, winding: int) -> tuple[Array, Array]:
    """Corners against the target and unit normals, outwards; without empty triangles.

    An empty triangle is a line, which the triangles beside it hold.
    """
    v = mesh.corners - target
    n = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
    size = np.linalg.norm(n, axis=1)
    there = size > 0.0
    sign = -1.0 if winding < 0 else 1.0
    return v[there], sign * n[there] / size[there, None]


def _least(count: int, slot: Ids, values: Array) -> Array:
    """The least value of every slot, (count,); infinite where there is none."""
    found = np.full(count, np.inf)
    np.minimum.at(found, slot, values)
    return found
