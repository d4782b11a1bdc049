"""What the page of a `compare` shows: who differs from whom, and why."""

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from borecheck.contact.causes import signed_determinants
from borecheck.report.allowed_words import named
from borecheck.report.figures_pair import two_triangles
from borecheck.report.pictures import Subject, pictures_at

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
    return {
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
