"""Every triangle of one mesh against every triangle of the other: no tree, no boxes.

The published algorithm asks all n m pairs. A triangle beta that lies strictly on one
side of the plane of alpha cannot touch it, and that first question is answered here
for 64 alphas at a time: one word of signs per shared vertex of beta, three words per
triangle (`sign_bits`). What is left, about 1 pair in 100, is confirmed in float64 by
the chosen narrowphase, so the result is that of asking all pairs one by one. (Pairs
whose bounding boxes are apart by more than the band are not put to it either.)

The dead band. Signs are formed in float32, on coordinates about a common centre. With
u = 2**-24, unit normals and R the largest distance from the centre, n . p + d is off
by at most u |p| (rounded normal) + u |p| (rounded point) + u R (rounded offset) +
4 u (|p| + R) (products and sums, fused or not): below 11 u R. A plane whose two
edges are nearly parallel has no normal worth the name: beyond SLIVER, alpha has no
plane and stays a candidate with every beta. Up to SLIVER the float64 normal is off by
SLIVER 2**-50, times 2 R: below 0.02 u R. The narrowphases evaluate their plane values
with rounding errors of the same kind plus 2**-47 X, X the largest coordinate away
from the origin. The band is 16 u R + 2**-45 X: outside it no narrowphase sees
anything but three equal signs, and each then says "no contact".
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

Rows = NDArray[np.float64]
Pairs = NDArray[np.int64]

BLOCK = 1024  # betas whose vertices, signs and indices stay in the first cache
SLIVER = 1e5  # |e1| |e2| / |e1 x e2|, one over the sine of the angle at a corner
_BAND_NEAR = 16.0 * 2.0**-24
_BAND_FAR = 2.0**-45


def all_contacts(code: int, first: Rows, second: Rows, *, vector: bool = True) -> Pairs:
    """Every pair of triangles in contact, after asking all of them.

    Args:
        code: The narrowphase (`triangle_contact.NARROWPHASES`).
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
    (low_a, high_a), (low_b, high_b) = _bounds(alpha), _bounds(beta)
    low, high = np.minimum(low_a, low_b), np.maximum(high_a, high_b)
    centre, band = _centre_and_band(low, high)
    # Neighbours in the list share corners and signs; the file's order may not do so.
    order_alpha = _along_a_curve(alpha, low_a, high_a)
    order_beta = _along_a_curve(beta, low_b, high_b)
    alpha, beta = alpha[order_alpha], beta[order_beta]
    planes = _planes(alpha, centre)
    points, corner_of, starts = _shared_points(beta, centre, BLOCK)
    boxes_alpha, boxes_beta = _boxes(alpha, band), _boxes(beta, band)
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


def _along_a_curve(rows: Rows, low: Rows, high: Rows) -> Pairs:
    """An order of the triangles in which neighbours are near (Morton's curve)."""
    extent = max(float((high - low).max()), 1e-300)
    return np.argsort(_curve_keys(rows, low, 1024.0 / extent), kind="stable")


@kernel
def _curve_keys(rows, low, scale):  # type: ignore[no-untyped-def]
    """Ten bits of each coordinate of the triangle's middle, interleaved."""
    keys = np.zeros(len(rows), np.int64)
    for i in range(len(rows)):
        for axis in range(3):
            middle = (rows[i, axis] + rows[i, axis + 3] + rows[i, axis + 6]) / 3.0
            cell = min(1023, max(0, int((middle - low[axis]) * scale)))
            for bit in range(10):
                keys[i] |= ((cell >> bit) & 1) << (3 * bit + axis)
    return keys


def _centre_and_band(low: Rows, high: Rows) -> tuple[Rows, float]:
    """Centre of all points, and the dead band derived in the module's docstring."""
    centre = 0.5 * low + 0.5 * high
    radius = float(np.linalg.norm(high - centre))
    away = float(np.linalg.norm(np.maximum(np.abs(low), np.abs(high))))
    return centre, _BAND_NEAR * radius + _BAND_FAR * away


