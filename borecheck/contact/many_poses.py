"""Contact at many configurations in one call: kinematics and search both compiled.

The placements come from the compiled chain, which agrees with Pinocchio to rounding
(tests hold it to 1e-12); a verdict with reasons for one pose is `contact.check`.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.containment import holds_or_might
from borecheck.core.once import once_per_pair
from borecheck.errors import JointLimitError, UsageError
from borecheck.geometry.surfaces import Surface, surface
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.geometry.triangles.winding import crossings
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]


def first_contacts(
    robot: Robot,
    scene: Scene,
    qs: ArrayLike,
    *,
    narrowphase: str = "exact",
    containment: bool = True,
    threads: int = 1,
) -> NDArray[np.bool_]:
    """Whether the robot touches anything, itself included, at each configuration, (n,).

    Args:
        robot: From `load_robot`.
        scene: From `load_scene`.
        qs: Configurations, (n, joints), [m] and [rad].
        narrowphase: exact, two-sided, paper:robot or paper:scanner.
        containment: Whether to ask also if a solid holds another; most of the time
            goes there. A surface that is open, or whose parts cancel, and might hold
            something counts as contact.
            False: surfaces only, for who knows that nothing starts inside.
        threads: How many poses are worked on at once.

    Raises:
        UsageError: Wrong shape or numbers that are not finite; or the unit of an
            obstacle was guessed, and a bare "no contact" could not say so.
        JointLimitError: A configuration beyond a joint limit: which one.
    """
    if scene.doubt is not None:
        raise UsageError(scene.doubt)
    batch = prepared(robot, scene)
    placements = batch.placements(checked_configurations(robot, qs))
    found = batch.obstacles.first_contacts(placements, narrowphase, threads)
    if batch.itself is not None:
        found |= batch.itself.first_contacts(placements, narrowphase, threads)
    if containment:
        open_poses = np.flatnonzero(~found)
        found[open_poses] = batch.holds(placements[open_poses])
    return found


def checked_configurations(robot: Robot, qs: ArrayLike) -> Array:
    """A copy of qs (n, joints), every one within the limits of free and mimic joints.

    Raises:
        UsageError: Wrong shape or numbers that are not finite.
        JointLimitError: Names the first configuration beyond a limit.
    """
    model = robot.model
    configurations = np.array(qs, dtype=np.float64, order="C")
    if configurations.ndim != 2 or configurations.shape[1] != len(model.free_joints):
        raise UsageError(
            f"qs have shape {configurations.shape}, not (n, {len(model.free_joints)})"
        )
    if not np.isfinite(configurations).all():
        raise UsageError("qs hold a number that is not finite")
    beyond = model.beyond_limits(configurations)
    if beyond.any():
        k = int(np.argmax(beyond))
        try:
            model.check_limits(configurations[k])
        except JointLimitError as error:
            raise JointLimitError(f"configuration {k}: {error}") from error
    return configurations


class PoseBatch:
    """Robot and scene packed for many poses."""

    def __init__(self, robot: Robot, scene: Scene) -> None:
        frame_of, self._chain = chain_of(robot)
        self._frames = [frame_of[part.link] for part in robot.parts]
        self._parts = [surface(part.mesh) for part in robot.parts]
        self._others = [surface(obstacle.mesh) for obstacle in scene.obstacles]
        self._self_pairs = robot.self_pairs
        trees = [part.tree for part in self._parts]
        self.obstacles = MovingLinks.against(trees, [o.tree for o in self._others])
        self.itself = (
            MovingLinks.among(trees, np.array(robot.self_pairs))
            if robot.self_pairs
            else None
        )

    def placements(self, qs: Array) -> Array:
        """T_scene_part of every configuration, (n, parts, 4, 4)."""
        return self._chain.placements(qs, self._frames)

    def holds(self, T_scene_parts: Array) -> NDArray[np.bool_]:
        """Whether a solid holds another, pose by pose, surfaces known not to meet."""
        found = np.zeros(len(T_scene_parts), dtype=bool)
        for i, part in enumerate(self._parts):
            T = T_scene_parts[:, i]
            T_part_scene = _inverses(T)
            for other in self._others:
                held, doubt = _held(part, T, other, T_part_scene, found)
                found |= held | _asked_singly(part, T, other, None, doubt)
        for i, j in self._self_pairs:
            T_i, T_j = T_scene_parts[:, i], T_scene_parts[:, j]
            a, b = self._parts[i], self._parts[j]
            T_j_i = _inverses(T_j) @ T_i
            held, doubt = _held(a, T_j_i, b, _inverses(T_j_i), found)
            found |= held | _asked_singly(a, T_i, b, T_j, doubt)
        return found


@once_per_pair
def prepared(robot: Robot, scene: Scene) -> PoseBatch:
    """The packed form of a robot and a scene; the same records give the same one."""
    return PoseBatch(robot, scene)


def _inverses(T: Array) -> Array:
    """Inverses of rigid transforms (n, 4, 4)."""
    R_back = np.swapaxes(T[:, :3, :3], 1, 2)
    result = np.zeros_like(T)
    result[:, :3, :3] = R_back
    result[:, :3, 3] = -np.einsum("nij,nj->ni", R_back, T[:, :3, 3])
    result[:, 3, 3] = 1.0
    return result


def _held(
    a: Surface, T_b_a: Array, b: Surface, T_a_b: Array, settled: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Where one of two surfaces holds a component of the other, and where it may, (n,).

    Poses that are settled are left out.
    """
    found, doubt = _inside(a, T_b_a, b, settled)
    again, more = _inside(b, T_a_b, a, settled | found)
    found |= again
    return found, (doubt | more) & ~found


def _asked_singly(
    a: Surface,
    T_a: Array,
    b: Surface,
    T_b: Array | None,
    doubt: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Whether one holds the other or might, where in doubt: asked as of one pose."""
    found = np.zeros(len(doubt), dtype=bool)
    for k in np.flatnonzero(doubt):
        T = None if T_b is None else T_b[k]
        found[k] = holds_or_might(a, T_a[k], b, T).kind != "none"
    return found


def _inside(
    inner: Surface,
    T_outer_inner: Array,
    outer: Surface,
    settled: NDArray[np.bool_],
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Where a component of inner lies in outer (or might, if that is open), (n,).

    And where crossings of a ray cancel, so that it may or may not. One corner of each
    component decides, because the surfaces do not meet.
    """
    found, doubt = np.zeros((2, len(T_outer_inner)), dtype=bool)
    low, high = outer.mesh.bounds
    rows = outer.mesh.corners.reshape(-1, 9)
    for corner in inner.representatives:
        points = T_outer_inner[:, :3, :3] @ corner + T_outer_inner[:, :3, 3]
        within = ((points >= low) & (points <= high)).all(axis=1)
        for k in np.flatnonzero(within & ~found & ~settled):
            if not outer.topology.is_closed:
                found[k] = True
                continue
            x, y, z = points[k].tolist()
            winding, crossed = crossings((x, y, z), rows)
            found[k] = winding != 0
            doubt[k] |= crossed > 0 and not outer.topology.winding_tells
    return found, doubt
