"""Results as text: lines and tables that read the same on a terminal and in a pipe."""

from collections.abc import Mapping, Sequence
from typing import Any

from borecheck.report.allowed_words import (
    MARKS,
    allowed_lines,
    half_lines,
    hint_lines,
)
from borecheck.report.blocks import Block, Table
from borecheck.report.case_words import case_lines
from borecheck.report.checked_words import lines as checked_lines
from borecheck.report.motion_words import at_least, motion_lines
from borecheck.report.probability_words import cells as probability_cells
from borecheck.report.probability_words import lines as probability_lines
from borecheck.report.route_words import route_lines
from borecheck.report.tolerance_words import tolerance_lines
from borecheck.report.way_words import point_mm, way_out_words

# As many rows as fit on a screen; the JSON holds all of them.
SHOWN = 10

# Said of a plan that no configuration reaches: definite, not open.
OUT_OF_REACH = "OUT OF REACH"


def check_text(document: Mapping[str, Any], *, explain: bool = False) -> list[Block]:
    """The result of `check` in words: what was checked, then the verdict.

    Args:
        document: The result.
        explain: Whether to list what is else summed up.
    """
    if "plans" in document:
        return _plans_text(document, explain)
    lines: list[Block] = [*checked_lines(document), *_verdict_lines(document)]
    lines += route_lines(document)
    lines += probability_lines(document)
    lines += allowed_lines(document, explain)
    lines += _warning_lines(document)
    lines += _not_covered(document["not_modelled"], explain)
    return lines


def _plans_text(document: Mapping[str, Any], explain: bool) -> list[Block]:
    """All plans, the worst of them first in words; a row for each."""
    asked = any("uncertainty" in plan for plan in document["plans"])
    likely = ("probability of contact", "risk") if asked else ()
    # what the robot does to itself hides nothing of the obstacles
    plans = sorted(document["plans"], key=_urgency)
    halves = [plan.get("obstacles", plan)["verdict"] for plan in plans]
    differ = halves != [plan["verdict"] for plan in plans]
    apart = ("obstacles",) if differ else ()
    rows: list[tuple[str, ...]] = [
        ("plan", "verdict", *apart, "least clearance", *likely, "reason")
    ]
    for plan, half in zip(plans, halves, strict=True):
        least = plan.get("clearance_m")
        beyond = not plan.get("reachable", True)
        touches = plan["verdict"] == "contact" and least is None
        rows.append(
            (
                plan["name"],
                OUT_OF_REACH if beyond else MARKS[plan["verdict"]],
                *([OUT_OF_REACH if beyond else MARKS[half]] if differ else ()),
                "none" if touches else at_least(least),
                *(probability_cells(plan) if asked else ()),
                plan["reason"],
            )
        )
    lines: list[Block] = [*checked_lines(document)]
    driven = any(plan.get("reachable", True) for plan in plans)
    if driven or not plans:
        lines += [f"{MARKS[document['verdict']]}: {document['reason']}"]
        lines += [f"  {line}" for line in half_lines(document)]
    else:
        lines += [f"{OUT_OF_REACH}: no plan can be driven, so nothing was checked"]
    if "each_plan" in document and driven:
        lines += [
            f"each plan is one motion: {document['each_plan']}",
            "least clearance: proven of the whole motion; the needle in the patient "
            "does not count where the plan has it",
        ]
    lines += ["", Table(rows), "", *_certificate_table(document)]
    lines += tolerance_lines(document)
    lines += allowed_lines(document, explain)
    lines += _warning_lines(document)
    lines += _not_covered(document["not_modelled"], explain)
    return lines


def _urgency(plan: Mapping[str, Any]) -> tuple[int, float]:
    """Contact first, then what is open, out of reach, clear; least clearance first."""
    order = {"contact": 0, "unknown": 1, "clear": 3}[plan["verdict"]]
    least = plan.get("clearance_m")
    if not plan.get("reachable", True):
        return 2, 0.0
    return order, -1.0 if least is None else least


def _not_covered(phrases: Sequence[str], explain: bool) -> list[str]:
    """What no verdict covers, in one line, or a line each."""
    if explain or not phrases:
        return [f"not covered: {phrase}" for phrase in phrases]
    return [f"not covered: {'; '.join(phrases)}"]


