"""`borecheck patient`: a scan as an obstacle that provably contains the patient.

Everything is worked out on this machine, and nothing that names a person is read.
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.commands.output import emit, refuse_outputs

if TYPE_CHECKING:
    from borecheck.patients.volume import Volume


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    parser.add_argument(
        "scan",
        type=Path,
        metavar="DIR|FILE",
        help="a folder of DICOM files; a NIfTI or NRRD file, a segmentation of Slicer",
    )
    parser.add_argument(
        "--list", action="store_true", help="the series of a folder, and nothing else"
    )
    parser.add_argument(
        "--series", metavar="UID|N", help="which series to read (default: the longest)"
    )
    parser.add_argument(
        "--geometry-only",
        action="store_true",
        help="read and judge the scan, make no surface",
    )
    parser.add_argument(
        "--format", choices=("text", "json"), default="text", help="form of the result"
    )
    parser.add_argument(
        "--result", type=Path, metavar="FILE", help="write the full result there (JSON)"
    )
    parser.add_argument(
        "--date", default=None, help="date to print in the result, as text"
    )


def run(args: argparse.Namespace) -> int:
    """Reads the scan; 0 if it can be used."""
    from borecheck.commands.exit_status import ExitStatus
    from borecheck.commands.progress import Progress
    from borecheck.patients.reading import list_series, read_volume
    from borecheck.report.document import header
    from borecheck.report.patient_words import listed, patient_text

    refuse_outputs(args, "result")
    args.out, args.report = args.result, None
    begun = {**header("patient", args.argv, args.date), "file": str(args.scan)}
    if args.list:
        found = list_series(args.scan, Progress("files"))
        emit(args, {**begun, "series": found}, listed)
        return ExitStatus.CLEAN
    volume = read_volume(args.scan, args.series, Progress("files"))
    emit(args, {**begun, **_judged(volume)}, patient_text)
    return ExitStatus.CLEAN


def _judged(volume: "Volume") -> dict[str, Any]:
    """The scan's geometry and what is at its edges; every voxel is read."""
    from borecheck.commands.progress import Progress
    from borecheck.patients.edges import cuts_of, tissue

    progress = Progress("slices")

    def masks() -> Any:
        for k, plane in enumerate(volume.planes()):
            progress(k + 1, volume.slices)
            yield tissue(volume, plane)

    cuts = cuts_of(volume, masks())
    return {
        "volume": volume.to_json(),
        "dropped": list(volume.dropped),
        "cuts": [
            {"kind": c.kind, "where": c.where, "area_m2": c.area / 1e6} for c in cuts
        ],
        "components": None,
        "proof": None,
        "obstacle": None,
        "notes": [*volume.notes, *volume.doubts, *(c.told for c in cuts)],
    }
