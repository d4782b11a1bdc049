"""A mesh made ready for contact and clearance queries: `MeshTree`."""

import math
from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import check_transform
from borecheck.errors import GeometryError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.tree import clearance as bvh_clearance
from borecheck.geometry.tree import query as bvh_query
from borecheck.geometry.tree.addresses import Book, PairBook
from borecheck.geometry.tree.boxes import LARGEST_COORDINATE
from borecheck.geometry.tree.build import CHILD_ROW
from borecheck.geometry.tree.kept_trees import checked_mesh, reject_far, tree_of
from borecheck.geometry.triangles.narrowphase import narrowphase_code

Placement = NDArray[np.float64]

# A lone tree against a lone tree.
_ONE_PAIR = np.zeros((1, 2), np.int64)
# For answers of `query.search` that nobody asks for.
NOT_ASKED, NOT_ASKED_BOOL = np.zeros(0, np.int64), np.zeros(0, np.bool_)
# Contacts found at first without asking again for more room.
_FIRST_ROOM = 2048


@dataclass(frozen=True, eq=False)
class NearestPoints:
    """Two nearest points of two meshes.

    Attributes:
        distance: Between them, [m]; 0 if the surfaces meet.
        lower: Certified lower bound of the distance of the surfaces, [m].
        upper: Certified upper bound, [m].
        point_self: On the first mesh, (3,), world, [m].
        point_other: On the other mesh, (3,), world, [m].
        triangle_self: Original id of the triangle that holds `point_self`.
        triangle_other: Original id of the triangle that holds `point_other`.
    """

    distance: float
    lower: float
    upper: float
    point_self: NDArray[np.float64]
    point_other: NDArray[np.float64]
    triangle_self: int
    triangle_other: int


@dataclass(frozen=True)
class Within:
    """Whether two surfaces come as near as a margin.

    Attributes:
        verdict: "contact" (distance <= margin), "clear" (distance > margin) or
            "undecided" (they differ by less than the error of the distance).
        lower: Certified lower bound of the distance, [m]; above the margin if clear
            (for a margin of 0 it is 0: the exact predicate is the certificate).
        upper: Certified upper bound; infinite if nothing as near as the margin was met.
    """

    verdict: Literal["clear", "contact", "undecided"]
    lower: float
    upper: float