def _verdict_lines(document: Mapping[str, Any]) -> list[Block]:
    qualifiers = ", ".join(document["qualifiers"])
    mark = MARKS[document["verdict"]] + (f" ({qualifiers})" if qualifiers else "")
    lines: list[Block] = [f"{mark}: {document['reason']}"]
    lines += [f"  {line}" for line in half_lines(document)]
    if document["closest"] is not None and "path" not in document:
        closest = document["closest"]
        within = document["self_contacts"] or document["contained"]
        what = "clearance to the obstacles" if within else "clearance"
        lines.append(
            f"{what} {millimetres(document['clearance_m'])}"
            f"{_at_most(closest, document['clearance_m'])}: "
            f"{closest['link']} to {closest['obstacle']}"
        )
    lines += _contact_lines(document)
    if "path" in document:
        lines += motion_lines(document)
        lines += _certificate_line(document)
    examined, pruned = document["pairs_examined"], document["pairs_pruned"]
    lines.append(
        f"{examined:,} triangle pairs examined, {pruned:,} pruned, "
        f"{document['seconds']:.3f} s"
    )
    return lines


def _at_most(closest: Mapping[str, Any], clearance: float) -> str:
    """How much more it may be, where round shapes leave more than rounding."""
    more = closest["upper"] - clearance
    return f" (at most {millimetres(more)} more, shapes are round)" * (more > 1e-6)


def _certificate_line(document: Mapping[str, Any]) -> list[str]:
    """Where the certificate of a path is, if one was asked for."""
    given = document.get("certificate")
    if given is None:
        return []
    if given["file"] is None:
        return [f"certificate: none, {given['reason']}"]
    return [f"certificate: {given['file']} (its meshes: {given['meshes']})"]


def _certificate_table(document: Mapping[str, Any]) -> list[Block]:
    """Which plan's certificate is in which file, if any were asked for."""
    plans = document["plans"]
    if not any("certificate" in plan for plan in plans):
        return []
    rows = [("certificate of", "file", "meshes")]
    for plan in plans:
        given = plan["certificate"]
        if given["file"] is None:
            rows.append((plan["name"], f"none: {given['reason']}", ""))
        else:
            rows.append((plan["name"], given["file"], given["meshes"]))
    rows += [(name, "none: not checked", "") for name in document["not_checked"]]
    return [Table(rows), ""]


def _contact_lines(document: Mapping[str, Any]) -> list[Block]:
    """What touches what and where, a row each; which solids hold others."""
    rows = document["touching"]
    lines: list[Block] = []
    if rows:
        lines.append("")
        heads = ("link", "touches", "triangle pairs", "place in mm", "way out in mm")
        cells: list[tuple[str, ...]] = [heads]
        cells += [
            (
                row["link"],
                row["obstacle"],
                f"{row['pairs']:,}",
                point_mm(row["place_m"]),
                way_out_words(row),
            )
            for row in rows[:SHOWN]
        ]
        lines.append(Table(cells))
        if len(rows) > SHOWN:
            lines.append(f"and {len(rows) - SHOWN} more (all are in the JSON)")
        lines.append("")
    for found in document["contained"]:
        lines.append(f"  {found['link']}, {found['obstacle']}: {found['reason']}")
    return lines


def _warning_lines(document: Mapping[str, Any]) -> list[str]:
    warnings = [*document["robot"]["warnings"], *document["scene"]["warnings"]]
    warnings += document.get("checked", {}).get("warnings", ())
    return [*(f"warning: {warning}" for warning in warnings), *hint_lines(document)]


def compare_text(document: Mapping[str, Any], *, explain: bool = False) -> list[Block]:
    """The result of `compare` in words: a row per checker, then the causes."""
    poses = len(document["poses"])
    summaries = document["checkers"]
    # only where the robot touches itself are these fewer
    apart = any(
        summary.get("obstacle_poses", summary["contact_poses"])
        != summary["contact_poses"]
        for summary in summaries.values()
    )
    with_obstacles = ("with obstacles",) if apart else ()
    rows: list[tuple[str, ...]] = [
        ("checker", "poses in contact", *with_obstacles)
        + ("triangle pairs", "examined", "seconds")
    ]
    for name, summary in summaries.items():
        around = len(summary.get("obstacle_poses", ()))
        rows.append(
            (
                name,
                f"{len(summary['contact_poses'])} of {poses}",
                *((f"{around} of {poses}",) if apart else ()),
                f"{summary['triangle_pairs']:,}",
                f"{summary['pairs_examined']:,}",
                f"{summary['seconds']:.3f}",
            )
        )
    lines: list[Block] = [_missed_line(summaries, poses), Table(rows)]
    lines += ["", *_cause_lines(document["disagreements"])]
    lines += _replay_lines(document)
    lines += case_lines(document)
    hidden = [text for pose in document["poses"] for text in pose["contained"]]
    if hidden:
        lines.append(f"seen by containment only: {len(hidden)} times")
        lines += [f"  {text}" for text in hidden[:SHOWN]]
    lines += allowed_lines(document, explain)
    lines += _warning_lines(document)
    return lines


