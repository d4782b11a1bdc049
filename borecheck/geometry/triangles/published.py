"""Triangle contact as published: edges of one triangle against the other.

`paper` is [Matsuno2020] section 3.2, equations (4) to (6) and its flowchart, with its
blind spots: only edges of beta against alpha, and strict inequalities. It rounds;
`triangles.exact` is the judge.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import GeometryError
from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.triangles.placing import Triangle

Point = tuple[float, float, float]

# alpha is the robot's triangle in paper:robot and the scanner's in paper:scanner.
NARROWPHASES = {"paper:robot": 0, "paper:scanner": 1, "two-sided": 2, "exact": 3}


def paper(alpha: ArrayLike, beta: ArrayLike) -> NDArray[np.bool_]:
    """Whether an edge of beta crosses the inside of alpha, pair by pair.

    One-sided and strict as published: a corner of alpha poking through beta is not
    seen, nor is any contact through an edge or corner of alpha, touching, or coplanar
    overlap. `docs/contact.md` has the smallest examples.

    Args:
        alpha: Triangles, (n, 3, 3): pair, corner, coordinate [m].
        beta: Triangles, (n, 3, 3), in the same frame.

    Returns:
        Contact, (n,) bool.

    Raises:
        GeometryError: Shapes that do not match, or a number that is not finite.

    Source: [Matsuno2020] eqs. (4)-(6), Fig. 9.
    """
    a, b = triangle_rows(alpha, beta)
    return _paper_rows(a, b)


def triangle_rows(
    alpha: ArrayLike, beta: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Both sets of triangles as contiguous (n, 9) rows, checked.

    Raises:
        GeometryError: Not (n, 3, 3) both, or a number that is not finite.
    """
    a, b = (np.ascontiguousarray(t, dtype=np.float64) for t in (alpha, beta))
    if a.ndim != 3 or a.shape[1:] != (3, 3) or a.shape != b.shape:
        raise GeometryError(
            f"triangles have shapes {a.shape} and {b.shape}, not (n, 3, 3) both"
        )
    for name, t in (("alpha", a), ("beta", b)):
        bad = np.flatnonzero(~np.isfinite(t).all(axis=(1, 2)))
        if len(bad):
            raise GeometryError(f"triangle {bad[0]} of {name} is not finite")
    return a.reshape(-1, 9), b.reshape(-1, 9)


@kernel(inline="always")
def triangle_row(rows: NDArray[np.float64], k: int) -> Triangle:
    """Row k of (n, 9) as a tuple of nine numbers."""
    return (
        rows[k, 0],
        rows[k, 1],
        rows[k, 2],
        rows[k, 3],
        rows[k, 4],
        rows[k, 5],
        rows[k, 6],
        rows[k, 7],
        rows[k, 8],
    )


# --- the published test -------------------------------------------------------------


@kernel
def _plane(p: Point, q: Point, r: Point) -> tuple[float, float, float, float]:
    """Coefficients a, b, c, d of the plane through p, q, r: eq. (5)."""
    ux, uy, uz = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    vx, vy, vz = p[0] - r[0], p[1] - r[1], p[2] - r[2]
    a = uy * vz - uz * vy
    b = uz * vx - ux * vz
    c = ux * vy - uy * vx
    return a, b, c, -(a * p[0] + b * p[1] + c * p[2])


@kernel
def _f(plane: tuple[float, float, float, float], x: Point) -> float:
    """The plane function f of eq. (5)."""
    return plane[0] * x[0] + plane[1] * x[1] + plane[2] * x[2] + plane[3]


@kernel
def _same_side(p: Point, q: Point, r: Point, x: Point, y: Point) -> bool:
    """One line of eq. (6): x, y strictly on one side of the plane through p, q, r."""
    plane = _plane(p, q, r)
    return _f(plane, x) * _f(plane, y) > 0.0


@kernel
def _edge_goes_through(a1: Point, a2: Point, a3: Point, bi: Point, bj: Point) -> bool:
    """Eq. (6): edge bi-bj, known to have its ends on both sides, goes through alpha."""
    return (
        _same_side(a1, a2, bi, bj, a3)
        and _same_side(a2, a3, bi, bj, a1)
        and _same_side(a3, a1, bi, bj, a2)
    )


@kernel
def paper_pair(a: Triangle, b: Triangle) -> bool:
    """The published test on one pair; a is alpha, b is beta.

    Only edges whose ends lie on opposite sides of alpha's plane are asked: the text
    below eq. (6) says so, and without it eq. (6) reports contacts that are none.

    Source: [Matsuno2020] eqs. (4)-(6), Fig. 9.
    """
    a1, a2, a3 = (a[0], a[1], a[2]), (a[3], a[4], a[5]), (a[6], a[7], a[8])
    b1, b2, b3 = (b[0], b[1], b[2]), (b[3], b[4], b[5]), (b[6], b[7], b[8])
    alpha = _plane(a1, a2, a3)
    f1, f2, f3 = _f(alpha, b1), _f(alpha, b2), _f(alpha, b3)
    if f1 * f2 > 0.0 and f1 * f3 > 0.0:  # eq. (4)
        return False
    if f1 * f2 < 0.0 and _edge_goes_through(a1, a2, a3, b1, b2):
        return True
    if f2 * f3 < 0.0 and _edge_goes_through(a1, a2, a3, b2, b3):
        return True
    return f3 * f1 < 0.0 and _edge_goes_through(a1, a2, a3, b3, b1)


@kernel
def _paper_rows(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.bool_]:
    contact = np.zeros(len(a), dtype=np.bool_)
    for k in range(len(a)):
        contact[k] = paper_pair(triangle_row(a, k), triangle_row(b, k))
    return contact
