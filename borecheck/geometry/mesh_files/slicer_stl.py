"""Binary STL that says its space, as 3D Slicer reads and writes it."""

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh_files.stl import binary_stl

HEADER = b"borecheck SPACE=LPS UNIT=mm"


def stl_for_slicer(corners_lps: NDArray[np.float64]) -> bytes:
    """Triangles as binary STL in mm, with `SPACE=LPS` in its header.

    Args:
        corners_lps: (n, 3, 3), in the patient's LPS coordinates, [m].

    Raises:
        GeometryError: A coordinate does not fit the format.
    """
    return binary_stl(1e3 * corners_lps, HEADER)
