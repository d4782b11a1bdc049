"""What the page of a `compare` shows: who differs from whom, and why."""

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from borecheck.contact.causes import signed_determinants
from borecheck.report.allowed_words import named
from borecheck.report.figures_pair import two_triangles
from borecheck.report.pictures import Subject, pictures_at

# The checker that the others are held against.
JUDGE = "exact"

# Disputed pairs that are drawn alone, with their determinants.
DRAWN = 12

# Options of `compare` that say which poses, or where the result goes.
_REPLACED = ("q", "path", "plan", "random", "seed", "replay", "samples")
_PLACES = ("out", "report", "format", "date")


def views(document: Mapping[str, Any]) -> dict[str, Any]:
    """Matrix, disputes worst first, causes counted, and pictures of the worst one."""
    found = sorted(
        (
            {"place": k, "depth": _depth(d), **d}
            for k, d in enumerate(document["disagreements"])
        ),
        key=_worse,
    )
    names = list(document["checkers"])
    causes: dict[str, int] = {}
    for dispute in found:
        cause = dispute["cause"] or "no known cause"
        causes[cause] = causes.get(cause, 0) + 1
    by_checker = poses_told(document["poses"], names)
    hits = sum(bool(pose["verdicts"].get(JUDGE)) for pose in document["poses"])
    missed = {name: told[0] for name, told in by_checker.items() if told[0]}
    return {
        "by_checker": by_checker,
        "missed": missed,
        "headline": _headline(missed, by_checker, hits),
        "verdicts_told": _verdicts_told(missed, hits, len(document["poses"])),
        "checkers": names,
        "matrix": [[_differences(found, a, b) for b in names] for a in names],
        "disputes": found,
        "drawn": [_drawn(document, dispute) for dispute in found[:DRAWN]],
        "causes": sorted(causes.items(), key=lambda item: -item[1]),
        "split": sum(
            len(set(pose["verdicts"].values())) > 1 for pose in document["poses"]
        ),
        "unexplained": sum(d["cause"] is None for d in found),
        "pictures": _pictures(document, found),
        "allowed": [named(pair) for pair in document.get("allowed", ())],
        "hints": document.get("hints", ()),
    }


def poses_told(
    poses: Sequence[Mapping[str, Any]], names: Sequence[str]
) -> dict[str, tuple[int, int]]:
    """Of every checker: poses whose contact it misses, and those it invents one at."""
    told = {}
    for name in names:
        pairs = [
            (pose["verdicts"][JUDGE], pose["verdicts"][name])
            for pose in poses
            if name in pose["verdicts"] and JUDGE in pose["verdicts"]
        ]
        missed = sum(bool(truth) and not said for truth, said in pairs)
        invented = sum(bool(said) and not truth for truth, said in pairs)
        told[name] = (missed, invented)
    return told


def _headline(
    missed: Mapping[str, int], told: Mapping[str, tuple[int, int]], hits: int
) -> str:
    if missed:
        worst = max(missed, key=lambda name: missed[name])
        of = f"{missed[worst]} of {hits} {'pose' if hits == 1 else 'poses'}"
        return f"{worst} misses {of} in contact"
    invented = {name: count for name, (_, count) in told.items() if count}
    if invented:
        worst = max(invented, key=lambda name: invented[name])
        count = invented[worst]
        return f"{worst} invents contact at {count} {'pose' if count == 1 else 'poses'}"
    return "All checkers say the same of every pose"


def _verdicts_told(missed: Mapping[str, int], hits: int, poses: int) -> str:
    """One sentence: in how many poses there is contact, and who misses some."""
    begin = f"{hits} of {poses} {'pose' if poses == 1 else 'poses'} in contact"
    if not hits:
        return f"{begin}: there was none to miss."
    if not missed:
        return f"{begin}: no checker misses one."
    told = ", ".join(f"{name} {count}" for name, count in missed.items())
    return f"{begin}. Missed: {told}; by the others none."


def _depth(dispute: Mapping[str, Any]) -> float:
    """How far the triangles reach through each other's planes, [m]."""
    corners = np.array(dispute["corners"], dtype=np.float64)
    # a damaged file may hold corners whose products overflow: no depth can be told
    with np.errstate(over="ignore", invalid="ignore"):
        depth = min(_reach(corners[0], corners[1]), _reach(corners[1], corners[0]))
    return depth if np.isfinite(depth) else 0.0


def _reach(plane: Any, other: Any) -> float:
    normal = np.cross(plane[1] - plane[0], plane[2] - plane[0])
    length = float(np.linalg.norm(normal))
    if length == 0.0:
        return 0.0
    heights = (other - plane[0]) @ normal / length
    return float(max(0.0, min(heights.max(), -heights.min())))


def _worse(dispute: Mapping[str, Any]) -> tuple[bool, bool, float, int]:
    """Without a cause first, then contacts missed before invented ones, deep first."""
    return (
        dispute["cause"] is not None,
        not dispute["exact"],
        -dispute["depth"],
        dispute["place"],
    )


def _differences(found: Sequence[Mapping[str, Any]], a: str, b: str) -> int:
    return sum(d["verdicts"].get(a) != d["verdicts"].get(b) for d in found)


def _drawn(document: Mapping[str, Any], dispute: Mapping[str, Any]) -> dict[str, Any]:
    first, second = np.array(dispute["corners"], dtype=np.float64)
    pose = document["poses"][dispute["pose"]]
    title = (
        f"{dispute['link']} triangle {dispute['link_triangle']} and "
        f"{dispute['obstacle']} triangle {dispute['obstacle_triangle']}"
    )
    return {
        **dispute,
        "title": title,
        "svg": two_triangles(dispute["corners"], title),
        "determinants": signed_determinants(first, second),
        "replay": replay_line(document["argv"], pose["q"]),
    }


def replay_line(argv: Sequence[str], q: Mapping[str, float]) -> str:
    """The command that asks all checkers again at one pose."""
    words = _without(list(map(str, argv)), {*_REPLACED, *_PLACES})
    if not q:
        return shlex.join([*words, "--replay", "RESULT"])
    values = ",".join(f"{name}={value!r}" for name, value in q.items())
    return shlex.join([*words, f"--q={values}"])


def _without(words: list[str], options: set[str]) -> list[str]:
    kept = []
    skip = False
    for word in words:
        if skip:
            skip = False
            continue
        name, equals, _ = word.removeprefix("--").partition("=")
        if word.startswith("--") and name in options:
            skip = not equals
            continue
        kept.append(word)
    return kept


def _pictures(
    document: Mapping[str, Any], found: Sequence[Mapping[str, Any]]
) -> list[dict[str, Any]]:
    display = document.get("display")
    if display is None or not document["poses"]:
        return []
    if not found:
        return pictures_at(display, Subject(0, 0, "unknown"))
    names = (found[0]["link"], found[0]["obstacle"])
    return pictures_at(display, Subject(0, found[0]["pose"], "unknown", touching=names))
