"""Distances of triangles against rational arithmetic, duality and linear programmes."""

import math
from decimal import Decimal, localcontext
from fractions import Fraction
from itertools import permutations, product

import numpy as np
import pytest
from scipy.optimize import linprog

from borecheck.geometry.triangles.distance import (
    DISTANCE_ERROR,
    chebyshev_distance,
    disjoint_distance,
    pair_distance,
)
from borecheck.geometry.triangles.exact import exact

PAIRS = 120
# A linear programme in floating point: HiGHS works to 1e-7 feasibility at the worst.
LP_TOLERANCE = 1e-7
# Our own two ways to the same number: a few roundings of numbers of size 1.
ROUNDING = 1e-13


def tuples(alpha, beta):
    for a, b in zip(alpha, beta, strict=True):
        yield tuple(a.ravel().tolist()), tuple(b.ravel().tolist())


def general(rng, n):
    return rng.normal(size=(n, 3, 3)), rng.normal(size=(n, 3, 3)) + np.array([1, 0, 0])


def far_from_origin(rng, n):
    a, b = general(rng, n)
    shift = rng.normal(size=(n, 1, 3)) * 100.0
    return a + shift, b + shift


def needles(rng, n):
    a, b = general(rng, n)
    for t in (a, b):
        width = 10.0 ** rng.uniform(-16, -2, (n, 1))
        share = rng.uniform(-0.2, 1.2, (n, 1))
        t[:, 2] = t[:, 0] + share * (t[:, 1] - t[:, 0])
        t[:, 2] += width * rng.normal(size=(n, 3))
    return a, b


def nearly_parallel(rng, n):
    a = rng.normal(size=(n, 3, 3))
    offset = 10.0 ** rng.uniform(-15, 0, (n, 1, 1)) * rng.normal(size=(n, 1, 3))
    tilt = 10.0 ** rng.uniform(-16, -2, (n, 1, 1)) * rng.normal(size=(n, 3, 3))
    return a, a + offset + tilt


def nearly_touching(rng, n):
    a, b = needles(rng, n)
    weights = rng.dirichlet((1.0, 1.0, 1.0), size=n)
    x, y = (np.einsum("nc,nck->nk", weights, t) for t in (a, b))
    gap = 10.0 ** rng.uniform(-16, -3, (n, 1)) * rng.normal(size=(n, 3))
    return a, b + (x - y + gap)[:, None]


def lattice(rng, n):
    return tuple(rng.integers(-2, 3, (n, 3, 3)).astype(float) for _ in range(2))


CLASSES = [general, far_from_origin, needles, nearly_parallel, nearly_touching, lattice]


@pytest.fixture(params=CLASSES, ids=lambda maker: maker.__name__)
def disjoint(request):
    alpha, beta = request.param(np.random.default_rng(8), 3 * PAIRS)
    apart = ~exact(alpha, beta)
    assert apart.sum() > 20
    return alpha[apart][:PAIRS], beta[apart][:PAIRS]


# --- the rational reference: all pairs of features, Gram matrices, no cross product -


def dot(u, v):
    return sum(x * y for x, y in zip(u, v, strict=True))


def nearest_squared(origin, directions, x):
    """Squared distance of x to origin + span(directions) where the foot is inside."""
    w = [p - q for p, q in zip(x, origin, strict=True)]
    gram = [[dot(u, v) for v in directions] for u in directions]
    right = [dot(u, w) for u in directions]
    if len(directions) == 1:
        if gram[0][0] == 0:
            return None
        shares = [right[0] / gram[0][0]]
    else:
        det = gram[0][0] * gram[1][1] - gram[0][1] * gram[1][0]
        if det == 0:
            return None
        shares = [
            (right[0] * gram[1][1] - right[1] * gram[0][1]) / det,
            (right[1] * gram[0][0] - right[0] * gram[1][0]) / det,
        ]
    return shares, [
        p - sum(s * u[k] for s, u in zip(shares, directions, strict=True))
        for k, p in enumerate(w)
    ]


def rational_distance(a, b):
    """True distance of disjoint triangles, from the least square over feature pairs."""
    a, b = ([[Fraction(x) for x in t[i : i + 3]] for i in (0, 3, 6)] for t in (a, b))
    squares = []
    for one, other in ((a, b), (b, a)):
        for x in one:
            squares += [dot(d, d) for d in (minus(x, y) for y in other)]
            for i in range(3):
                found = nearest_squared(other[i], [minus(other[i - 1], other[i])], x)
                if found and 0 <= found[0][0] <= 1:
                    squares.append(dot(found[1], found[1]))
            edges = [minus(other[1], other[0]), minus(other[2], other[0])]
            found = nearest_squared(other[0], edges, x)
            if found and min(found[0]) >= 0 and sum(found[0]) <= 1:
                squares.append(dot(found[1], found[1]))
    for i, j in product(range(3), range(3)):
        u, v = minus(a[i - 1], a[i]), minus(b[j], b[j - 1])
        found = nearest_squared(a[i], [u, v], b[j])
        if found and min(found[0]) >= 0 and max(found[0]) <= 1:
            squares.append(dot(found[1], found[1]))
    return root(min(squares))


def minus(p, q):
    return [x - y for x, y in zip(p, q, strict=True)]


def root(square):
    with localcontext() as context:
        context.prec = 60
        return (Decimal(square.numerator) / Decimal(square.denominator)).sqrt()


def size_of(a, b):
    points = np.array([a, b]).reshape(-1, 3)
    return float(np.ptp(points, axis=0).max())


