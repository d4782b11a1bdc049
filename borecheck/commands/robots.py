"""`borecheck robots`: what is installed, with joints, limits and arguments."""

import argparse
import json
import math
import sys
from typing import Any

from borecheck.core.result_file import SCHEMA_VERSION
from borecheck.core.text import in_lines
from borecheck.robots.description import (
    Description,
    RobotDescription,
    ScannerDescription,
    installed,
    installed_names,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument("--format", choices=("text", "json"), default="text")


def run(args: argparse.Namespace) -> int:
    """Prints robots and scanners."""
    robots = [_robot(name) for name in installed_names("robots")]
    scanners = [_scanner(name) for name in installed_names("scanners")]
    if args.format == "json":
        document = {
            "schema_version": SCHEMA_VERSION,
            "robots": robots,
            "scanners": scanners,
        }
        sys.stdout.write(json.dumps(document, indent=2) + "\n")
        return 0
    for kind, things in (("robot", robots), ("scanner", scanners)):
        for thing in things:
            sys.stdout.write(in_lines([*_lines(kind, thing), ""]))
    return 0


def _robot(name: str) -> dict[str, Any]:
    description: RobotDescription = installed("robots", "robot", name)
    return {
        **_common(description),
        "scanner": description.scanner,
        "tool_frame": description.tool_frame,
        "home": dict(description.home),
    }


def _scanner(name: str) -> dict[str, Any]:
    description: ScannerDescription = installed("scanners", "scanner", name)
    return {
        **_common(description),
        "roles": dict(description.roles),
        "points": dict(description.points),
    }


def _common(description: Description) -> dict[str, Any]:
    return {
        "name": description.name,
        "title": description.title,
        "source": description.source,
        "joints": _joints(description),
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
    }


def _joints(description: Description) -> list[dict[str, Any]]:
    """Free joints in the order of q, from the URDF with default arguments."""
    from borecheck.robots.urdf.mimic import resolve
    from borecheck.robots.urdf.parse import parse
    from borecheck.robots.urdf.reach import ANYWHERE
    from borecheck.robots.urdf.xacro import expand

    tree = parse(expand(description.xacro, roots=ANYWHERE).text, str(description.xacro))
    follows = resolve(tree.joints)
    moving = [j for j in tree.joints if j.type != "fixed" and j.name not in follows]
    return [
        {
            "name": joint.name,
            "type": joint.type,
            "lower": joint.limits.lower if joint.limits else None,
            "upper": joint.limits.upper if joint.limits else None,
        }
        for joint in moving
    ]


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