@kernel
def _bounds(rows):  # type: ignore[no-untyped-def]
    """Least and largest coordinates of all corners, two arrays (3,)."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(len(rows)):
        for k in range(9):
            low[k % 3] = min(low[k % 3], rows[i, k])
            high[k % 3] = max(high[k % 3], rows[i, k])
    return low, high


@kernel
def _planes(alpha, centre):  # type: ignore[no-untyped-def]
    """Unit normals and offsets in words of 64, (words, 4, 64).

    The plane 0 x + 0 = 0 lies within every dead band: so slivers and zero-area
    triangles stay candidates. Places beyond the last triangle are surely above.
    """
    words = (len(alpha) + PLANES - 1) // PLANES
    planes = np.zeros((words, 4, PLANES), np.float32)
    planes[:, 3] = np.finfo(np.float32).max
    for i in range(len(alpha)):
        a = alpha[i]
        ux, uy, uz = a[3] - a[0], a[4] - a[1], a[5] - a[2]
        vx, vy, vz = a[6] - a[0], a[7] - a[1], a[8] - a[2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = np.sqrt(x * x + y * y + z * z)
        edges = (ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz)
        plane = planes[i // PLANES, :, i % PLANES]
        plane[:] = 0.0
        # Squares of areas below 1e-140 leave the range of float64.
        if length > 1e-140 and length * SLIVER > np.sqrt(edges):
            x, y, z = x / length, y / length, z / length
            plane[0], plane[1], plane[2] = x, y, z
            px, py, pz = a[0] - centre[0], a[1] - centre[1], a[2] - centre[2]
            plane[3] = -(x * px + y * py + z * pz)
    return planes


@kernel
def _boxes(rows, band):  # type: ignore[no-untyped-def]
    """Least and largest coordinates of every triangle, (n, 6), grown by the band."""
    boxes = np.zeros((len(rows), 6))
    for i in range(len(rows)):
        for k in range(3):
            p, q, r = rows[i, k], rows[i, k + 3], rows[i, k + 6]
            boxes[i, k] = min(p, q, r) - band
            boxes[i, k + 3] = max(p, q, r) + band
    return boxes


@kernel
def _shared_points(beta, centre, block):  # type: ignore[no-untyped-def]
    """Different corner points of every block of triangles.

    Corners count as one point if their numbers are equal, whatever the file's
    indices say: a triangle soup is as fast as an indexed mesh.

    Returns:
        Coordinates about the centre (3, p), float32, block after block; the point of
        every corner within its block (m, 3); where the blocks' points start.
    """
    count = len(beta)
    blocks = (count + block - 1) // block
    points = np.zeros((3, 3 * count), np.float32)
    corner_of = np.zeros((count, 3), np.uint32)  # unsigned: no wrap-around
    starts = np.zeros(blocks + 1, np.int64)
    slots = 8 * block  # a power of two with room: at most 3 block points go in
    table = np.zeros(slots, np.int64)
    home = np.zeros(3 * block, np.int64)
    used = 0
    for b in range(blocks):
        table[:] = -1
        starts[b] = used
        for t in range(b * block, min(count, (b + 1) * block)):
            for c in range(3):
                slot = _hash(beta, t, c) & (slots - 1)
                while table[slot] >= 0 and not _equal(beta, home[table[slot]], t, c):
                    slot = (slot + 1) & (slots - 1)
                if table[slot] < 0:
                    table[slot] = used - starts[b]
                    home[table[slot]] = 3 * t + c
                    for k in range(3):
                        points[k, used] = np.float32(beta[t, 3 * c + k] - centre[k])
                    used += 1
                corner_of[t, c] = table[slot]
    starts[blocks] = used
    return points[:, :used].copy(), corner_of, starts


@kernel(inline="always")
def _equal(rows, corner, t, c):  # type: ignore[no-untyped-def]
    s, d = corner // 3, 3 * (corner % 3)
    return (
        rows[s, d] == rows[t, 3 * c]
        and rows[s, d + 1] == rows[t, 3 * c + 1]
        and rows[s, d + 2] == rows[t, 3 * c + 2]
    )


@kernel(inline="always")
def _hash(rows, t, c):  # type: ignore[no-untyped-def]
    """A word that equal points share (+0.0 brings -0.0 to 0.0)."""
    word = np.uint64(0)
    for k in range(3):
        bits = np.float64(rows[t, 3 * c + k] + 0.0).view(np.uint64)
        word = (word ^ bits) * np.uint64(0x9E3779B97F4A7C15)
        word ^= word >> np.uint64(29)
    return np.int64(word & np.uint64(0x7FFFFFFFFFFFFFFF))


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
