"""Certifies a motion between its waypoints: clear only if every instant is.

The motion is straight in the configuration between waypoints. The whole of it is tried
at once: how far points stray from the chord between both ends is bounded
(`motion_bounds`), and if boxes or planes separate the surfaces by more than that, all
of it is clear (`swept_boxes`). What stays open is halved in time (`path_kernels`) until
it is proven clear, shown to be in contact, or too short to go on: that is `unknown`.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck import path_kernels
from borecheck.bvh import MeshTree
from borecheck.errors import GeometryError, UsageError
from borecheck.mesh import TriangleMesh
from borecheck.motion_bounds import WORLD, Chain, Route, mesh_radius, route
from borecheck.passage import Passage
from borecheck.passage_search import examine_passage
from borecheck.path_containment import examine_containment
from borecheck.path_distance import by_distance
from borecheck.path_outcome import (
    PathVerdict,
    Stretch,
    Timeline,
    in_doubt,
    path_verdict,
)
from borecheck.se3 import check_transform
from borecheck.solid import Topology, topology
from borecheck.swept_boxes import LARGEST_PLACE

Array = NDArray[np.float64]

# Pieces during which nothing moves farther are not halved, [m].
RESOLUTION = 1e-6
# Nor pieces with contact at both ends during which nothing moves farther than this:
# inside a stretch of contact, where exactly there is contact matters little.
CONTACT_LENGTH = 2e-3
# Pieces looked at for one pair before the rest is left undecided.
PIECE_LIMIT = 20_000
# Of these so many by boxes and planes: where that does not do, more of it will not.
QUICK_LIMIT = 1_000


@dataclass(frozen=True, eq=False)
class Body:
    """A surface that takes part, fixed to a frame of the chain or to the world.

    Attributes:
        name: For people.
        mesh: Its triangles in its own frame.
        frame: The chain's frame it is fixed to, or WORLD.
        T_frame_mesh: Its placement in that frame; the identity for parts of links.
    """

    name: str
    mesh: TriangleMesh
    frame: int = WORLD
    T_frame_mesh: Array = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        T = check_transform(self.T_frame_mesh, f"placement of {self.name}")
        if self.frame != WORLD and not np.array_equal(T, np.eye(4)):
            raise GeometryError(f"{self.name}: a link's mesh must be in its frame")
        object.__setattr__(self, "T_frame_mesh", T)

    @cached_property
    def tree(self) -> MeshTree:
        """Bounding-volume tree, built on first use."""
        return MeshTree.of(self.mesh)

    @cached_property
    def topology(self) -> Topology:
        """Closedness and components, found on first use."""
        return topology(self.mesh)

    @cached_property
    def one_corner_each(self) -> Array:
        """A corner of every connected component, (c, 3), [m]."""
        first = np.unique(self.topology.component, return_index=True)[1]
        return self.mesh.vertices[self.mesh.triangles[first, 0]]

    @cached_property
    def radius(self) -> float:
        """Largest distance of a vertex from the origin of the frame, [m]."""
        return mesh_radius(self.mesh.vertices)


@dataclass(frozen=True, eq=False)
class PathProblem:
    """A robot, what stands around it, and who must not touch whom.

    Attributes:
        chain: The robot's joints.
        parts: Surfaces of its links.
        obstacles: Surfaces in the world.
        self_pairs: Pairs of parts that must not touch, as indices.
        margin: Required clearance to obstacles (not among parts), [m].
        excluded: Pairs (part, obstacle) that are not examined; the caller answers
            for them.
        passages: Pairs that may touch within a corridor, and only there.
        doubt: Why nothing may be called clear, whatever is proven; or None.
    """

    chain: Chain
    parts: tuple[Body, ...]
    obstacles: tuple[Body, ...]
    self_pairs: tuple[tuple[int, int], ...] = ()
    margin: float = 0.0
    excluded: frozenset[tuple[int, int]] = frozenset()
    passages: tuple[Passage, ...] = ()
    doubt: str | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.margin) and self.margin >= 0.0):
            raise UsageError(f"margin is {self.margin}, not a distance in metres")
        for part in self.parts:
            if not 0 <= part.frame < self.chain.frame_count:
                raise GeometryError(f"{part.name} is fixed to no frame of the chain")
        for passage in self.passages:
            patient = self.obstacles[passage.obstacle]
            if not np.array_equal(patient.T_frame_mesh, np.eye(4)):
                raise GeometryError(f"{patient.name}: its mesh must be in the world")

    @cached_property
    def pairs(self) -> tuple["Pair", ...]:
        """Everything that is examined, but for passages."""
        apart = self.excluded | {(p.part, p.obstacle) for p in self.passages}
        against_obstacles = [
            Pair(part, obstacle, self.margin)
            for i, part in enumerate(self.parts)
            for j, obstacle in enumerate(self.obstacles)
            if (i, j) not in apart
        ]
        within_robot = [
            Pair(self.parts[i], self.parts[j], 0.0) for i, j in self.self_pairs
        ]
        return (*against_obstacles, *within_robot)

    @cached_property
    def routes(self) -> tuple[Route, ...]:
        """The way through the chain from the standing to the moving body of a pair."""
        return tuple(
            route(self.chain, pair.standing.frame, pair.moving.frame)
            for pair in self.pairs
        )


@dataclass(frozen=True, eq=False)
class Pair:
    """Two surfaces that must not come nearer than the margin, [m]."""

    moving: Body
    standing: Body
    margin: float

    @property
    def names(self) -> tuple[str, str]:
        """Names of the part and the obstacle (or the other part)."""
        return self.moving.name, self.standing.name

    @cached_property
    def undo(self) -> Array:
        """Inverse of the standing mesh's placement in its frame."""
        return np.array(np.linalg.inv(self.standing.T_frame_mesh), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Motion:
    """The waypoints as joint values, and what is remembered about them.

    Attributes:
        theta: Joint values at the waypoints, (k, joints).
        largest: Largest |theta| of every joint, (joints,).
        placed: T_world_frame at waypoints where it was needed, (k, frames, 4, 4).
        is_placed: Where it was, (k,).
        bends: Bends of runs of waypoints, in the order of a tree of halves.
        has_bend: Which are there.
    """

    theta: Array
    largest: Array
    placed: Array
    is_placed: NDArray[np.bool_]
    bends: Array
    has_bend: NDArray[np.bool_]

    def joints_at(self, time: float) -> Array:
        """Joint values at a time in units of waypoints; waypoints are met exactly."""
        first = min(int(time), len(self.theta) - 2)
        if time == first + 1:
            return self.theta[first + 1]
        change = self.theta[first + 1] - self.theta[first]
        return self.theta[first] + (time - first) * change

    def place(self, chain: Chain, time: float) -> Array:
        """T_world_frame (frames, 4, 4) at a time in units of waypoints."""
        if time == int(time) and self.is_placed[int(time)]:
            return np.asarray(self.placed[int(time)])
        theta = self.joints_at(time)
        placed = np.zeros((chain.frame_count, 4, 4))
        path_kernels.place_all(
            theta, chain.parent, chain.origin, chain.kind, chain.axis, placed
        )
        return placed


def search(
    problem: PathProblem,
    waypoints: ArrayLike,
    *,
    resolution: float = RESOLUTION,
    piece_limit: int = PIECE_LIMIT,
) -> PathVerdict:
    """The verdict for every instant of a motion.

    Args:
        problem: Who must not touch whom.
        waypoints: Configurations, (n, nq), [rad] and [m]; straight in between.
        resolution: Stretches during which nothing moves farther are not halved, [m].
        piece_limit: Pieces looked at for one pair before the rest is `unknown`.

    Raises:
        UsageError: No waypoint, wrong length, or numbers that are not finite.
        GeometryError: Farther from the origin than rounding bounds allow.
    """
    if not (np.isfinite(resolution) and resolution > 0.0):
        raise UsageError(f"resolution is {resolution}, not a distance in metres")
    motion = path_motion(problem, waypoints)
    timeline = Timeline(len(motion.theta) - 1.0)
    for pair, way in zip(problem.pairs, problem.routes, strict=True):
        _examine(problem.chain, pair, way, motion, resolution, piece_limit, timeline)
    for pair, way in zip(problem.pairs, problem.routes, strict=True):
        examine_containment(problem.chain, pair, way, motion, timeline)
    for passage in problem.passages:
        needle = problem.parts[passage.part]
        patient = problem.obstacles[passage.obstacle]
        examine_passage(
            problem.chain, needle, patient, passage.corridor, motion, timeline
        )
    verdict = path_verdict(timeline, len(problem.pairs) + len(problem.passages))
    return verdict if problem.doubt is None else in_doubt(verdict, problem.doubt)


def _checked(chain: Chain, waypoints: ArrayLike) -> Array:
    points = np.array(waypoints, dtype=np.float64)
    if points.ndim != 2 or len(points) == 0 or points.shape[1] < chain.joint_count:
        raise UsageError(
            f"waypoints have shape {points.shape}, not (n, {chain.joint_count})"
        )
    if not np.isfinite(points).all():
        raise UsageError("a waypoint holds a number that is not finite")
    # One configuration is a motion that stands still.
    return np.repeat(points, 2, axis=0) if len(points) == 1 else points


def path_motion(problem: PathProblem, waypoints: ArrayLike) -> Motion:
    """The waypoints as joint values, checked.

    Raises:
        UsageError: No waypoint, wrong length, or numbers that are not finite.
        GeometryError: Farther from the origin than rounding bounds allow.
    """
    chain = problem.chain
    points = _checked(chain, waypoints)
    theta = chain.thetas(points)
    largest = np.abs(theta).max(axis=0)
    reach = chain.extent(largest)
    reach += max((part.radius for part in problem.parts), default=0.0)
    for obstacle in problem.obstacles:
        shift = float(np.linalg.norm(obstacle.T_frame_mesh[:3, 3]))
        reach = max(reach, obstacle.radius + shift)
    if reach > LARGEST_PLACE:
        raise GeometryError(
            f"the scene reaches {reach:.3g} m from the origin; rounding bounds hold "
            f"up to {LARGEST_PLACE:g} m"
        )
    runs = 4 * len(points)
    return Motion(
        theta,
        largest,
        np.zeros((len(points), chain.frame_count, 4, 4)),
        np.zeros(len(points), np.bool_),
        np.zeros((runs, chain.frame_count)),
        np.zeros(runs, np.bool_),
    )


def _examine(
    chain: Chain,
    pair: Pair,
    way: Route,
    motion: Motion,
    resolution: float,
    piece_limit: int,
    timeline: Timeline,
) -> None:
    """Adds what is found about a pair to the timeline."""
    a, b = pair.moving, pair.standing
    quick = min(piece_limit, QUICK_LIMIT)
    findings, found, looked, judged = path_kernels.examine(
        motion.theta,
        chain.parent,
        chain.origin,
        chain.kind,
        chain.axis,
        chain.length,
        way.joints,
        way.forward,
        a.radius,
        motion.largest,
        a.frame,
        b.frame,
        pair.undo,
        b.T_frame_mesh,
        pair.margin,
        resolution,
        CONTACT_LENGTH,
        quick,
        a.tree.nodes,
        a.tree.corners,
        a.tree.frames[0],
        b.tree.nodes,
        b.tree.corners,
        b.tree.frames[0],
        a.tree.depth + b.tree.depth,
        motion.placed,
        motion.is_placed,
        motion.bends,
        motion.has_bend,
        timeline.settled(),
        np.zeros((64, 3)),
    )
    timeline.count(looked, judged)
    if looked > quick:
        findings, looked = _examined_by_distance(
            chain, pair, way, motion, findings[:found], resolution, piece_limit
        )
        found = len(findings)
        timeline.count(looked, looked)
    if found:
        timeline.add(pair.names, findings[:found])
    if looked > piece_limit:
        timeline.note(pair.names, f"gave up after {looked} pieces")


def _examined_by_distance(
    chain: Chain,
    pair: Pair,
    way: Route,
    motion: Motion,
    findings: Array,
    resolution: float,
    limit: int,
) -> tuple[Array, int]:
    """Findings in which what was left undecided is examined by true distances."""
    rows: list[tuple[float, float, float]] = []
    looked = 0
    for begin, end, outcome in _joined(findings):
        if outcome != path_kernels.UNDECIDED:
            rows.append((begin, end, outcome))
            continue
        found, count = by_distance(
            chain,
            pair,
            way,
            motion,
            (begin, end),
            (resolution, CONTACT_LENGTH),
            max(limit - looked, 0),
        )
        rows += found
        looked += count
    return np.array(rows, dtype=np.float64).reshape(-1, 3), looked


def _joined(findings: Array) -> list[tuple[float, float, float]]:
    """Findings in order, neighbouring ones of equal outcome as one."""
    joined: list[tuple[float, float, float]] = []
    for row in findings:
        begin, end, outcome = (float(x) for x in row)
        if joined and joined[-1][1] == begin and joined[-1][2] == outcome:
            joined[-1] = (joined[-1][0], end, outcome)
        else:
            joined.append((begin, end, outcome))
    return joined


__all__ = ["Body", "Pair", "PathProblem", "PathVerdict", "Stretch", "search"]
