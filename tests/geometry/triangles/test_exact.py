"""`exact` against rational clipping, libigl's predicates, and the laws of contact."""

from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest

from borecheck.errors import GeometryError
from borecheck.geometry.triangles.exact import exact, exact_counted, exact_road_only
from borecheck.geometry.triangles.exact_sign import orientation_2d, orientation_3d
from studies import exactness as study
from tests.places import PROJECT

STUDY = PROJECT / "studies" / "exactness.py"
PER_CLASS = 400


@pytest.fixture(params=sorted(study.CLASSES))
def pairs(request):
    return study.pairs_of(request.param, seed=7, chunk=0, n=PER_CLASS)


def test_agrees_with_rational_clipping(pairs):
    alpha, beta = pairs
    truth = np.array([study.meets(a, b) for a, b in zip(alpha, beta, strict=True)])
    assert 0.05 * len(truth) < truth.sum() < 0.95 * len(truth)
    answer, exact_road = exact_counted(alpha, beta)
    assert (answer == truth).all()
    assert 0 <= exact_road <= len(truth)
    assert (exact_road_only(alpha, beta) == truth).all()


def test_filter_decides_general_pairs_and_leaves_coplanar_ones():
    assert exact_counted(*study.pairs_of("general", 7, 0, PER_CLASS))[1] == 0
    alpha = np.array([[[0.0, 0.0, 0.3], [1.0, 0.0, 0.3], [0.0, 1.0, 0.3]]])
    assert exact_counted(alpha, alpha)[1] == 1


def test_same_answer_with_roles_exchanged_and_corners_in_any_order(pairs):
    alpha, beta = pairs
    answer = exact(alpha, beta)
    assert (exact(beta, alpha) == answer).all()
    for order in permutations(range(3)):
        assert (exact(alpha[:, order], beta) == answer).all()
        assert (exact(alpha, beta[:, order]) == answer).all()
    for axes in permutations(range(3)):
        assert (exact(alpha[:, :, axes], beta[:, :, axes]) == answer).all()


def test_same_answer_after_motions_that_floating_point_carries_out_exactly(rng):
    alpha, beta = study.pairs_of("coplanar", 7, 1, PER_CLASS)
    alpha, beta = np.round(alpha * 1024) / 1024, np.round(beta * 1024) / 1024
    answer = exact(alpha, beta)
    assert answer.any()
    assert not answer.all()
    for shift in 2.0 ** rng.integers(-8, 30, size=(6, 3)):
        assert (exact(alpha + shift, beta + shift) == answer).all()
    for scale in (2.0**-900, 0.25, -1.0, 2.0**900):
        assert (exact(alpha * scale, beta * scale) == answer).all()


def test_agrees_with_libigl_on_triangles_with_area(pairs):
    predicates = pytest.importorskip("igl.predicates")
    alpha, beta = pairs
    # Shewchuk's predicates promise nothing near under- and overflow, libigl's triangle
    # test nothing for triangles without area.
    ordinary = _ordinary(alpha) & _ordinary(beta)
    alpha, beta = alpha[ordinary], beta[ordinary]
    if len(alpha) == 0:
        pytest.skip("no pair of this class is within libigl's promise")
    theirs = np.array(
        [_igl_meets(predicates, a, b) for a, b in zip(alpha, beta, strict=True)]
    )
    assert (exact(alpha, beta) == theirs).all()


def _ordinary(triangles):
    sizes = np.abs(triangles)
    fine = ((sizes == 0.0) | ((sizes > 1e-60) & (sizes < 1e60))).all(axis=(1, 2))
    area = np.array(
        [_has_area(t) if ok else False for t, ok in zip(triangles, fine, strict=True)]
    )
    return fine & area


def _has_area(triangle):
    p, q, r = triangle.tolist()
    return any(
        orientation_2d((p[i], p[j]), (q[i], q[j]), (r[i], r[j])) != 0
        for i, j in ((0, 1), (1, 2), (2, 0))
    )


