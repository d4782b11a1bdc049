"""Series of a folder: which images belong together, which series is read.

UIDs may be empty, so that images are told apart by what places them as well: frame of
reference, orientation, size, spacing, kernel.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from borecheck.patients.dicom_headers import Folder, SliceHeader
from borecheck.patients.volume import VolumeError

# A body in the scan is more than these; fewer are scouts, or single pictures.
_FEWEST = 3

# Of files that are left out for one reason, so many are named.
_NAMED = 3


@dataclass(frozen=True)
class Series:
    """Images that are one stack.

    Attributes:
        number: From 1, the longest series first.
        slices: Its images, in the order of their places.
    """

    number: int
    slices: tuple[SliceHeader, ...]

    @property
    def uid(self) -> str:
        """SeriesInstanceUID, or empty."""
        return self.slices[0].series

    @property
    def name(self) -> str:
        """What `--series` takes: the UID, else the number."""
        return self.uid or str(self.number)

    def to_json(self) -> dict[str, Any]:
        """For `--list`."""
        first = self.slices[0]
        along = [_along(one) for one in self.slices]
        return {
            "number": self.number,
            "uid": self.uid,
            "slices": len(self.slices),
            "rows": first.size[0],
            "columns": first.size[1],
            "spacing_down_across_mm": list(first.spacing),
            "extent_mm": max(along) - min(along),
            "orientation": list(first.orientation),
            "position": first.position or None,
            "kernel": first.kernel or None,
        }


def series_of(folder: Folder) -> tuple[Series, ...]:
    """Stacks in a folder, the longest first; names of files never matter.

    Slices across the body come before reformatted ones, of which there may be more.
    """
    groups: dict[tuple[Any, ...], list[SliceHeader]] = {}
    for one in folder.slices:
        groups.setdefault(_key(one), []).append(one)
    ordered = sorted(
        groups.items(),
        key=lambda item: (not _is_across(item[1][0]), -len(item[1]), item[0]),
    )
    return tuple(
        Series(k + 1, tuple(sorted(images, key=lambda one: (_along(one), one.origin))))
        for k, (_, images) in enumerate(ordered)
    )


def chosen(
    path: Path, folder: Folder, wanted: str | None
) -> tuple[Series, tuple[str, ...]]:
    """The series to read, and what is said about the others.

    Args:
        path: The folder, as the user named it.
        folder: What lies in it.
        wanted: `--series`: a UID or a number; None: the longest.

    Raises:
        VolumeError: There is none, or none of that name, or it has images that cannot
            be placed.
    """
    found = series_of(folder)
    if not found:
        raise VolumeError(path, _why_none(folder))
    if wanted is None:
        series, said = found[0], _others_told(found)
    else:
        series, said = _wanted(path, found, wanted), ()
    for uid, name, problem in folder.faults:
        if uid == series.uid:
            raise VolumeError(path / name if path.is_dir() else path, problem)
    if wanted is None and len(series.slices) < _FEWEST <= len(folder.faults):
        raise VolumeError(path, _why_none(folder))
    return series, said


def dropped_told(folder: Folder, series: Series) -> tuple[str, ...]:
    """Lines about files that were left out; file names only where they are told apart.

    Equal reasons are one line, so that a thousand scouts are not a thousand lines.
    """
    reasons: dict[str, list[str]] = {}
    for name, reason in folder.dropped:
        reasons.setdefault(reason, []).append(name)
    for uid, name, reason in folder.faults:
        if uid != series.uid:
            reasons.setdefault(reason, []).append(name)
    return tuple(
        f"{_listed(names)}: {reason}" for reason, names in sorted(reasons.items())
    )


def _others_told(found: Sequence[Series]) -> tuple[str, ...]:
    """One line if there was a choice."""
    if len(found) == 1:
        return ()
    first, others = found[0], found[1:]
    counts = ", ".join(_counted(one) for one in others[:_NAMED])
    more = f" and {len(others) - _NAMED} more" if len(others) > _NAMED else ""
    return (
        f"of {len(found)} series the longest across the body is taken, "
        f"{_counted(first)}; left out: {counts}{more} (--list shows them, --series "
        "chooses)",
    )


def _counted(one: Series) -> str:
    images = "images" if len(one.slices) != 1 else "image"
    scout = " (a localizer, or a single picture)" if len(one.slices) < _FEWEST else ""
    return f"series {one.number} of {len(one.slices)} {images}{scout}"


def _wanted(path: Path, found: Sequence[Series], wanted: str) -> Series:
    of_name = [one for one in found if one.uid == wanted]
    by_number = [one for one in found if str(one.number) == wanted]
    matching = of_name or by_number
    if len(matching) == 1:
        return matching[0]
    if matching:
        numbers = ", ".join(str(one.number) for one in matching)
        raise VolumeError(
            path, f"series {wanted} is {len(matching)} stacks: choose one of {numbers}"
        )
    raise VolumeError(
        path, f"no series {wanted} (known: 1 to {len(found)}; see --list)"
    )


def _why_none(folder: Folder) -> str:
    if folder.faults:
        _, name, problem = folder.faults[0]
        images = f"{len(folder.faults)} images" if len(folder.faults) > 1 else "image"
        return f"{problem} in {name} (of {images} without a place)"
    lines = sorted({reason for _, reason in folder.dropped})
    named = _listed([name for name, _ in folder.dropped])
    return f"no CT series: {named}: {'; '.join(lines[:_NAMED])}"


def _key(one: SliceHeader) -> tuple[Any, ...]:
    return (
        one.series,
        one.frame,
        tuple(round(x, 3) + 0.0 for x in one.orientation),
        one.size,
        tuple(round(x, 4) for x in one.spacing),
        one.kernel,
    )


def _along(one: SliceHeader) -> float:
    """Place of a slice along its normal, [mm]."""
    return float(np.array(one.origin) @ one.normal)


def _is_across(one: SliceHeader) -> bool:
    """Whether the slice cuts the body across, tilted or not."""
    return bool(abs(one.normal[2]) > np.sqrt(0.5))


def _listed(names: Iterable[str]) -> str:
    every = sorted(names)
    more = f" and {len(every) - _NAMED} more" if len(every) > _NAMED else ""
    return ", ".join(every[:_NAMED]) + more
