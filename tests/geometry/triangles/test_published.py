"""The published test and its two-sided form, with their blind spots."""

from itertools import permutations

import numpy as np
import pytest

from borecheck.errors import GeometryError
from borecheck.geometry.triangles.exact import exact
from borecheck.geometry.triangles.exact_sign import orientation_2d
from borecheck.geometry.triangles.published import NARROWPHASES, paper
from borecheck.geometry.triangles.two_sided import two_sided

# The smallest example of one-sidedness: a spike through the middle of a plate.
SPIKE = [[0.0, 0.0, -0.01], [0.0005, 0.0, 0.1], [-0.0005, 0.0, 0.1]]
PLATE = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]]
FACE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]


@pytest.fixture
def pairs():
    rng = np.random.default_rng(5)
    return rng.normal(size=(4000, 3, 3)), rng.normal(size=(4000, 3, 3))


# --- reference forms in numpy, sharing nothing with the kernels ---------------------


def plane_function(p, q, r, x):
    """Eq. (5) for arrays of points (n, 3)."""
    normal = np.cross(p - q, p - r)
    d = -np.einsum("nk,nk->n", normal, p)
    return np.einsum("nk,nk->n", normal, x) + d


def paper_reference(alpha, beta):
    """Eqs. (4)-(6), all pairs at once, nothing skipped early."""
    f = np.stack([plane_function(*alpha.swapaxes(0, 1), beta[:, i]) for i in range(3)])
    rejected = (f[0] * f[1] > 0) & (f[0] * f[2] > 0)
    contact = np.zeros(len(alpha), dtype=bool)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        goes_through = f[i] * f[j] < 0
        for u, v, w in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            plane = alpha[:, u], alpha[:, v], beta[:, i]
            left = plane_function(*plane, beta[:, j])
            goes_through &= left * plane_function(*plane, alpha[:, w]) > 0
        contact |= goes_through
    return contact & ~rejected


def barycentric_reference(alpha, beta):
    """Some edge of beta meets the closed alpha, by solving for the crossing point."""
    contact = np.zeros(len(alpha), dtype=bool)
    u, v = alpha[:, 1] - alpha[:, 0], alpha[:, 2] - alpha[:, 0]
    for i, j in ((0, 1), (1, 2), (2, 0)):
        matrix = np.stack([u, v, beta[:, i] - beta[:, j]], axis=2)
        solution = np.linalg.solve(matrix, (beta[:, i] - alpha[:, 0])[..., None])
        s, t, along = solution[..., 0].T
        contact |= (s >= 0) & (t >= 0) & (s + t <= 1) & (along >= 0) & (along <= 1)
    return contact


def test_paper_is_the_published_formulas(pairs):
    answer = paper(*pairs)
    assert answer.sum() > 500
    assert (answer == paper_reference(*pairs)).all()


def test_two_sided_is_edges_of_either_against_the_other(pairs):
    alpha, beta = pairs
    answer = two_sided(alpha, beta)
    reference = barycentric_reference(alpha, beta) | barycentric_reference(beta, alpha)
    assert answer.sum() > 500
    assert (answer == reference).all()


def test_in_general_position_both_directions_are_exact(pairs):
    alpha, beta = pairs
    truth = exact(alpha, beta)
    assert (paper(alpha, beta) | paper(beta, alpha) == truth).all()
    assert (two_sided(alpha, beta) == truth).all()


def test_one_direction_loses_a_fifth_of_the_contacts(pairs):
    truth = exact(*pairs)
    lost = truth & ~paper(*pairs)
    assert 0.18 < lost.sum() / truth.sum() < 0.27
    assert not (paper(*pairs) & ~truth).any()


def test_spike_as_alpha_is_not_seen():
    for order in permutations(range(3)):
        for other in permutations(range(3)):
            spike, plate = np.array([SPIKE])[:, order], np.array([PLATE])[:, other]
            assert not paper(spike, plate)[0]
            assert paper(plate, spike)[0]
            assert two_sided(spike, plate)[0]
            assert exact(spike, plate)[0]


@pytest.mark.parametrize(
    "other",
    [
        [[0.2, 0.2, 0.0], [0.2, 0.2, 1.0], [0.3, 0.2, 1.0]],  # corner on the face
        [[0.2, 0.2, 0.0], [0.3, 0.2, 0.0], [0.3, 0.2, 1.0]],  # edge in the face
        [[0.5, 0.5, 0.0], [1.0, 1.0, 1.0], [1.0, 1.0, 2.0]],  # corner on an edge
        [[1.0, 0.0, 0.0], [2.0, 0.0, 1.0], [2.0, 1.0, 1.0]],  # shared corner
        [[0.1, 0.1, 0.0], [0.7, 0.1, 0.0], [0.1, 0.7, 0.0]],  # coplanar, inside
        [[0.5, -1.0, 0.0], [0.5, 2.0, 0.0], [0.7, 2.0, 0.0]],  # coplanar, across
        FACE,
        [[0.5, 0.5, -1.0], [0.5, 0.5, 1.0], [0.9, 0.9, 1.0]],  # edge through an edge
    ],
)
def test_paper_misses_what_two_sided_defines_as_contact(other):
    assert not paper([FACE], [other])[0]
    assert two_sided([FACE], [other])[0]
    assert two_sided([other], [FACE])[0]
    assert exact([FACE], [other])[0]


def test_coplanar_triangles_apart_are_clear():
    beside = np.array([FACE]) + np.array([5.0, 0.0, 0.0])
    assert not two_sided([FACE], beside)[0]
    assert not exact([FACE], beside)[0]


def test_two_sided_is_exact_where_nothing_rounds():
    rng = np.random.default_rng(6)
    alpha, beta = (rng.integers(-3, 4, (6000, 3, 3)).astype(float) for _ in range(2))
    fine = np.array(
        [has_area(a) and has_area(b) for a, b in zip(alpha, beta, strict=True)]
    )
    alpha, beta = alpha[fine], beta[fine]
    assert len(alpha) > 4000
    assert (two_sided(alpha, beta) == exact(alpha, beta)).all()


def test_zero_area_triangle_is_a_segment_to_the_other_one():
    segment = [[0.2, 0.2, -1.0], [0.2, 0.2, 1.0], [0.2, 0.2, 0.5]]
    assert paper([FACE], [segment])[0]
    assert not paper([segment], [FACE])[0]
    assert two_sided([FACE], [segment])[0]
    assert two_sided([segment], [FACE])[0]
    assert not two_sided([segment], [segment])[0]  # the documented blind spot
    assert exact([segment], [segment])[0]


def has_area(triangle):
    p, q, r = triangle.tolist()
    return any(
        orientation_2d((p[i], p[j]), (q[i], q[j]), (r[i], r[j])) != 0
        for i, j in ((0, 1), (1, 2), (2, 0))
    )


def test_numbers_of_the_narrowphases():
    expected = {"paper:robot": 0, "paper:scanner": 1, "two-sided": 2, "exact": 3}
    assert expected == NARROWPHASES


@pytest.mark.parametrize("test", [paper, two_sided])
def test_refuses_what_it_cannot_judge(test):
    with pytest.raises(GeometryError, match="shapes"):
        test(np.zeros((3, 9)), np.zeros((3, 9)))
    with pytest.raises(GeometryError, match="triangle 0 of alpha is not finite"):
        test([[[np.inf, 0, 0], [1, 0, 0], [0, 1, 0]]], [FACE])
