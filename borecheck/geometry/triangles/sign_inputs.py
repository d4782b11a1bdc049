"""Planes, points and boxes of two meshes, made ready for words of signs.

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

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.triangles.sign_bits import PLANES

Rows = NDArray[np.float64]
Pairs = NDArray[np.int64]

SLIVER = 1e5  # |e1| |e2| / |e1 x e2|, one over the sine of the angle at a corner
_BAND_NEAR = 16.0 * 2.0**-24
_BAND_FAR = 2.0**-45


def along_a_curve(rows: Rows, low: Rows, high: Rows) -> Pairs:
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


def centre_and_band(low: Rows, high: Rows) -> tuple[Rows, float]:
    """Centre of all points, and the dead band derived in the module's docstring."""
    centre = 0.5 * low + 0.5 * high
    radius = float(np.linalg.norm(high - centre))
    away = float(np.linalg.norm(np.maximum(np.abs(low), np.abs(high))))
    return centre, _BAND_NEAR * radius + _BAND_FAR * away


@kernel
def bounds_of(rows):  # type: ignore[no-untyped-def]
    """Least and largest coordinates of all corners, two arrays (3,)."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(len(rows)):
        for k in range(9):
            low[k % 3] = min(low[k % 3], rows[i, k])
            high[k % 3] = max(high[k % 3], rows[i, k])
    return low, high


@kernel
def planes_of(alpha, centre):  # type: ignore[no-untyped-def]
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
def boxes_of(rows, band):  # type: ignore[no-untyped-def]
    """Least and largest coordinates of every triangle, (n, 6), grown by the band."""
    boxes = np.zeros((len(rows), 6))
    for i in range(len(rows)):
        for k in range(3):
            p, q, r = rows[i, k], rows[i, k + 3], rows[i, k + 6]
            boxes[i, k] = min(p, q, r) - band
            boxes[i, k + 3] = max(p, q, r) + band
    return boxes


@kernel
def shared_points(beta, centre, block):  # type: ignore[no-untyped-def]
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
