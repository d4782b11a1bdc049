"""Every triangle of one mesh against every triangle of the other: no tree, no boxes.

The published algorithm asks all n m pairs. A triangle beta that lies strictly on one
side of the plane of alpha cannot touch it, and that first question is answered here
for 64 alphas at a time: one word of signs per shared vertex of beta, three words per
triangle (`sign_bits`). What is left, about 1 pair in 100, is confirmed in float64 by
the chosen narrowphase, so the result is that of asking all pairs one by one. (Pairs
whose bounding boxes are apart by more than the dead band are not put to it either.)
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.triangles.narrowphase import leaf
from borecheck.geometry.triangles.published import NARROWPHASES, triangle_row
from borecheck.geometry.triangles.sign_bits import (
    PLANES,
    lowest_bit,
    plane_signs_plain,
    plane_signs_vector,
)
from borecheck.geometry.triangles.sign_inputs import (
    along_a_curve,
    bounds_of,
    boxes_of,
    centre_and_band,
    planes_of,
    shared_points,
)

Rows = NDArray[np.float64]
Pairs = NDArray[np.int64]

BLOCK = 1024  # betas whose vertices, signs and indices stay in the first cache


def all_contacts(code: int, first: Rows, second: Rows, *, vector: bool = True) -> Pairs:
    """Every pair of triangles in contact, after asking all of them.

    Args:
        code: The narrowphase (`published.NARROWPHASES`).
        first: Placed triangles of the robot, (n, 9), [m].
        second: Placed triangles of the obstacle, (m, 9), [m], in the same frame.
        vector: Use vector instructions; the same result without, slower.

    Returns:
        Triangle pairs (k, 2), sorted.
    """
    first = np.ascontiguousarray(first, dtype=np.float64)
    second = np.ascontiguousarray(second, dtype=np.float64)
    if len(first) == 0 or len(second) == 0:
        return np.zeros((0, 2), np.int64)
    # Planes come from alpha: the second mesh in paper:scanner, the first otherwise.
    swapped = code == NARROWPHASES["paper:scanner"]
    alpha, beta = (second, first) if swapped else (first, second)
    (low_a, high_a), (low_b, high_b) = bounds_of(alpha), bounds_of(beta)
    low, high = np.minimum(low_a, low_b), np.maximum(high_a, high_b)
    centre, band = centre_and_band(low, high)
    # Neighbours in the list share corners and signs; the file's order may not do so.
    order_alpha = along_a_curve(alpha, low_a, high_a)
    order_beta = along_a_curve(beta, low_b, high_b)
    alpha, beta = alpha[order_alpha], beta[order_beta]
    planes = planes_of(alpha, centre)
    points, corner_of, starts = shared_points(beta, centre, BLOCK)
    boxes_alpha, boxes_beta = boxes_of(alpha, band), boxes_of(beta, band)
    search = _search_vector if vector and vector_signs_work() else _search_plain
    pairs = search(
        code, swapped, alpha, beta, boxes_alpha, boxes_beta,
        planes, points, corner_of, starts, np.float32(band),
    )  # fmt: skip
    pairs = np.column_stack([order_alpha[pairs[:, 0]], order_beta[pairs[:, 1]]])
    if swapped:
        pairs = pairs[:, ::-1]
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    return np.ascontiguousarray(pairs[order])


@kernel
def _search_vector(  # type: ignore[no-untyped-def]
    code, swapped, alpha, beta, boxes_alpha, boxes_beta,
    planes, points, corner_of, starts, band,
):  # fmt: skip
    """All contacts as (alpha, beta); signs by vector instructions."""
    pairs, found = np.zeros((1024, 2), np.int64), 0
    above, below = np.zeros((2, 3 * BLOCK), np.uint64)
    where, left = np.zeros(BLOCK, np.int64), np.zeros(BLOCK, np.uint64)
    for block in range(len(starts) - 1):
        begin, end = starts[block], starts[block + 1]
        x, y, z = points[0, begin:end], points[1, begin:end], points[2, begin:end]
        corners = corner_of[block * BLOCK : (block + 1) * BLOCK]
        for word in range(len(planes)):
            plane_signs_vector(planes[word], x, y, z, end - begin, band, above, below)
            count = _words_left(corners, above, below, where, left)
            pairs, found = _confirm(
                code, swapped, alpha, beta, boxes_alpha, boxes_beta,
                PLANES * word, BLOCK * block, where[:count], left, pairs, found,
            )  # fmt: skip
    return pairs[:found].copy()


@kernel
def _search_plain(  # type: ignore[no-untyped-def]
    code, swapped, alpha, beta, boxes_alpha, boxes_beta,
    planes, points, corner_of, starts, band,
):  # fmt: skip
    """As `_search_vector`, signs by an ordinary loop."""
    pairs, found = np.zeros((1024, 2), np.int64), 0
    above, below = np.zeros((2, 3 * BLOCK), np.uint64)
    where, left = np.zeros(BLOCK, np.int64), np.zeros(BLOCK, np.uint64)
    for block in range(len(starts) - 1):
        begin, end = starts[block], starts[block + 1]
        x, y, z = points[0, begin:end], points[1, begin:end], points[2, begin:end]
        corners = corner_of[block * BLOCK : (block + 1) * BLOCK]
        for word in range(len(planes)):
            plane_signs_plain(planes[word], x, y, z, end - begin, band, above, below)
            count = _words_left(corners, above, below, where, left)
            pairs, found = _confirm(
                code, swapped, alpha, beta, boxes_alpha, boxes_beta,
                PLANES * word, BLOCK * block, where[:count], left, pairs, found,
            )  # fmt: skip
    return pairs[:found].copy()


@kernel
def _words_left(corners, above, below, where, left):  # type: ignore[no-untyped-def]
    """Triangles of a block not surely on one side of all 64 planes; how many.

    `where` gets their places in the block and `left` the planes they may cross.
    """
    count = 0
    for t in range(len(corners)):
        p, q, r = corners[t, 0], corners[t, 1], corners[t, 2]
        up = above[p] & above[q] & above[r]
        down = below[p] & below[q] & below[r]
        where[count] = t
        left[count] = ~(up | down)
        count += left[count] != np.uint64(0)
    return count


@kernel
def _confirm(  # type: ignore[no-untyped-def]
    code, swapped, alpha, beta, boxes_alpha, boxes_beta,
    first_alpha, first_beta, where, left, pairs, found,
):  # fmt: skip
    """Asks the narrowphase about what the signs leave of one block and 64 alphas."""
    for n in range(len(where)):
        t = first_beta + where[n]
        word = left[n]
        while word != np.uint64(0):
            k = first_alpha + lowest_bit(word)
            word &= word - np.uint64(1)
            if not _boxes_meet(boxes_alpha, k, boxes_beta, t):
                continue
            if _in_contact(code, swapped, alpha, k, beta, t):
                if found == len(pairs):
                    pairs = np.concatenate((pairs, np.zeros_like(pairs)))
                pairs[found, 0], pairs[found, 1] = k, t
                found += 1
    return pairs, found


@kernel(inline="always")
def _boxes_meet(first, i, second, j):  # type: ignore[no-untyped-def]
    return not (
        (first[i, 0] > second[j, 3])
        | (first[i, 1] > second[j, 4])
        | (first[i, 2] > second[j, 5])
        | (second[j, 0] > first[i, 3])
        | (second[j, 1] > first[i, 4])
        | (second[j, 2] > first[i, 5])
    )


@kernel
def _in_contact(code, swapped, alpha, i, beta, j):  # type: ignore[no-untyped-def]
    """The narrowphase, with the robot's triangle first."""
    a, b = triangle_row(alpha, i), triangle_row(beta, j)
    return leaf(code, b, a) if swapped else leaf(code, a, b)


@cache
def vector_signs_work() -> bool:
    """Whether the vector form can be built here (asked once, on one point)."""
    planes = np.zeros((4, PLANES), np.float32)
    planes[3] = 1.0
    one = np.zeros(1, np.float32)
    above, below = np.zeros((2, 1), np.uint64)
    try:
        _try_vector(planes, one, np.float32(0.5), above, below)
    except Exception:  # noqa: BLE001 - whatever LLVM raises, the plain form stays
        return False
    return bool(above[0] == ~np.uint64(0) and below[0] == 0)


@kernel
def _try_vector(planes, point, band, above, below):  # type: ignore[no-untyped-def]
    plane_signs_vector(planes, point, point, point, 1, band, above, below)
