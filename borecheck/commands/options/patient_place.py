"""`--isocentre`, `--position`, `--transform`: where the patient lies."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.core.patient_frame import POSITIONS
from borecheck.core.units import parse_length
from borecheck.errors import UsageError

if TYPE_CHECKING:
    from borecheck.plans.needle_plan import NeedlePlan
    from borecheck.plans.patient_place import PatientPlace

# Patients of a scanner lie within this of what their images call zero, [m].
_FARTHEST = 10.0


def add_patient_place(parser: argparse.ArgumentParser) -> None:
    """The options; for every command that takes the patient's coordinates."""
    group = parser.add_argument_group(
        "the patient's coordinates",
        "Markups of 3D Slicer are in LPS or RAS; where that lies in the scanner is "
        "never guessed.",
    )
    group.add_argument(
        "--isocentre",
        metavar="X,Y,Z",
        help="the isocentre in the patient's LPS coordinates: 12mm,-40mm,-750mm",
    )
    group.add_argument(
        "--position",
        choices=POSITIONS,
        metavar="CODE",
        help="how the patient lies, with --isocentre: HFS, FFP, HFDR ...",
    )
    group.add_argument(
        "--transform",
        metavar="FILE",
        help="instead: a rigid transform of ITK or Slicer (.tfm, .h5) from the "
        "scanner's frame (fixed) to the patient's LPS (moving); FILE:inverse for the "
        "other sense",
    )


def place_of(args: argparse.Namespace) -> "PatientPlace | None":
    """The place that the options state; None where they state none.

    Raises:
        UsageError: They contradict each other, or are no place.
        InputError: The transform cannot be used.
    """
    isocentre = getattr(args, "isocentre", None)
    transform = getattr(args, "transform", None)
    position = getattr(args, "position", None)
    if isocentre is not None and transform is not None:
        raise UsageError("--isocentre and --transform both say where: give one")
    scans = getattr(args, "patient_ct", [])
    if position is None and isocentre is not None and scans:
        # a scan says how its patient lies; `scan_place` asks that all agree
        args.position = position = _scanned_position(args, scans[0])
    if position is not None and isocentre is None and not scans:
        raise UsageError("--position goes with --isocentre")
    if isocentre is None and transform is None:
        return None
    if transform is None and position is None:
        raise UsageError(
            "--isocentre says where, and nothing how the patient lies: add "
            f"--position, one of {', '.join(POSITIONS)}"
        )
    from borecheck.plans.patient_place import at_isocentre, by_transform

    if transform is not None:
        return by_transform(transform)
    said = f"isocentre {isocentre} in LPS"
    return at_isocentre(centre_of(str(isocentre)), str(position), said)


def _scanned_position(args: argparse.Namespace, scan: Path) -> str | None:
    from borecheck.patients.reading import read_volume

    return read_volume(scan, args.series).position


def place_block(args: argparse.Namespace) -> dict[str, Any]:
    """What a result says of the place, if it was stated."""
    place = place_of(args)
    return {} if place is None else {"patient_place": place.to_json()}


def plans_of(args: argparse.Namespace, file: str | Path) -> "tuple[NeedlePlan, ...]":
    """The plans of a file, with the patient's place that the options state.

    Raises:
        PlanError: The file cannot be used.
        UsageError, InputError: The place cannot.
    """
    from borecheck.plans.plan_file import read_plans

    return read_plans(file, place_of(args))


def centre_of(text: str) -> list[float]:
    """The three lengths of `--isocentre`, [m].

    Raises:
        UsageError: They are no three lengths, or lie beyond any scanner.
    """
    parts = text.split(",")
    if len(parts) != 3:
        raise UsageError(f"--isocentre {text!r} has {len(parts)} numbers, not 3")
    centre = [parse_length(part.strip()) for part in parts]
    if max(map(abs, centre)) > _FARTHEST:
        raise UsageError(
            f"--isocentre {text!r} lies beyond {_FARTHEST:g} m: are these millimetres? "
            "Bare numbers are metres; write for example 12mm,-40mm,-750mm"
        )
    return centre
