"""`--patient-ct` and what goes with it: a scan as the patient of any command."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from borecheck.commands.options.patient_place import stated
from borecheck.core.patient_frame import POSITIONS
from borecheck.core.units import parse_length
from borecheck.errors import UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from borecheck.patients.obstacle import PatientObstacle, Wishes
    from borecheck.patients.volume import Volume
    from borecheck.robots.obstacle_files import Obstacle
    from borecheck.robots.scene import Scene

# Of whatever is done to a body; more is a mistake of the unit, [m].
_MOST = 0.5


@dataclass(frozen=True, eq=False)
class ScanPlace:
    """Where a scan's coordinates lie.

    Attributes:
        T_frame_lps: (4, 4), [m].
        frame: "scanner", or "LPS" if nobody says how the patient lies.
        doubts: What is not known; until then nothing is clear.
        notes: How it was stated.
    """

    T_frame_lps: "NDArray[np.float64]"
    frame: str
    doubts: tuple[str, ...]
    notes: tuple[str, ...]


def add_patient_ct(parser: argparse.ArgumentParser) -> None:
    """A scan as a patient, for commands that take obstacles."""
    group = parser.add_argument_group(
        "patient from a scan",
        "See borecheck patient; --isocentre or --transform says where the scan lies.",
    )
    group.add_argument(
        "--patient-ct",
        action="append",
        default=[],
        type=Path,
        metavar="DIR|FILE",
        help="a scan: the patient is an obstacle proven to contain it (repeatable)",
    )
    add_shape(group)


def add_shape(group: "argparse._ArgumentGroup | argparse.ArgumentParser") -> None:
    """What is read of a scan, and what is done to the body."""
    group.add_argument(
        "--series", metavar="UID|N", help="which series to read (default: the longest)"
    )
    group.add_argument(
        "--segment",
        metavar="NAMES",
        help="labels that are the whole body: names or numbers, or all",
    )
    group.add_argument(
        "--extend",
        metavar="LENGTH",
        default="50mm",
        help="how far the body goes on where the scan cuts it (default: 50mm)",
    )
    for name, what in (
        ("breathing", "the body may be moved forwards by so much"),
        ("couch-sag", "the couch may sink by so much"),
        ("cover", "a blanket lies so high on the body"),
    ):
        group.add_argument(f"--{name}", metavar="LENGTH", help=f"{what}, e.g. 15mm")


def wishes_of(args: argparse.Namespace) -> "Wishes":
    """What the options ask of the obstacle.

    Raises:
        UsageError: A length that is none, negative, or no length of a body.
    """
    from borecheck.patients.motion import BREATHING, COVER, SAG, Motion
    from borecheck.patients.obstacle import Wishes

    given = {BREATHING: args.breathing, SAG: args.couch_sag, COVER: args.cover}
    motions = tuple(
        Motion(kind, 1e3 * _length(f"--{kind.replace(' ', '-')}", text))
        for kind, text in given.items()
        if text is not None
    )
    return Wishes(1e3 * _length("--extend", args.extend), motions)


def wishes_at(args: argparse.Namespace, place: ScanPlace) -> "Wishes":
    """What the options ask of the obstacle of a scan that lies there.

    Raises:
        UsageError: As `wishes_of`; or it is to move down or up, and nobody says where
            that is.
    """
    from dataclasses import replace

    wishes = wishes_of(args)
    if place.frame == "scanner":
        x, y, z = (float(value) for value in place.T_frame_lps[2, :3])
        return replace(wishes, up=(x, y, z))
    for name in ("couch_sag", "cover"):
        if getattr(args, name) is not None:
            raise UsageError(
                f"--{name.replace('_', '-')} needs to know where up is: say how the "
                "patient lies, with --position or --transform"
            )
    return wishes


def scan_of(args: argparse.Namespace, path: Path) -> "Volume":
    """The scan that lies there, with the series and labels that are asked for.

    Raises:
        VolumeError: It cannot be used.
    """
    from borecheck.commands.progress import Progress
    from borecheck.patients.reading import read_volume
    from borecheck.patients.segments import with_segments

    volume = read_volume(path, args.series, Progress("files"))
    return with_segments(volume, args.segment)


def scan_place(args: argparse.Namespace, volume: "Volume") -> ScanPlace:
    """Where the scan lies, by the options and by what it says of the patient.

    Raises:
        UsageError: They contradict each other, or are no place.
    """
    typed = args.position
    if args.transform is None and typed and volume.position not in (None, typed):
        raise UsageError(
            f"--position {typed}, but {volume.file} says {volume.position}: leave it "
            "out, or mend the file"
        )
    said, doubts = stated(args, volume.position), []
    if not said.turned:
        doubts.append(f"{volume.file} does not say how the patient lies: --position")
    if not said.moved:
        doubts.append(
            f"where the isocentre is in {volume.file} is not known: give --isocentre "
            "or --transform"
        )
    frame = "scanner" if said.turned else "LPS"
    return ScanPlace(said.place.T_scanner_lps, frame, tuple(doubts), said.notes)


def with_scans(args: argparse.Namespace, scene: "Scene") -> "Scene":
    """The scene with the patients of `--patient-ct`.

    Raises:
        VolumeError: A scan that cannot be used.
        UsageError: A place that is none.
    """
    if not args.patient_ct:
        return scene
    stand_ins = [o for o in scene.obstacles if _is_phantom(scene, o)]
    scene = scene.without_obstacles(stand_ins)
    for path in args.patient_ct:
        scene = _with_scan(args, scene, path)
    names = ", ".join(o.name for o in stand_ins)
    told = f"{names} of {scene.name}, a phantom, is replaced by the patient's scan"
    return scene.with_obstacles([], [told] if stand_ins else [])


def _is_phantom(scene: "Scene", obstacle: "Obstacle") -> bool:
    """Whether it is an installed scanner's own patient."""
    return obstacle.role == "patient" and obstacle.source == scene.name


