"""A certificate compared with what was rebuilt from files: numpy only.

A certificate shows that some motion is clear. Whoever has the files of robot, scene and
plan rebuilds what it must state, and here every mesh, joint, pair, margin, corridor and
waypoint is compared. Numbers may differ by rounding, as from another machine's sine,
far below the reserve that each clearance keeps.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from borecheck.verify.fields import text
from borecheck.verify.reading import Arrays
from borecheck.verify.statement import Statement

# Numbers as near as this are the same, [m] and [rad].
SAME = 1e-12
# Differences told of one certificate.
MOST_TOLD = 20


@dataclass(frozen=True, eq=False)
class Expected:
    """What a certificate of certain files must state.

    Attributes:
        what: What it is, for people: robot, scene, and path or plan.
        content: The fields of a certificate, but for intervals.
        meshes: The surfaces by their hash.
        doubt: Why nothing may be called clear of these files; or None.
        not_known: What even then cannot be known, one sentence each.
    """

    what: str
    content: Mapping[str, Any]
    meshes: Mapping[str, Arrays]
    doubt: str | None = None
    not_known: tuple[str, ...] = ()


def differences(stated: Statement, expected: Expected) -> tuple[str, ...]:
    """What a certificate states otherwise than it should, one line each."""
    found = [] if expected.doubt is None else [f"nothing is clear: {expected.doubt}"]
    document, content = stated.document, expected.content
    found += _names(document.get("about", {}), content.get("about", {}))
    found += _numbers("margin", document["margin_m"], content["margin_m"])
    found += _waypoints(document["waypoints"], content["waypoints"])
    found += _chain(document["chain"], content["chain"])
    found += _bodies(stated, expected)
    found += _pairs(document, content)
    if len(found) > MOST_TOLD:
        found = [*found[:MOST_TOLD], f"and {len(found) - MOST_TOLD} more differences"]
    return tuple(found)


def _numbers(what: str, found: Any, expected: Any) -> Iterator[str]:
    """Whether numbers, or arrays of them, are the same up to rounding."""
    first, second = np.array(found, float), np.array(expected, float)
    if first.shape != second.shape:
        yield f"{what}: other numbers than its file's"
    elif first.size and not (np.abs(first - second) <= SAME).all():
        if first.ndim == 0:
            yield f"{what}: {float(first):g}, not {float(second):g}"
        else:
            most = float(np.abs(first - second).max())
            yield f"{what}: off by up to {most:.3g}"


def _waypoints(found: Sequence[Any], expected: Sequence[Any]) -> Iterator[str]:
    if len(found) != len(expected):
        yield f"waypoints: {len(found)}, not {len(expected)}"
        return
    for k, (q, other) in enumerate(zip(found, expected, strict=True)):
        yield from _numbers(f"waypoint {k + 1}", q, other)


def _chain(found: Sequence[Any], expected: Sequence[Any]) -> Iterator[str]:
    if len(found) != len(expected):
        yield f"chain: {len(found)} joints, not {len(expected)}"
        return
    for k, (joint, other) in enumerate(zip(found, expected, strict=True)):
        for name in ("kind", "parent", "source"):
            if joint[name] != other[name]:
                yield f"joint {k} of the chain: {name} {joint[name]}, not {other[name]}"
        for name in ("origin", "axis", "factor", "offset"):
            yield from _numbers(
                f"joint {k} of the chain: {name}", joint[name], other[name]
            )


def _bodies(stated: Statement, expected: Expected) -> Iterator[str]:
    content = expected.content
    found, others = stated.document["bodies"], content["bodies"]
    counts = [
        (stated.parts, len(found) - stated.parts),
        (content["part_count"], len(others) - content["part_count"]),
    ]
    if counts[0] != counts[1]:
        yield "{} parts and {} obstacles, not {} and {}".format(*counts[0], *counts[1])
        return
    for surface, body, other in zip(stated.bodies, found, others, strict=True):
        name = other["name"]
        for field in ("name", "role", "frame"):
            if body[field] != other[field]:
                yield f"{name}: {field} is {body[field]}, not {other[field]}"
        yield from _numbers(
            f"{name}: placement", body["T_frame_mesh"], other["T_frame_mesh"]
        )
        if body["mesh_sha256"] != other["mesh_sha256"]:
            vertices, triangles = expected.meshes[other["mesh_sha256"]]
            same = np.array_equal(surface.mesh.triangles, triangles)
            same = same and surface.mesh.vertices.shape == vertices.shape
            if not same or np.abs(surface.mesh.vertices - vertices).max() > SAME:
                yield f"{name}: another mesh than its file's"


def _pairs(document: Mapping[str, Any], content: Mapping[str, Any]) -> Iterator[str]:
    """Who is examined against whom, with which margin, and who may touch."""
    names = [body["name"] for body in content["bodies"]]
    kinds: list[tuple[str, str, str, Callable[[Any], Any]]] = [
        ("pairs", "moving", "standing", lambda r: r["margin_m"]),
        ("passages", "moving", "standing", lambda r: _corridor(r)),
        ("allowed", "first", "second", lambda r: 0.0),
    ]
    for kind, one, other, numbers in kinds:
        found = {frozenset((r[one], r[other])): r for r in document[kind]}
        asked = {frozenset((r[one], r[other])): r for r in content[kind]}
        for pair in sorted(found.keys() ^ asked.keys(), key=sorted):
            both = " and ".join(names[i] for i in sorted(pair) if i < len(names))
            says = "states" if pair in found else "lacks"
            more = ""
            if kind == "allowed" and pair in found:
                why = text(found[pair]["reason"], "reason")
                more = f" ({why}): if they may touch, give --srdf or --allow, too"
            yield f"{both}: it {says} them under {kind}{more}"
        for pair in sorted(found.keys() & asked.keys(), key=sorted):
            both = " and ".join(names[i] for i in sorted(pair) if i < len(names))
            what = "margin" if kind == "pairs" else "corridor"
            yield from _numbers(
                f"{both}: {what}", numbers(found[pair]), numbers(asked[pair])
            )


def _corridor(record: Mapping[str, Any]) -> list[float]:
    return [
        *record["entry"], *record["target"], record["radius_m"], record["slack_m"]
    ]  # fmt: skip


def _names(found: Mapping[str, Any], expected: Mapping[str, Any]) -> Iterator[str]:
    """What it says it is called, where it says so."""
    for kind in ("robot", "scene"):
        if kind not in found:
            continue
        name, other = found[kind]["name"], expected[kind]["name"]
        if _without_folders(name) != _without_folders(other):
            yield f"the {kind} is called {name}, not {other}"
        elif found[kind]["arguments"] != expected[kind]["arguments"]:
            yield f"the {kind}'s arguments are others"
    plan, other = found.get("plan"), expected.get("plan")
    if (plan is None) != (other is None):
        yield "it names a plan" if other is None else "it names no plan"
    elif plan is not None and other is not None:
        if plan["name"] != other["name"]:
            yield f"the plan is called {plan['name']}, not {other['name']}"
        yield from _numbers("corridor of the plan", _corridor(plan), _corridor(other))
    path, other = found.get("corridor"), expected.get("corridor")
    if (path is None) != (other is None):
        yield "it names a corridor" if other is None else "it names no corridor"
    elif path is not None and other is not None:
        yield from _numbers("corridor of the path", _corridor(path), _corridor(other))


def _without_folders(name: str) -> list[str]:
    return [word.rpartition("/")[2] for word in name.split(" + ")]