class MeshTree:
    """A mesh and its tree of boxes, built once in the mesh's own frame.

    The arrays are copied. Trees of large meshes are kept on disk under the hash of
    the mesh's numbers, see `borecheck.core.cache`.

    Args:
        vertices: Points, (n, 3), [m].
        triangles: Vertex indices, (m, 3).
        cached: Whether the tree may be read from and written to the disk cache.

    Raises:
        GeometryError: Wrong shapes, no triangles, numbers that are not finite or not
            indices.
    """

    def __init__(
        self, vertices: ArrayLike, triangles: ArrayLike, *, cached: bool = True
    ) -> None:
        self._build(checked_mesh(vertices, triangles), cached)

    def _build(self, mesh: TriangleMesh, cached: bool) -> None:
        corners = mesh.corners.reshape(-1, 9)
        tree = tree_of(mesh, corners, cached)
        self.nodes = tree.nodes
        self.order = tree.order
        self.depth = tree.depth
        self.corners = corners[tree.order]
        # Of one tree, as kernels take it of many: node 0 is the first.
        self.frames = np.append(tree.frame, 0.0)[None]
        self.book = Book(self.nodes, self.corners, self.order, self.frames, self.depth)
        # Entries of pair books by the other tree; they hold no array of it.
        self._pairs: WeakKeyDictionary[MeshTree, NDArray[np.int64]]
        self._pairs = WeakKeyDictionary()

    def __repr__(self) -> str:
        return f"<MeshTree of {len(self.order)} triangles>"

    def __getstate__(self) -> dict[str, Any]:
        """Without what was laid out for other trees: addresses of this process."""
        return {**vars(self), "_pairs": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, _pairs=WeakKeyDictionary())

    def _pair_with(self, other: "MeshTree") -> NDArray[np.int64]:
        """What `query.search` takes of this tree and another."""
        entries = self._pairs.get(other)
        if entries is None:
            entries = PairBook(self.book, other.book, _ONE_PAIR).entries
            self._pairs[other] = entries
        return entries

    @classmethod
    def of(cls, mesh: TriangleMesh, *, cached: bool = True) -> "MeshTree":
        """The tree of a mesh record, whose numbers are known to be sound."""
        reject_far(mesh)
        tree = cls.__new__(cls)
        tree._build(mesh, cached)
        return tree

    @property
    def triangle_count(self) -> int:
        """Number of triangles."""
        return len(self.order)

    def first_contact(
        self,
        other: "MeshTree",
        T_self: ArrayLike,
        T_other: ArrayLike,
        narrowphase: str = "exact",
    ) -> bool:
        """Whether any triangle of this mesh meets any of the other one.

        Args:
            other: The obstacle.
            T_self: Placement of this mesh, T_world_self, (4, 4).
            T_other: Placement of the other mesh, T_world_other, (4, 4).
            narrowphase: "exact", "two-sided", "paper:robot" or "paper:scanner"; this
                mesh is the robot's.

        Raises:
            GeometryError: A placement that is no rigid transform.
            UnknownNameError: No such narrowphase.
        """
        task = bvh_query.FIRST
        count, _, _ = self._search(other, T_self, T_other, narrowphase, task)
        return bool(count > 0)

    def contacts(
        self,
        other: "MeshTree",
        T_self: ArrayLike,
        T_other: ArrayLike,
        narrowphase: str = "exact",
    ) -> NDArray[np.int64]:
        """All pairs of triangles that meet, (k, 2), as original ids, sorted.

        Arguments and errors as in `first_contact`.
        """
        pairs, _ = self.contacts_counted(other, T_self, T_other, narrowphase)
        return pairs

    def contacts_counted(
        self,
        other: "MeshTree",
        T_self: ArrayLike,
        T_other: ArrayLike,
        narrowphase: str = "exact",
    ) -> tuple[NDArray[np.int64], int]:
        """`contacts`, and how many triangle pairs the narrowphase examined.

        All other pairs were pruned: their boxes are surely apart.
        """
        task = bvh_query.ALL
        _, examined, found = self._search(other, T_self, T_other, narrowphase, task)
        return np.ascontiguousarray(found), examined

    def candidates(
        self,
        other: "MeshTree",
        T_self: ArrayLike,
        T_other: ArrayLike,
        inflate: float = 0.0,
    ) -> NDArray[np.int64]:
        """Pairs of triangles whose boxes may meet, (k, 2), as original ids, sorted.

        Every pair nearer than `inflate` [m] is among them.
        """
        if not (math.isfinite(inflate) and inflate >= 0.0):
            raise GeometryError(f"inflate is {inflate}, not a distance in metres")
        task = bvh_query.BOXES
        _, _, found = self._search(other, T_self, T_other, "exact", task, inflate)
        return np.ascontiguousarray(found)

    def clearance(
        self,
        other: "MeshTree",
        T_self: ArrayLike,
        T_other: ArrayLike,
        relative_tolerance: float = 0.0,
        cutoff: float = math.inf,
        *,
        known_apart: bool = False,
    ) -> tuple[float, float]:
        """Certified bounds of the distance between both surfaces, (lower, upper) [m].

        (0, 0) exactly if they meet by the exact predicate. Otherwise lower <= distance
        <= upper; with a tolerance of 0 they differ by no more than twice
        `distance.DISTANCE_ERROR` times the size of the nearest pair of
        triangles, else upper <= (1 + relative_tolerance) * lower besides that error. A
        tolerance of 0.1 is 5 to 100 times cheaper than 0.

        Surfaces that are farther apart than the cutoff [m] are cheap: lower may then be
        the cutoff, and upper anything above it.

        Who knows that the surfaces do not meet says so, and spares the exact search.

        Raises:
            GeometryError: A placement that is no rigid transform, or a tolerance that
                is negative or not finite.
        """
        if not (math.isfinite(relative_tolerance) and relative_tolerance >= 0.0):
            raise GeometryError(f"relative_tolerance is {relative_tolerance}")
        if not known_apart and self.first_contact(other, T_self, T_other):
            return 0.0, 0.0
        scale = 1.0 + relative_tolerance
        return bounds_of(self._nearest(other, T_self, T_other, scale, cutoff))

    def closest(
        self, other: "MeshTree", T_self: ArrayLike, T_other: ArrayLike
    ) -> "NearestPoints":
        """Two nearest points, in the world, and the triangles that hold them.

        If the surfaces meet, the distance is 0 and the triangles are the first pair in
        contact that was found; the points are theirs, near each other but not
        necessarily one.
        """
        task = bvh_query.FIRST
        count, _, pairs = self._search(other, T_self, T_other, "exact", task)
        lower, upper = 0.0, 0.0
        if count:
            leaf_a, leaf_b = int(pairs[0, 0]), int(pairs[0, 1])
        else:
            answer = self._nearest(other, T_self, T_other, 1.0)
            lower, upper = bounds_of(answer)
            leaf_a = leaf_in(self.nodes, int(answer[bvh_clearance.SLOT_A]))
            leaf_b = leaf_in(other.nodes, int(answer[bvh_clearance.SLOT_B]))
        T_a, T_b = placement(T_self, "T_self"), placement(T_other, "T_other")
        found = nearest_at(self, T_a, leaf_a, other, T_b, leaf_b, (lower, upper))
        return replace(found, distance=0.0) if count else found

    def within(
        self, other: "MeshTree", T_self: ArrayLike, T_other: ArrayLike, margin: float
    ) -> "Within":
        """Whether the surfaces come as near as `margin` [m]; certified both ways.

        Cheaper than `clearance`: ends at the first pair that is near enough, and opens
        no box that is farther away.

        Raises:
            GeometryError: A placement that is no rigid transform, or a margin that is
                negative or not finite.
        """
        if not (math.isfinite(margin) and margin >= 0.0):
            raise GeometryError(f"margin is {margin}, not a distance in metres")
        if self.first_contact(other, T_self, T_other):
            return Within("contact", 0.0, 0.0)
        if margin == 0.0:  # not in contact, exactly
            return Within("clear", 0.0, math.inf)
        # Distances that cannot be told from the margin are looked at as well.
        cutoff = margin * (1.0 + 1e-9)
        answer = self._nearest(other, T_self, T_other, 1.0, cutoff, margin)
        lower, upper = bounds_of(answer)
        if upper <= margin:
            return Within("contact", 0.0, upper)
        return Within("clear" if lower > margin else "undecided", lower, upper)

    def _nearest(
        self,
        other: "MeshTree",
        T_self: ArrayLike,
        T_other: ArrayLike,
        scale: float,
        cutoff: float = math.inf,
        stop: float = -1.0,
    ) -> NDArray[np.float64]:
        """The answer of `clearance.nearest`; placements known to be rigid."""
        answers = np.array([[bvh_clearance.NO_ANSWER]])
        bvh_clearance.nearest(
            self.nodes,
            self.corners,
            self.frames,
            other.nodes,
            other.corners,
            other.frames,
            _ONE_PAIR,
            placement(T_self, "T_self"),
            placement(T_other, "T_other"),
            False,
            0,
            1,
            self.depth + other.depth,
            scale,
            cutoff,
            stop,
            answers,
        )
        return answers[0, 0]

    def _search(
        self,
        other: "MeshTree",
        T_self: ArrayLike,
        T_other: ArrayLike,
        narrowphase: str,
        task: int,
        inflate: float = 0.0,
    ) -> tuple[int, int, NDArray[np.int64]]:
        """Number of pairs found, number examined, and what `search` found, (k, 2)."""
        T_self, T_other = placement(T_self, "T_self"), placement(T_other, "T_other")
        code = narrowphase_code(narrowphase)
        book = self._pair_with(other)
        room = 1 if task == bvh_query.FIRST else _FIRST_ROOM
        while True:
            found = np.empty((room, bvh_query.FOUND_COLUMNS), np.int64)
            count, examined, bad, _ = bvh_query.search(
                book,
                T_self,
                T_other,
                False,
                0,
                1,
                code,
                task,
                inflate,
                NOT_ASKED,
                NOT_ASKED_BOOL,
                found,
            )
            if bad >= 0:
                reject_placement(T_self[0, 0], "T_self")
                reject_placement(T_other[0, 0], "T_other")
            if count <= room:
                return count, examined, found[:count, 2:]
            room = count


