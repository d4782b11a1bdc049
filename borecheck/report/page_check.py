"""What the page of a `check` shows, drawn from its document."""

from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from borecheck.report.allowed_words import half_lines, named
from borecheck.report.checked_words import about
from borecheck.report.figures import LINKS_SHOWN
from borecheck.report.figures_clearance import clearance_plot, overlaid
from borecheck.report.motion_words import motion_lines
from borecheck.report.pictures import Subject, pictures_at
from borecheck.report.probability_words import lines as probability_lines
from borecheck.report.way_words import way_out_words

# Motions with a section of their own, the worst first; the table has all.
MOST_DETAILED = 12

CHECKERS = {
    "exact": "the sign of every determinant is exact; touching counts as contact",
    "two-sided": "edges of both triangles against each other, in float64",
    "paper:robot": "as published, the scanner's edges against the robot's triangles",
    "paper:scanner": "as published, the robot's edges against the scanner's triangles",
    "coal": "Coal's own triangle test and tree",
}


def views(document: Mapping[str, Any]) -> dict[str, Any]:
    """Motions with their plots and tables, the worst of them, and still pictures."""
    motions, shown = _motions(document)
    worst = min(shown, key=_badness) if shown else None
    detailed = sorted(shown, key=_badness)[:MOST_DETAILED]
    for motion in detailed:
        motion["plot"] = _plot(motion)
    return {
        "motions": motions,
        "shown": detailed,
        "not_detailed": len(shown) - len(detailed),
        "counts": {
            verdict: sum(motion["verdict"] == verdict for motion in motions)
            for verdict in ("contact", "unknown", "clear")
        },
        "left_out": document.get("poses_left_out"),
        "overlay": _overlay(document, shown),
        "paths": sum(motion["path"] is not None for motion in shown),
        "proven": sum(
            bool((motion["path"] or {}).get("certified")) for motion in shown
        ),
        "certificates": any(motion["certificate"] for motion in motions),
        "worst": worst,
        "checker_told": CHECKERS.get(document["checker"], ""),
        "pictures": _pictures(document, worst),
        "about": about(document),
        "warnings": [
            *document["robot"]["warnings"],
            *document["scene"]["warnings"],
            *document.get("checked", {}).get("warnings", ()),
        ],
        "halves": list(half_lines(document)),
        "allowed": [named(pair) for pair in document.get("allowed", ())],
        "hints": document.get("hints", ()),
        "surfaces": len(document["scene"]["obstacles"]),
        "parts": len(document["robot"]["parts"]),
    }


