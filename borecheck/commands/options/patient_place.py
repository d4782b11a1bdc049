"""`--isocentre`, `--position`, `--transform`: where the patient lies."""

import argparse
from dataclasses import dataclass
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


@dataclass(frozen=True, eq=False)
class Stated:
    """What is said of where the patient's coordinates lie; parts may be unsaid.

    Attributes:
        place: Turned and moved as far as it is said.
        turned: Whether it is said how the patient lies.
        moved: Whether it is said where the isocentre is.
        notes: How it was said.
    """

    place: "PatientPlace"
    turned: bool
    moved: bool
    notes: tuple[str, ...]


def stated(args: argparse.Namespace, scanned: str | None = None) -> Stated:
    """What the options say, and what a scan says of how its patient lies.

    Raises:
        UsageError: They contradict each other, or are no place.
        InputError: The transform cannot be used.
    """
    import numpy as np

    from borecheck.plans.patient_place import PatientPlace, at_isocentre, by_transform

    typed = (getattr(args, n, None) for n in ("isocentre", "position", "transform"))
    isocentre, position, transform = typed
    if transform is not None:
        if isocentre is not None:
            raise UsageError("--isocentre and --transform both say where: give one")
        if position is not None:
            raise UsageError("--transform says how the patient lies: no --position")
        place = by_transform(transform)
        return Stated(place, True, True, (place.stated,))
    position = position or scanned
    centre = np.array([0.0, 0.0, 0.0] if isocentre is None else centre_of(isocentre))
    words = f"isocentre {isocentre} in LPS"
    if position is None:
        T = np.eye(4)
        T[:3, 3] -= centre
        place = PatientPlace(T, words)
    else:
        place = at_isocentre(centre, position, words)
    notes = [] if position is None else [f"the patient lies {position}"]
    if isocentre is not None:
        notes.append(words)
    return Stated(place, position is not None, isocentre is not None, tuple(notes))


def place_of(args: argparse.Namespace) -> "PatientPlace | None":
    """The place that the options state; None where they state none.

    Raises:
        UsageError: They contradict each other, or are no place.
        InputError: The transform cannot be used.
    """
    isocentre = getattr(args, "isocentre", None)
    scans = getattr(args, "patient_ct", [])
    if isocentre is None and getattr(args, "transform", None) is None:
        if getattr(args, "position", None) is not None and not scans:
            raise UsageError("--position goes with --isocentre")
        return None
    if isocentre is not None and args.position is None and scans:
        # a scan says how its patient lies; `scan_place` asks that all agree
        args.position = _scanned_position(args, scans[0])
    found = stated(args)
    if not found.turned:
        raise UsageError(
            "--isocentre says where, and nothing how the patient lies: add "
            f"--position, one of {', '.join(POSITIONS)}"
        )
    return found.place


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