def bounds_of(answer: NDArray[np.float64]) -> tuple[float, float]:
    """Lower and upper bound in the answer of a walk, see `tree.clearance`."""
    lower, upper = answer[bvh_clearance.LOWER], answer[bvh_clearance.UPPER]
    return max(0.0, float(min(lower, upper))), float(upper)


class _Leaves(Protocol):
    """Triangles in the order of a tree's leaves, and their original numbers."""

    corners: NDArray[np.float64]
    order: NDArray[np.int64]


def nearest_at(
    a: _Leaves,
    T_a: Placement,
    leaf_a: int,
    b: _Leaves,
    T_b: Placement,
    leaf_b: int,
    bounds: tuple[float, float],
) -> NearestPoints:
    """The nearest points of two leaves, of surfaces with these bounds of distance.

    Args:
        a: A tree, or packed trees.
        T_a: Its placement, (1, 1, 4, 4).
        leaf_a: Which leaf.
        b: The other.
        T_b: As T_a.
        leaf_b: As leaf_a.
        bounds: Lower and upper bound of the surfaces' distance, [m].
    """
    distance, p, q = bvh_clearance.nearest_points(
        a.corners, T_a, leaf_a, b.corners, T_b, leaf_b
    )
    triangles = int(a.order[leaf_a]), int(b.order[leaf_b])
    return NearestPoints(distance, *bounds, np.array(p), np.array(q), *triangles)


def leaf_in(nodes: NDArray[np.float32], slot: int) -> int:
    """The leaf in a slot of the tree, see `boxes.child_box`."""
    return ~int(nodes.view(np.int32)[slot >> 3, CHILD_ROW, slot & 7])


def placement(T: ArrayLike, name: str) -> Placement:
    """T as kernels take many: (1, 1, 4, 4); they check that it is rigid."""
    T = np.array(T, dtype=np.float64, order="C")
    if T.shape != (4, 4):
        raise GeometryError(f"{name} has shape {T.shape}, not (4, 4)")
    return T.reshape(1, 1, 4, 4)


def reject_placement(T: Placement, name: str) -> None:
    """Raises if a transform is not rigid, or too far for boxes of float32.

    Raises:
        GeometryError: With what is wrong.
    """
    check_transform(T, name)
    if np.abs(T[:3, 3]).max() > LARGEST_COORDINATE:
        raise GeometryError(f"{name} shifts by more than {LARGEST_COORDINATE:g} m")
