"""What a caller from Python gives: robot, scene, configurations, lengths, in any form.

A configuration is a list in the order of the joints, a dictionary or a row of a table
by joint name, or the name "home". Natural mistakes are told in one line.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.units import parse_length
from borecheck.errors import UnknownNameError, UsageError
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]

# In place of ArrayLike: the other forms of a configuration, or of several.
Given = ArrayLike | Mapping[str, float] | str


def refuse_others(robot: object, scene: object = None) -> None:
    """Nothing, unless robot or scene is none.

    Args:
        robot: What was given as the robot.
        scene: What was given as the scene; None where there is none to give.

    Raises:
        UsageError: They are swapped, or names instead of what was loaded.
    """
    if isinstance(robot, Scene):
        raise UsageError("robot and scene are swapped: the robot comes first")
    if not isinstance(robot, Robot):
        raise UsageError(_not_loaded("robot", "load_robot", robot))
    if scene is not None and not isinstance(scene, Scene):
        raise UsageError(_not_loaded("scene", "load_scene", scene))


def _not_loaded(what: str, loader: str, given: object) -> str:
    named = f"({given!r})" if isinstance(given, str) else "(...)"
    kind = type(given).__name__
    return f"{what} is a {kind}: give what borecheck.{loader}{named} returns"


def configuration(robot: Robot, q: Any) -> Array:
    """One configuration (n,), within the limits.

    Args:
        robot: The robot.
        q: Positions in the joints' order, by name, or "home"; [m] and [rad].

    Raises:
        UsageError: Another shape, a string that is no name, numbers that are none.
        UnknownNameError: A joint, or a named configuration, that there is not.
        JointLimitError: It is beyond a joint limit.
    """
    return robot.model.check_limits(positions(robot, q))


def positions(robot: Robot, q: Any) -> Array:
    """One configuration (n,); limits are left to who asks; else as `configuration`."""
    if isinstance(q, str):
        if q == "home":
            return robot.home.copy()
        raise UnknownNameError("configuration", q, ["home"])
    if hasattr(q, "keys") and hasattr(q, "__getitem__"):  # also a row of a table
        named = {str(name): q[name] for name in q.keys()}  # noqa: SIM118  pandas' too
        return robot.model.configuration(named)
    return robot.model.check_configuration(q)


def configurations(robot: Robot, qs: Any) -> Array:
    """Several configurations (k, n); limits are left to who asks.

    Args:
        robot: The robot.
        qs: An array (k, n), or a list, or a table, of what `configuration` takes.

    Raises:
        UsageError: Another shape, or numbers that are none.
        UnknownNameError: See `configuration`.
    """
    if isinstance(qs, str) or (isinstance(qs, Mapping) and not _is_table(qs)):
        raise UsageError(
            "one configuration is given where a list of them is meant: write [q]"
        )
    if not hasattr(qs, "__iter__"):
        kind = type(qs).__name__
        raise UsageError(f"configurations are a {kind}: give an array (k, n)")
    rows: Any = qs
    if _is_table(qs):
        rows = [row for _, row in qs.iterrows()]
    if isinstance(rows, np.ndarray):
        found = _numbers(rows)
    else:
        listed = list(rows)
        named = any(isinstance(q, str) or hasattr(q, "keys") for q in listed)
        found = _numbers([positions(robot, q) for q in listed] if named else listed)
    count = len(robot.model.free_joints)
    if found.ndim != 2 or found.shape[1] != count:
        names = ", ".join(robot.model.joint_names)
        raise UsageError(
            f"configurations have shape {found.shape}, not (k, {count}): a row each, "
            f"its columns {names}"
        )
    return found


def length(value: float | str, name: str) -> float:
    """A length in [m]: a number, or text with its unit such as "20mm".

    Raises:
        UsageError: Neither, or no finite number.
    """
    if isinstance(value, str):
        return parse_length(value)
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        kind = type(value).__name__
        raise UsageError(f"{name} is a {kind}: give metres, or text such as '20mm'")
    if not np.isfinite(value):
        raise UsageError(f"{name} is {value}, not a length")
    return float(value)


def _is_table(given: object) -> bool:
    """Whether it is a table of pandas, or like one."""
    return hasattr(given, "iterrows")


def _numbers(given: Any) -> Array:
    try:
        found = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise UsageError(
            "configurations are no table of numbers: rows of one length, [m] and [rad]"
        ) from None
    if not np.isfinite(found).all():
        raise UsageError("configurations hold a number that is not finite")
    return found
