"""Which labels of a segmentation are the patient."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from borecheck.patients.volume import LABELS, Plane, Volume, VolumeError

ALL = "all"


def with_segments(volume: Volume, wanted: str | None) -> Volume:
    """The volume with only these labels; a CT has none.

    Args:
        volume: The scan.
        wanted: Names or numbers with commas, or "all"; None: all, which is a doubt.

    Raises:
        VolumeError: It has no such label, or none at all.
    """
    if volume.kind != LABELS:
        if wanted is not None:
            raise VolumeError(volume.file, "is a CT, not labels: leave out --segment")
        return volume
    if wanted is None:
        doubt = (
            f"{volume.file} holds labels, and nobody says that they hold the whole "
            "body: type --segment all, or names, if they do"
        )
        return replace(volume, doubts=(*volume.doubts, doubt), notes=_all(volume))
    if wanted == ALL:
        return replace(volume, notes=_all(volume))
    labels = [_label(volume, name.strip()) for name in wanted.split(",")]

    def planes() -> Iterator[Plane]:
        for plane in volume.planes():
            yield np.isin(plane, labels).astype(np.float32)

    said = f"of its labels {wanted} is taken as the body"
    return replace(volume, planes=planes, notes=(*volume.notes, said))


def _all(volume: Volume) -> tuple[str, ...]:
    names = ", ".join(volume.segments.values()) or "every number but 0"
    return (*volume.notes, f"all labels together are taken as the body: {names}")


def _label(volume: Volume, name: str) -> int:
    found = [number for number, text in volume.segments.items() if text == name]
    if len(found) == 1 and found[0] < 100_000:
        return found[0]
    if name.isdecimal() and len(name) < 6 and not found:
        return int(name)
    known = ", ".join(volume.segments.values()) or "numbers"
    raise VolumeError(volume.file, f"has no single segment {name!r} (known: {known})")
