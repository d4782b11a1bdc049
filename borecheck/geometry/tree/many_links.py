"""Many configurations in one call: links that move against what stands in the room.

The answers are those of single `MeshTree` queries, pose by pose and pair by pair: the
same compiled walks, without a Python call for each.

Give the trees as `PackedTrees` to calls that come often: lists of trees are packed
(copied one behind the other) in every call.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import GeometryError
from borecheck.geometry.tree import clearance as bvh_clearance
from borecheck.geometry.tree import query as bvh_query
from borecheck.geometry.tree.addresses import PairBook
from borecheck.geometry.tree.mesh_tree import (
    NOT_ASKED,
    NOT_ASKED_BOOL,
    MeshTree,
    NearestPoints,
    bounds_of,
    leaf_in,
    nearest_at,
    reject_placement,
)
from borecheck.geometry.tree.nearest_first import comes_near, nearest_first
from borecheck.geometry.tree.packed import PackedTrees
from borecheck.geometry.tree.query import NO_PAIR
from borecheck.geometry.tree.threads import in_threads
from borecheck.geometry.triangles.narrowphase import narrowphase_code

Trees = PackedTrees | Sequence[MeshTree]
Floats = NDArray[np.float64]
Ids = NDArray[np.int64]

# Triangle pairs found at first without asking again for more room.
_FIRST_ROOM = 2048
_FIRST, _ALL = bvh_query.FIRST, bvh_query.ALL
_FLOAT = np.dtype(np.float64)
_NOTHING = np.zeros((0, bvh_query.FOUND_COLUMNS), np.int64)


@dataclass(frozen=True, eq=False)
class MovingLinks:
    """Links and what they may touch, checked and packed once for many calls.

    Attributes:
        links: Trees of the links.
        others: Trees of the obstacles, or the links themselves.
        pairs: Which link against which other, (p, 2), in the order they are asked.
        T_world_others: Placements of the obstacles, (1, k, 4, 4); None if the others
            are the links.
    """

    links: PackedTrees
    others: PackedTrees
    pairs: Ids
    T_world_others: Floats | None

    @classmethod
    def against(
        cls,
        links: Trees,
        obstacles: Trees,
        T_world_obstacles: ArrayLike | None = None,
    ) -> "MovingLinks":
        """Every link against every obstacle; obstacles stand still.

        Args:
            links: Trees of the links.
            obstacles: Trees of the obstacles.
            T_world_obstacles: Their placements, (k, 4, 4); default: in the world.

        Raises:
            GeometryError: Placements of wrong shape or not rigid.
        """
        links, obstacles = _packed(links), _packed(obstacles)
        count = len(obstacles)
        placements = np.tile(np.eye(4), (1, count, 1, 1))
        if T_world_obstacles is not None:
            given = np.array(T_world_obstacles, np.float64, order="C")
            if given.shape != (count, 4, 4):
                raise GeometryError(
                    f"T_world_obstacles has shape {given.shape}, not ({count}, 4, 4)"
                )
            placements = given[None]
            for k in range(count):
                reject_placement(given[k], f"T_world_obstacles[{k}]")
        each = [(a, b) for a in range(len(links)) for b in range(count)]
        pairs = np.array(each, np.int64).reshape(-1, 2)
        return cls(links, obstacles, pairs, placements)

    @classmethod
    def among(cls, links: Trees, link_pairs: ArrayLike) -> "MovingLinks":
        """Links against each other: the pairs of links listed, (p, 2).

        Raises:
            GeometryError: Pairs of wrong shape, or naming a link that is not there.
        """
        links = _packed(links)
        pairs = np.array(link_pairs, np.int64, order="C").reshape(-1, 2)
        if len(pairs) and (pairs.min() < 0 or pairs.max() >= len(links)):
            raise GeometryError(f"link_pairs name links beyond the {len(links)} given")
        return cls(links, links, pairs, None)

    def first_pairs(
        self, placements: ArrayLike, narrowphase: str = "exact", threads: int = 1
    ) -> Ids:
        """For every pose the first of `pairs` that is in contact, or -1, (n,).

        Args:
            placements: T_world_link of every pose, (n, links, 4, 4).
            narrowphase: As in `MeshTree.first_contact`; links are the robot's.
            threads: How many poses are worked on at once.

        Raises:
            GeometryError: Placements of wrong shape or not rigid: which pose and link.
            UnknownNameError: No such narrowphase.
        """
        placements = self._checked(placements)
        hits = np.empty(len(placements), np.int64)
        self._first(placements, narrowphase, threads, hits, NOT_ASKED_BOOL)
        return hits

    def first_contacts(
        self, placements: ArrayLike, narrowphase: str = "exact", threads: int = 1
    ) -> NDArray[np.bool_]:
        """Whether anything touches, pose by pose, (n,); see `first_pairs`."""
        placements = self._checked(placements)
        touches = np.empty(len(placements), np.bool_)
        self._first(placements, narrowphase, threads, NOT_ASKED, touches)
        return touches

    def first_pair(self, T_world_links: Floats, narrowphase: str = "exact") -> int:
        """The first of `pairs` that is in contact in one pose, or -1.

        What `first_pairs` answers, with the least work around the search: for callers
        that ask pose by pose.

        Args:
            T_world_links: (links, 4, 4), float64.
            narrowphase: As in `first_pairs`.

        Raises:
            GeometryError: Placements of wrong shape or not rigid: which link.
            UnknownNameError: No such narrowphase.
        """
        placements = self._checked(T_world_links[None])
        code = narrowphase_code(narrowphase)
        return self._search(placements, 0, 1, code, _FIRST)[2]

    def _first(
        self,
        placements: Floats,
        narrowphase: str,
        threads: int,
        hits: Ids,
        touches: NDArray[np.bool_],
    ) -> None:
        """Fills one of the two: first pairs, or whether there is one."""
        code, count = narrowphase_code(narrowphase), len(placements)
        if threads == 1:
            self._search(placements, 0, count, code, _FIRST, hits, touches)
            return

        def run(begin: int, end: int) -> None:
            self._search(placements, begin, end, code, _FIRST, hits, touches)

        in_threads(run, count, threads)

    def contacts(self, placements: ArrayLike, narrowphase: str = "exact") -> Ids:
        """All triangle pairs in contact, sorted, (k, 4).

        Columns: pose, row of `pairs`, triangle of the link, triangle of the other, both
        as original ids. Arguments and errors as in `first_pairs`.
        """
        return self.contacts_counted(placements, narrowphase)[0]

    def contacts_counted(
        self, placements: ArrayLike, narrowphase: str = "exact"
    ) -> tuple[Ids, int]:
        """`contacts`, and how many triangle pairs the narrowphase examined."""
        placements = self._checked(placements)
        code, end = narrowphase_code(narrowphase), len(placements)
        count, room = _FIRST_ROOM, 0
        while count > room:
            room = count
            found = np.empty((room, bvh_query.FOUND_COLUMNS), np.int64)
            count, examined, _ = self._search(
                placements, 0, end, code, _ALL, NOT_ASKED, NOT_ASKED_BOOL, found
            )
        return found[:count].copy(), examined

    def clearances(
        self, placements: ArrayLike, relative_tolerance: float = 0.0, threads: int = 1
    ) -> Floats:
        """Certified bounds of the least distance of all pairs, pose by pose, (n, 2).

        Lower and upper as in `MeshTree.clearance`; (0, 0) where anything touches.
        Poses without any pair have infinite bounds.
        """
        return self._clearances(placements, relative_tolerance, threads, each=False)[0]

    def nearest_pairs(
        self, placements: ArrayLike, relative_tolerance: float = 0.0, threads: int = 1
    ) -> tuple[Floats, Ids]:
        """As `clearances`, and the row of `pairs` where `upper` was found, (n,)."""
        return self._clearances(placements, relative_tolerance, threads, each=False)

    def closest(self, T_world_links: Floats) -> tuple[int, NearestPoints | None]:
        """The nearest points of all pairs in one pose, and the row of their pair.

        As `MeshTree.closest` of that pair, 0 apart if it meets; -1 and None without
        pairs.

        Args:
            T_world_links: (1, links, 4, 4).
        """
        placements = self._checked(T_world_links)
        answers = np.array([[bvh_clearance.NO_ANSWER]])
        row = self._search(placements, 0, 1, narrowphase_code("exact"), _FIRST)[2]
        if row == NO_PAIR and len(self.pairs):
            self._nearest(placements, 0, 1, 1.0, answers)
            row = int(answers[0, 0, bvh_clearance.PAIR])
        if row == NO_PAIR:
            return NO_PAIR, None
        a, b = self.pairs[row].tolist()
        others = self.T_world_others
        T_a, T_b = placements[0, a], (placements if others is None else others)[0, b]
        first, second = self.links.trees[a], self.others.trees[b]
        if math.isinf(answers[0, 0, bvh_clearance.UPPER]):  # they meet
            return row, first.closest(second, T_a, T_b)
        return row, self._points(answers[0, 0], T_a, T_b)

    def _points(self, answer: Floats, T_a: Floats, T_b: Floats) -> NearestPoints:
        """The nearest points that a walk's answer names, of meshes that do not meet."""
        a, b = self.links, self.others
        leaf_a = leaf_in(a.nodes, int(answer[bvh_clearance.SLOT_A]))
        leaf_b = leaf_in(b.nodes, int(answer[bvh_clearance.SLOT_B]))
        bounds = bounds_of(answer)
        return nearest_at(
            a, T_a[None, None], leaf_a, b, T_b[None, None], leaf_b, bounds
        )

    def pair_clearances(
        self, placements: ArrayLike, relative_tolerance: float = 0.0, threads: int = 1
    ) -> Floats:
        """Certified bounds of the distance of every pair, (n, p, 2)."""
        return self._clearances(placements, relative_tolerance, threads, each=True)[0]

    def _clearances(
        self,
        placements: ArrayLike,
        relative_tolerance: float,
        threads: int,
        each: bool,
    ) -> tuple[Floats, Ids]:
        if not (math.isfinite(relative_tolerance) and relative_tolerance >= 0.0):
            raise GeometryError(f"relative_tolerance is {relative_tolerance}")
        placements = self._checked(placements)
        shape = (len(placements), len(self.pairs) if each else 1, 1)
        answers = np.tile(np.array(bvh_clearance.NO_ANSWER), shape)
        scale = 1.0 + relative_tolerance

        def run(begin: int, end: int) -> None:
            self._nearest(placements, begin, end, scale, answers)

        self._mark_contacts(placements, threads, answers, each)
        in_threads(run, len(placements), threads)
        lower, upper = (
            answers[..., bvh_clearance.LOWER],
            answers[..., bvh_clearance.UPPER],
        )
        bounds = np.stack([np.maximum(np.minimum(lower, upper), 0.0), upper], axis=-1)
        pairs = answers[..., bvh_clearance.PAIR].astype(np.int64)
        return (bounds, pairs) if each else (bounds[:, 0], pairs[:, 0])

    def _mark_contacts(
        self, placements: Floats, threads: int, answers: Floats, each: bool
    ) -> None:
        """Sets the answers of what is in contact to 0."""
        parts = [self]
        if each:
            rows = range(len(self.pairs))
            parts = [replace(self, pairs=self.pairs[k : k + 1]) for k in rows]
        for column, part in enumerate(parts):
            hits = part.first_pairs(placements, threads=threads)
            touching = hits != NO_PAIR
            answers[touching, column] = 0.0
            answers[touching, column, bvh_clearance.PAIR] = hits[touching] + column

    def _search(
        self,
        placements: Floats,
        begin: int,
        end: int,
        code: int,
        task: int,
        hits: Ids = NOT_ASKED,
        touches: NDArray[np.bool_] = NOT_ASKED_BOOL,
        found: Ids = _NOTHING,
    ) -> tuple[int, int, int]:
        """Triangle pairs found and examined, and the last pose's first pair or -1.

        Fills what is given.
        """
        others = self.T_world_others
        count, examined, bad, hit = bvh_query.search(
            self.book.entries,
            placements,
            placements if others is None else others,
            others is None,
            begin,
            end,
            code,
            task,
            0.0,
            hits,
            touches,
            found,
        )
        if bad >= 0:
            for k, T in enumerate(placements[bad]):
                reject_placement(T, f"placements[{bad}, {k}]")
        return count, examined, hit

    def _nearest(
        self,
        placements: Floats,
        begin: int,
        end: int,
        scale: float,
        answers: Floats,
    ) -> None:
        moving = self.T_world_others is None
        others = placements if moving else self.T_world_others
        of_poses = placements, others, moving, begin, end, self._depths, scale
        if answers.shape[1] == 1:
            nearest_first(*self._trees, *of_poses, answers)
        else:
            bvh_clearance.nearest(*self._trees, *of_poses, math.inf, -1.0, answers)

    def comes_near(
        self,
        placements: ArrayLike,
        margin: float,
        settled: NDArray[np.bool_] | None = None,
    ) -> tuple[NDArray[np.int8], Ids]:
        """Whether any pair comes as near as a margin, pose by pose, and which pair.

        Surfaces must be known not to meet. FAR, NEAR or UNDECIDED of
        `tree.nearest_first`, (n,), and the row of `pairs`, (n,); -1 where FAR.

        Args:
            placements: As in `first_pairs`.
            margin: [m].
            settled: Poses to leave out, (n,); FAR is answered of them.

        Raises:
            GeometryError: As in `first_pairs`; or a margin that is no distance.
        """
        if not (math.isfinite(margin) and margin >= 0.0):
            raise GeometryError(f"margin is {margin}, not a distance in metres")
        placements = self._checked(placements)
        count = len(placements)
        near, which = np.zeros(count, np.int8), np.full(count, NO_PAIR)
        if margin == 0.0:  # surfaces do not meet: the exact predicate says so
            return near, which
        if settled is None:
            settled = np.zeros(count, np.bool_)
        moving = self.T_world_others is None
        others = placements if moving else self.T_world_others
        of_poses = placements, others, moving, self._depths, margin, settled
        comes_near(*self._trees, *of_poses, near, which)
        return near, which

    def farther_than(
        self, placements: ArrayLike, lengths: ArrayLike, enough: float = 0.0
    ) -> Floats:
        """Bounds of the distance of every pair, as far as a length needs, (n, p, 2).

        (0, 0) where they meet by the exact predicate. Lower is above its length where
        they are surely farther apart. Upper bounds the distance where something as near
        was met, and is infinite elsewhere.

        Args:
            placements: As in `first_pairs`.
            lengths: Above 0, (n, p), [m]; NaN: not asked, and answered by NaN.
            enough: Below all lengths, [m]: of what is so near nothing nearer is sought.
        """
        placements = self._checked(placements)
        lengths = np.asarray(lengths, np.float64)
        asked = lengths > 0.0
        # Distances that cannot be told from the length are looked at as well.
        limits = np.where(asked, lengths * (1.0 + 1e-9), 0.0)
        answers = np.tile(np.array(bvh_clearance.NO_ANSWER), (*lengths.shape, 1))
        answers[..., bvh_clearance.UPPER] = limits
        moving = self.T_world_others is None
        others = placements if moving else self.T_world_others
        of_poses = placements, others, moving, 0, len(placements), self._depths, 1.0
        bvh_clearance.nearest(*self._trees, *of_poses, math.inf, enough, answers)
        upper = answers[..., bvh_clearance.UPPER]
        lower = np.minimum(answers[..., bvh_clearance.LOWER], upper)
        bounds = np.stack([lower, np.where(upper < limits, upper, np.inf)], axis=-1)
        # Triangles may meet although their edges are far from each other.
        seen = asked & (answers[..., bvh_clearance.EXAMINED] > 0.0)
        for k in np.flatnonzero(seen.any(axis=0)):
            rows = np.flatnonzero(seen[:, k])
            alone = replace(self, pairs=self.pairs[k : k + 1])
            bounds[rows[alone.first_contacts(placements[rows])], k] = 0.0
        return np.where(asked[..., None], bounds, np.nan)

    @cached_property
    def triangle_pairs(self) -> int:
        """How many pairs of triangles there are in all pairs of meshes."""
        counts = [tree.triangle_count for tree in self.links.trees]
        others = [tree.triangle_count for tree in self.others.trees]
        return sum(counts[a] * others[b] for a, b in self.pairs.tolist())

    @cached_property
    def _shape(self) -> tuple[int, int, int]:
        """Of the placements of one pose."""
        return len(self.links), 4, 4

    @cached_property
    def book(self) -> PairBook:
        """Where both sides' arrays lie, for kernels."""
        return PairBook(self.links.book, self.others.book, self.pairs)

    @cached_property
    def _trees(self) -> tuple[NDArray[Any], ...]:
        """What every kernel takes first."""
        links, others = self.links, self.others
        of_links = links.nodes, links.corners, links.frames
        return (*of_links, others.nodes, others.corners, others.frames, self.pairs)

    @cached_property
    def _depths(self) -> int:
        return self.links.depth + self.others.depth

    def _checked(self, placements: ArrayLike) -> Floats:
        """Placements as kernels take them: contiguous, float64, writable."""
        if (
            type(placements) is np.ndarray
            and placements.dtype == _FLOAT
            and placements.flags.carray
            and placements.ndim == 4
            and placements.shape[1:] == self._shape
        ):
            return placements  # the usual case, without the cost of asking more
        array = np.ascontiguousarray(placements, dtype=np.float64)
        if array.ndim != 4 or array.shape[1:] != self._shape:
            raise GeometryError(
                f"placements have shape {array.shape}, not (n, {len(self.links)}, 4, 4)"
            )
        return array if array.flags.writeable else array.copy()


def _packed(trees: Trees) -> PackedTrees:
    return trees if isinstance(trees, PackedTrees) else PackedTrees(trees)
