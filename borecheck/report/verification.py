"""What `verify` found, as a document and in words."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from borecheck.report.case_words import case_lines
from borecheck.verify.verification import Verification

# Of a hash, enough to tell two robots apart on a line.
HASH_SHOWN = 12
# Of things that are wrong in the same way, so many are named.
NAMED = 3
# Of a corridor.
ENDS = ("entry", "target")


def verification_block(file: str, answer: Verification) -> dict[str, Any]:
    """One certificate's part of the document."""
    return {
        "file": file,
        "accepted": answer.accepted,
        "could_not_run": answer.could_not_run,
        "bound_to": answer.bound_to,
        "problems": list(answer.problems),
        "intervals": answer.intervals,
        "pairs": answer.pairs,
        "not_covered": [list(pair) for pair in answer.not_covered],
        "allowed": list(answer.allowed),
        "neighbours": [list(pair) for pair in answer.neighbours],
        "passages": list(answer.passages),
        "not_known": list(answer.not_known),
        "about": answer.stated.get("about") if answer.accepted else None,
        "subject": _subject(answer.stated) if answer.accepted else None,
    }


def verification_document(blocks: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """All certificates together, and under `certificates` each for itself."""
    several = len(blocks) > 1
    return {
        "accepted": all(block["accepted"] for block in blocks),
        "bound": all(block["bound_to"] is not None for block in blocks),
        "problems": [
            f"{block['file']}: {problem}" if several else problem
            for block in blocks
            for problem in block["problems"]
        ],
        "intervals": sum(block["intervals"] for block in blocks),
        "pairs": sum(block["pairs"] for block in blocks),
        "not_covered": [pair for block in blocks for pair in block["not_covered"]],
        "passages": [text for block in blocks for text in block["passages"]],
        "allowed": [text for block in blocks for text in block["allowed"]],
        "certificates": list(blocks),
    }


def verification_text(document: Mapping[str, Any]) -> Iterator[str]:
    """The result of `verify` in words: each certificate, and of several how many hold.

    Names are a file's own: no character of them is left that a terminal would obey.
    """
    blocks = document["certificates"]
    several = len(blocks) > 1
    for block in blocks:
        named = several or block["could_not_run"]
        yield from _one(block, f" {block['file']}" if named else "")
    yield from case_lines(document)
    for name in document.get("plans_without", ()):
        yield f"no certificate accepted for the plan {name}"
    if several:
        rejected = [block["file"] for block in blocks if not block["accepted"]]
        accepted = (
            f"{len(blocks) - len(rejected)} of {len(blocks)} certificates accepted"
        )
        yield accepted + (f"; rejected: {', '.join(rejected)}" if rejected else "")


def _one(block: Mapping[str, Any], named: str) -> Iterator[str]:
    if not block["accepted"]:
        first, *more = merged(block["problems"])
        yield f"REJECTED{named}: {first}"
        yield from (f"  {problem}" for problem in more)
        return
    bound = block["bound_to"]
    checked = f"{block['intervals']} intervals of {block['pairs']} pairs checked"
    yield f"ACCEPTED{named}: {checked}, {'bound to files' if bound else 'by itself'}"
    yield from (f"  {line}" for line in _subject_lines(block))
    yield from (f"  allowed: {passage}" for passage in block["passages"])
    yield from (f"  may touch, not covered: {pair}" for pair in block["allowed"])
    count = len(block["neighbours"])
    yield f"  not asked: {count} pairs of parts, neighbours in the chain or one body"
    yield f"  bound to: {bound}" if bound else "  not bound to any file"
    yield from (f"  not known: {text}" for text in block["not_known"])


def merged(problems: Sequence[str]) -> list[str]:
    """Problems as lines; those that say the same of several things are one."""
    kinds: dict[str, list[str]] = {}
    for problem in problems:
        subject, colon, said = problem.partition(": ")
        kinds.setdefault(said if colon else problem, []).append(subject)
    return [
        _of_several(subjects, said) if subjects != [said] else said
        for said, subjects in kinds.items()
    ]


def _of_several(subjects: Sequence[str], said: str) -> str:
    """The first of the things, how many more, and what is said of each."""
    more = len(subjects) - NAMED
    named = "; ".join(subjects[:NAMED]) + (f" and {more} more" if more > 0 else "")
    return f"{named}: {said}"


def _subject(stated: Mapping[str, Any]) -> dict[str, Any]:
    """What a certificate speaks of: motion, margin and surfaces."""
    names = [body["name"] for body in stated["bodies"]]
    parts = stated["part_count"]
    return {
        "waypoints": len(stated["waypoints"]),
        "first": stated["waypoints"][0],
        "last": stated["waypoints"][-1],
        "margin_m": stated["margin_m"],
        "parts": names[:parts],
        "obstacles": names[parts:],
    }


def _subject_lines(block: Mapping[str, Any]) -> Iterator[str]:
    subject = block["subject"]
    yield from _names(block["about"] or {}, bool(block["passages"]))
    if block["about"] and not block["bound_to"]:
        yield "(names are as its writer stated them; what follows was checked)"
    first, last = _rounded(subject["first"]), _rounded(subject["last"])
    yield f"motion of {subject['waypoints']} waypoints, from {first} to {last}"
    yield f"margin {1e3 * subject['margin_m']:g} mm"
    yield f"parts: {', '.join(subject['parts'])}"
    yield f"obstacles: {', '.join(subject['obstacles'])}"


def _rounded(q: Sequence[float]) -> str:
    """A configuration for reading: micrometres and microradians."""
    return f"[{', '.join(f'{round(value, 6) + 0.0:g}' for value in q)}]"


def _names(about: Mapping[str, Any], enters: bool) -> Iterator[str]:
    """Robot, scene and plan, as its writer called them."""
    if "robot" in about:
        robot = about["robot"]
        digest = robot["urdf_sha256"][:HASH_SHOWN]
        yield f"robot: {_with_arguments(robot)}; URDF sha256 {digest}..."
    if "scene" in about:
        yield f"scene: {_with_arguments(about['scene'])}"
    if "plan" in about:
        plan = about["plan"]
        ends = f"entry {_millimetres(plan['entry'])}, target "
        ends += f"{_millimetres(plan['target'])} mm"
        more = "" if enters else "; no patient: no contact is allowed anywhere"
        yield f"plan: {plan['name']}, {ends}{more}"
    if "corridor" in about:
        entry, target = (_millimetres(about["corridor"][k]) for k in ENDS)
        yield f"corridor of the path: from {entry} to {target} mm"


def _with_arguments(named: Mapping[str, Any]) -> str:
    arguments = ", ".join(f"{k}={v}" for k, v in named["arguments"].items())
    return f"{named['name']} ({arguments})" if arguments else str(named["name"])


def _millimetres(point: Sequence[float]) -> str:
    return f"({', '.join(f'{1e3 * x:.1f}' for x in point)})"
