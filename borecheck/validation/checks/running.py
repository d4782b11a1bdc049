"""Kinematics checks by running: do libraries place the links as the file says."""

import json
import sys
from collections.abc import Iterator
from copy import deepcopy
from typing import TYPE_CHECKING, Any

import numpy as np

from borecheck.core.se3 import Array, rotation_angle
from borecheck.validation.checks.limits import UNLIMITED_FROM
from borecheck.validation.findings import Severity
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.reading.mesh_reading import resolution_of
from borecheck.validation.reading.moving_tree import moving_tree_of
from borecheck.validation.registry import Problem, register

if TYPE_CHECKING:
    from subprocess import Popen

TOLERANCE = 1e-9  # [m] and [rad] on a robot of 1 m; agreement is 3e-13 in practice
ROUNDING = 1e-7  # a difference below it is a root of the smallest one, 2e-16
PATIENCE_S = 120.0
FRAMES = ("pinocchio", "yourdfpy")  # the libraries that place links
_MODULE = "borecheck.validation.reading.libraries"


def start_libraries(robot: CheckedUrdf) -> None:
    """Starts the libraries in a process of their own; `answers_of` awaits them."""
    import subprocess  # slow to import, and not needed for quick checks

    from lxml import etree

    moving = moving_tree_of(robot)
    configurations = []
    if moving is not None:
        chosen = moving.sampled(robot.options.seed, robot.options.samples)
        configurations = [moving.positions(free) for free in chosen]
    request = {
        "text": etree.tostring(_with_places(robot), encoding="unicode"),
        "configurations": configurations,
        "libraries": [*FRAMES, *(["geometry"] if robot.options.load_meshes else [])],
    }
    process = subprocess.Popen(
        [sys.executable, "-m", _MODULE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    robot.memory["configurations"] = configurations
    robot.memory["libraries"] = (process, json.dumps(request))


def answers_of(robot: CheckedUrdf) -> dict[str, Any]:
    """What Pinocchio and yourdfpy said; each with frames or an error."""
    if "answer" not in robot.memory:
        if "libraries" not in robot.memory:
            start_libraries(robot)
        robot.memory["answer"] = _await(*robot.memory["libraries"])
    found: dict[str, Any] = robot.memory["answer"]
    return found


def _with_places(robot: CheckedUrdf) -> Any:
    """The robot with its mesh files by their absolute paths, as all libraries read."""
    if not robot.options.load_meshes:
        return robot.root
    root = deepcopy(robot.root)
    for mesh in root.iter("mesh"):
        name = mesh.get("filename") or ""
        path = resolution_of(robot, name).path if name.strip() else None
        # What was not found, or refused, is not to be found by a library either.
        place = "not-found" if path is None else str(path.absolute())
        mesh.set("filename", f"file://{place}")
    return root


def _await(process: "Popen[str]", request: str) -> dict[str, Any]:
    from subprocess import TimeoutExpired

    try:
        answer, noise = process.communicate(request, timeout=PATIENCE_S)
        problem = f"the process died (status {process.returncode})"
    except TimeoutExpired:
        process.kill()
        answer, noise = process.communicate()
        problem = f"gave no answer within {PATIENCE_S:g} s"
    said: dict[str, Any] = {}
    for line in answer.splitlines():
        said |= json.loads(line)
    for name in json.loads(request)["libraries"]:
        said.setdefault(name, {"error": problem})
    reason = [line for line in noise.splitlines() if line.startswith("Error:")]
    if reason and "error" in said["pinocchio"]:
        said["pinocchio"]["error"] += f" ({' '.join(reason[0].split())})"
    return said


@register("K601", "kinematics-disagree", "kinematics", "EEE", "run")
def kinematics_disagree(robot: CheckedUrdf) -> Iterator[Problem]:
    """Libraries place the links differently.

    Why: What is planned with one library is driven elsewhere by the other. A known
    cause in a library makes this a warning: the file itself is sound.

    Fix: Look at the named cause; if there is none, send the file to the library.

    Libraries: yourdfpy takes mimic chains for zero and shifts mimic indices after a
    planar or floating joint; Pinocchio ignores mimic joints unless asked.
    """
    moving = moving_tree_of(robot)
    if moving is None:
        return
    configurations = robot.memory.get("configurations") or _configurations(robot)
    expected = [moving.placements(positions) for positions in configurations]
    for library, said in answers_of(robot).items():
        if library not in FRAMES or "frames" not in said:
            continue
        worst = _worst(expected, said["frames"], moving.root)
        if worst is None or worst[0] <= TOLERANCE * max(1.0, robot.size):
            continue
        size, distance, angle, link, index = worst
        cause = _cause(robot, library)
        level = Severity.WARNING if cause else None
        if size <= ROUNDING * max(1.0, robot.size):
            cause = f"rounding: {library} loses half of the digits"
            level = Severity.INFO
        message = (
            f"{library} places link {link!r} {distance:.3g} m and {angle:.3g} rad away "
            f"(configuration {index} of seed {robot.options.seed}); "
            f"cause: {cause or 'not known'}"
        )
        yield Problem(robot.link_named[link].element, message, None, level)


@register("K608", "pinocchio-refuses", "kinematics", "WWE", "run")
def pinocchio_refuses(robot: CheckedUrdf) -> Iterator[Problem]:
    """Pinocchio cannot load the robot.

    Why: Whoever uses it cannot use this file. borecheck's own checks hand it the joints
    only, so what it dislikes about the rest does not stop them.

    Fix: See the other findings; Pinocchio seldom says the reason.
    """
    said = answers_of(robot)["pinocchio"]
    if "error" in said and not robot.holds_macros_only:
        yield Problem(robot.root, f"Pinocchio: {said['error']}")


@register("K609", "yourdfpy-refuses", "kinematics", "WWW", "run")
def yourdfpy_refuses(robot: CheckedUrdf) -> Iterator[Problem]:
    """The library yourdfpy cannot load the robot.

    Why: Whoever uses it cannot use this file.

    Fix: See the other findings.
    """
    said = answers_of(robot)["yourdfpy"]
    if "error" in said and not robot.holds_macros_only:
        yield Problem(robot.root, f"yourdfpy: {said['error']}")


@register("K611", "pinocchio-geometry-refuses", "kinematics", "WWW", "run")
def pinocchio_geometry_refuses(robot: CheckedUrdf) -> Iterator[Problem]:
    """Pinocchio and Coal cannot load the collision geometry (with --load-meshes).

    Why: Whoever checks contacts with them has no geometry.

    Fix: See the other findings; else export the mesh again, as binary STL.
    """
    said = answers_of(robot).get("geometry", {})
    if "error" in said and "error" not in answers_of(robot)["pinocchio"]:
        yield Problem(robot.root, f"Pinocchio: {said['error']}")


@register("K615", "loading-effort", "kinematics", "III", "run")
def loading_effort(robot: CheckedUrdf) -> Iterator[Problem]:
    """What loading the robot takes in time and memory (with --load-meshes).

    Why: A program that loads it on every start should know.

    Fix: Nothing, unless it is too much: simplify the collision meshes.
    """
    if not robot.options.load_meshes:
        return
    for library, said in answers_of(robot).items():
        if "error" not in said:
            shapes = f" {said['shapes']} shapes," if "shapes" in said else ""
            mega = said["bytes"] / 1e6
            text = f"{library}:{shapes} {said['seconds']:.2g} s, {mega:.0f} MB at most"
            yield Problem(robot.root, text)


@register("K612", "pinocchio-refuses-mimic", "kinematics", "III", "run")
def pinocchio_refuses_mimic(robot: CheckedUrdf) -> Iterator[Problem]:
    """Pinocchio refuses the robot when it is asked to respect mimic joints.

    Why: It then has to be built with free followers, which must be set by hand.

    Fix: Nothing in the file, if chains or fixed leaders are meant; borecheck resolves
    them by itself.

    Libraries: Pinocchio with mimic=True refuses chains and some joint types.
    """
    said = answers_of(robot)["pinocchio"]
    if said.get("mimic"):
        yield Problem(robot.root, f"Pinocchio with mimic=True: {said['mimic']}")


@register("K610", "joint-moves-nothing", "kinematics", "III")
def joint_moves_nothing(robot: CheckedUrdf) -> Iterator[Problem]:
    """A joint moves no geometry.

    Why: Perhaps the geometry hangs on the wrong link, or is missing.

    Fix: Nothing, if it carries plain frames only.
    """
    if not any(link.shapes for link in robot.links):
        return
    ends = {end for loop in robot.options.loops for end in (loop.first, loop.second)}
    for joint in robot.joints:
        child = joint.child
        if not joint.moves or child not in robot.link_named:
            continue
        below = [name for name, _ in robot.below(child)]
        if ends & set(below):
            continue
        if not any(robot.link_named[name].shapes for name in below):
            yield Problem(joint.element, f"joint {joint.name!r} moves no geometry")


def _configurations(robot: CheckedUrdf) -> list[dict[str, float]]:
    answers_of(robot)
    found: list[dict[str, float]] = robot.memory["configurations"]
    return found


def _worst(
    expected: list[dict[str, Array]], frames: dict[str, list[list[float]]], root: str
) -> tuple[float, float, float, str, int] | None:
    """The largest difference: size, distance, angle, link, configuration."""
    worst = None
    for link, placed in frames.items():
        for index, numbers in enumerate(placed):
            if link not in expected[index]:
                continue
            T = np.reshape(numbers, (4, 4))
            size, distance, angle = gap(expected[index][link], T)
            if worst is None or not size <= worst[0]:
                worst = (size, distance, angle, link, index)
    return worst


def gap(T: Array, T_other: Array) -> tuple[float, float, float]:
    """Larger of both, distance [m], angle [rad]; NaN counts as infinite."""
    distance = float(np.linalg.norm(T[:3, 3] - T_other[:3, 3]))
    angle = rotation_angle(T[:3, :3], T_other[:3, :3])
    # A matrix that is no rotation can hide from the angle.
    skew = float(np.abs(T[:3, :3] - T_other[:3, :3]).max())
    size = max(distance, angle, skew)
    return (size if size == size else float("inf")), distance, angle


def _cause(robot: CheckedUrdf, library: str) -> str | None:
    """The known cause of a disagreement, if the file has one."""
    moving = [joint for joint in robot.joints if joint.has_axis]
    lengths = [float(np.linalg.norm(joint.axis or (1.0, 0, 0))) for joint in moving]
    if 0.0 in lengths:
        return "an axis is 0 0 0 (J302)"
    if any("xyz" not in e.attrib for e in robot.root.iterfind("joint/axis")):
        return "an <axis> has no xyz, which urdfdom takes for 0 0 0 (D119)"
    mimics = [joint for joint in robot.joints if joint.mimic is not None]
    if library == "yourdfpy" and mimics:
        names = {joint.name for joint in mimics}
        if any(j.mimic is not None and j.mimic.joint in names for j in mimics):
            return "yourdfpy takes mimic chains for zero (J318)"
        if any(joint.type in ("floating", "planar") for joint in robot.joints):
            return "yourdfpy shifts mimic indices after a planar or floating joint"
    if any("quat_xyzw" in e.attrib for e in robot.root.iter("origin")):
        return "quat_xyzw, which only the newest parsers read (D133)"
    if any(abs(length - 1.0) > 1e-9 for length in lengths):
        return "an axis is not of length one (J303)"
    if any(abs(v or 0.0) > UNLIMITED_FROM for j in moving for v in (j.lower, j.upper)):
        return "limits so large that angles lose their digits (J309)"
    return None