def _missed_line(summaries: Mapping[str, Any], poses: int) -> str:
    """The headline: poses in contact that a checker calls free of it.

    The judge is `exact`, or without it whatever another checker found.
    """
    found = {name: set(one["contact_poses"]) for name, one in summaries.items()}
    judge = found.get("exact", set().union(*found.values()))
    by = "exact" if "exact" in found else "any checker"
    missed = {name: len(judge - seen) for name, seen in found.items()}
    told = [f"{name} missed {count}" for name, count in missed.items() if count]
    more = {name: len(seen - judge) for name, seen in found.items()}
    told += [f"{name} found {count} more" for name, count in more.items() if count]
    said = ", ".join(told) if told else "no checker missed any"
    return f"{len(judge)} of {poses} poses in contact by {by}: {said}"


def _cause_lines(disagreements: Sequence[Mapping[str, Any]]) -> list[str]:
    if not disagreements:
        return ["all checkers agree about every pair of triangles"]
    counts: dict[str, int] = {}
    for found in disagreements:
        cause = found["cause"] or "NO KNOWN CAUSE"
        counts[cause] = counts.get(cause, 0) + 1
    lines = [f"{len(disagreements)} triangle pairs are disputed:"]
    for cause, count in sorted(counts.items(), key=lambda item: -item[1]):
        lines.append(f"  {count:6d}  {cause}")
    first = disagreements[0]
    saying = ", ".join(
        f"{name}: {'contact' if said else 'none'}"
        for name, said in first["verdicts"].items()
    )
    lines.append(
        f"for example pose {first['pose']}, {first['link']} "
        f"#{first['link_triangle']} with {first['obstacle']} "
        f"#{first['obstacle_triangle']}: {saying}"
    )
    return lines


def _replay_lines(document: Mapping[str, Any]) -> list[str]:
    """What a replay finds to be otherwise than its file says."""
    lines = []
    agreed = document.get("agreed", [])
    if agreed:
        lines.append(f"{len(agreed)} stored pairs are disputed no more: all agree")
    changed = document.get("changed", [])
    if changed:
        lines.append(f"{len(changed)} verdicts differ from those stored in the file:")
    for found in changed[:SHOWN]:
        said = [
            "contact" if found[key] is True else "none" for key in ("stored", "now")
        ]
        lines.append(
            f"  {found['link']} #{found['link_triangle']} with {found['obstacle']} "
            f"#{found['obstacle_triangle']}, {found['checker']}: {said[0]} stored, "
            f"{said[1]} now"
        )
    if len(changed) > SHOWN:
        lines.append(f"  and {len(changed) - SHOWN} more (all are in the JSON)")
    return lines


def fk_text(document: Mapping[str, Any]) -> list[Block]:
    """The result of `fk` in words."""
    worst = document["worst"]
    mark = "AGREE" if document["agree"] else "DISAGREE"
    lines: list[Block] = [
        f"{mark}: {document['configurations']} configurations, worst difference "
        f"{worst['position_m']:.2e} m, {worst['rotation_rad']:.2e} rad"
    ]
    rows = [("sources", "frames", "worst position", "worst rotation")]
    for pair, frames in document["worst_by_frame"].items():
        by_position = max(frames, key=lambda name: frames[name]["position_m"])
        by_rotation = max(frames, key=lambda name: frames[name]["rotation_rad"])
        position = frames[by_position]["position_m"]
        rotation = frames[by_rotation]["rotation_rad"]
        rows.append(
            (
                pair,
                str(len(frames)),
                f"{position:.1e} m ({by_position})",
                f"{rotation:.1e} rad ({by_rotation})",
            )
        )
    lines.append(Table(rows))
    lines += case_lines(document)
    lines += [f"no {source}: {why}" for source, why in document["silent"].items()]
    return lines


def millimetres(length: float | None) -> str:
    """A length in millimetres, or a dash."""
    return "-" if length is None else f"{1e3 * length:.3f} mm"
