"""`borecheck examples`: writes an arm, a gantry, a torso, plans and a case to try."""

import argparse
from importlib.resources import files
from pathlib import Path

# What README and docs use, and what each is.
CONTENTS = {
    "arm.urdf": "an arm of six joints with a needle, made up",
    "arm.srdf": "which of its links may touch each other",
    "gantry.stl": "a bore of 780 mm, in mm",
    "torso.stl": "a slim torso, in mm, its middle at the origin",
    "plans.csv": "two needle plans, for the arm and for zerobot",
    "line.mrk.json": "the first of them in a patient's coordinates, from 3D Slicer",
    "path.csv": "the arm's way to where the first plan begins",
    "insertion.csv": "the first plan's insertion by the arm, as a path",
    "whole.csv": "the arm's way and the insertion in one path",
    "case.toml": "arm, gantry, torso and plans in one case file",
    "errors.json": "how inexact zerobot is, for --uncertainty",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="made if need be")


def run(args: argparse.Namespace) -> int:
    """Writes all files or, where one of them is there already, none."""
    from borecheck.commands.progress import say
    from borecheck.core.whole_files import telling, write_all
    from borecheck.errors import UsageError

    there = [name for name in CONTENTS if (args.folder / name).exists()]
    if there:
        raise UsageError(
            f"{args.folder / there[0]}: is there already; nothing was written"
        )
    source = files("borecheck") / "examples"
    contents = {args.folder / n: (source / n).read_bytes() for n in CONTENTS}
    with telling(args.folder):
        args.folder.mkdir(exist_ok=True)
    write_all(contents)
    for name, what in CONTENTS.items():
        say(f"{args.folder / name}: {what}")
    return 0
