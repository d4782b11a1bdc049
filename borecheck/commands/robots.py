"""`borecheck robots`: what is installed, with joints, limits and arguments."""

import argparse
import json
import math
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from borecheck.core.result_file import SCHEMA_VERSION
from borecheck.core.text import in_lines, one_line
from borecheck.errors import BorecheckError, UsageError
from borecheck.robots.description import (
    Description,
    RobotDescription,
    ScannerDescription,
    installed,
    installed_names,
)
from borecheck.robots.description.hooks import broken_hooks
from borecheck.robots.description.plugins import package_of

if TYPE_CHECKING:
    from borecheck.robots.model import FreeJoint, RobotModel
    from borecheck.robots.robot import Robot

LISTED, SOME_BROKEN = 0, 1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument("--format", choices=("text", "json"), default="text")


def run(args: argparse.Namespace) -> int:
    """Prints robots and scanners, and of those that cannot be used what is wrong."""
    robots, broken = _sound("robots", _robot)
    scanners, more = _sound("scanners", _scanner)
    broken = [*broken, *more]
    status = SOME_BROKEN if broken else LISTED
    if args.format == "json":
        document = {
            "schema_version": SCHEMA_VERSION,
            "robots": robots,
            "scanners": scanners,
            "broken": broken,
        }
        sys.stdout.write(json.dumps(document, indent=2) + "\n")
        return status
    for kind, things in (("robot", robots), ("scanner", scanners)):
        for thing in things:
            sys.stdout.write(in_lines([*_lines(kind, thing), ""]))
    sys.stdout.write(in_lines(f"broken: {one['problem']}" for one in broken))
    return status


def _sound(
    group: str, describe: Callable[[str], dict[str, Any]]
) -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
    """What the sound packages bring, and what is wrong with the others."""
    found, broken = [], []
    for name in installed_names(group):
        try:
            found.append(describe(name))
        except BorecheckError as error:
            kind, whose = group.removesuffix("s"), package_of(group, name)
            said = one_line(error).removeprefix(f"{whose}: ")
            problem = f"{whose}: {said}"
            broken.append({"kind": kind, "name": name, "problem": problem})
    return found, broken


def _robot(name: str) -> dict[str, Any]:
    from borecheck.robots.robot import load_robot

    description: RobotDescription = installed("robots", "robot", name)
    _refuse_broken(description)
    robot = load_robot(name)
    _try_closed_form(robot, description)
    return {
        **_common(description, robot.model, robot.warnings),
        "scanner": description.scanner,
        "tool_frame": description.tool_frame,
        "home": dict(description.home),
    }


def _scanner(name: str) -> dict[str, Any]:
    from borecheck.robots.from_description import build_installed, complete_arguments
    from borecheck.robots.scene import load_scene

    description: ScannerDescription = installed("scanners", "scanner", name)
    _refuse_broken(description)
    scene = load_scene(name)  # its meshes are there
    model, _, _ = build_installed(
        description, scene.level, complete_arguments(description, {})
    )
    return {
        **_common(description, model, scene.warnings),
        "roles": dict(description.roles),
        "points": dict(description.points),
    }


def _refuse_broken(description: Description) -> None:
    for problem in broken_hooks(description):
        raise UsageError(problem)


def _try_closed_form(robot: "Robot", description: RobotDescription) -> None:
    """Asks every hook once, so that a result of a wrong form is found here."""
    from borecheck.plans.plan_motion import inverse_of
    from borecheck.robots.kinematics.cross_check import parameters
    from borecheck.robots.kinematics.sources import analytic, closed_form_arguments

    closed, arguments = analytic(robot), closed_form_arguments(robot)
    if closed is not None:
        closed(robot.home)
    parameters(robot)
    if description.inverse is not None:
        ahead = np.array([0.0, 0.0, 1.0])
        inverse_of(description)(np.zeros(3), ahead, 0.0, **arguments)


def _common(
    description: Description, model: "RobotModel", warnings: Sequence[str]
) -> dict[str, Any]:
    return {
        "name": description.name,
        "title": description.title,
        "source": description.source,
        "joints": [_joint(joint) for joint in model.free_joints],
        "arguments": {
            name: {
                "default": argument.default,
                "choices": list(argument.choices),
                "quantity": argument.quantity,
                "meaning": argument.meaning,
            }
            for name, argument in description.arguments.items()
        },
        "not_modelled": list(description.not_modelled),
        "warnings": list(warnings),
    }


def _joint(joint: "FreeJoint") -> dict[str, Any]:
    is_limited = math.isfinite(joint.lower)
    return {
        "name": joint.name,
        "type": joint.type,
        "lower": joint.lower if is_limited else None,
        "upper": joint.upper if is_limited else None,
    }


def _lines(kind: str, thing: dict[str, Any]) -> list[str]:
    lines = [f"{kind} {thing['name']}: {thing['title']} [{thing['source']}]"]
    lines += [f"  joint {_joint_text(joint)}" for joint in thing["joints"]]
    for name, argument in thing["arguments"].items():
        choices = f" ({' | '.join(argument['choices'])})" if argument["choices"] else ""
        default = argument["default"]
        lines.append(f"  argument {name}={default}{choices}: {argument['meaning']}")
    for name, meaning in thing.get("points", {}).items():
        lines.append(f"  point {name}: {meaning}")
    if "home" in thing:
        home = ", ".join(f"{name}={value:g}" for name, value in thing["home"].items())
        lines.append(f"  home {home}")
    lines += [f"  not modelled: {phrase}" for phrase in thing["not_modelled"]]
    lines += [f"  warning: {warning}" for warning in thing["warnings"]]
    return lines


def _joint_text(joint: dict[str, Any]) -> str:
    if joint["lower"] is None:
        return f"{joint['name']}: {joint['type']}, no limits"
    lower, upper = joint["lower"], joint["upper"]
    if joint["type"] == "prismatic":
        limits = f"{1e3 * lower:g} .. {1e3 * upper:g} mm"
    else:
        limits = f"{math.degrees(lower):g} .. {math.degrees(upper):g} deg"
    return f"{joint['name']}: {joint['type']}, {limits}"
