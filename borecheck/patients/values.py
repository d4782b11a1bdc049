"""What the numbers of a file are that does not say: Hounsfield units, or labels."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from borecheck.patients.volume import HOUNSFIELD, LABELS, Plane, VolumeError

# Between air and skin; see `skin`.
SKIN_HU = -500.0

# More labels than any atlas of the body has.
_MOST_LABELS = 1000


def kind_of(path: Path, planes: Callable[[], Iterator[Plane]]) -> str:
    """HOUNSFIELD or LABELS, from all numbers of the file.

    Raises:
        VolumeError: They are neither: no air, and no small whole numbers.
    """
    low, high, whole = np.inf, -np.inf, True
    for plane in planes():
        finite = plane[np.isfinite(plane)]
        if finite.size == 0:
            continue
        low, high = min(low, float(finite.min())), max(high, float(finite.max()))
        whole = whole and bool((finite == np.rint(finite)).all())
    if low > high:
        raise VolumeError(path, "holds no number that is finite")
    if low <= SKIN_HU:
        return HOUNSFIELD
    if whole and low >= 0.0 and 0.0 < high <= _MOST_LABELS:
        return LABELS
    raise VolumeError(
        path,
        f"its numbers, {low:.4g} to {high:.4g}, are neither Hounsfield units (no air) "
        "nor labels",
    )
