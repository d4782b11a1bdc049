"""`check --slicer DIR`, `--dicom DIR`: the result in the patient's coordinates.

For a scene of 3D Slicer, and for an archive, beside the series that it is about.
"""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.commands.options.patient_place import place_of
from borecheck.core.whole_files import same_file
from borecheck.errors import InputError, UsageError

if TYPE_CHECKING:
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene


def add_slicer(parser: argparse.ArgumentParser) -> None:
    """The option."""
    parser.add_argument(
        "--slicer",
        type=Path,
        metavar="DIR",
        help="write plans, contacts, bodies and robot there for 3D Slicer, in the "
        "patient's LPS (a new or empty folder; needs --isocentre or --transform)",
    )
    parser.add_argument(
        "--dicom",
        type=Path,
        metavar="DIR",
        help="write plans, bodies, robot (Encapsulated STL) and verdict (SR) there; "
        "needs --dicom-from, too",
    )
    parser.add_argument(
        "--dicom-from",
        type=Path,
        metavar="IMAGE",
        help="an image of the patient's series: patient, study, frame of reference",
    )


def refuse_folder(args: argparse.Namespace) -> None:
    """Refuses a folder that holds anything: what is old there would be taken for new.

    Raises:
        UsageError: It does, or nobody says where the patient's coordinates lie.
    """
    if (args.dicom is None) != (args.dicom_from is None):
        raise UsageError("--dicom DIR and --dicom-from IMAGE go together")
    for option, folder in (("--slicer", args.slicer), ("--dicom", args.dicom)):
        if folder is None:
            continue
        if place_of(args) is None:
            raise UsageError(
                f"{option} writes in the patient's coordinates: give --isocentre or "
                "--transform"
            )
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise UsageError(f"{option} {folder}: is no empty folder; name a new one")
    if args.dicom is not None:
        if args.slicer is not None and same_file(args.dicom, args.slicer):
            raise UsageError("--slicer and --dicom name the same folder")
        from borecheck.patients.dicom_out import read_reference

        read_reference(args.dicom_from)  # refused before any work is done


def show_in_slicer(
    args: argparse.Namespace,
    document: Mapping[str, Any],
    robot: "Robot",
    scene: "Scene",
) -> None:
    """Writes the files, if they are asked for.

    Raises:
        InputError: They cannot be written.
    """
    folder, place = getattr(args, "slicer", None), place_of(args)
    if folder is not None and place is not None:
        from borecheck.report.slicer import slicer_files

        _write(folder, slicer_files(robot, scene, document, place))
    folder = getattr(args, "dicom", None)
    if folder is not None and place is not None:
        from borecheck.patients.dicom_out import read_reference
        from borecheck.report.dicom import dicom_files

        reference = read_reference(args.dicom_from)
        _write(folder, dicom_files(robot, scene, document, place, reference))


def _write(folder: Path, files: Mapping[str, str | bytes]) -> None:
    """All files into a folder, which is made if need be."""
    from borecheck.core.whole_files import write_all

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(folder, f"cannot be made: {error.strerror}") from error
    write_all({folder / name: content for name, content in files.items()})
