"""The frame or the up axis that a mesh file states, and what turns it into ours.

3D Slicer writes `SPACE=LPS` or `SPACE=RAS` into the headers of STL, PLY and OBJ files,
Collada has an up axis. Who does not hear it places a patient on the wrong side.
"""

import re
from collections.abc import Iterable
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from borecheck.core.patient_frame import POSITIONS, scanner_from_patient
from borecheck.errors import MeshError, UsageError

AS_IT_STANDS = "z-up"
PATIENT_FRAMES = ("lps", "ras")
UP_AXES = ("x-up", "y-up", AS_IT_STANDS)
FRAMES = (*PATIENT_FRAMES, *UP_AXES)

# Columns: where x, y and z of the file point in a frame with z up and x to the right
# (COLLADA 1.4.1, up_axis: X_UP has -y to the right, Y_UP has z towards the viewer).
_UPRIGHT = {
    "x-up": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
    "y-up": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    AS_IT_STANDS: np.eye(3),
}

_ANATOMICAL = (
    rb"(?:[lr][ap][si]|(?:left|right)-(?:anterior|posterior)-(?:superior|inferior))"
)
# Slicer's own form takes any word; other spellings count with a known value only.
_STATED = re.compile(
    rb"(?<!color )(?<!colour )\bspace\s*=\s*[\"']?([a-z][\w-]*)"
    rb"|\b(?:space|frame|coordinate[ _]?system)\s*[=:]\s*[\"']?("
    + _ANATOMICAL
    + rb")\b",
    re.IGNORECASE,
)


def stated_in(texts: Iterable[bytes], file: str | PathLike[str]) -> str | None:
    """The frame that comments or a header state: "lps", "ras", another, or None.

    Raises:
        MeshError: Two different frames are stated.
    """
    found = {
        _short(match[1] or match[2])
        for text in texts
        for match in _STATED.finditer(text)
    }
    if len(found) > 1:
        both = " and ".join(sorted(word.upper() for word in found))
        raise MeshError(file, f"states two frames, {both}")
    return found.pop() if found else None


def _short(word: bytes) -> str:
    """`lps` of `LPS` and of `left-posterior-superior`."""
    text = word.decode("ascii", "replace").lower()
    parts = text.split("-")
    return "".join(part[0] for part in parts) if len(parts) == 3 else text


def rotation(frame: str) -> NDArray[np.float64]:
    """Rotation R with p_scanner = R p_file, (3, 3).

    Args:
        frame: A word of `FRAMES`; `lps` and `ras` take the patient position behind a
            hyphen (`lps-ffp`), head first and supine without.

    Raises:
        UsageError: No such frame or position.
    """
    if frame in _UPRIGHT:
        return _UPRIGHT[frame].copy()
    axes, hyphen, position = frame.partition("-")
    code = position.upper() if hyphen else "HFS"
    if axes not in PATIENT_FRAMES or code not in POSITIONS:
        raise UsageError(
            f"frame {frame!r} is none of {', '.join(FRAMES)} "
            "(lps and ras with a patient position: lps-ffp)"
        )
    return scanner_from_patient(axes.upper(), code)


def is_frame(word: str) -> bool:
    """Whether `rotation` knows the word."""
    try:
        rotation(word)
    except UsageError:
        return False
    return True


def without_position(frame: str) -> str:
    """`lps` of `lps-ffp`; up axes as they are."""
    return frame if frame in UP_AXES else frame.partition("-")[0]


def spelt(frame: str) -> str:
    """A frame as files spell it: LPS, Y_UP."""
    return frame.upper().replace("-", "_")