def _igl_meets(predicates, a, b):
    triangle = np.array([[0, 1, 2]], dtype=np.int64)
    return bool(predicates.find_intersections(a, triangle, b, triangle)[0])


TRIANGLE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
UP = np.nextafter(0.0, 1.0)


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        ([[0.2, 0.2, 0.0], [0.2, 0.2, 1.0], [0.3, 0.2, 1.0]], True),  # corner on face
        ([[0.2, 0.2, UP], [0.2, 0.2, 1.0], [0.3, 0.2, 1.0]], False),  # 5e-324 above
        ([[0.5, 0.5, 0.0], [1.0, 1.0, 1.0], [1.0, 1.0, 2.0]], True),  # corner on edge
        ([[1.0, 0.0, 0.0], [2.0, 0.0, 1.0], [2.0, 1.0, 1.0]], True),  # shared corner
        ([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, -1.0, 0.0]], True),  # shared edge
        ([[0.1, 0.1, 0.0], [0.2, 0.1, 0.0], [0.1, 0.2, 0.0]], True),  # inside, coplanar
        (
            [[2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, 1.0, 0.0]],
            False,
        ),  # beside, coplanar
        ([[0.2, 0.2, 0.0]] * 3, True),  # point on face
        ([[0.2, 0.2, UP]] * 3, False),
        ([[0.2, 0.2, -1.0], [0.2, 0.2, 1.0], [0.2, 0.2, 1.0]], True),  # segment through
        (
            [[-1.0, 0.5, 0.0], [3.0, 0.5, 0.0], [1.0, 0.5, 0.0]],
            True,
        ),  # segment in plane
        ([[-1.0, 3.0, 0.0], [3.0, 3.0, 0.0], [1.0, 3.0, 0.0]], False),
    ],
)
def test_touching_coplanar_and_zero_area(other, expected):
    assert exact([TRIANGLE], [other])[0] == expected
    assert exact([other], [TRIANGLE])[0] == expected


def test_crack_between_two_triangles_is_closed():
    square = np.array(
        [
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]],
            [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        ]
    )
    sliver = np.array([[0.5, 0.5, -1.0], [0.5, 0.5, 1.0], [0.6, 0.6, 1.0]])
    assert exact(square, np.stack([sliver, sliver])).all()


@pytest.mark.parametrize("size", [1.0, 2.0**-1000, 2.0**900])
def test_orientation_signs_are_those_of_rational_determinants(rng, size):
    for _ in range(200):
        points = rng.integers(-4, 5, size=(4, 3)) * rng.choice([1.0, 0.1, 1e-9])
        if rng.random() < 0.5:
            points[3] = 0.5 * points[0] + 0.25 * points[1] + 0.25 * points[2]
            points += rng.integers(-1, 2, size=(4, 3)) * np.spacing(points)
        points = points * size
        corners = [tuple(float(x) for x in p) for p in points]
        assert orientation_3d(*corners) == _rational_sign(points)
        flat = [corner[:2] for corner in corners[:3]]
        lifted = [[*flat[0], 0], [*flat[1], 0], [*flat[2], 0], [*flat[2], 1]]
        assert orientation_2d(*flat) == -_rational_sign(lifted)


def _rational_sign(points):
    a, b, c, d = ([Fraction(float(x)) for x in p] for p in points)
    u, v, w = ([x - y for x, y in zip(p, d, strict=True)] for p in (a, b, c))
    det = (
        u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
    )
    return (det > 0) - (det < 0)


def test_refuses_what_it_cannot_judge():
    with pytest.raises(GeometryError, match="shapes"):
        exact(np.zeros((2, 3, 3)), np.zeros((1, 3, 3)))
    with pytest.raises(GeometryError, match="triangle 1 of beta is not finite"):
        exact(np.zeros((2, 3, 3)), [TRIANGLE, [[0, 0, np.nan], [1, 0, 0], [0, 1, 0]]])


@pytest.fixture
def rng():
    return np.random.default_rng(11)
