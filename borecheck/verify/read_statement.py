"""Reads what a certificate states into values that are safe to compute with.

Every field is asked for its type and range here, and nothing that is unknown is let
pass; whether the statements are true is asked in `verify.claims`.
"""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.verify.chain import WORLD, Chain, Joint, skewness
from borecheck.verify.distance import GroupedMesh
from borecheck.verify.fields import (
    Rejected,
    array,
    listed,
    number,
    record,
    text,
    whole,
)
from borecheck.verify.reading import LARGEST_PLACE, Arrays
from borecheck.verify.statement import (
    CORRIDOR,
    Pair,
    Passage,
    Statement,
    Surface,
)

Array = NDArray[np.float64]
FORMAT = "borecheck path certificate"
FORMAT_VERSION = 2
ROLES = ("scanner", "couch", "patient", "other")

# All that arithmetic may put a point astray, [m]: with `ROUNDING` less than `RESERVE`.
MOST_ASTRAY = 2e-10
# Joints do not turn farther, [rad], nor mimic more strongly.
LARGEST_TURN = 1e3
# A rotation's rows are unit vectors up to this.
RIGID = 1e-12
MOST_WAYPOINTS, MOST_JOINTS, MOST_BODIES = 1_000_000, 2_000, 2_000
MOST_PAIRS, MOST_INTERVALS = 1_000_000, 20_000
_TOP = (
    *("format", "format_version", "versions", "waypoints", "margin_m", "chain"),
    *("bodies", "part_count", "pairs", "passages", "allowed", "sha256"),
)
_JOINT = ("parent", "origin", "kind", "axis", "source", "factor", "offset")
_BODY = ("name", "role", "frame", "T_frame_mesh", "mesh_sha256")
_PAIR_COLUMNS = ["from", "to", "at", "clearance_m", "displacement_m"]
_PASSAGE_COLUMNS = ["from", "to", "at", "displacement_m"]


def read_statement(
    document: Mapping[str, Any], meshes: Mapping[str, Arrays]
) -> Statement:
    """A certificate's statements.

    Args:
        document: Plain values, of which `check_frame` approves.
        meshes: The surfaces by their hash.

    Raises:
        Rejected: Something is missing, unknown, of another type or out of range.
    """
    waypoints = _waypoints(document["waypoints"])
    records = listed(document["chain"], "chain", MOST_JOINTS, 1)
    joints = [_joint(k, r, waypoints.shape[1]) for k, r in enumerate(records)]
    listed(document["bodies"], "bodies", MOST_BODIES, 2)
    parts = whole(document["part_count"], "part_count", 1, len(document["bodies"]) - 1)
    bodies = tuple(
        _surface(record, k < parts, len(joints), meshes)
        for k, record in enumerate(document["bodies"])
    )
    statement = Statement(
        document,
        waypoints,
        Chain(joints, waypoints),
        number(document["margin_m"], "margin_m", 0.0, LARGEST_PLACE),
        bodies,
        parts,
        _pairs(document["pairs"], parts, len(bodies)),
        _passages(document["passages"], parts, len(bodies)),
        _allowed(document["allowed"], parts),
    )
    if "about" in document:
        _check_about(document["about"])
    _check_sizes(statement)
    return statement


def check_frame(document: Mapping[str, Any]) -> None:
    """Format, version, fields, and that nothing was changed since it was written.

    Raises:
        Rejected: It is no certificate, of an earlier version, or was changed.
    """
    if document.get("format") != FORMAT:
        raise Rejected(f"not a certificate: not in the format {FORMAT!r}")
    version = document.get("format_version")
    if type(version) is not int or version != FORMAT_VERSION:
        raise Rejected(
            f"not in version {FORMAT_VERSION} of the format: let the motion be "
            "certified anew"
        )
    record(document, "the certificate", _TOP, ("about",))
    content = {name: value for name, value in document.items() if name != "sha256"}
    canonical = json.dumps(content, sort_keys=True, separators=(",", ":"))
    if hashlib.sha256(canonical.encode()).hexdigest() != document["sha256"]:
        raise Rejected("its content does not have the hash it states")
    if type(document["versions"]) is not dict:
        raise Rejected("versions is no record")
    for name, value in document["versions"].items():
        text(value, f"version of {text(name, 'a name')}")


