"""Binary STL that says its space, as 3D Slicer reads and writes it."""

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import GeometryError

HEADER = b"borecheck SPACE=LPS UNIT=mm"

_RECORD = np.dtype(
    [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")]
)


def stl_for_slicer(corners_lps: NDArray[np.float64]) -> bytes:
    """Triangles as binary STL in mm, with `SPACE=LPS` in its header.

    Args:
        corners_lps: (n, 3, 3), in the patient's LPS coordinates, [m].

    Raises:
        GeometryError: A coordinate does not fit the format.
    """
    records = np.zeros(len(corners_lps), dtype=_RECORD)
    with np.errstate(over="ignore"):
        records["corners"] = 1e3 * corners_lps
    if not np.isfinite(records["corners"]).all():
        raise GeometryError("a coordinate is too large for STL (float32)")
    # no normals: zeros mean that the corners' order says it
    count = np.array([len(records)], dtype="<u4")
    return HEADER.ljust(80) + count.tobytes() + records.tobytes()