def test_distance_is_within_the_stated_error(disjoint):
    worst = 0.0
    for a, b in tuples(*disjoint):
        distance, _, _ = pair_distance(a, b)
        error = abs(float(Decimal(distance) - rational_distance(a, b)))
        worst = max(worst, error / size_of(a, b))
    assert worst <= DISTANCE_ERROR / 2.0  # measured: 2 * 2^-53


def test_witnesses_lie_on_the_triangles_and_are_that_far_apart(disjoint):
    for a, b in tuples(*disjoint):
        distance, p, q = disjoint_distance(a, b)
        allowed = DISTANCE_ERROR * (size_of(a, b) + max(map(abs, a + b)))
        assert math.dist(p, q) == pytest.approx(distance, abs=allowed)
        assert disjoint_distance(p * 3, a)[0] <= allowed
        assert disjoint_distance(q * 3, b)[0] <= allowed


def test_no_plane_separates_further_than_the_distance():
    """Weak duality: the gap along q - p is a lower bound that meets the distance."""
    alpha, beta = general(np.random.default_rng(9), 500)
    checked = 0
    for a, b in tuples(alpha, beta):
        distance, p, q = pair_distance(a, b)
        if distance > 1e-3:  # below, rounding turns the direction
            w = (np.array(q) - p) / distance
            gap = (np.reshape(b, (3, 3)) @ w).min() - (np.reshape(a, (3, 3)) @ w).max()
            assert gap == pytest.approx(distance, abs=1e-11)
            checked += 1
    assert checked > 200


def test_zero_exactly_in_contact():
    alpha, beta = general(np.random.default_rng(10), 2000)
    truth = exact(alpha, beta)
    assert 100 < truth.sum() < 1900
    distances = [pair_distance(a, b)[0] for a, b in tuples(alpha, beta)]
    assert ((np.array(distances) == 0.0) == truth).all()


@pytest.mark.parametrize("scale", [1e-150, 1e-30, 1e30, 1e150])
def test_any_size(scale):
    alpha, beta = general(np.random.default_rng(12), 40)
    for (a, b), (c, d) in zip(
        tuples(alpha, beta), tuples(scale * alpha, scale * beta), strict=True
    ):
        expected = scale * pair_distance(a, b)[0]
        # looser than the bound: the scaled corners themselves are rounded
        assert pair_distance(c, d)[0] == pytest.approx(expected, abs=1e-13 * scale)


def test_distance_in_axes_is_the_linear_programme(disjoint):
    alpha, beta = disjoint
    for i, (a, b) in enumerate(tuples(alpha[:25], beta[:25])):
        expected = chebyshev_programme(alpha[i], beta[i])
        assert chebyshev_distance(a, b) == pytest.approx(expected, abs=LP_TOLERANCE)


def test_distance_in_axes_is_within_the_stated_error(disjoint):
    for a, b in tuples(*disjoint):
        error = abs(Fraction(chebyshev_distance(a, b)) - rational_in_axes(a, b))
        assert error <= DISTANCE_ERROR / 2.0 * size_of(a, b)


def rational_in_axes(a, b):
    """The same candidate directions as the kernel's, without rounding."""
    a, b = ([[Fraction(x) for x in t[i : i + 3]] for i in (0, 3, 6)] for t in (a, b))
    axes = [[Fraction(i == k) for i in range(3)] for k in range(3)]
    edges = [[minus(t[i], t[i - 1]) for i in range(3)] for t in (a, b)]
    crossed = [*product(axes, edges[0] + edges[1]), *product(*edges)]
    crossed += [tuple(edges[0][:2]), tuple(edges[1][:2])]
    best = Fraction(0)
    for w in axes + [cross(u, v) for u, v in crossed]:
        norm = sum(map(abs, w))
        if norm:
            s, t = [dot(w, p) for p in a], [dot(w, p) for p in b]
            best = max(best, (min(t) - max(s)) / norm, (min(s) - max(t)) / norm)
    return best


def cross(u, v):
    return [u[i - 2] * v[i - 1] - u[i - 1] * v[i - 2] for i in range(3)]


def chebyshev_programme(alpha, beta):
    """Least t with |x - y| <= t per axis; x, y convex combinations of the corners."""
    offset = alpha[0].copy()
    rows = []
    for k in range(3):
        row = np.concatenate([alpha[:, k] - offset[k], offset[k] - beta[:, k], [-1.0]])
        rows += [row, np.append(-row[:-1], -1.0)]
    sums = [[1, 1, 1, 0, 0, 0, 0], [0, 0, 0, 1, 1, 1, 0]]
    cost = [0, 0, 0, 0, 0, 0, 1]
    return linprog(cost, rows, np.zeros(6), sums, [1, 1], bounds=[(0, None)] * 7).fun


def test_distance_in_axes_lies_between_the_distance_and_its_root_three_part(disjoint):
    for a, b in tuples(*disjoint):
        distance, in_axes = pair_distance(a, b)[0], chebyshev_distance(a, b)
        slack = ROUNDING * size_of(a, b)
        assert in_axes <= distance + slack
        assert distance <= math.sqrt(3.0) * in_axes + slack


def test_distance_in_axes_is_zero_in_contact_and_grows_with_a_shift():
    face = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    for shift in permutations((0.02, 0.01, 0.015)):
        moved = tuple(x + shift[i % 3] for i, x in enumerate(face))
        assert chebyshev_distance(face, moved) == pytest.approx(shift[2], abs=ROUNDING)
    assert chebyshev_distance(face, face) == 0.0
    beyond = tuple(x + (3.0, 4.0, 5.0)[i % 3] for i, x in enumerate(face))
    assert chebyshev_distance(face, beyond) == 5.0
