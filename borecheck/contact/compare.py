"""All checkers over the same poses, and the cause of every disagreement.

Every checker sees the same placed float64 vertices. Where they differ about a pair of
triangles, exact arithmetic says who is right, and `causes` says why the other is not.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.comparison import (
    CheckerDisagreement,
    Comparison,
    Gathered,
    judged,
)
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
from borecheck.robots.given import (
    Given,
    configuration,
    configurations,
    refuse_others,
)
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]

WORLD = np.eye(4)


def compare(
    robot: Robot,
    scene: Scene,
    qs: ArrayLike | Sequence[Given] | Given,
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
    refuse_others(robot, scene)
    if isinstance(checkers, str):
        raise UsageError(f"checkers is a string: give a list, [{checkers!r}]")
    names = tuple(dict.fromkeys(["exact", *map(checker_name, checkers)]))
    check_pruning(pruning)
    poses = _poses(robot, qs)
    _warm_up(names)
    gathered = Gathered(names)
    interrupted = False
    try:
        for done, q in enumerate(poses, 1):
            gathered.begin_pose()
            _compare_pose(robot, scene, q, pruning, gathered)
            if progress is not None:
                progress(done, len(poses))
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
        pose_obstacles=tuple(gathered.pose_obstacles),
        touching_itself=tuple(sorted(gathered.touching_itself)),
        contained=tuple(gathered.contained),
        interrupted=interrupted,
    )


def _poses(robot: Robot, qs: Any) -> Array:
    """The configurations (n, joints), each within the limits."""
    if isinstance(qs, str | Mapping):  # one pose, as `check` takes it
        return configuration(robot, qs)[None]
    one = isinstance(qs, np.ndarray | Sequence) and np.ndim(qs[:1]) < 2  # of numbers
    named = isinstance(qs, Sequence) and any(isinstance(q, str | Mapping) for q in qs)
    many: Any = [qs] if one and not named and len(qs) else qs
    poses = configurations(robot, many) if len(many) else np.zeros((0, 0))
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


@dataclass(frozen=True, eq=False)
class PlacedPair:
    """Two placed surfaces that are to be examined.

    Attributes:
        names: Part, and obstacle or other part.
        a: Surface of the part.
        T_a: Its placement, (4, 4).
        b: The other surface.
        T_b: Its placement.
        links: The two links, where the robot itself is meant.
    """

    names: tuple[str, str]
    a: Surface
    T_a: Array
    b: Surface
    T_b: Array
    links: tuple[str, str] | None = None


def placed_pairs(
    robot: Robot, scene: Scene, placements: dict[str, Array]
) -> Iterator[PlacedPair]:
    """Every pair that is to be examined: parts with obstacles, then self pairs."""
    for part in robot.parts:
        a, T_a = surface(part.mesh), placements[part.link]
        for obstacle in scene.obstacles:
            names = (part.mesh.name, obstacle.name)
            yield PlacedPair(names, a, T_a, surface(obstacle.mesh), WORLD)
    for i, j in robot.self_pairs:
        first, second = robot.parts[i], robot.parts[j]
        yield PlacedPair(
            (first.mesh.name, second.mesh.name),
            surface(first.mesh),
            placements[first.link],
            surface(second.mesh),
            placements[second.link],
            (first.link, second.link),
        )


def _compare_pose(
    robot: Robot, scene: Scene, q: Array, pruning: str, gathered: Gathered
) -> None:
    """Adds what all checkers say at the next pose."""
    around, itself = (dict.fromkeys(gathered.names, False) for _ in range(2))
    hidden = []
    for pair in placed_pairs(robot, scene, robot.placements(q)):
        found = _asked(pair, pruning, gathered)
        seen = around if pair.links is None else itself
        for name in gathered.names:
            seen[name] = seen[name] or len(found[name].pairs) > 0
        gathered.disagreements += _differences(gathered.number, pair, found)
        if len(found["exact"].pairs) == 0:
            hidden += _contained(pair)
        elif pair.links is not None:
            gathered.touching_itself.add(pair.links)
    whole = {name: around[name] or itself[name] for name in gathered.names}
    gathered.close_pose(whole, around, hidden)


def _asked(pair: PlacedPair, pruning: str, gathered: Gathered) -> dict[str, Found]:
    """What every checker finds of one pair of surfaces, timed."""
    found: dict[str, Found] = {}
    a, T_a, b, T_b = pair.a, pair.T_a, pair.b, pair.T_b
    if "coal" in gathered.names:  # placing is not what Coal is timed for
        a.coal.placed(T_a)
        b.coal.placed(T_b)
    for name in gathered.names:
        start = time.perf_counter()
        found[name] = contacts(a, T_a, b, T_b, name, pruning, same_vertices=True)
        seconds = time.perf_counter() - start
        gathered.add(name, found[name], a.count * b.count, seconds)
    return found


def _contained(pair: PlacedPair) -> list[str]:
    from borecheck.contact.containment import boxes_apart

    if boxes_apart(pair.a, pair.T_a, pair.b, pair.T_b):
        return []
    answer = contained(
        place_mesh(pair.T_a, pair.a.mesh),
        place_mesh(pair.T_b, pair.b.mesh),
        pair.a.topology,
        pair.b.topology,
    )
    names = ", ".join(pair.names)
    return [] if answer.kind == "none" else [f"{names}: {answer.reason}"]


def _differences(
    number: int, pair: PlacedPair, found: dict[str, Found]
) -> list[CheckerDisagreement]:
    """Pairs of triangles about which the checkers differ."""
    sets = {name: {tuple(p) for p in f.pairs.tolist()} for name, f in found.items()}
    everywhere = set.intersection(*sets.values())
    disputed = sorted(set.union(*sets.values()) - everywhere)
    if not disputed:
        return []
    corners_a = place_mesh(pair.T_a, pair.a.mesh).corners
    corners_b = place_mesh(pair.T_b, pair.b.mesh).corners
    return [
        judged(
            number,
            (*pair.names, i, j),
            {name: (i, j) in pairs for name, pairs in sets.items()},
            corners_a[i],
            corners_b[j],
        )
        for i, j in disputed
    ]