def _motions(
    document: Mapping[str, Any],
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """All motions (or single poses) of a result, and those that can be shown."""
    motions = [_motion(k, m, document) for k, m in enumerate(_blocks(document))]
    shown = [m for m in motions if m["reachable"]]
    for number, motion in enumerate(shown):
        motion["number"] = number  # its place in the display block
    return motions, shown


def worst_motion(document: Mapping[str, Any]) -> dict[str, Any] | None:
    """The motion that decides, for the functions below; None if none is in reach."""
    return min(_motions(document)[1], key=_badness, default=None)


def picture_of(
    document: Mapping[str, Any],
    motion: Mapping[str, Any],
    name: str,
    width: int,
    height: int,
) -> Markup | None:
    """The picture of that name of a motion's worst pose."""
    made = pictures_at(document["display"], _subject(motion), width, height, name)
    return made[0]["svg"] if made else None


def plot_of(motion: Mapping[str, Any]) -> Markup | None:
    """Clearance along a motion; None of a single pose."""
    return _plot(motion)


def _blocks(document: Mapping[str, Any]) -> Sequence[Mapping[str, Any]]:
    blocks: Sequence[Mapping[str, Any]] = document.get("plans", [document])
    return blocks


def _motion(
    place: int, block: Mapping[str, Any], document: Mapping[str, Any]
) -> dict[str, Any]:
    path = block.get("path")
    poses = path["poses"] if path else [block]
    reachable = block.get("reachable", True)
    worst = _worst_pose(path) if path else 0
    return {
        "place": place,
        "number": None,
        "name": str(block.get("name", "motion" if path else "pose")),
        "block": block,
        "path": path,
        "reachable": reachable,
        "verdict": block["verdict"],
        "reason": block["reason"],
        "worst": worst,
        "pose": poses[worst] if reachable else None,
        "fraction": path["fractions"][worst] if path else None,
        "clearance": _least(block) if reachable else None,
        "least": (path or {}).get("least"),
        "at": _instant(block) if reachable else None,
        "said": [*half_lines(block), *(motion_lines(block) if path else [])],
        "links": _links(poses) if reachable else [],
        "touching": _touching(poses[worst], block) if reachable else [],
        "margin": document["margin_m"],
        "probability": probability_lines(block),
        "certificate": block.get("certificate"),
        "plot": None,
    }


def _worst_pose(path: Mapping[str, Any]) -> int:
    fractions = list(path["fractions"])
    return fractions.index(path["worst"]["fraction"])


def _least(block: Mapping[str, Any]) -> float | None:
    """Of a motion the certified least clearance; 0 in contact, None if not known."""
    held = (c for c in block["contained"] if c.get("role") != "self")
    if any(c["state"] != "unknown" for c in held):
        return 0.0  # a solid holds another, however far apart their surfaces are
    source = block if "path" not in block else block["path"].get("least") or {}
    least: float | None = source.get("clearance_m")
    return 0.0 if least is None and block["verdict"] == "contact" else least


def _instant(block: Mapping[str, Any]) -> float | None:
    """At which fraction of a motion the least clearance is, if it is known."""
    least = block.get("path", {}).get("least")
    return None if least is None else float(least["fraction"])


def _badness(motion: Mapping[str, Any]) -> tuple[int, float]:
    order = {"contact": 0, "unknown": 1, "clear": 2}[motion["verdict"]]
    least = motion["clearance"]
    return order, -1.0 if least is None else least


def _links(poses: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Every part's least clearance and the pose of it, nearest first."""
    best: dict[str, tuple[float, int]] = {}
    for k, pose in enumerate(poses):
        for link, clearance in (pose.get("link_clearance") or {}).items():
            if link not in best or clearance < best[link][0]:
                best[link] = (clearance, k)
    rows = [
        {"link": link, "clearance": clearance, "pose": k}
        for link, (clearance, k) in best.items()
    ]
    return sorted(rows, key=lambda row: float(row["clearance"]))


def _touching(
    pose: Mapping[str, Any], block: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Pairs of parts in contact at a pose, with their triangles and their way out."""
    told = {(row["link"], row["obstacle"]): row for row in block.get("touching", ())}
    found: dict[tuple[str, str], dict[str, Any]] = {}
    for k, pair in enumerate([*pose["contacts"], *pose["self_contacts"]]):
        names = (pair["link"], pair["obstacle"])
        row = found.setdefault(
            names,
            {
                "link": names[0],
                "obstacle": names[1],
                "first": k,
                "pairs": [],
                "way": way_out_words(told.get(names, {})),
            },
        )
        row["pairs"].append((pair["link_triangle"], pair["obstacle_triangle"]))
    return sorted(found.values(), key=lambda row: -len(row["pairs"]))


def _plot(motion: Mapping[str, Any]) -> Markup | None:
    if motion["path"] is None or len(motion["path"]["poses"]) < 2:
        return None
    title = f"Clearance along {motion['name']}: {motion['reason']}"
    return clearance_plot(motion["path"], motion["margin"], motion["number"], title)


def _overlay(
    document: Mapping[str, Any], shown: Sequence[Mapping[str, Any]]
) -> Markup | None:
    """The worst motions over each other, where there are several."""
    worst = [m for m in sorted(shown, key=_badness) if m["path"]][:LINKS_SHOWN]
    if len(worst) < 2 or "poses_left_out" in document:
        return None
    paths = {m["name"]: m["path"] for m in worst}
    title = "Clearance of the whole robot along the plans that come nearest"
    return overlaid(paths, document["margin_m"], title)


def _pictures(
    document: Mapping[str, Any], worst: Mapping[str, Any] | None
) -> list[dict[str, Any]]:
    display = document.get("display")
    if display is None or worst is None:
        return []
    return pictures_at(display, _subject(worst))


def _subject(worst: Mapping[str, Any]) -> Subject:
    """The worst pose of a motion, as pictures tell of it."""
    block, pose = worst["block"], worst["pose"]
    pairs = [*pose["contacts"], *pose["self_contacts"]]
    held = [c for c in pose["contained"] if c["state"] != "unknown"]
    found = [*pairs, *held]
    names = (found[0]["link"], found[0]["obstacle"]) if found else None
    return Subject(
        motion=worst["number"],
        pose=worst["worst"],
        verdict=_shown_verdict(worst),
        closest=None if held else pose["closest"],
        touching=names,
        plan=(block["entry"], block["target"]) if "entry" in block else None,
    )


def _shown_verdict(motion: Mapping[str, Any]) -> str:
    """A sample's verdict; of a clear one what is proven of the motion around it."""
    verdict, path = str(motion["pose"]["verdict"]), motion["path"]
    if verdict != "clear" or path is None:
        return verdict
    at = motion["fraction"]
    around = [i for i in path["intervals"] if i["from"] <= at <= i["to"]]
    return "clear" if all(i["verdict"] == "clear" for i in around) else "unknown"
