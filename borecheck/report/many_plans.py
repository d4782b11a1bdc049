"""A result with very many plans as a page can carry it.

A page of a thousand plans is to open at once: of every plan it keeps what is said of it
and the pose that decides, and of the worst ones the whole motion. The page says so; the
result's file has all.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from borecheck.report.display import deflated, inflated

Record = Mapping[str, Any]

# Plans up to which a page carries whole motions, and of how many if there are more.
WHOLE_UP_TO, WHOLE_OF_MANY = 40, 8

# What a page tells of a pose.
_OF_POSE = (
    *("verdict", "reason", "qualifiers", "clearance_m", "closest", "contacts"),
    *("self_contacts", "corridor_contacts", "contained", "link_clearance", "q"),
)
# Triangle pairs kept of a pose that stands for a motion.
_PAIRS = 20
_ORDER = {"contact": 0, "unknown": 1, "clear": 2}


def for_a_page(document: Record) -> Record:
    """The document, or one with fewer poses where it has very many plans."""
    plans = document.get("plans", ())
    if len(plans) <= WHOLE_UP_TO:
        return document
    worst = sorted(range(len(plans)), key=lambda k: _badness(plans[k]))
    whole = set(worst[:WHOLE_OF_MANY])
    kept = [p if k in whole else _with_one_pose(p) for k, p in enumerate(plans)]
    thin: dict[str, Any] = {**document, "plans": kept}
    if document.get("display") is not None:
        thin["display"] = _display(document["display"], plans, whole)
    thin["poses_left_out"] = {"plans": len(plans), "whole": len(whole)}
    return thin


def _badness(plan: Record) -> tuple[int, float]:
    least = plan.get("clearance_m")
    return _ORDER.get(plan["verdict"], 1), -1.0 if least is None else float(least)


def _with_one_pose(plan: Record) -> Record:
    path = plan.get("path")
    if path is None:
        return plan
    k = _worst(path)
    thin = {key: value for key, value in plan.items() if key not in _SAID_BEFORE}
    fewer = {
        "poses": [_short(path["poses"][k])],
        "fractions": [path["fractions"][k]],
        "intervals": _joined(path["intervals"]),
    }
    if "times_s" in path:
        fewer["times_s"] = [path["times_s"][k]]
    left = {key: value for key, value in path.items() if key != "waypoints"}
    return {**thin, "path": {**left, **fewer}}


# What every plan of a result repeats, or its pose says again.
_SAID_BEFORE = (
    *("not_modelled", "checker", "checker_verdict", "pruning", "margin_kind"),
    *("margin_m", "pairs_examined", "pairs_pruned", "seconds", "link_clearance"),
)


def _worst(path: Record) -> int:
    return int(list(path["fractions"]).index(path["worst"]["fraction"]))


def _short(pose: Record) -> dict[str, Any]:
    short = {key: pose[key] for key in _OF_POSE if key in pose}
    for key in ("contacts", "self_contacts"):
        short[key] = short[key][:_PAIRS]
    return short


def _joined(intervals: Sequence[Record]) -> list[dict[str, Any]]:
    """Neighbours of one verdict as one."""
    joined: list[dict[str, Any]] = []
    for found in intervals:
        if joined and joined[-1]["verdict"] == found["verdict"]:
            joined[-1]["to"] = found["to"]
        else:
            joined.append({key: found[key] for key in ("from", "to", "verdict")})
    return joined


def _display(display: Record, plans: Sequence[Record], whole: set[int]) -> Record:
    moving = [(k, plan["path"]) for k, plan in enumerate(plans) if "path" in plan]
    motions = [
        motion if k in whole else _one_placement(motion, _worst(path))
        for (k, path), motion in zip(moving, display["motions"], strict=True)
    ]
    return {**display, "motions": motions}


def _one_placement(motion: Record, pose: int) -> Record:
    placements = inflated(motion["placements"], "<f4").reshape(motion["poses"], -1)
    lit = [{**found, "pose": 0} for found in motion["lit"] if found["pose"] == pose]
    for found in lit:
        corners = inflated(found["corners"], "<f4").reshape(-1, 18)[:_PAIRS]
        found["corners"] = deflated(np.ascontiguousarray(corners))
        found["shown"] = len(corners)
    one = np.ascontiguousarray(placements[pose])
    return {**motion, "poses": 1, "placements": deflated(one), "lit": lit}
