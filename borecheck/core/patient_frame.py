"""Patient coordinates (RAS, LPS) in the scanner's frame.

The scanner's frame: origin at the isocentre, x along the bore from the couch side into
the gantry, z up. Patient coordinates name directions of the body (RAS: right, anterior,
superior; LPS, as in DICOM: left, posterior, superior), so that one needs to know how
the patient lies: DICOM's patient position, `HFS` (head first, supine) unless stated.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import UnknownNameError

Array = NDArray[np.float64]

FRAMES = ("scanner", "RAS", "LPS")

# Right is minus left, anterior minus posterior; it is its own inverse.
LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0])

_X, _Y, _Z = np.eye(3)

# Where anterior and superior point in the scanner's frame. DICOM PS3.3 C.7.3.1.1.2:
# head or feet first; supine, prone, lying on the right (DR) or the left (DL) side.
# Head first: superior is +x. Right is anterior x superior, so on the right side: -z.
_ANTERIOR_SUPERIOR: Mapping[str, tuple[Array, Array]] = MappingProxyType(
    {
        "HFS": (_Z, _X),
        "HFP": (-_Z, _X),
        "HFDR": (_Y, _X),
        "HFDL": (-_Y, _X),
        "FFS": (_Z, -_X),
        "FFP": (-_Z, -_X),
        "FFDR": (-_Y, -_X),
        "FFDL": (_Y, -_X),
    }
)

POSITIONS = tuple(_ANTERIOR_SUPERIOR)


def scanner_from_patient(frame: str, position: str = "HFS") -> Array:
    """Rotation R with p_scanner = R p_patient, (3, 3); the origins coincide.

    Args:
        frame: RAS or LPS (or scanner, which gives the identity).
        position: How the patient lies, a code of DICOM: HFS, FFP ...

    Raises:
        UnknownNameError: No such frame or position.
    """
    if frame not in FRAMES:
        raise UnknownNameError("frame", frame, FRAMES)
    if position not in POSITIONS:
        raise UnknownNameError("patient position", position, POSITIONS)
    if frame == "scanner":
        return np.eye(3)
    anterior, superior = _ANTERIOR_SUPERIOR[position]
    right = np.cross(anterior, superior)
    R = np.column_stack([right, anterior, superior])
    return R if frame == "RAS" else R @ LPS_FROM_RAS
