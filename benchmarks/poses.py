"""Five poses of every scene: clear, parallel and skew at 5 mm, touching, and deep.

A pose is found by shifting the foot towards the wall until the certified distance to
the scanner is the wanted one; "2 mm deep" is 2 mm beyond first contact.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes import (
    BENT,
    FOOT,
    SIZES,
    STRAIGHT,
    arm_chain,
    make_scene,
    placements,
)
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import WORLD

Array = NDArray[np.float64]

POSES = ("clear", "parallel 5 mm", "skew 5 mm", "touching 2 mm", "50 mm deep")


@dataclass(frozen=True, eq=False)
class Pose:
    """Where everything stands.

    Attributes:
        q: Joint positions.
        shift: How far the foot was moved, (3,), [m].
        placements: T_world_link, (links, 4, 4).
    """

    q: Array
    shift: Array
    placements: Array


@dataclass(frozen=True, eq=False)
class BenchScene:
    """Links, an obstacle, the chain that moves them, and five poses.

    Attributes:
        name: For example "arm M".
        links: Meshes of the links in their frames.
        obstacle: The scanner's mesh in the world.
        chain: The joints; its root is shifted by a pose's shift.
        frames: Frame of the chain that carries every link.
        poses: By the names in POSES.
    """

    name: str
    links: tuple[TriangleMesh, ...]
    obstacle: TriangleMesh
    chain: JointChain
    frames: tuple[int, ...]
    poses: dict[str, Pose]

    @property
    def counts(self) -> tuple[int, int]:
        """Triangles of all links, and of the obstacle."""
        return sum(len(m.triangles) for m in self.links), len(self.obstacle.triangles)


def arm_scene(size: str) -> BenchScene:
    """The synthetic ten-link arm in its gantry: S, M or L of `scenes.SIZES`."""
    scene = make_scene(size)
    return _with_poses(
        f"arm {size}",
        scene.links,
        scene.gantry,
        arm_chain(),
        tuple(range(len(scene.links))),
        lambda q, shift: placements(q, FOOT + shift),
        (STRAIGHT, BENT),
        np.array([0.0, 1.0, 0.0]),
    )


def zerobot_scene(level: str) -> BenchScene:
    """Zerobot against the project's CT gantry (the gantry only, not its couch)."""
    import borecheck as bc
    from borecheck.robots.kinematics.robot_chain import chain_of

    robot = bc.load_robot("zerobot", level=level)
    scene = bc.load_scene("ct_gantry", level=level)
    gantry = next(o.mesh for o in scene.obstacles if o.name == "gantry")
    frame_of, chain = chain_of(robot)
    links = tuple(part.mesh for part in robot.parts)
    frames = tuple(frame_of[part.link] for part in robot.parts)

    def place(q: Array, shift: Array) -> Array:
        placed = robot.placements(q)
        stacked = np.array([placed[part.link] for part in robot.parts])
        stacked[:, :3, 3] += shift
        return stacked

    bent = robot.home.copy()
    bent[3:5] += (0.5, 0.3)
    up = np.array([0.0, 1.0, 0.0])
    straight = robot.home
    return _with_poses(
        f"zerobot {level}", links, gantry, chain, frames, place, (straight, bent), up
    )


SCENES: dict[str, Callable[[], BenchScene]] = {
    **{f"arm {size}": (lambda s=size: arm_scene(s)) for size in SIZES},
    **{
        f"zerobot {level}": (lambda level=level: zerobot_scene(level))
        for level in ("coarse", "middle", "fine")
    },
}


def _with_poses(
    name: str,
    links: tuple[TriangleMesh, ...],
    obstacle: TriangleMesh,
    chain: JointChain,
    frames: tuple[int, ...],
    place: Callable[[Array, Array], Array],
    qs: tuple[Array, Array],
    way: Array,
) -> BenchScene:
    """The poses of a scene: the straight q for the parallel one, the bent one else."""
    trees = [MeshTree.of(mesh) for mesh in links]
    scene = MovingLinks.against(trees, [MeshTree.of(obstacle)])

    def distance(q: Array, along: float) -> float:
        placed = place(q, along * way)[None]
        return float(np.min(scene.clearances(placed)[0]))

    straight, bent = qs
    touch = _first(lambda s: distance(bent, s) > 0.0)
    found = {
        "clear": (bent, 0.0),
        "parallel 5 mm": (straight, _first(lambda s: distance(straight, s) > 5e-3)),
        "skew 5 mm": (bent, _first(lambda s: distance(bent, s) > 5e-3)),
        "touching 2 mm": (bent, touch + 2e-3),
        "50 mm deep": (bent, touch + 0.05),
    }
    poses = {
        pose: Pose(q, along * way, place(q, along * way))
        for pose, (q, along) in found.items()
    }
    return BenchScene(name, links, obstacle, chain, frames, poses)


def _first(is_clear: Callable[[float], bool]) -> float:
    """The shift at which it is clear no more, to a micrometre."""
    step = 0.02
    high = step
    while is_clear(high):
        high += step
        if high > 3.0:
            raise RuntimeError("no shift brings the arm to the wall")
    low = high - step
    while high - low > 1e-6:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_clear(middle) else (low, middle)
    return low


def path_of(scene: BenchScene, samples: int, end: str) -> Array:
    """A straight motion of the configuration from the clear pose, (samples, nq).

    `end`: "clear" stays away from the wall, "free" ends near it, "contact" in it.
    """
    start = scene.poses["clear"].q
    goal = _goals(scene)[end]
    return start + np.linspace(0.0, 1.0, samples)[:, None] * (goal - start)


def _goals(scene: BenchScene) -> dict[str, Array]:
    """Configurations along one direction: halfway, just before, and beyond contact."""
    from borecheck.motion.problem import Body, PathProblem
    from borecheck.motion.search import search

    start = scene.poses["clear"].q
    parts = tuple(
        Body(mesh.name, mesh, frame)
        for mesh, frame in zip(scene.links, scene.frames, strict=True)
    )
    problem = PathProblem(scene.chain, parts, (Body("obstacle", scene.obstacle),))
    rng = np.random.default_rng(3)
    for _ in range(50):
        direction = rng.normal(size=len(start))
        direction *= 1.2 / np.abs(direction).max()
        found = search(problem, np.array([start, start + direction])).first_contact
        if found is not None and found[0] > 0.1:
            at = found[0]
            return {
                "clear": start + 0.5 * at * direction,
                "free": start + 0.99 * at * direction,
                "contact": start + 1.12 * at * direction,
            }
    raise RuntimeError("no direction meets the obstacle")


__all__ = ["POSES", "SCENES", "WORLD", "BenchScene", "Pose", "path_of"]
