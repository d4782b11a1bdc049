"""`borecheck patient`: a scan as an obstacle that provably contains the patient.

Everything is worked out on this machine, and nothing that names a person is read.
"""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.commands import common
from borecheck.commands.options.patient_place import add_patient_place
from borecheck.commands.options.scan import (
    Shown,
    add_shape,
    notes_of,
    scan_of,
    scan_place,
    wishes_at,
)
from borecheck.commands.output import emit, refuse_suffix, refuse_surface
from borecheck.core.whole_files import write_whole
from borecheck.errors import UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from borecheck.patients.obstacle import PatientObstacle
    from borecheck.patients.volume import Volume
    from borecheck.robots.obstacle_files import Obstacle


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
        "--geometry-only",
        action="store_true",
        help="read and judge the scan, make no surface",
    )
    add_shape(parser)
    add_patient_place(parser)
    parser.add_argument(
        "--out",
        type=Path,
        metavar="SKIN.stl",
        help="write the obstacle there, in metres, in the scanner's frame",
    )
    parser.add_argument(
        "--picture",
        type=Path,
        metavar="FILE.png",
        help="write a picture there: three slices with the outline, the body in place",
    )
    parser.add_argument(
        "--scanner",
        metavar="NAME",
        help="an installed scanner to show around the body in the picture",
    )
    common.add_result(parser)


def run(args: argparse.Namespace) -> int:
    """Reads the scan; 0 if it can be used."""
    from borecheck.commands.exit_status import ExitStatus
    from borecheck.commands.progress import Progress
    from borecheck.patients.reading import list_series
    from borecheck.report.document import header
    from borecheck.report.patient_words import listed, patient_text

    _refuse_outputs(args)
    begun = {**header("patient", args.argv, args.date), "file": str(args.scan)}
    if args.list:
        found = list_series(args.scan, Progress("files"))
        emit(args, {**begun, "series": found}, listed)
        return ExitStatus.CLEAN
    volume = scan_of(args, args.scan)
    if args.geometry_only:
        emit(args, {**begun, **_judged(volume)}, patient_text)
        return ExitStatus.CLEAN
    emit(args, {**begun, **_made(args, volume)}, patient_text)
    return ExitStatus.CLEAN


def _refuse_outputs(args: argparse.Namespace) -> None:
    """Outputs that cannot be written, before any work is done."""
    refuse_surface(args, "result", "picture")
    refuse_suffix("--picture", args.picture, "pictures of a scan are PNG", ".png")
    if args.scanner is not None and args.picture is None:
        raise UsageError("--scanner is shown in the picture: give --picture")
    for name in ("out", "picture"):
        if getattr(args, name) is not None and (args.list or args.geometry_only):
            raise UsageError(f"--{name} needs the surface: leave out --list and so on")


def _judged(volume: "Volume") -> dict[str, Any]:
    """The scan's geometry and what is at its edges; every voxel is read."""
    from borecheck.patients.edges import cuts_of, tissue

    progress = Shown()

    def masks() -> "Iterator[NDArray[np.bool_]]":
        for k, plane in enumerate(volume.planes()):
            progress("slices", k + 1, volume.slices)
            yield tissue(volume, plane)

    cuts = cuts_of(volume, masks())
    return {
        "volume": volume.to_json(),
        "dropped": list(volume.dropped),
        "cuts": [cut.to_json() for cut in cuts],
        "extension_m": None,
        "components": None,
        "proof": None,
        "obstacle": None,
        "notes": [*volume.notes, *volume.doubts, *(cut.told for cut in cuts)],
    }


def _made(args: argparse.Namespace, volume: "Volume") -> dict[str, Any]:
    """The obstacle: what it was made of, what is proven, where it was written."""
    from borecheck.geometry.mesh_files.reading import write_stl
    from borecheck.patients.obstacle import patient_obstacle
    from borecheck.report.patient_picture import preview

    place = scan_place(args, volume)
    wishes = wishes_at(args, place)
    around = _around(args.scanner)
    made = patient_obstacle(volume, place.T_frame_lps, wishes, Shown())
    if args.out is not None:
        write_stl(args.out, made.mesh)
    if args.picture is not None:
        write_whole(args.picture, preview(made, place.T_frame_lps, around))
    return {
        **made.to_json(),
        "obstacle": {**_obstacle(args.out, made), "frame": place.frame},
        "place": {
            "known": not place.doubts,
            "T_frame_lps": place.T_frame_lps.tolist(),
        },
        "notes": list(notes_of(made, place)),
    }


def _around(scanner: str | None) -> "Sequence[Obstacle]":
    """What stands in a scanner but its own patient."""
    if scanner is None:
        return ()
    from borecheck.robots.scene import load_scene

    return [o for o in load_scene(scanner).obstacles if o.role != "patient"]


def _obstacle(file: Path | None, made: "PatientObstacle") -> dict[str, Any]:
    mesh = made.mesh
    return {
        "file": None if file is None else str(file),
        "triangles": len(mesh.triangles),
        "assumed_triangles": int(made.assumed.sum()),
        "bounds_m": mesh.bounds.tolist(),
        "sha256": mesh.sha256,
    }
