"""`borecheck verify`: checks a path certificate again, by code of its own."""

import argparse
import json
import sys
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument("certificate", type=Path, help="the certificate (JSON)")
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
    from borecheck.certificate_check import verify
    from borecheck.errors import InputError
    from borecheck.exit_status import ExitStatus

    if not args.certificate.is_file():
        raise InputError(args.certificate, "there is no such file")
    answer = verify(args.certificate, args.meshes)
    if answer.problems and answer.problems[0].startswith("not a certificate"):
        raise InputError(args.certificate, "is no path certificate")
    if args.format == "json":
        document = {
            "schema_version": "1",
            "command": "verify",
            "accepted": answer.accepted,
            "problems": list(answer.problems),
            "intervals": answer.intervals,
            "pairs": answer.pairs,
            "not_covered": [list(pair) for pair in answer.not_covered],
            "passages": list(answer.passages),
        }
        sys.stdout.write(json.dumps(document, indent=1) + "\n")
    else:
        mark = "ACCEPTED" if answer.accepted else "REJECTED"
        lines = [
            f"{mark}: {answer.intervals} intervals of {answer.pairs} pairs checked"
        ]
        if answer.accepted:
            lines += [f"  {line}" for line in _subject(args.certificate)]
        lines += [f"  {problem}" for problem in answer.problems]
        lines += [f"  allowed: {passage}" for passage in answer.passages]
        lines += [f"  not covered: {a} against {b}" for a, b in answer.not_covered]
        sys.stdout.write("\n".join(lines) + "\n")
    return ExitStatus.CLEAN if answer.accepted else ExitStatus.FINDINGS


def _subject(certificate: Path) -> list[str]:
    """What a certificate speaks of: motion, margin and surfaces, by their names."""
    stated = json.loads(certificate.read_text(encoding="utf-8"))
    names = [str(body["name"]) for body in stated["bodies"]]
    parts = int(stated["part_count"])
    waypoints = stated["waypoints"]
    return [
        f"motion of {len(waypoints)} waypoints, from {waypoints[0]} to {waypoints[-1]}",
        f"margin {1e3 * stated['margin_m']:g} mm",
        f"parts: {', '.join(names[:parts])}",
        f"obstacles: {', '.join(names[parts:])}",
    ]
