"""All checkers over the same poses, and the cause of every disagreement.

Every checker sees the same placed float64 vertices. Where they differ about a pair of
triangles, exact arithmetic says who is right, and `causes` says why the other is not.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.causes import cause_of
from borecheck.errors import UsageError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import (
    CHECKERS,
    PRUNINGS,
    Found,
    Surface,
    check_pruning,
    checker_name,
    contacts,
    surface,
)
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.geometry.triangles.solid import contained
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]

WORLD = np.eye(4)


@dataclass(frozen=True)
class CheckerSummary:
    """What one checker said over all poses.

    Attributes:
        contact_poses: Numbers of the poses at which it sees contact.
        triangle_pairs: Pairs in contact, over all poses.
        pairs_examined: Pairs its narrowphase looked at.
        pairs_pruned: Pairs it did not need to look at.
        seconds: Time taken, all poses.
    """

    contact_poses: tuple[int, ...] = ()
    triangle_pairs: int = 0
    pairs_examined: int = 0
    pairs_pruned: int = 0
    seconds: float = 0.0


@dataclass(frozen=True)
class CheckerDisagreement:
    """Two triangles about which the checkers differ, with the triangles themselves.

    Attributes:
        pose: Number of the pose.
        link: Part of the robot.
        obstacle: Obstacle, or other part.
        link_triangle: Triangle of the link; -1 where no pair of triangles is meant.
        obstacle_triangle: Triangle of the obstacle.
        verdicts: Contact or not, by checker.
        exact: What exact arithmetic says.
        cause: Why the others differ; None if no known cause fits.
        corners: The two placed triangles, (2, 3, 3), [m].
    """

    pose: int
    link: str
    obstacle: str
    link_triangle: int
    obstacle_triangle: int
    verdicts: dict[str, bool]
    exact: bool
    cause: str | None
    corners: tuple[tuple[tuple[float, ...], ...], ...]


@dataclass(frozen=True, eq=False)
class Comparison:
    """The outcome of `compare`.

    Attributes:
        joint_names: Order of every q.
        poses: Configurations, (n, joints).
        pruning: How pairs were kept from the narrowphases.
        checkers: Summary by checker.
        disagreements: Every pair of triangles about which two checkers differ.
        pose_verdicts: For every pose contact or not, by checker; containment included
            for `exact` as "contained".
        contained: Per pose, what only containment sees: texts.
        interrupted: Whether the user stopped it before the last pose.
    """

    joint_names: tuple[str, ...]
    poses: tuple[tuple[float, ...], ...]
    pruning: str
    checkers: dict[str, CheckerSummary]
    disagreements: tuple[CheckerDisagreement, ...]
    pose_verdicts: tuple[dict[str, bool], ...]
    contained: tuple[tuple[str, ...], ...]
    interrupted: bool = False

    @property
    def unexplained(self) -> tuple[CheckerDisagreement, ...]:
        """Disagreements for which no known cause fits."""
        return tuple(d for d in self.disagreements if d.cause is None)


def compare(
    robot: Robot,
    scene: Scene,
    qs: ArrayLike,
    *,
    checkers: Sequence[str] = CHECKERS,
    pruning: str = "bvh",
    progress: Progress | None = None,
    keep_finished: bool = False,
) -> Comparison:
    """All checkers at every configuration, with every disagreement explained.

    Args:
        robot: From `load_robot`.
        scene: From `load_scene`.
        qs: Configurations, (n, joints), [m] and [rad].
        checkers: Which ones; `exact` is always among them, as the judge.
        pruning: none, coal or bvh.
        progress: Called with poses done and in all.
        keep_finished: Return what is finished when the user interrupts.

    Raises:
        UsageError: No configuration.
        JointLimitError: A configuration beyond a joint limit.
    """
    names = tuple(dict.fromkeys(["exact", *map(checker_name, checkers)]))
    check_pruning(pruning)
    poses = _poses(robot, qs)
    _warm_up(names)
    gathered = _Gathered(names)
    interrupted = False
    try:
        for number, q in enumerate(poses):
            gathered.begin_pose()
            _compare_pose(robot, scene, number, q, pruning, gathered)
            if progress is not None:
                progress(number + 1, len(poses))
    except KeyboardInterrupt:
        if not keep_finished:
            raise
        gathered.drop_unfinished()
        interrupted = True
    poses = poses[: len(gathered.pose_verdicts)]
    return Comparison(
        joint_names=robot.model.joint_names,
        poses=tuple(tuple(float(v) for v in q) for q in poses),
        pruning=pruning,
        checkers=gathered.summaries,
        disagreements=tuple(gathered.disagreements),
        pose_verdicts=tuple(gathered.pose_verdicts),
        contained=tuple(gathered.contained),
        interrupted=interrupted,
    )


def _poses(robot: Robot, qs: ArrayLike) -> Array:
    """The configurations (n, joints), each within the limits."""
    try:
        poses = np.atleast_2d(np.array(qs, dtype=np.float64))
    except (TypeError, ValueError) as error:
        raise UsageError(f"configurations are no numbers: {error}") from None
    if len(poses) == 0 or np.size(qs) == 0 != len(robot.model.free_joints):
        raise UsageError("there is no configuration to compare at")
    return np.array([robot.model.check_limits(q) for q in poses])


def _warm_up(names: Sequence[str]) -> None:
    """Loads or compiles every kernel, so that no checker is billed for it."""
    triangle = TriangleMesh("warm-up", np.eye(3), np.array([[0, 1, 2]]))
    for name in names:
        for pruning in PRUNINGS:
            a, b = Surface(triangle), Surface(triangle)
            contacts(a, WORLD, b, WORLD, name, pruning, same_vertices=True)


class _Gathered:
    """What grows while poses are compared."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self.summaries = {name: CheckerSummary() for name in names}
        self.disagreements: list[CheckerDisagreement] = []
        self.pose_verdicts: list[dict[str, bool]] = []
        self.contained: list[tuple[str, ...]] = []
        self.begin_pose()

    def begin_pose(self) -> None:
        """Remembers how far it is, should the pose not be finished."""
        self._before = (dict(self.summaries), len(self.disagreements))
        self._finished = len(self.contained)

    def drop_unfinished(self) -> None:
        """Takes back what belongs to a pose that was interrupted."""
        if len(self.contained) > self._finished:
            return
        self.summaries, known = self._before
        del self.disagreements[known:], self.pose_verdicts[self._finished :]

    def add(self, name: str, found: Found, total: int, seconds: float) -> None:
        summary = self.summaries[name]
        self.summaries[name] = replace(
            summary,
            triangle_pairs=summary.triangle_pairs + len(found.pairs),
            pairs_examined=summary.pairs_examined + found.examined,
            pairs_pruned=summary.pairs_pruned + total - found.examined,
            seconds=summary.seconds + seconds,
        )

    def close_pose(
        self, number: int, seen: dict[str, bool], contained: list[str]
    ) -> None:
        for name in self.names:
            if seen[name]:
                summary = self.summaries[name]
                poses = (*summary.contact_poses, number)
                self.summaries[name] = replace(summary, contact_poses=poses)
        self.pose_verdicts.append(seen)
        self.contained.append(tuple(contained))