def _with_scan(args: argparse.Namespace, scene: "Scene", path: Path) -> "Scene":
    import numpy as np

    from borecheck.core.patient_frame import scanner_from_patient
    from borecheck.geometry.mesh_files.doubt import PlaceDoubt
    from borecheck.patients.obstacle import patient_obstacle
    from borecheck.robots.obstacle_files import Assumed, Obstacle, far_patient

    volume = scan_of(args, path)
    place = scan_place(args, volume)
    if args.isocentre is not None and args.position is None:
        args.position = volume.position  # plans of the same patient lie like the scan
    T = place.T_frame_lps
    if place.frame != "scanner":  # shown as most patients lie; nothing is clear
        turn = np.eye(4)
        turn[:3, :3] = scanner_from_patient("LPS", POSITIONS[0])
        T = turn @ T
    made = patient_obstacle(volume, T, wishes_at(args, place), Shown())
    name, missing = _name(path), made.not_modelled
    reason = "; ".join(place.doubts + volume.doubts)
    cut = f"{name} beyond the scan ({', '.join(c.where for c in made.cuts)})"
    told = (*notes_of(made, place), *far_patient(made.mesh))
    obstacle = Obstacle(
        name,
        "patient",
        made.mesh,
        str(path),
        PlaceDoubt(reason) if reason else None,
        Assumed(made.assumed, cut) if made.assumed.any() else None,
    )
    return scene.with_obstacles(
        [obstacle],
        [f"{path}: {line}" for line in told if line not in missing],
        [*([f"{cut}: unknown past {args.extend}"] if made.cuts else []), *missing],
    )


class Shown:
    """Bars of progress, one for each kind of work, which is told with it."""

    def __init__(self) -> None:
        from borecheck.commands.progress import Progress

        self._bars: dict[str, Progress] = {}

    def __call__(self, what: str, done: int, total: int) -> None:
        """Shows how much is done of a kind of work."""
        from borecheck.commands.progress import Progress

        if what not in self._bars:
            self._bars[what] = Progress(what)
        self._bars[what](done, total)


def notes_of(made: "PatientObstacle", place: ScanPlace) -> Sequence[str]:
    """All that is said of an obstacle and its place."""
    return [*place.notes, *made.notes, *place.doubts, *made.volume.doubts]


def _name(path: Path) -> str:
    return path.resolve().name.removesuffix(".gz").partition(".")[0] or "patient"


def _length(option: str, text: str) -> float:
    length = parse_length(text)
    if not 0.0 <= length <= _MOST:
        raise UsageError(f"{option} {text}: not from 0 to {_MOST:g} m")
    return length
