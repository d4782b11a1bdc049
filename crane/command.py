"""`borecheck crane`: inverse, coupling, statics, registration and control of CRANE.

Each is a study of `crane.studies`, with its JSON, page and pictures.
"""

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from borecheck.commands import common
from borecheck.commands.output import emit, refuse_outputs
from borecheck.errors import InputError, UsageError

TITLES = {
    "inverse": "closed form and the paper's iteration: what is found, what is lost",
    "coupling": "motors and joints, eqs. (6) to (10), from what encoders read",
    "statics": "stiffness, the 5 N test and bearings' ratings, eqs. (1) to (5)",
    "registration": "tracker, robot and scanner, eq. (15), with its errors",
    "control": "open and closed loop on a cone, eqs. (27) to (31), as in Fig. 11",
}

# The least --count: what is fewer tells nothing, or is no turn of the cone.
LEAST = {**dict.fromkeys(TITLES, 100), "control": 200}
# Options of one study alone.
ONLY_FOR = {"series": "coupling", "uncertainty": "registration", "pictures": "control"}

# What a study's pages and texts do not list number by number.
_LONG = ("pictures", "uncertainty")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument("study", choices=tuple(TITLES), help="what is looked at")
    parser.add_argument(
        "--count",
        type=int,
        metavar="N",
        help="poses, samples, seeds, or periods a turn of the cone (default: "
        "20000, 50000, 200, 1200; statics 500)",
    )
    parser.add_argument("--seed", type=int, help="of all random numbers (default: 1)")
    parser.add_argument(
        "--series",
        type=Path,
        metavar="FILE.csv",
        help="coupling: m5,m6,m7,m8,q5,q6,q7,q8 [rad, q8 m] as read, a line a sample",
    )
    parser.add_argument(
        "--uncertainty",
        type=Path,
        metavar="FILE.json",
        help="registration: write its covariance there, for `check --uncertainty`",
    )
    parser.add_argument(
        "--pictures", type=Path, metavar="DIR", help="control: write its curves as SVG"
    )
    common.add_output(parser)


def run(args: argparse.Namespace) -> int:
    """Runs the study; 0 when it is done."""
    _check(args)
    from borecheck.commands.exit_status import ExitStatus
    from borecheck.core.whole_files import write_all
    from borecheck.report.document import dumps, header

    found, told = _STUDIES[args.study](args)
    files: dict[Path, str | bytes] = {}
    if args.uncertainty is not None:
        files[args.uncertainty] = dumps(found["uncertainty"])
    if args.pictures is not None:
        files |= _drawn(args.pictures, found["pictures"])
    write_all(files)
    document = {
        **header("crane", args.argv, args.date),
        "study": args.study,
        "summary": f"CRANE: {TITLES[args.study]}",
        "seed": None if args.series is not None else _seed(args),
        **{k: v for k, v in found.items() if k not in _LONG},
        "told": told,
    }
    document["sections"] = _sections(told, found.get("pictures", {}))
    emit(args, document, lambda _: [f"CRANE: {TITLES[args.study]}", "", *told])
    return int(ExitStatus.CLEAN)


def _check(args: argparse.Namespace) -> None:
    """Refuses what makes no sense before any work is done."""
    _refuse_stray(args)
    if args.seed is not None and args.seed < 0:
        raise UsageError("--seed is 0 or more")
    least = LEAST[args.study]
    if args.count is not None and args.count < least:
        raise UsageError(
            f"--count {args.count}: {least} is the least that tells anything"
        )
    if args.count is not None and args.count > 1_000_000:
        raise UsageError(f"--count {args.count}: 1000000 is the most")
    if args.pictures is not None and not args.pictures.is_dir():
        raise UsageError(f"--pictures {args.pictures}: there is no such directory")
    drawn = {} if args.pictures is None else _pictures(args.pictures)
    refuse_outputs(args, "out", "report", "uncertainty", more=drawn)


def _refuse_stray(args: argparse.Namespace) -> None:
    """Refuses options that would have no effect."""
    for option, study in ONLY_FOR.items():
        if getattr(args, option) is not None and args.study != study:
            raise UsageError(f"--{option} is for `borecheck crane {study}`")
    for option in ("count", "seed"):
        if args.series is not None and getattr(args, option) is not None:
            raise UsageError(
                f"--{option} is for simulated series: it does not go with --series"
            )


def _inverse(args: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    from crane.studies import inverse as study

    count = args.count or 20_000
    return _both(study, study.study(count, min(count, 2000), _seed(args)))


def _coupling(args: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    from crane.studies import coupling as study

    if args.series is None:
        return _both(study, study.study(args.count or 50_000, _seed(args)))
    from crane.series_file import read_series

    try:
        return _both(study, study.measured(read_series(args.series)))
    except ValueError as error:
        raise InputError(args.series, str(error)) from error


def _statics(args: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    from crane.studies import statics as study

    return _both(study, study.study(args.count or 500, _seed(args)))


def _registration(args: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    from crane.studies import registration as study

    return _both(study, study.study(args.count or 200, _seed(args)))


def _control(args: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    from crane.studies import control as study

    return _both(study, study.study(_seed(args), args.count or 1200))


def _seed(args: argparse.Namespace) -> int:
    return 1 if args.seed is None else int(args.seed)


def _both(study: Any, found: dict[str, Any]) -> tuple[dict[str, Any], list[str]]:
    told: Iterator[str] = study.lines(found)
    return found, list(told)


_STUDIES: dict[
    str, Callable[[argparse.Namespace], tuple[dict[str, Any], list[str]]]
] = {
    "inverse": _inverse,
    "coupling": _coupling,
    "statics": _statics,
    "registration": _registration,
    "control": _control,
}


def _drawn(folder: Path, pictures: dict[str, Any]) -> dict[Path, str | bytes]:
    from crane.pictures import curves

    return {file: curves(**pictures[file.stem]) for file in _pictures(folder).values()}


def _pictures(folder: Path) -> dict[str, Path]:
    """The files of `--pictures`, by what a user would call them."""
    names = ("position", "angle", "path")
    return {f"{n}.svg of --pictures": folder / f"{n}.svg" for n in names}


def _sections(told: list[str], pictures: dict[str, Any]) -> list[dict[str, Any]]:
    """What a page shows: the study's lines, then its curves over the turn."""
    rows = [[line] for line in told]
    sections: list[dict[str, Any]] = [
        {"title": "What the study says", "table": {"columns": [""], "rows": rows}}
    ]
    for name, picture in pictures.items():
        if name != "path":  # drawn from 0 up, which a path is not
            figure = {"kind": "curves", "title": picture["y"], **picture}
            sections.append({"title": picture["y"], "figure": figure})
    return sections