def surface_pairs(
    robot: Robot, scene: Scene, placements: dict[str, Array]
) -> Iterator[tuple[str, str, Surface, Array, Surface, Array]]:
    """Every pair that is to be examined: parts with obstacles, then self pairs."""
    for part in robot.parts:
        a, T_a = surface(part.mesh), placements[part.link]
        for obstacle in scene.obstacles:
            yield part.mesh.name, obstacle.name, a, T_a, surface(obstacle.mesh), WORLD
    for i, j in robot.self_pairs:
        first, second = robot.parts[i], robot.parts[j]
        yield (
            first.mesh.name,
            second.mesh.name,
            surface(first.mesh),
            placements[first.link],
            surface(second.mesh),
            placements[second.link],
        )


def _compare_pose(
    robot: Robot,
    scene: Scene,
    number: int,
    q: Array,
    pruning: str,
    gathered: _Gathered,
) -> None:
    placements = robot.placements(q)
    seen = dict.fromkeys(gathered.names, False)
    hidden = []
    for link, obstacle, a, T_a, b, T_b in surface_pairs(robot, scene, placements):
        found: dict[str, Found] = {}
        if "coal" in gathered.names:  # placing is not what Coal is timed for
            a.coal.placed(T_a)
            b.coal.placed(T_b)
        for name in gathered.names:
            start = time.perf_counter()
            found[name] = contacts(a, T_a, b, T_b, name, pruning, same_vertices=True)
            seconds = time.perf_counter() - start
            gathered.add(name, found[name], a.count * b.count, seconds)
            seen[name] = seen[name] or len(found[name].pairs) > 0
        gathered.disagreements += _differences(
            number, link, obstacle, found, a, T_a, b, T_b
        )
        if len(found["exact"].pairs) == 0:
            hidden += _contained(link, obstacle, a, T_a, b, T_b)
    gathered.close_pose(number, seen, hidden)


