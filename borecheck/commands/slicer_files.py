"""`check --slicer DIR`: the result as files that 3D Slicer shows in its scene."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.commands.options.patient_place import place_of
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


def refuse_folder(args: argparse.Namespace) -> None:
    """Refuses a folder that holds anything: what is old there would be taken for new.

    Raises:
        UsageError: It does, or nobody says where the patient's coordinates lie.
    """
    folder = getattr(args, "slicer", None)
    if folder is None:
        return
    if place_of(args) is None:
        raise UsageError(
            "--slicer writes in the patient's coordinates: give --isocentre or "
            "--transform"
        )
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"--slicer {folder}: is no empty folder; name a new one")


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
    folder = getattr(args, "slicer", None)
    place = place_of(args)
    if folder is None or place is None:
        return
    from borecheck.core.whole_files import write_all
    from borecheck.report.slicer import slicer_files

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(folder, f"cannot be made: {error.strerror}") from error
    files = slicer_files(robot, scene, document, place)
    write_all({folder / name: content for name, content in files.items()})
