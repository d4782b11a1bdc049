"""The narrowphases by number, for kernels, and the plain all-pairs loops over them.

`NARROWPHASES` in `published` maps names to these numbers. Triangle a is always
the robot's and b the scanner's: who is alpha in the published test follows from the
name.
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import UnknownNameError
from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.triangles.exact import exact_pair
from borecheck.geometry.triangles.placing import Triangle
from borecheck.geometry.triangles.published import (
    NARROWPHASES,
    paper_pair,
    triangle_row,
)
from borecheck.geometry.triangles.two_sided import two_sided_pair

Rows = NDArray[np.float64]


def narrowphase_code(name: str) -> int:
    """The number of a narrowphase.

    Raises:
        UnknownNameError: No narrowphase of that name.
    """
    if name not in NARROWPHASES:
        raise UnknownNameError("narrowphase", name, NARROWPHASES)
    return NARROWPHASES[name]


@kernel
def leaf(code: int, a: Triangle, b: Triangle) -> bool:
    """Contact of the robot's triangle a and the scanner's b; other codes mean exact."""
    if code == 0:
        return paper_pair(a, b)
    if code == 1:
        return paper_pair(b, a)
    if code == 2:
        return two_sided_pair(a, b)
    return exact_pair(a, b)


@kernel
def contact_pairs(
    code: int, corners_a: Rows, corners_b: Rows, pairs: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Contact of the named triangle pairs.

    Args:
        code: Narrowphase, see `narrowphase_code`.
        corners_a: Robot's triangles, (n, 9), placed [m].
        corners_b: Scanner's triangles, (m, 9), placed [m].
        pairs: Indices into both, (k, 2).

    Returns:
        Contact, (k,) bool.
    """
    contact = np.zeros(len(pairs), dtype=np.bool_)
    for k in range(len(pairs)):
        a = triangle_row(corners_a, pairs[k, 0])
        b = triangle_row(corners_b, pairs[k, 1])
        contact[k] = leaf(code, a, b)
    return contact


@kernel
def all_contacts(code: int, corners_a: Rows, corners_b: Rows) -> NDArray[np.int64]:
    """Every triangle pair in contact, by asking all pairs: (k, 2), sorted."""
    found = np.zeros((64, 2), dtype=np.int64)
    count = 0
    for i in range(len(corners_a)):
        a = triangle_row(corners_a, i)
        for j in range(len(corners_b)):
            if leaf(code, a, triangle_row(corners_b, j)):
                if count == len(found):
                    longer = np.zeros((2 * count, 2), dtype=np.int64)
                    longer[:count] = found
                    found = longer
                found[count, 0], found[count, 1] = i, j
                count += 1
    return found[:count].copy()


@kernel
def first_contact(code: int, corners_a: Rows, corners_b: Rows) -> tuple[int, int]:
    """The first triangle pair in contact among all pairs, or (-1, -1)."""
    for i in range(len(corners_a)):
        a = triangle_row(corners_a, i)
        for j in range(len(corners_b)):
            if leaf(code, a, triangle_row(corners_b, j)):
                return i, j
    return -1, -1