def _contained(
    link: str, obstacle: str, a: Surface, T_a: Array, b: Surface, T_b: Array
) -> list[str]:
    from borecheck.contact.containment import boxes_apart

    if boxes_apart(a, T_a, b, T_b):
        return []
    answer = contained(
        place_mesh(T_a, a.mesh), place_mesh(T_b, b.mesh), a.topology, b.topology
    )
    return [] if answer.kind == "none" else [f"{link}, {obstacle}: {answer.reason}"]


def _differences(
    number: int,
    link: str,
    obstacle: str,
    found: dict[str, Found],
    a: Surface,
    T_a: Array,
    b: Surface,
    T_b: Array,
) -> list[CheckerDisagreement]:
    sets = {name: {tuple(p) for p in f.pairs.tolist()} for name, f in found.items()}
    everywhere = set.intersection(*sets.values())
    disputed = sorted(set.union(*sets.values()) - everywhere)
    if not disputed:
        return []
    corners_a = place_mesh(T_a, a.mesh).corners
    corners_b = place_mesh(T_b, b.mesh).corners
    return [
        judged(
            number,
            (link, obstacle, i, j),
            {name: (i, j) in pairs for name, pairs in sets.items()},
            corners_a[i],
            corners_b[j],
        )
        for i, j in disputed
    ]


def judged(
    pose: int,
    where: tuple[str, str, int, int],
    verdicts: dict[str, bool],
    first: Array,
    second: Array,
) -> CheckerDisagreement:
    """One disputed pair of triangles with its cause, by exact arithmetic."""
    truth, cause = cause_of(first, second, verdicts)
    return CheckerDisagreement(
        pose=pose,
        link=where[0],
        obstacle=where[1],
        link_triangle=where[2],
        obstacle_triangle=where[3],
        verdicts=verdicts,
        exact=truth,
        cause=cause,
        corners=(_nested(first), _nested(second)),
    )


def _nested(triangle: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(x) for x in point) for point in triangle)


def to_json(result: Comparison) -> dict[str, Any]:
    """Plain values for `json.dumps`, as the contract names them."""
    return {
        "interrupted": result.interrupted,
        "poses": [
            {
                "q": dict(zip(result.joint_names, q, strict=True)),
                "verdicts": verdicts,
                "contained": list(inside),
            }
            for q, verdicts, inside in zip(
                result.poses, result.pose_verdicts, result.contained, strict=True
            )
        ],
        "pruning": result.pruning,
        "checkers": {
            name: {
                "contact_poses": list(summary.contact_poses),
                "triangle_pairs": summary.triangle_pairs,
                "pairs_examined": summary.pairs_examined,
                "pairs_pruned": summary.pairs_pruned,
                "seconds": summary.seconds,
            }
            for name, summary in result.checkers.items()
        },
        "disagreements": [
            {
                "pose": d.pose,
                "link": d.link,
                "obstacle": d.obstacle,
                "link_triangle": d.link_triangle,
                "obstacle_triangle": d.obstacle_triangle,
                "verdicts": d.verdicts,
                "exact": d.exact,
                "cause": d.cause,
                "corners": d.corners,
            }
            for d in result.disagreements
        ],
    }
