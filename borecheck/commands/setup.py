"""`borecheck setup`: the best configuration for a needle, or that there is none.

What is given was asked of the exact checker; the waypoints that `--motions` writes are
checked and certified by `borecheck check --path`.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.commands import common
from borecheck.commands.options.allowed import add_allowed
from borecheck.commands.options.needle import add_needle
from borecheck.commands.options.patient_place import add_patient_place, plans_of
from borecheck.commands.output import check_outputs, emit, refuse_outputs
from borecheck.core.units import parse_angle, parse_length, parse_pair
from borecheck.errors import UsageError

if TYPE_CHECKING:
    from borecheck.report.blocks import Block
    from borecheck.setup.answer import Setup
    from borecheck.setup.requirements import Requirements


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    common.add_robot(parser)
    common.add_scene(parser)
    parser.add_argument(
        "--plan",
        type=Path,
        metavar="FILE",
        help="needle plans, CSV, JSON, or markups of 3D Slicer",
    )
    add_solver(parser)
    add_requirements(parser)
    parser.add_argument(
        "--motions",
        type=Path,
        metavar="DIR",
        help="write the waypoints through each configuration there, NAME.csv: from "
        "before the skin to the target, for check --path",
    )
    add_needle(parser)
    add_patient_place(parser)
    add_allowed(parser)
    common.add_output(parser)


def add_solver(parser: argparse.ArgumentParser) -> None:
    """Which solver, for a redundant arm with a closed form."""
    parser.add_argument(
        "--solver",
        default=None,
        metavar="NAME",
        help="of a redundant arm with a closed form: grid (fast, proves nothing) or "
        "proven (branch and bound); other arms have one way each",
    )
    parser.add_argument(
        "--gap",
        type=float,
        default=0.05,
        metavar="G",
        help="of proven: how much cheaper another configuration may be (default: 0.05)",
    )
    parser.add_argument(
        "--boxes",
        type=int,
        default=40_000,
        metavar="N",
        help="of proven: boxes looked at before it is given up (default: 40000)",
    )


def add_requirements(parser: argparse.ArgumentParser) -> None:
    """What a set-up must fulfil; docs/setup.md has the sources of the defaults."""
    group = parser.add_argument_group("requirements")
    group.add_argument(
        "--margin", default="10mm", help="distance kept from obstacles (default: 10mm)"
    )
    group.add_argument(
        "--force", type=float, default=5.0, metavar="N", help="along the needle, [N]"
    )
    group.add_argument(
        "--moment", type=float, default=0.1, metavar="NM", help="on the needle, [Nm]"
    )
    group.add_argument(
        "--cone",
        default="10deg",
        metavar="DEG",
        help="how far the needle can be tilted to all sides (default: 10deg; a bare "
        "number is in degrees)",
    )
    group.add_argument(
        "--depth",
        default=None,
        help="how far the drive must reach (default: as deep as the plan goes)",
    )
    group.add_argument(
        "--weight",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="of the cost: dexterity, scanner, patient, motion (repeatable)",
    )
    group.add_argument(
        "--exclude",
        action="append",
        default=[],
        metavar="LINK:OBSTACLE",
        help="a pair that need not keep the margin; it may not touch (repeatable)",
    )


def asked_of(args: argparse.Namespace) -> "Requirements":
    """The requirements that the options state.

    Raises:
        UsageError: A number that is none, or a pair of another form.
    """
    from borecheck.setup.requirements import requirements

    pairs = []
    for text in args.exclude:
        first, colon, second = text.partition(":")
        if not (first and colon and second):
            raise UsageError(f"--exclude {text!r}: give LINK:OBSTACLE")
        pairs.append((first, second))
    return requirements(
        padding=parse_length(args.margin),
        force=args.force,
        moment=args.moment,
        cone=_degrees(args.cone),
        depth=None if args.depth is None else parse_length(args.depth),
        weights=_weights(args.weight),
        excluded=tuple(pairs),
    )


def _degrees(text: str) -> float:
    """An angle; without a unit in degrees, as the option's name says."""
    try:
        float(text)
    except ValueError:
        return parse_angle(text)
    return parse_angle(f"{text}deg")


def _weights(texts: Sequence[str]) -> dict[str, float]:
    found = {}
    for text in texts:
        name, value = parse_pair(text, "--weight")
        try:
            found[name] = float(value)
        except ValueError:
            raise UsageError(f"--weight {text!r}: {value!r} is no number") from None
    return found


def run(args: argparse.Namespace) -> int:
    """Solves every plan; 0 all reachable, 1 one is unreachable, 2 one is undecided."""
    asked = asked_of(args)
    if args.plan is None:
        raise UsageError("give the needles: --plan FILE")
    check_outputs(args)
    from borecheck.commands.compiling import tell_of_compiling

    tell_of_compiling()
    from borecheck.commands.progress import Progress
    from borecheck.report.document import about_block, header
    from borecheck.setup.solve import setups

    robot, scene = common.load(args), common.load_surroundings(args)
    plans = plans_of(args, args.plan)
    _refuse_motions(args, [plan.name for plan in plans])
    found = setups(
        robot, scene, plans, asked, args.solver, Progress("plans"), args.gap, args.boxes
    )
    files = _write_motions(args.motions, found)
    document = {
        **header("setup", args.argv, args.date),
        **about_block(robot, scene),
        "requirements": asked.to_json(),
        "setups": [one.to_json() for one in found],
        "motions": files,
        "summary": {
            status: sum(one.status == status for one in found)
            for status in ("reachable", "unreachable", "undecided")
        },
    }
    emit(args, document, _text)
    return _status(found)


def _status(found: "Sequence[Setup]") -> int:
    from borecheck.commands.exit_status import ExitStatus

    said = {one.status for one in found}
    if "unreachable" in said:
        return ExitStatus.FINDINGS
    return ExitStatus.COULD_NOT if "undecided" in said else ExitStatus.CLEAN


def _refuse_motions(args: argparse.Namespace, names: "Sequence[str]") -> None:
    """Refuses motions that would be lost or replace what is read, before the work."""
    if args.motions is None:
        return
    files: dict[str, Path] = {}
    owner: dict[str, str] = {}
    for name in names:
        file = args.motions / f"{_file_name(name)}.csv"
        first = owner.setdefault(file.name.casefold(), name)
        if first != name:
            raise UsageError(
                f"plans {first!r} and {name!r} would both have the motion {file}: "
                "rename one of them, by letters or digits"
            )
        files[f"the motion of plan {name!r}"] = file
    if args.motions.is_dir():  # in a new folder nothing is there to be lost
        refuse_outputs(args, "out", "report", more=files)


def _write_motions(folder: Path | None, found: "Sequence[Setup]") -> dict[str, str]:
    """Files of waypoints by the plan's name; what has none is left out."""
    from borecheck.core.whole_files import telling
    from borecheck.plans.path_file import write_path

    if folder is None:
        return {}
    with telling(folder):
        folder.mkdir(exist_ok=True)
    files = {}
    for one in found:
        if one.motion is not None:
            file = folder / f"{_file_name(one.plan.name)}.csv"
            write_path(file, one.joints, one.motion)
            files[one.plan.name] = str(file)
    return files


def _file_name(name: str) -> str:
    """A plan's name as part of a file's: letters, digits, - and _ alone."""
    return "".join(c if c.isalnum() or c in "-_" else "_" for c in name) or "plan"


def _text(document: Mapping[str, Any]) -> "Sequence[Block]":
    from borecheck.report.setup_words import setup_text

    return setup_text(document)