def _waypoints(value: Any) -> Array:
    rows = listed(value, "waypoints", MOST_WAYPOINTS, 1)
    width = len(listed(rows[0], "waypoints", MOST_JOINTS, 0))
    waypoints = array(rows, "waypoints", (len(rows), width), LARGEST_PLACE)
    if len(rows) == 1:  # a motion that stands still
        waypoints = np.repeat(waypoints, 2, axis=0)
    return waypoints


def _joint(index: int, value: Any, width: int) -> Joint:
    name = f"joint {index} of the chain"
    fields = record(value, name, _JOINT)
    kind = fields["kind"]
    if kind not in ("fixed", "turns", "slides"):
        raise Rejected(f"{name} is of an unknown kind")
    parent = whole(fields["parent"], f"{name}: parent", WORLD, index - 1)
    low = -1 if kind == "fixed" else 0
    source = whole(fields["source"], f"{name}: source", low, width - 1)
    axis = array(fields["axis"], f"{name}: axis", (3,), LARGEST_PLACE)
    if kind != "fixed" and not abs(np.linalg.norm(axis) - 1.0) < RIGID:
        raise Rejected(f"{name}: the axis is no unit vector")
    return Joint(
        parent,
        _rigid(fields["origin"], name),
        kind,
        axis,
        source,
        number(fields["factor"], f"{name}: factor", -LARGEST_TURN, LARGEST_TURN),
        number(fields["offset"], f"{name}: offset", -LARGEST_TURN, LARGEST_TURN),
    )


def _rigid(value: Any, name: str) -> Array:
    T = array(value, f"{name}: placement", (4, 4), LARGEST_PLACE)
    R = T[:3, :3]
    if skewness(T) > RIGID or np.linalg.det(R) < 0.0 or (T[3] != (0, 0, 0, 1)).any():
        raise Rejected(f"{name}: not a rigid placement")
    return T


def _surface(
    value: Any, is_part: bool, frames: int, meshes: Mapping[str, Arrays]
) -> Surface:
    fields = record(value, "a body", _BODY)
    name = text(fields["name"], "the name of a body")
    role = fields["role"]
    if role not in (("robot",) if is_part else ROLES):
        raise Rejected(f"{name}: its role is not one of its kind's")
    low, high = (0, frames - 1) if is_part else (WORLD, WORLD)
    frame = whole(fields["frame"], f"{name}: frame", low, high)
    stated = text(fields["mesh_sha256"], f"{name}: mesh_sha256")
    if stated not in meshes:
        raise Rejected(f"{name}: no mesh given has the hash {stated[:12]}...")
    T = _rigid(fields["T_frame_mesh"], name)
    return Surface(name, role, frame, T, GroupedMesh(*meshes[stated]))


def _pairs(value: Any, parts: int, bodies: int) -> tuple[Pair, ...]:
    found = []
    for k, item in enumerate(listed(value, "pairs", MOST_PAIRS)):
        name = f"pair {k}"
        fields = record(
            item, name, ("moving", "standing", "margin_m", "columns", "intervals")
        )
        moving = whole(fields["moving"], f"{name}: moving", 0, parts - 1)
        standing = whole(fields["standing"], f"{name}: standing", 0, bodies - 1)
        margin = number(fields["margin_m"], f"{name}: margin_m", 0.0, LARGEST_PLACE)
        rows = _intervals(fields, name, _PAIR_COLUMNS)
        found.append(Pair(moving, standing, margin, rows))
    return tuple(found)


def _passages(value: Any, parts: int, bodies: int) -> tuple[Passage, ...]:
    found = []
    for k, item in enumerate(listed(value, "passages", MOST_PAIRS)):
        name = f"passage {k}"
        needed = ("moving", "standing", *CORRIDOR, "columns", "intervals")
        fields = record(item, name, needed, ("beside",))
        moving = whole(fields["moving"], f"{name}: moving", 0, parts - 1)
        standing = whole(fields["standing"], f"{name}: standing", parts, bodies - 1)
        found.append(
            Passage(
                moving,
                standing,
                *_corridor(fields, name),
                _intervals(fields, name, _PASSAGE_COLUMNS, 0),
                _beside(fields, f"{name}: beside"),
            )
        )
    return tuple(found)


