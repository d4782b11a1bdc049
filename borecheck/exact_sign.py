"""The exact sign of a determinant of float64 numbers.

A float64 is an integer times a power of two. So the coordinates of one determinant,
brought to the lowest power of two among them, are integers, and its sign follows from
integer arithmetic alone: nothing rounds, overflows or underflows, from the smallest
subnormal to the largest finite number. Integers are rows of int64 limbs of 26 bits,
few for numbers of like size (two to five for a scanner in metres), 82 at the worst.

`orientation_3d` and `orientation_2d` ask floating point first and come here only when
its error bound leaves the sign open (as [Shewchuk1997] does; the bounds differ).
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from borecheck.placing import Triangle

Point = tuple[float, float, float]
Flat = tuple[float, float]

# Bits per limb. A difference of two integers has limbs below 2^27; a minor adds at
# most 2 * 82 products of those, a determinant 3 * 82 products with normalised limbs
# (below 2^26): 2^61.4, no int64 overflow.
_BITS = 26
_MASK = (1 << _BITS) - 1

# Half a unit in the last place, the relative error of one float64 operation.
EPSILON = 2.0**-53

# Error of a computed 3x3 determinant of differences, relative to the product of the
# largest difference along x, y and z. The determinant is a sum of six products of
# three differences. Each runs through at most 8 roundings: its three differences
# (they are not exact), two multiplications, the subtraction in its minor, two
# additions. So the error is below 6 * ((1 + e)^8 - 1) = 48 e + O(e^2) of that product;
# 50 e also covers the roundings of the bound itself.
ERROR_3D = 50.0 * EPSILON

# The same in the plane: two products of two differences, 4 roundings each: 8 e.
ERROR_2D = 9.0 * EPSILON

# Outside these limits floating point is not asked. Within, no product overflows, and
# what underflow loses, at most 2^-1075 per multiplication times a factor up to LARGEST,
# stays below UNDERFLOW.
LARGEST = 1e100
UNDERFLOW = 1e-220


@njit(cache=True, nogil=True, error_model="numpy")
def error_bound_3d(x: float, y: float, z: float) -> float:
    """Bound for |computed - true| of a 3x3 determinant of differences.

    Args:
        x: Largest difference of x coordinates in it (any upper bound), likewise y, z.
        y: See x.
        z: See x.

    Returns:
        The bound; infinite when the differences are too large for floating point.
    """
    if not max(x, y, z) < LARGEST:
        return np.inf
    return ERROR_3D * (x * y * z) + UNDERFLOW


@njit(cache=True, nogil=True, error_model="numpy")
def orientation_3d(a: Point, b: Point, c: Point, d: Point) -> int:
    """Exact sign of det(a - d, b - d, c - d), for any finite coordinates.

    Positive when a, b, c turn counterclockwise seen from d (d lies below their plane).
    """
    ax, ay, az = a[0] - d[0], a[1] - d[1], a[2] - d[2]
    bx, by, bz = b[0] - d[0], b[1] - d[1], b[2] - d[2]
    cx, cy, cz = c[0] - d[0], c[1] - d[1], c[2] - d[2]
    det = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    x, y, z = (
        max(abs(ax), abs(bx), abs(cx)),
        max(abs(ay), abs(by), abs(cy)),
        max(abs(az), abs(bz), abs(cz)),
    )
    bound = error_bound_3d(x, y, z)
    if det > bound:
        return 1
    if det < -bound:
        return -1
    if x == 0.0 or y == 0.0 or z == 0.0:
        return 0  # a computed difference is 0 only if the numbers are equal
    return _exact_3d(a, b, c, d)


@njit(cache=True, nogil=True, error_model="numpy")
def orientation_2d(a: Flat, b: Flat, c: Flat) -> int:
    """Exact sign of det(a - c, b - c); positive when a, b, c turn counterclockwise."""
    ax, ay = a[0] - c[0], a[1] - c[1]
    bx, by = b[0] - c[0], b[1] - c[1]
    det = ax * by - ay * bx
    x, y = max(abs(ax), abs(bx)), max(abs(ay), abs(by))
    if max(x, y) < LARGEST:
        bound = ERROR_2D * (x * y) + UNDERFLOW
        if det > bound:
            return 1
        if det < -bound:
            return -1
    if x == 0.0 or y == 0.0:
        return 0  # a computed difference is 0 only if the numbers are equal
    return _exact_2d(a, b, c)


# --- integers as rows of limbs ------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def _bit_range(x: float, low: int, high: int) -> tuple[int, int]:
    """Widen [low, high) to the powers of two that x is made of."""
    if x == 0.0:
        return low, high
    fraction, exponent = math.frexp(abs(x))
    mantissa = np.int64(fraction * 9007199254740992.0)  # 2^53: exact
    trailing = math.frexp(float(mantissa & -mantissa))[1] - 1
    return min(low, exponent - 53 + trailing), max(high, exponent)


@njit(cache=True, nogil=True, error_model="numpy")
def _add(row: NDArray[np.int64], x: float, sign: int, low: int) -> None:
    """Add sign * x / 2^low to row; an integer by the choice of low."""
    if x == 0.0:
        return
    fraction, exponent = math.frexp(abs(x))
    rest = np.int64(fraction * 9007199254740992.0)
    if x < 0.0:
        sign = -sign
    shift = exponent - 53 - low
    if shift < 0:  # only zeros are shifted out
        rest >>= -shift
        shift = 0
    limb = shift // _BITS
    offset = shift - limb * _BITS
    row[limb] += sign * ((rest & ((1 << (_BITS - offset)) - 1)) << offset)
    rest >>= _BITS - offset
    while rest != 0:
        limb += 1
        row[limb] += sign * (rest & _MASK)
        rest >>= _BITS


@njit(cache=True, nogil=True, error_model="numpy")
def _carry(row: NDArray[np.int64]) -> int:
    """Bring all limbs but the last into [0, 2^26); return the sign of the number."""
    carry = np.int64(0)
    some = np.int64(0)
    for i in range(len(row) - 1):
        value = row[i] + carry
        row[i] = value & _MASK
        carry = value >> _BITS
        some |= row[i]
    last = len(row) - 1
    row[last] += carry
    if row[last] < 0:  # the limbs below are worth less than one unit of the last
        return -1
    return 1 if row[last] > 0 or some != 0 else 0


@njit(cache=True, nogil=True, error_model="numpy")
def _minor(
    out: NDArray[np.int64],
    p: NDArray[np.int64],
    q: NDArray[np.int64],
    r: NDArray[np.int64],
    s: NDArray[np.int64],
) -> int:
    """Out = p * q - r * s, normalised; returns its sign."""
    for i in range(len(p)):
        for j in range(len(p)):
            out[i + j] += p[i] * q[j] - r[i] * s[j]
    return _carry(out)


@njit(cache=True, nogil=True, error_model="numpy")
def _exact_3d(a: Point, b: Point, c: Point, d: Point) -> int:
    low, high = 2000, -2000
    for k in range(3):
        low, high = _bit_range(a[k], low, high)
        low, high = _bit_range(b[k], low, high)
        low, high = _bit_range(c[k], low, high)
        low, high = _bit_range(d[k], low, high)
    if high < low:
        return 0
    n = (high - 1 - low) // _BITS + 1
    rows = np.zeros((9, n), dtype=np.int64)
    for k in range(3):
        _add(rows[k], a[k], 1, low)
        _add(rows[k], d[k], -1, low)
        _add(rows[3 + k], b[k], 1, low)
        _add(rows[3 + k], d[k], -1, low)
        _add(rows[6 + k], c[k], 1, low)
        _add(rows[6 + k], d[k], -1, low)
    minor = np.zeros(2 * n + 1, dtype=np.int64)
    total = np.zeros(3 * n + 2, dtype=np.int64)
    for k in range(3):
        k1, k2 = (k + 1) % 3, (k + 2) % 3
        minor[:] = 0
        _minor(minor, rows[3 + k1], rows[6 + k2], rows[3 + k2], rows[6 + k1])
        for i in range(len(minor)):
            for j in range(n):
                total[i + j] += minor[i] * rows[k, j]
    return _carry(total)


@njit(cache=True, nogil=True, error_model="numpy")
def _exact_2d(a: Flat, b: Flat, c: Flat) -> int:
    low, high = 2000, -2000
    for k in range(2):
        low, high = _bit_range(a[k], low, high)
        low, high = _bit_range(b[k], low, high)
        low, high = _bit_range(c[k], low, high)
    if high < low:
        return 0
    n = (high - 1 - low) // _BITS + 1
    rows = np.zeros((4, n), dtype=np.int64)
    for k in range(2):
        _add(rows[k], a[k], 1, low)
        _add(rows[k], c[k], -1, low)
        _add(rows[2 + k], b[k], 1, low)
        _add(rows[2 + k], c[k], -1, low)
    minor = np.zeros(2 * n + 1, dtype=np.int64)
    return _minor(minor, rows[0], rows[3], rows[1], rows[2])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def corners_of(t: Triangle) -> tuple[Point, Point, Point]:
    """The three corners of a triangle given as nine numbers."""
    return (t[0], t[1], t[2]), (t[3], t[4], t[5]), (t[6], t[7], t[8])
