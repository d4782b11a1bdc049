"""Where the patient's coordinates lie in the scanner's frame, as a user states it.

Either the isocentre in the patient's LPS coordinates with how the patient lies, or a
registration: a rigid transform of ITK between the scanner's frame (fixed) and the
patient's LPS coordinates (moving). Images say neither reliably, so it is asked for.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core import se3
from borecheck.core.patient_frame import scanner_from_patient
from borecheck.errors import UsageError
from borecheck.exchange.itk_transform import read_transform

Array = NDArray[np.float64]

# Behind a file's name: it maps the patient's coordinates to the scanner's.
INVERSE = ":inverse"


@dataclass(frozen=True, eq=False)
class PatientPlace:
    """The place of the patient's LPS coordinates.

    Attributes:
        T_scanner_lps: (4, 4), translation in [m].
        stated: How it was stated, as typed.
    """

    T_scanner_lps: Array
    stated: str

    def to_scanner(self, points_lps: Array) -> Array:
        """Points (n, 3) in the scanner's frame, [m]."""
        return points_lps @ self.T_scanner_lps[:3, :3].T + self.T_scanner_lps[:3, 3]

    def to_lps(self, points: Array) -> Array:
        """Points (n, 3) of the scanner's frame in LPS, [m]."""
        return (points - self.T_scanner_lps[:3, 3]) @ self.T_scanner_lps[:3, :3]

    def to_json(self) -> dict[str, Any]:
        """Plain values for `json.dumps`."""
        return {
            "stated": self.stated,
            "T_scanner_lps": self.T_scanner_lps.tolist(),
        }


def at_isocentre(
    isocentre_lps: ArrayLike, position: str, stated: str | None = None
) -> PatientPlace:
    """The place by the isocentre.

    Args:
        isocentre_lps: The isocentre in the patient's LPS coordinates, (3,), [m].
        position: How the patient lies, as in DICOM: HFS, FFP ...
        stated: How it was typed.

    Raises:
        UsageError: These are no three finite numbers.
        UnknownNameError: No such position.
    """
    centre = np.asarray(isocentre_lps, dtype=np.float64)
    if centre.shape != (3,) or not np.isfinite(centre).all():
        raise UsageError("the isocentre is not three finite numbers")
    T = np.eye(4)
    T[:3, :3] = scanner_from_patient("LPS", position)
    T[:3, 3] -= T[:3, :3] @ centre
    words = ",".join(f"{x:g}" for x in centre)
    said = stated or f"isocentre {words} m in LPS"
    return PatientPlace(T, f"{said}, {position}")


def by_transform(file: str | Path) -> PatientPlace:
    """The place by a file of ITK or Slicer; `FILE:inverse` for the other sense.

    Raises:
        InputError: It is no rigid transform.
    """
    text = str(file)
    inverse = text.endswith(INVERSE) and not Path(text).exists()
    T_lps_scanner = read_transform(text.removesuffix(INVERSE) if inverse else text)
    T = T_lps_scanner if inverse else se3.inverse(T_lps_scanner)
    return PatientPlace(T, f"transform {text}")
