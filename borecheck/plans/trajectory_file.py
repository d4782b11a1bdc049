"""A joint path from a JointTrajectory of ROS, as YAML or JSON.

Read are `joint_names` and of each of the `points` its `positions` ([m], [rad]) and
`time_from_start`. The message may stand in what holds one: `joint_trajectory` of a
RobotTrajectory, `trajectory` of an action's goal.
"""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from borecheck.core.small_files import read_at_most
from borecheck.core.units import PLAIN_NUMBER
from borecheck.errors import InputError, PlanError, UnknownNameError
from borecheck.plans.joint_path import JointPath, first_not_after, time_note

SUFFIXES = (".yaml", ".yml", ".json")
# Two hours at 100 points a second of one arm.
MAX_BYTES = 20_000_000

# What holds a JointTrajectory, from the outside in.
_AROUND = ("goal", "trajectory", "joint_trajectory")
_UNUSED = ("velocities", "accelerations", "effort")
# The same in ROS 1 and 2.
_SECONDS = (("sec", "nanosec"), ("secs", "nsecs"))


def read_trajectory(path: Path, joint_names: Sequence[str]) -> JointPath:
    """The waypoints in the order of the joints.

    Args:
        path: YAML or JSON, by its suffix.
        joint_names: The robot's free joints: the file names each, in any order.

    Raises:
        PlanError: The file cannot be read or holds no such message, a joint is missing,
            unknown or doubled, or a value is no finite number; one line that says
            where.
    """
    message = _message(path, _document(path))
    names = _names(path, message, joint_names)
    points = _list(path, message, "points")
    if not points:
        raise PlanError(path, "holds no waypoint", "points")
    rows = [_positions(path, k, point, names) for k, point in enumerate(points, 1)]
    order = [names.index(name) for name in joint_names]
    waypoints = np.array(rows)[:, order]
    times = _times(path, points)
    notes = [] if times is None else [time_note(times)]
    unused = [word for word in _UNUSED if any(point.get(word) for point in points)]
    if unused:
        notes.append(f"its {', '.join(unused)} are not used")
    return JointPath(waypoints, times, tuple(notes))


def _document(path: Path) -> Any:
    """What the file holds; all scalars of YAML as text, so that none is guessed at."""
    try:
        text = read_at_most(path, MAX_BYTES).decode("utf-8-sig")
    except InputError as error:
        raise PlanError(path, error.problem) from error
    except UnicodeDecodeError as error:
        raise PlanError(path, "is no text in UTF-8") from error
    try:
        if path.suffix.lower() == ".json":
            return json.loads(text)
        return _yaml(path, text)
    except (ValueError, RecursionError) as error:
        raise PlanError(path, f"cannot be read: {error}") from error


def _yaml(path: Path, text: str) -> Any:
    import yaml

    loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
    try:
        documents = list(yaml.load_all(text, Loader=loader))
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = None if mark is None else f"line {mark.line + 1}"
        problem = getattr(error, "problem", None) or "it cannot be parsed"
        raise PlanError(path, f"is no YAML: {problem}", where) from error
    held = [document for document in documents if document]
    if len(held) > 1:
        raise PlanError(path, f"holds {len(held)} messages; a path is one of them")
    return held[0] if held else None


def _message(path: Path, document: Any) -> Mapping[str, Any]:
    """The JointTrajectory, out of what it stands in."""
    for around in _AROUND:
        if isinstance(document, list) and len(document) == 1:
            document = document[0]  # what a planner displays is a list of one
        if isinstance(document, dict) and around in document:
            others = document.get("multi_dof_joint_trajectory") or {}
            if isinstance(others, dict) and others.get("points"):
                raise PlanError(path, "moves joints of several freedoms, not read here")
            document = document[around]
    if not isinstance(document, dict) or "joint_names" not in document:
        raise PlanError(path, "is no JointTrajectory: it holds no `joint_names`")
    return document


def _names(
    path: Path, message: Mapping[str, Any], joint_names: Sequence[str]
) -> list[str]:
    names = [str(name) for name in _list(path, message, "joint_names")]
    for name in names:
        if name not in joint_names:
            problem = str(UnknownNameError("joint", name, joint_names))
            raise PlanError(path, problem, "joint_names")
        if names.count(name) > 1:
            raise PlanError(path, f"names {name!r} twice", "joint_names")
    missing = [name for name in joint_names if name not in names]
    if missing:
        raise PlanError(path, f"does not name {', '.join(missing)}", "joint_names")
    return names


def _positions(path: Path, k: int, point: Any, names: Sequence[str]) -> list[float]:
    where = f"points[{k}]"
    if not isinstance(point, dict):
        raise PlanError(path, "is no point: it holds no `positions`", where)
    values = _list(path, point, "positions", where)
    if len(values) != len(names):
        problem = f"has {len(values)} positions, not {len(names)}"
        raise PlanError(path, problem, where)
    return [
        _number(path, value, f"{where}, {name}")
        for value, name in zip(values, names, strict=True)
    ]


def _times(path: Path, points: Sequence[Mapping[str, Any]]) -> Any:
    """Seconds of every point, or None where no point has any."""
    given = ["time_from_start" in point for point in points]
    if not any(given):
        return None
    if not all(given):
        where = f"points[{given.index(False) + 1}]"
        raise PlanError(path, "has no time_from_start, as others have", where)
    times = [
        _seconds(path, point["time_from_start"], f"points[{k}], time_from_start")
        for k, point in enumerate(points, 1)
    ]
    if len(times) > 1 and not any(times):
        return None  # a planner's path that nobody has timed yet
    late = first_not_after(times)
    if late is not None:
        problem = f"its time {times[late]:g} s is not after {times[late - 1]:g} s"
        raise PlanError(path, problem, f"points[{late + 1}]")
    return np.array(times)


def _seconds(path: Path, value: Any, where: str) -> float:
    if not isinstance(value, dict):
        return _number(path, value, where)
    for whole, parts in _SECONDS:
        if value.keys() <= {whole, parts} and value:
            seconds = _number(path, value.get(whole, 0), where)
            return seconds + 1e-9 * _number(path, value.get(parts, 0), where)
    raise PlanError(path, "is neither seconds nor {sec, nanosec}", where)


def _list(
    path: Path, within: Mapping[str, Any], key: str, where: str | None = None
) -> list[Any]:
    value = within.get(key)
    if not isinstance(value, list):
        raise PlanError(path, f"holds no list of `{key}`", where)
    return value


def _number(path: Path, value: Any, where: str) -> float:
    """A finite number, from JSON or as text in YAML."""
    found = math.nan
    if isinstance(value, str) and PLAIN_NUMBER.fullmatch(value):
        found = float(value)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        found = float(value) if abs(value) < 1e300 else math.nan
    if not math.isfinite(found):
        raise PlanError(path, f"{str(value)[:40]!r} is no finite number", where)
    return found