def _beside(fields: Mapping[str, Any], name: str) -> Array:
    """Where a needle is said to be plainly clear of its patient; may be nowhere."""
    if "beside" not in fields:
        return np.zeros((0, len(_PAIR_COLUMNS)))
    beside = record(fields["beside"], name, ("columns", "intervals"))
    return _intervals(beside, name, _PAIR_COLUMNS, 0)


def _corridor(
    fields: Mapping[str, Any], name: str
) -> tuple[Array, Array, float, float]:
    return (
        array(fields["entry"], f"{name}: entry", (3,), LARGEST_PLACE),
        array(fields["target"], f"{name}: target", (3,), LARGEST_PLACE),
        number(fields["radius_m"], f"{name}: radius_m", 0.0, LARGEST_PLACE),
        number(fields["slack_m"], f"{name}: slack_m", 0.0, LARGEST_PLACE),
    )


def _intervals(
    fields: Mapping[str, Any], name: str, columns: list[str], least: int = 1
) -> Array:
    if fields["columns"] != columns:
        raise Rejected(f"{name}: its columns are not {', '.join(columns)}")
    rows = listed(fields["intervals"], f"{name}: intervals", MOST_INTERVALS, least)
    shape = (len(rows), len(columns))
    if not rows:
        return np.zeros(shape)
    return array(rows, f"{name}: intervals", shape, float(MOST_WAYPOINTS))


def _allowed(value: Any, parts: int) -> dict[tuple[int, int], str]:
    found: dict[tuple[int, int], str] = {}
    for k, item in enumerate(listed(value, "allowed", MOST_PAIRS)):
        name = f"allowed pair {k}"
        fields = record(item, name, ("first", "second", "reason"))
        second = whole(fields["second"], f"{name}: second", 1, parts - 1)
        first = whole(fields["first"], f"{name}: first", 0, second - 1)
        if (first, second) in found:
            raise Rejected(f"{name}: stated twice")
        found[first, second] = text(fields["reason"], f"{name}: reason")
    return found


def _check_about(value: Any) -> None:
    """Names, as the command prints them."""
    fields = record(value, "about", (), ("robot", "scene", "plan", "corridor"))
    if "plan" in fields and "corridor" in fields:
        raise Rejected("about: a plan has its own corridor, and a path has no plan")
    for kind, more in (("robot", ("urdf_sha256",)), ("scene", ())):
        if kind in fields:
            named = record(fields[kind], kind, ("name", "arguments", *more))
            for field in ("name", *more):
                text(named[field], f"{kind}: {field}")
            if type(named["arguments"]) is not dict:
                raise Rejected(f"{kind}: its arguments are no record")
            for name, argument in named["arguments"].items():
                text(argument, f"argument of the {kind}")
                text(name, f"argument of the {kind}")
    if "plan" in fields:
        plan = record(fields["plan"], "plan", ("name", *CORRIDOR))
        text(plan["name"], "name of the plan")
        _corridor(plan, "plan")
    if "corridor" in fields:
        _corridor(record(fields["corridor"], "corridor", CORRIDOR), "corridor")


def _check_sizes(statement: Statement) -> None:
    """Everything stays where arithmetic is far finer than the reserve."""
    chain, bodies = statement.chain, statement.bodies
    turns = [joint.kind == "turns" for joint in chain.joints]
    if np.abs(chain.values[:, turns]).max(initial=0.0) > LARGEST_TURN:
        raise Rejected(f"a joint turns farther than {LARGEST_TURN:g} rad")
    arm = max(body.size for body in bodies[: statement.parts])
    size = max(chain.extent() + arm, *(body.size for body in bodies[statement.parts :]))
    if not size <= LARGEST_PLACE:
        raise Rejected(f"reaches {size:.3g} m from the origin, over {LARGEST_PLACE:g}")
    skew = max(skewness(body.T_frame_mesh) for body in bodies)
    astray = chain.rounding(size, skew)
    if not astray <= MOST_ASTRAY:
        raise Rejected(
            f"rounding may put points {astray:.1e} m astray: too large, too many "
            "turns, or placements that are not quite rigid"
        )
