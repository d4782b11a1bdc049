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
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.triangles.placing import Triangle

Point = tuple[float, float, float]
Flat = tuple[float, float]
Limbs = NDArray[np.int64]

# Bits per limb. A difference of two integers has limbs below 2^27; a minor adds at
# most 2 * 82 products of those, a determinant 3 * 82 products with normalised limbs
# (below 2^26): 2^61.4, no int64 overflow.
_BITS = 26
_MASK = (1 << _BITS) - 1
_NO_BITS = (2000, -2000)  # lowest and highest power of two of no number at all

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


@kernel
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


@kernel
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


@kernel
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


@kernel
def _bit_range(x: float, low: int, high: int) -> tuple[int, int]:
    """Widen [low, high) to the powers of two that x is made of."""
    if x == 0.0:
        return low, high
    fraction, exponent = math.frexp(abs(x))
    mantissa = np.int64(fraction * 9007199254740992.0)  # 2^53: exact
    trailing = math.frexp(float(mantissa & -mantissa))[1] - 1
    return min(low, exponent - 53 + trailing), max(high, exponent)


@kernel
def _add(limbs: Limbs, start: int, x: float, sign: int, low: int) -> None:
    """Add sign * x / 2^low, an integer by the choice of low, to the number at start."""
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
    k = start + shift // _BITS
    offset = shift % _BITS
    limbs[k] += sign * ((rest & ((1 << (_BITS - offset)) - 1)) << offset)
    rest >>= _BITS - offset
    while rest != 0:
        k += 1
        limbs[k] += sign * (rest & _MASK)
        rest >>= _BITS


@kernel
def _carry(limbs: Limbs, start: int, end: int) -> int:
    """Bring limbs start to end - 2 into [0, 2^26); return the sign of the number."""
    carry = np.int64(0)
    some = np.int64(0)
    for i in range(start, end - 1):
        value = limbs[i] + carry
        limbs[i] = value & _MASK
        carry = value >> _BITS
        some |= limbs[i]
    last = limbs[end - 1] + carry
    limbs[end - 1] = last
    if last < 0:  # the limbs below are worth less than one unit of the last
        return -1
    return 1 if last > 0 or some != 0 else 0


@kernel
def _minor(limbs: Limbs, out: int, n: int, p: int, q: int, r: int, s: int) -> int:
    """Write p * q - r * s, normalised, to the 2n + 1 limbs at out; return its sign.

    The operands are the starts of numbers of n limbs.
    """
    for i in range(out, out + 2 * n + 1):
        limbs[i] = 0
    for i in range(n):
        for j in range(n):
            limbs[out + i + j] += (
                limbs[p + i] * limbs[q + j] - limbs[r + i] * limbs[s + j]
            )
    return _carry(limbs, out, out + 2 * n + 1)


@kernel
def _exact_3d(a: Point, b: Point, c: Point, d: Point) -> int:
    """Sign of det(a - d, b - d, c - d) in integers."""
    low, high = _NO_BITS
    for k in range(3):
        low, high = _bit_range(a[k], low, high)
        low, high = _bit_range(b[k], low, high)
        low, high = _bit_range(c[k], low, high)
        low, high = _bit_range(d[k], low, high)
    if high < low:
        return 0
    # nine differences of n limbs, one minor, the determinant: side by side in one array
    n = (high - 1 - low) // _BITS + 1
    minor = 9 * n
    total = minor + 2 * n + 1
    end = total + 3 * n + 2
    limbs = np.zeros(end, dtype=np.int64)
    for k in range(3):
        _add(limbs, k * n, a[k], 1, low)
        _add(limbs, k * n, d[k], -1, low)
        _add(limbs, (3 + k) * n, b[k], 1, low)
        _add(limbs, (3 + k) * n, d[k], -1, low)
        _add(limbs, (6 + k) * n, c[k], 1, low)
        _add(limbs, (6 + k) * n, d[k], -1, low)
    for k in range(3):
        y, z = (k + 1) % 3, (k + 2) % 3
        sign = _minor(
            limbs, minor, n, (3 + y) * n, (6 + z) * n, (3 + z) * n, (6 + y) * n
        )
        if sign != 0:
            for i in range(2 * n + 1):
                for j in range(n):
                    limbs[total + i + j] += limbs[minor + i] * limbs[k * n + j]
    return _carry(limbs, total, end)


@kernel
def _exact_2d(a: Flat, b: Flat, c: Flat) -> int:
    """Sign of det(a - c, b - c) in integers."""
    low, high = _NO_BITS
    for k in range(2):
        low, high = _bit_range(a[k], low, high)
        low, high = _bit_range(b[k], low, high)
        low, high = _bit_range(c[k], low, high)
    if high < low:
        return 0
    n = (high - 1 - low) // _BITS + 1
    limbs = np.zeros(6 * n + 1, dtype=np.int64)
    for k in range(2):
        _add(limbs, k * n, a[k], 1, low)
        _add(limbs, k * n, c[k], -1, low)
        _add(limbs, (2 + k) * n, b[k], 1, low)
        _add(limbs, (2 + k) * n, c[k], -1, low)
    return _minor(limbs, 4 * n, n, 0, 3 * n, n, 2 * n)


@kernel(inline="always")
def corners_of(t: Triangle) -> tuple[Point, Point, Point]:
    """The three corners of a triangle given as nine numbers."""
    return (t[0], t[1], t[2]), (t[3], t[4], t[5]), (t[6], t[7], t[8])
