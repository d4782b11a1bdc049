"""The options of `borecheck validate`, and what they ask for."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from borecheck.commands.options.outside import add_allow_outside
from borecheck.core.units import parse_pair
from borecheck.errors import UnknownNameError, UsageError
from borecheck.validation.codes import codes_of
from borecheck.validation.config import FAIL_ON
from borecheck.validation.options import PROFILES, check_count

FORMATS = ("text", "json", "sarif", "junit", "markdown", "html")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the options of `borecheck validate`."""
    add = parser.add_argument
    add("files", nargs="*", metavar="FILE", help="URDF or xacro, folder, pattern, or -")
    add("--arg", action="append", metavar="NAME=VALUE", help="xacro argument")
    add("--package-path", action="append", metavar="DIR", help="root for package://")
    add_allow_outside(add)
    add("--profile", choices=PROFILES, help="what the robot is for (collision)")
    add("--select", action="append", metavar="CODES", help="report only these")
    add("--ignore", action="append", metavar="CODES", help="leave these out")
    add("--fail-on", choices=FAIL_ON, help="exit 1 from this severity on (error)")
    add("--format", choices=FORMATS, help="of the result (text)")
    add("--out", metavar="FILE", type=Path, help="write the result here")
    add("--report", metavar="FILE", type=Path, help="write an HTML page as well")
    add("--brief", action="store_true", help="one line per finding")
    _add_depth(parser)
    _add_expectations(parser)
    _add_work(parser)


def _add_depth(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument_group("how deep").add_argument
    add("--no-meshes", action="store_true", help="read no mesh file, run no library")
    add(
        "--no-run", action="store_true", help="do not move the robot in other libraries"
    )
    add("--load-meshes", action="store_true", help="in Pinocchio and Coal, too")
    add("--containment", action="store_true", help="an open collision mesh is an error")
    add("--self-intersection", action="store_true", help="search meshes for crossings")
    add("--self-contact", type=int, metavar="N", help="sample N configurations")
    add("--write-srdf", type=Path, metavar="FILE", help="what --self-contact found")
    add("--samples", type=int, metavar="N", help="configurations compared (20)")
    add("--seed", type=int, metavar="K", help="of random configurations (0)")


def _add_expectations(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument_group("what must be there").add_argument
    add("--frame", action="append", metavar="NAME", help="a link that must exist")
    add("--link", action="append", metavar="NAME", help="must have collision geometry")
    add("--srdf", type=Path, metavar="FILE", help="check the names in this SRDF")
    add("--reference", type=Path, metavar="FILE", help="must move as this file does")
    add("--closed-form", metavar="MODULE:FUNCTION", help="must move as it says")
    add("--config", type=Path, metavar="FILE", help="instead of the nearest one")
    add("--baseline", type=Path, metavar="FILE", help="report only what is new")
    add("--write-baseline", type=Path, metavar="FILE", help="keep what is found")


def _add_work(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument_group("work").add_argument
    add("--jobs", type=int, metavar="N", help="processes (one per core)")
    add("--resume", type=Path, metavar="FILE", help="keep finished results here")
    add("--fix", action="store_true", help="show what needs no guessing, as a diff")
    add("--write", action="store_true", help="with --fix: change the files")
    add("--list-checks", action="store_true", help="list all checks and stop")


def given_by(args: argparse.Namespace) -> dict[str, Any]:
    """What the command line says, as fields of `Options`; None where it is silent."""
    for name in ("samples", "seed", "self_contact", "jobs"):
        if getattr(args, name) is not None:
            check_count(f"--{name.replace('_', '-')}", getattr(args, name))
    return {
        "profile": args.profile,
        "arguments": dict(parse_pair(text, "--arg") for text in args.arg or ()),
        "package_paths": args.package_path,
        "allow_outside": args.allow_outside or None,
        "select": _codes("--select", args.select),
        "ignore": _codes("--ignore", args.ignore),
        "meshes": False if args.no_meshes else None,
        "run": False if args.no_run or args.no_meshes else None,
        "load_meshes": args.load_meshes or None,
        "containment": args.containment or None,
        "self_intersection": args.self_intersection or None,
        "self_contact": args.self_contact,
        "samples": args.samples,
        "seed": args.seed,
        "frames": args.frame,
        "links": args.link,
        "srdf": args.srdf,
        "reference": args.reference,
        "closed_form": _closed_form(args.closed_form),
    }


def _closed_form(text: str | None) -> Any:
    if text is None:
        return None
    from borecheck.validation.checks.references import ClosedForm

    return ClosedForm(text)


def _codes(option: str, words: Sequence[str] | None) -> tuple[str, ...] | None:
    if words is None:
        return None
    try:
        return codes_of(words)
    except UnknownNameError as error:
        raise UsageError(
            f"{option}: {error.name!r} is no check; see borecheck validate "
            "--list-checks"
        ) from error


def refuse_nonsense(args: argparse.Namespace) -> None:
    """Options that would have no effect, or not the one that was meant."""
    if args.write and not args.fix:
        raise UsageError("--write goes with --fix")
    for name in ("format", "out", "report", "resume", "write_baseline", "write_srdf"):
        if args.fix and getattr(args, name) is not None:
            option = f"--{name.replace('_', '-')}"
            raise UsageError(f"--fix shows a diff: {option} does not go with it")
    for folder in args.package_path or ():
        if not Path(folder).is_dir():
            raise UsageError(f"--package-path {folder!r} is no folder")
