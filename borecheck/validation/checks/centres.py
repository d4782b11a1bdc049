"""Remote centres, tool axes and closed loops: declared ones hold, others are found."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from borecheck.core.se3 import Array, inverse
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.reading.extents import link_extent
from borecheck.validation.reading.moving_tree import MovingTree, moving_tree_of
from borecheck.validation.registry import Problem, register

SAMPLES = 12
FEW = 4  # poses of two joints that tell a point that does not stay
FIXED_M = 1e-6  # a point that moves less, on a robot of 1 m, was meant to stay
MOST = 5  # discoveries reported; a humanoid has dozens of wrists and hips


class Fixed(NamedTuple):
    """A point of a frame that stays while joints move."""

    frame: str
    joints: tuple[str, ...]
    point: Array
    in_root: Array
    error: float


def _poses(
    robot: CheckedUrdf,
    moving: MovingTree,
    joints: Sequence[str],
    frames: Sequence[str],
    samples: int = SAMPLES,
) -> list[dict[str, Array]]:
    """Placements while only some joints move, the others half-way in their limits."""
    rng = np.random.default_rng(robot.options.seed)
    middle = {name: 0.5 * (low + high) for name, (low, high) in moving.ranges.items()}
    poses = []
    for _ in range(samples):
        moved = {
            name: rng.uniform(*moving.ranges[name])
            for name in joints
            if name in moving.ranges
        }
        placed = moving.placements(moving.positions({**middle, **moved}))
        poses.append({frame: placed[frame] for frame in frames})
    return poses


def _unknown(
    robot: CheckedUrdf, moving: MovingTree, frames: Any, joints: Any
) -> str | None:
    for frame in frames:
        if frame is not None and frame not in robot.link_named:
            return f"there is no link {frame!r}"
    for joint in joints:
        if joint not in moving.ranges:
            return f"{joint!r} is no free joint"
    return None


@register("K603", "remote-centre-missed", "kinematics", "EEE")
def remote_centre_missed(robot: CheckedUrdf) -> Iterator[Problem]:
    """A declared remote centre moves.

    Why: The needle would tear the tissue at the point that must stay.

    Fix: Compare the lengths between the axes with the drawing: some published robots
    miss their centre by millimetres.
    """
    moving = moving_tree_of(robot)
    for centre in robot.options.remote_centres:
        if moving is None:
            return  # no tree: other findings say so
        problem = _unknown(robot, moving, [centre.frame], centre.joints)
        if problem:
            yield Problem(robot.root, problem)
            continue
        poses = _poses(robot, moving, centre.joints, [centre.frame])
        point = np.array([*centre.point, 1.0])
        path = np.array([(pose[centre.frame] @ point)[:3] for pose in poses])
        error = float(np.linalg.norm(path - path[0], axis=1).max())
        if error > centre.tolerance:
            message = f"the remote centre of {centre.frame!r} moves by {error:.3g} m"
            yield Problem(robot.link_named[centre.frame].element, message)


@register("K604", "remote-centre-found", "kinematics", "III")
def remote_centre_found(robot: CheckedUrdf) -> Iterator[Problem]:
    """A point away from the robot stays fixed while two joints turn, undeclared.

    Why: It is a remote centre; declared, it is checked from now on.

    Fix: Declare it in the settings: [[validate.remote-centre]].
    """
    moving = moving_tree_of(robot)
    if moving is None:
        return
    declared = {(c.frame, frozenset(c.joints)) for c in robot.options.remote_centres}
    count = 0
    for fixed in _discovered(robot, moving):
        if (fixed.frame, frozenset(fixed.joints)) in declared or count == MOST:
            continue
        if not _is_remote(robot, moving, fixed):
            continue
        count += 1
        point = " ".join(f"{v:.4g}" for v in fixed.point + 0.0)
        turning = " and ".join(fixed.joints)
        message = f"point ({point}) of {fixed.frame!r} stays while {turning} turn"
        yield Problem(robot.link_named[fixed.frame].element, message)


@register("K605", "loop-open", "kinematics", "EEE")
def loop_open(robot: CheckedUrdf) -> Iterator[Problem]:
    """A declared loop does not close.

    Why: Two ends of a closed mechanism drift apart, so the rods cannot be where the
    file puts them.

    Fix: Check the mimic multipliers and the lengths of the rods.
    """
    moving = moving_tree_of(robot)
    for loop in robot.options.loops:
        ends = [loop.first, loop.second]
        if moving is None:
            return  # no tree: other findings say so
        problem = _unknown(robot, moving, ends, ())
        if problem:
            yield Problem(robot.root, problem)
            continue
        poses = _poses(robot, moving, tuple(moving.ranges), ends)
        gaps = [np.linalg.norm(p[ends[0]][:3, 3] - p[ends[1]][:3, 3]) for p in poses]
        if float(max(gaps)) > loop.tolerance:
            message = f"{ends[0]!r} and {ends[1]!r} are up to {max(gaps):.3g} m apart"
            yield Problem(robot.link_named[ends[0]].element, message)


@register("K606", "loop-found", "kinematics", "III")
def loop_found(robot: CheckedUrdf) -> Iterator[Problem]:
    """Two frames on different branches coincide always, and nobody declared a loop.

    Why: A closed mechanism written as a tree; declared, its closing is checked.

    Fix: Declare it in the settings: [[validate.loop]].
    """
    moving = moving_tree_of(robot)
    if moving is None or not moving.follows:
        return
    declared = {frozenset((p.first, p.second)) for p in robot.options.loops}
    links = [link for link, _, _ in moving.steps]
    poses = _poses(robot, moving, tuple(moving.ranges), links)
    track = {link: np.array([pose[link][:3, 3] for pose in poses]) for link in links}
    count = 0
    for first, second in _coincident(track, FIXED_M * max(1.0, robot.size)):
        if frozenset((first, second)) in declared or count == MOST:
            continue
        if _closes(moving, first, second):
            count += 1
            message = f"{first!r} and {second!r} coincide at every configuration"
            yield Problem(robot.link_named[first].element, message)


@register("K613", "tool-axis-missed", "kinematics", "EEE")
def tool_axis_missed(robot: CheckedUrdf) -> Iterator[Problem]:
    """A declared tool axis does not pass through its point.

    Why: The needle would miss the entry point although every joint is right.

    Fix: Compare axis and point with the drawing.
    """
    moving = moving_tree_of(robot)
    for tool in robot.options.tool_axes:
        frames = [tool.frame, tool.base]
        if moving is None:
            return  # no tree: other findings say so
        problem = _unknown(robot, moving, frames, tool.joints)
        if problem:
            yield Problem(robot.root, problem)
            continue
        base = tool.base or moving.root
        poses = _poses(robot, moving, tool.joints, [tool.frame, base])
        error = max(_off_axis(pose[base], pose[tool.frame], tool) for pose in poses)
        if error > tool.tolerance:
            message = f"the axis of {tool.frame!r} passes its point at {error:.3g} m"
            yield Problem(robot.link_named[tool.frame].element, message)


def _off_axis(T_root_base: Array, T_root_tool: Array, tool: Any) -> float:
    T = inverse(T_root_tool) @ T_root_base
    point = T[:3, :3] @ np.array(tool.through) + T[:3, 3]
    axis = np.array(tool.axis) / np.linalg.norm(tool.axis)
    return float(np.linalg.norm(point - axis * (axis @ point)))


def _discovered(robot: CheckedUrdf, moving: MovingTree) -> Iterator[Fixed]:
    """Fixed points of the ends of chains under pairs of successive turning joints."""
    carrying = {joint.parent for _, joint, _ in moving.steps}
    ends = [link for link, _, _ in moving.steps if link not in carrying]
    seen: set[tuple[str, ...]] = set()
    for end in ends[:10]:
        free = [j.name for j in moving.joints_to(end) if j.name in moving.ranges]
        turning = [n for n in free if robot.joint_named[n].type != "prismatic"]
        for pair in pairwise(turning):
            if pair not in seen:
                seen.add(pair)
                fixed = _fixed_point(robot, moving, end, pair)
                if fixed is not None:
                    yield fixed


def _fixed_point(
    robot: CheckedUrdf, moving: MovingTree, frame: str, joints: tuple[str, ...]
) -> Fixed | None:
    """The point of a frame that stays; a few poses rule out most pairs of joints."""
    if _solved(robot, moving, frame, joints, FEW) is None:
        return None
    return _solved(robot, moving, frame, joints, SAMPLES)


def _solved(
    robot: CheckedUrdf,
    moving: MovingTree,
    frame: str,
    joints: tuple[str, ...],
    samples: int,
) -> Fixed | None:
    """By least squares over so many poses: R_k p + t_k = w for all k."""
    poses = [p[frame] for p in _poses(robot, moving, joints, [frame], samples)]
    A = np.concatenate([np.hstack([T[:3, :3], -np.eye(3)]) for T in poses])
    b = -np.concatenate([T[:3, 3] for T in poses])
    solution, _, rank, _ = np.linalg.lstsq(A, b, rcond=1e-9)
    if rank < 6:
        return None  # one axis, or two parallel ones: no single point
    error = float(np.linalg.norm((A @ solution - b).reshape(-1, 3), axis=1).max())
    if not error <= FIXED_M * max(1.0, robot.size):
        return None
    return Fixed(frame, joints, solution[:3], solution[3:], error)


def _is_remote(robot: CheckedUrdf, moving: MovingTree, fixed: Fixed) -> bool:
    """Whether the point lies outside of the links about it: no wrist, no hip."""
    first = robot.joint_named[fixed.joints[0]].parent or moving.root
    middle = {name: 0.5 * (low + high) for name, (low, high) in moving.ranges.items()}
    placed = moving.placements(moving.positions(middle))
    point = placed[fixed.frame] @ np.append(fixed.point, 1.0)
    around = [first, *(name for name, _ in robot.below(first))]
    extents = [(name, link_extent(robot, robot.link_named[name])) for name in around]
    known = [(name, extent) for name, extent in extents if extent is not None]
    room = 0.02 * robot.size
    return bool(known) and all(
        extent.distance((inverse(placed[name]) @ point)[:3]) > room
        for name, extent in known
    )


def _coincident(track: dict[str, Array], tolerance: float) -> Iterator[tuple[str, str]]:
    names = list(track)
    paths = np.array([track[name].reshape(-1) for name in names])
    if len(names) > 2000:
        return
    for i in range(len(names)):
        near = np.abs(paths[i + 1 :] - paths[i]).max(axis=1) <= tolerance
        for j in np.flatnonzero(near):
            yield names[i], names[i + 1 + int(j)]


def _closes(moving: MovingTree, first: str, second: str) -> bool:
    """Whether the way between two links leads over followers on separate branches."""
    one = [joint.name for joint in moving.joints_to(first)]
    two = [joint.name for joint in moving.joints_to(second)]
    only_one, only_two = set(one) - set(two), set(two) - set(one)
    if not only_one or not only_two:
        return False  # one above the other: a frame on its own axis
    turning = {*moving.follows, *moving.ranges}
    return bool(only_one & turning) and bool(only_two & turning)
