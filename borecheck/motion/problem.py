"""Who must not touch whom, along which waypoints: the records of a motion."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import check_transform
from borecheck.errors import GeometryError, UsageError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import surface
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.triangles.placing import placed_bounds
from borecheck.geometry.triangles.topology import Topology
from borecheck.motion.bounds import Route, mesh_radius, refuse_skewed, route
from borecheck.motion.swept_boxes import LARGEST_PLACE
from borecheck.plans.corridor import Corridor
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import WORLD

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Passage:
    """A part that may be in an obstacle, within a corridor; both as indices.

    Attributes:
        part: The needle, among a problem's parts.
        obstacle: The patient, among its obstacles.
        corridor: Where the one may be in the other, in the world's frame.
    """

    part: int
    obstacle: int
    corridor: Corridor


@dataclass(frozen=True, eq=False)
class Body:
    """A surface that takes part, fixed to a frame of the chain or to the world.

    Attributes:
        name: For people.
        mesh: Its triangles in its own frame.
        frame: The chain's frame it is fixed to, or WORLD.
        T_frame_mesh: Its placement in that frame; the identity for parts of links.
        role: Of an obstacle: scanner, couch, patient or other.
    """

    name: str
    mesh: TriangleMesh
    frame: int = WORLD
    T_frame_mesh: Array = field(default_factory=lambda: np.eye(4))
    role: str = "other"

    def __post_init__(self) -> None:
        T = check_transform(self.T_frame_mesh, f"placement of {self.name}")
        if self.frame != WORLD and not np.array_equal(T, np.eye(4)):
            raise GeometryError(f"{self.name}: a link's mesh must be in its frame")
        object.__setattr__(self, "T_frame_mesh", T)

    @cached_property
    def tree(self) -> MeshTree:
        """Bounding-volume tree, built on the mesh's first use anywhere."""
        return surface(self.mesh).tree

    @cached_property
    def topology(self) -> Topology:
        """Closedness and components, found on the mesh's first use anywhere."""
        return surface(self.mesh).topology

    @cached_property
    def one_corner_each(self) -> Array:
        """A corner of every connected component, (c, 3), [m]."""
        return surface(self.mesh).representatives

    @cached_property
    def undo(self) -> Array:
        """Inverse of T_frame_mesh, (4, 4)."""
        return np.array(np.linalg.inv(self.T_frame_mesh), dtype=np.float64)

    @cached_property
    def bounds(self) -> Array:
        """Bounds of the mesh where it stands in its frame, (2, 3), [m]."""
        return np.array(placed_bounds(self.T_frame_mesh, self.mesh.bounds))

    @cached_property
    def radius(self) -> float:
        """Largest distance of a vertex from the origin of the frame, [m]."""
        return mesh_radius(self.mesh.vertices)


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

    def place(self, chain: JointChain, time: float) -> Array:
        """T_world_frame (frames, 4, 4) at a time in units of waypoints."""
        if time == int(time) and self.is_placed[int(time)]:
            return np.asarray(self.placed[int(time)])
        return chain.placed(self.joints_at(time))


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
        allowed: Pairs of parts that may touch, i < j, and the reason.
        doubt: Why nothing may be called clear, whatever is proven; or None.
    """

    chain: JointChain
    parts: tuple[Body, ...]
    obstacles: tuple[Body, ...]
    self_pairs: tuple[tuple[int, int], ...] = ()
    margin: float = 0.0
    excluded: frozenset[tuple[int, int]] = frozenset()
    passages: tuple[Passage, ...] = ()
    allowed: tuple[tuple[int, int, str], ...] = ()
    doubt: str | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.margin) and self.margin >= 0.0):
            raise UsageError(f"margin is {self.margin}, not a distance in metres")
        refuse_skewed(self.chain)
        for part in self.parts:
            if not 0 <= part.frame < self.chain.frame_count:
                raise GeometryError(f"{part.name} is fixed to no frame of the chain")
        for passage in self.passages:
            patient = self.obstacles[passage.obstacle]
            if not np.array_equal(patient.T_frame_mesh, np.eye(4)):
                raise GeometryError(f"{patient.name}: its mesh must be in the world")

    @cached_property
    def within(self) -> "PathProblem | None":
        """The same with polyhedra within the round shapes; None: there are none."""
        bodies = (*self.parts, *self.obstacles)
        if all(body.mesh.inner is body.mesh for body in bodies):
            return None
        parts, obstacles = (
            tuple(replace(body, mesh=body.mesh.inner) for body in all_of)
            for all_of in (self.parts, self.obstacles)
        )
        return replace(self, parts=parts, obstacles=obstacles)

    @cached_property
    def excess(self) -> dict[str, float]:
        """How far bodies of a name may be larger than their shapes, [m]."""
        found: dict[str, float] = {}
        for body in (*self.parts, *self.obstacles):
            found[body.name] = max(body.mesh.excess, found.get(body.name, 0.0))
        return found

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

    def passage_pair(self, passage: Passage) -> Pair:
        """Needle and patient as any part and obstacle: where no corridor is needed."""
        part, obstacle = self.parts[passage.part], self.obstacles[passage.obstacle]
        return Pair(part, obstacle, self.margin)

    @property
    def obstacle_pair_count(self) -> int:
        """How many of the pairs, the first ones, are of a part and an obstacle."""
        return len(self.pairs) - len(self.self_pairs)

    @cached_property
    def routes(self) -> tuple[Route, ...]:
        """The way through the chain from the standing to the moving body of a pair."""
        return tuple(
            route(self.chain, pair.standing.frame, pair.moving.frame)
            for pair in self.pairs
        )


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


def _checked(chain: JointChain, waypoints: ArrayLike) -> Array:
    points = np.array(waypoints, dtype=np.float64)
    if points.ndim != 2 or len(points) == 0 or points.shape[1] < chain.joint_count:
        raise UsageError(
            f"waypoints have shape {points.shape}, not (n, {chain.joint_count})"
        )
    if not np.isfinite(points).all():
        raise UsageError("a waypoint holds a number that is not finite")
    # One configuration is a motion that stands still.
    return np.repeat(points, 2, axis=0) if len(points) == 1 else points
