"""`borecheck verify`: checks path certificates again, by code of its own."""

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from borecheck.verify.check import Verification

# Of a hash, enough to tell two robots apart on a line.
HASH_SHOWN = 12


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument(
        "certificates",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="a certificate, JSON (several: all of them are checked)",
    )
    parser.add_argument(
        "--meshes",
        type=Path,
        default=None,
        metavar="FILE",
        help="the meshes it speaks of (default: the .npz file beside it)",
    )
    parser.add_argument("--format", choices=("text", "json"), default="text")


def run(args: argparse.Namespace) -> int:
    """0 if every statement was confirmed, 1 if not, 2 if there is no such file."""
    from borecheck.commands.exit_status import ExitStatus
    from borecheck.errors import InputError, UsageError
    from borecheck.verify.check import verify

    if args.meshes is not None and len(args.certificates) > 1:
        raise UsageError("--meshes goes with one certificate; each has its own")
    for file in args.certificates:
        if not file.is_file():
            raise InputError(file, "there is no such file")
    answers: dict[Path, Verification] = {}
    for file in args.certificates:
        answers[file] = verify(file, args.meshes)
        problems = answers[file].problems
        if problems and problems[0].startswith("not a certificate"):
            raise InputError(file, "is no path certificate")
    if args.format == "json":
        sys.stdout.write(json.dumps(_document(answers), indent=1) + "\n")
    else:
        sys.stdout.write("\n".join(_lines(answers)) + "\n")
    accepted = all(answer.accepted for answer in answers.values())
    return ExitStatus.CLEAN if accepted else ExitStatus.FINDINGS


def _document(answers: Mapping[Path, "Verification"]) -> dict[str, Any]:
    """All answers together, and under `certificates` each for itself."""
    several = len(answers) > 1
    each: list[dict[str, Any]] = [
        {
            "file": str(file),
            "accepted": answer.accepted,
            "problems": list(answer.problems),
            "intervals": answer.intervals,
            "pairs": answer.pairs,
            "not_covered": [list(pair) for pair in answer.not_covered],
            "passages": list(answer.passages),
            "about": _stated(file).get("about") if answer.accepted else None,
        }
        for file, answer in answers.items()
    ]
    return {
        "schema_version": "1",
        "command": "verify",
        "accepted": all(answer.accepted for answer in answers.values()),
        "problems": [
            f"{file}: {problem}" if several else problem
            for file, answer in answers.items()
            for problem in answer.problems
        ],
        "intervals": sum(answer.intervals for answer in answers.values()),
        "pairs": sum(answer.pairs for answer in answers.values()),
        "not_covered": [pair for one in each for pair in one["not_covered"]],
        "passages": [text for one in each for text in one["passages"]],
        "certificates": each,
    }


def _lines(answers: Mapping[Path, "Verification"]) -> Iterator[str]:
    """What people read: each certificate, and of several how many hold."""
    several = len(answers) > 1
    for file, answer in answers.items():
        mark = "ACCEPTED" if answer.accepted else "REJECTED"
        named = f"{mark} {file}" if several else mark
        yield f"{named}: {answer.intervals} intervals of {answer.pairs} pairs checked"
        if answer.accepted:
            yield from (f"  {line}" for line in _subject(_stated(file)))
        yield from (f"  {problem}" for problem in answer.problems)
        yield from (f"  allowed: {passage}" for passage in answer.passages)
        yield from (f"  not covered: {a} against {b}" for a, b in answer.not_covered)
    if several:
        rejected = [str(f) for f, answer in answers.items() if not answer.accepted]
        told = f"{len(answers) - len(rejected)} of {len(answers)} certificates accepted"
        yield told + (f"; rejected: {', '.join(rejected)}" if rejected else "")


def _stated(certificate: Path) -> dict[str, Any]:
    return dict(json.loads(certificate.read_text(encoding="utf-8")))


def _subject(stated: Mapping[str, Any]) -> Iterator[str]:
    """What a certificate speaks of: names, motion, margin and surfaces."""
    yield from _names(stated.get("about") or {}, bool(stated.get("passages")))
    names = [str(body["name"]) for body in stated["bodies"]]
    parts = int(stated["part_count"])
    waypoints = stated["waypoints"]
    first, last = _rounded(waypoints[0]), _rounded(waypoints[-1])
    yield f"motion of {len(waypoints)} waypoints, from {first} to {last}"
    yield f"margin {1e3 * stated['margin_m']:g} mm"
    yield f"parts: {', '.join(names[:parts])}"
    yield f"obstacles: {', '.join(names[parts:])}"


def _rounded(q: Sequence[float]) -> str:
    """A configuration for reading: micrometres and microradians."""
    return f"[{', '.join(f'{round(value, 6) + 0.0:g}' for value in q)}]"


def _names(about: Mapping[str, Any], enters: bool) -> Iterator[str]:
    """Robot, scene and plan, as its writer called them."""
    if "robot" in about:
        robot = about["robot"]
        yield (
            f"robot: {_with_arguments(robot)}; "
            f"URDF sha256 {str(robot['urdf_sha256'])[:HASH_SHOWN]}..."
        )
    if "scene" in about:
        yield f"scene: {_with_arguments(about['scene'])}"
    if "plan" in about:
        plan = about["plan"]
        ends = f"entry {_millimetres(plan['entry'])}, target "
        ends += f"{_millimetres(plan['target'])} mm"
        more = "" if enters else "; no patient: no contact is allowed anywhere"
        yield f"plan: {plan['name']}, {ends}{more}"
    if about:
        yield "(names are as its writer stated them; what follows was checked)"


def _with_arguments(named: Mapping[str, Any]) -> str:
    arguments = ", ".join(f"{k}={v}" for k, v in named["arguments"].items())
    return f"{named['name']} ({arguments})" if arguments else str(named["name"])


def _millimetres(point: Sequence[float]) -> str:
    return f"({', '.join(f'{1e3 * x:.1f}' for x in point)})"
