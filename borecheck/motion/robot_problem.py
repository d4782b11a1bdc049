"""Robot and scene as the certified search sees them: chain, bodies, pairs, passages.

`motion.search` knows frames and surfaces only. Here a robot's joints become its chain,
its parts and the scene's obstacles become bodies, and needle and patient become a
passage: they may touch within the plan's corridor, and nowhere else.
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.motion.bounds import FIXED, SLIDES, TURNS, WORLD, Chain
from borecheck.motion.problem import Body, Passage, PathProblem
from borecheck.plans.corridor import Corridor
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]


def path_problem(
    robot: Robot,
    scene: Scene,
    margin: float = 0.0,
    corridor: Corridor | None = None,
) -> PathProblem:
    """Robot and scene as the certified search sees them.

    With a corridor, needle and patient are a passage: they may touch in it alone.
    """
    frame_of, chain = chain_of(robot)
    parts = tuple(
        Body(part.mesh.name, part.mesh, frame_of[part.link]) for part in robot.parts
    )
    obstacles = tuple(Body(o.name, o.mesh, role=o.role) for o in scene.obstacles)
    passages = tuple(
        Passage(i, j, corridor)
        for i, part in enumerate(robot.parts)
        for j, obstacle in enumerate(scene.obstacles)
        if corridor is not None and robot.may_enter(part.link, obstacle.role)
    )
    return PathProblem(
        chain,
        parts,
        obstacles,
        robot.self_pairs,
        margin,
        passages=passages,
        allowed=_allowed(robot),
        doubt=scene.doubt,
    )


def _allowed(robot: Robot) -> tuple[tuple[int, int, str], ...]:
    """Pairs of parts whose links may touch by the robot's description."""
    reasons = {frozenset((a, b)): reason for a, b, reason in robot.allowed_contacts}
    links = [part.link for part in robot.parts]
    return tuple(
        (i, j, reasons[frozenset((links[i], links[j]))])
        for j in range(len(links))
        for i in range(j)
        if frozenset((links[i], links[j])) in reasons
    )


def chain_of(robot: Robot) -> tuple[dict[str, int], Chain]:
    """Frame number of every link, and the chain; the root stands fixed in the scene."""
    model = robot.model
    below: dict[str, list[int]] = {}
    for index, joint in enumerate(model.tree.joints):
        below.setdefault(joint.parent, []).append(index)
    root = model.tree.root.name
    frame_of = {root: 0}
    rows: list[tuple[int, Array, int, Array, int, float, float]] = [
        (WORLD, robot.T_scene_root, FIXED, np.array([1.0, 0.0, 0.0]), -1, 1.0, 0.0)
    ]
    waiting = [root]
    while waiting:
        link = waiting.pop(0)
        for index in below.get(link, ()):
            joint = model.tree.joints[index]
            frame_of[joint.child] = len(rows)
            source, factor, offset = model.driver(joint.name, joint.type)
            kind = {"fixed": FIXED, "prismatic": SLIDES}.get(joint.type, TURNS)
            row = (frame_of[link], joint.origin, kind, joint.axis)
            rows.append((*row, source, factor, offset))
            waiting.append(joint.child)
    parent, origin, kinds, axis, source_, factors, offsets = zip(*rows, strict=True)
    return frame_of, Chain(
        np.array(parent),
        np.array(origin),
        np.array(kinds),
        np.array(axis),
        np.array(source_),
        np.array(factors),
        np.array(offsets),
    )


def left_out(problem: PathProblem) -> tuple[str, ...]:
    """The pairs that nothing was asked about."""
    return tuple(
        f"{problem.parts[i].name} and {problem.obstacles[j].name}: not examined"
        for i, j in sorted(problem.excluded)
    )
