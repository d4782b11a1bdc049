"""Why a checker is wrong about two triangles, told by rational arithmetic.

Slow and plain on purpose: every sign here is that of a `Fraction`, and nothing is
shared with the checkers that are judged.
"""

from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Point = tuple[Fraction, Fraction, Fraction]

ONE_SIDED = "one-sided test"
TOUCHING = "touching"
COPLANAR = "coplanar"
ZERO_AREA = "zero-area"
ROUNDING = "rounding"
COAL_TOLERANCE = "Coal tolerance"
CONTAINMENT = "containment"

# Coal stops its iteration at this distance (coal_contact.GJK_TOLERANCE), typed again
# here because this module judges Coal; a pair further apart has no such excuse.
_COAL_REACH = 2e-9
# A plane value or determinant in float64 is off by a few dozen units in the last place
# of its largest term; beyond 64 of them rounding is no excuse.
_ROUNDING_SHARE = 64 * 2.0**-52


def cause_of(
    first: Array, second: Array, verdicts: Mapping[str, bool]
) -> tuple[bool, str | None]:
    """Whether two closed triangles meet, and why some checker says otherwise.

    Args:
        first: The robot's triangle, placed, (3, 3), [m].
        second: The obstacle's triangle, (3, 3).
        verdicts: Contact or not, by checker; at least two differ.

    Returns:
        What is true, and the cause of the disagreement (None: no known cause fits).
    """
    truth = verdicts["exact"]
    wrong = [name for name, verdict in verdicts.items() if verdict != truth]
    if not wrong:
        return truth, None
    if truth:
        return truth, _cause_of_miss(first, second, wrong)
    return truth, _cause_of_false_contact(first, second, wrong)


def _cause_of_miss(first: Array, second: Array, wrong: Sequence[str]) -> str | None:
    a, b = _exact(first), _exact(second)
    if _is_flat(a) or _is_flat(b):
        return ZERO_AREA
    if all(orientation(*a, p) == 0 for p in b):
        return COPLANAR
    seen_with_alpha = {"paper:robot": _crosses(a, b), "paper:scanner": _crosses(b, a)}
    if not any(seen_with_alpha.values()):
        return TOUCHING
    blind = {name for name in wrong if not seen_with_alpha.get(name, True)}
    causes = [ONE_SIDED] if blind else []
    if set(wrong) - blind:
        rounding = _rounding(first, second)
        if rounding is None:
            return None
        causes.append(rounding)
    return ", ".join(causes)


def _cause_of_false_contact(
    first: Array, second: Array, wrong: Sequence[str]
) -> str | None:
    causes = []
    if "coal" in wrong:
        if _gap(first, second) > _COAL_REACH:
            return None
        causes.append(COAL_TOLERANCE)
    if set(wrong) - {"coal"}:
        rounding = _rounding(first, second)
        if rounding is None:
            return None
        causes.append(rounding)
    return ", ".join(causes)


def _rounding(first: Array, second: Array) -> str | None:
    """Rounding, if some determinant of the pair is too small for float64 to sign."""
    a, b = _exact(first), _exact(second)
    size = float(max(np.ptp(np.vstack([first, second]), axis=0).max(), 1e-300))
    smallest = min(abs(float(value)) for value in _determinants(a, b))
    far = float(np.abs(np.vstack([first, second])).max())
    reach = _ROUNDING_SHARE * size * size * max(size, far)
    return ROUNDING if smallest <= reach else None


def signed_determinants(first: Array, second: Array) -> dict[str, float]:
    """The determinants behind the verdicts, signed, as floats of exact values.

    Heights of each triangle's corners over the other one's plane; a report shows them
    beside the two triangles.
    """
    a, b = _exact(first), _exact(second)
    named = {f"f_alpha(beta{i + 1})": orientation(*a, p) for i, p in enumerate(b)}
    named |= {f"f_beta(alpha{i + 1})": orientation(*b, p) for i, p in enumerate(a)}
    return {name: float(value) for name, value in named.items()}


def orientation(p: Point, q: Point, r: Point, s: Point) -> Fraction:
    """Six times the signed volume of p q r s, exactly."""
    u = [q[k] - p[k] for k in range(3)]
    v = [r[k] - p[k] for k in range(3)]
    w = [s[k] - p[k] for k in range(3)]
    return (
        (u[1] * v[2] - u[2] * v[1]) * w[0]
        + (u[2] * v[0] - u[0] * v[2]) * w[1]
        + (u[0] * v[1] - u[1] * v[0]) * w[2]
    )


def _exact(triangle: Array) -> tuple[Point, Point, Point]:
    points = [tuple(Fraction(float(x)) for x in point) for point in triangle]
    return tuple(points)  # type: ignore[return-value]


def _is_flat(t: tuple[Point, Point, Point]) -> bool:
    """Whether the triangle is a segment or a point."""
    u = [t[1][k] - t[0][k] for k in range(3)]
    v = [t[2][k] - t[0][k] for k in range(3)]
    return all(u[i] * v[j] == u[j] * v[i] for i, j in ((0, 1), (1, 2), (2, 0)))


def _crosses(
    alpha: tuple[Point, Point, Point], beta: tuple[Point, Point, Point]
) -> bool:
    """Whether an edge of beta crosses the inside of alpha, strictly."""
    heights = [orientation(*alpha, p) for p in beta]
    for i in range(3):
        j = (i + 1) % 3
        if heights[i] * heights[j] >= 0:
            continue
        turns = [
            orientation(alpha[k], alpha[(k + 1) % 3], beta[i], beta[j])
            for k in range(3)
        ]
        if all(t > 0 for t in turns) or all(t < 0 for t in turns):
            return True
    return False


def _determinants(
    a: tuple[Point, Point, Point], b: tuple[Point, Point, Point]
) -> list[Fraction]:
    values = [orientation(*a, p) for p in b] + [orientation(*b, p) for p in a]
    values += [
        orientation(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3])
        for i in range(3)
        for j in range(3)
    ]
    return values


def _gap(first: Array, second: Array) -> float:
    from borecheck.geometry.triangles.distance import pair_distance
    from borecheck.geometry.triangles.placing import place_triangle

    here = np.eye(4)
    a = place_triangle(here, np.ascontiguousarray(first.reshape(1, 9)), 0)
    b = place_triangle(here, np.ascontiguousarray(second.reshape(1, 9)), 0)
    return float(pair_distance(a, b)[0])
