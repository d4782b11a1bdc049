from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest

from borecheck.contact.causes import cause_of, orientation, signed_determinants
from borecheck.geometry.triangles.exact import exact
from borecheck.geometry.triangles.published import paper
from borecheck.geometry.triangles.two_sided import two_sided

# The smallest example of [Matsuno2020]'s one-sided test: a spike through a large plate.
SPIKE = np.array([[0, 0, -0.01], [0.0005, 0, 0.1], [-0.0005, 0, 0.1]])
PLATE = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])


def verdicts_of(first, second):
    a, b = first[None], second[None]
    return {
        "exact": bool(exact(a, b)[0]),
        "paper:robot": bool(paper(a, b)[0]),
        "paper:scanner": bool(paper(b, a)[0]),
        "two-sided": bool(two_sided(a, b)[0]),
    }


def test_the_spike_through_a_plate_is_one_sided():
    verdicts = verdicts_of(SPIKE, PLATE)
    assert verdicts["exact"]
    assert not verdicts["paper:robot"]
    assert cause_of(SPIKE, PLATE, verdicts) == (True, "one-sided test")


def test_coplanar_overlap():
    verdicts = verdicts_of(PLATE, PLATE + [0.5, 0, 0])
    assert cause_of(PLATE, PLATE + [0.5, 0, 0], verdicts) == (True, "coplanar")


def test_a_corner_on_the_plate_is_touching():
    standing = np.array([[0, 0, 0.0], [0.1, 0, 0.5], [-0.1, 0, 0.5]])
    assert cause_of(standing, PLATE, verdicts_of(standing, PLATE)) == (True, "touching")


def test_a_triangle_without_area():
    segment = np.array([[0, 0, -0.5], [0, 0, 0.5], [0, 0, 0.25]])
    verdicts = verdicts_of(segment, PLATE)
    assert verdicts["exact"]
    assert cause_of(segment, PLATE, verdicts) == (True, "zero-area")


def test_a_gap_that_coal_reports_is_its_tolerance():
    near = SPIKE + [0, 0, 0.01 + 5e-10]
    verdicts = {**verdicts_of(near, PLATE), "coal": True}
    assert not verdicts["exact"]
    assert cause_of(near, PLATE, verdicts) == (False, "Coal tolerance")


def test_a_wide_gap_that_coal_reports_has_no_excuse():
    far = SPIKE + [0, 0, 0.02]
    verdicts = {**verdicts_of(far, PLATE), "coal": True}
    assert cause_of(far, PLATE, verdicts) == (False, None)


def test_a_plain_contact_that_two_sided_misses_has_no_excuse():
    # in general position no determinant is 0
    aside = SPIKE + [[0.01, 0.02, 0.0], [0.011, 0.021, 0.0], [0.012, 0.025, 0.01]]
    verdicts = dict.fromkeys(verdicts_of(aside, PLATE), True)
    verdicts["two-sided"] = False
    assert cause_of(aside, PLATE, verdicts) == (True, None)


def test_signs_lost_to_rounding_are_named_so(rng):
    """A corner a hair from a plane: the sign of a value that float64 cannot hold."""
    found = set()
    for _ in range(3000):
        a = rng.normal(size=(3, 3))
        weights = rng.dirichlet(np.ones(3))
        point = weights @ a
        away = np.cross(a[1] - a[0], a[2] - a[0])
        b = np.array([point, point + away + rng.normal(size=3) / 9, point + away])
        verdicts = verdicts_of(a, b)
        if verdicts["two-sided"] != verdicts["exact"]:
            found.add(cause_of(a, b, verdicts)[1])
    assert found
    assert all("rounding" in (cause or "") for cause in found)


def leibniz(rows):
    """A determinant by its definition, over all permutations."""
    total = Fraction(0)
    for order in permutations(range(3)):
        swaps = sum(order[i] > order[j] for i in range(3) for j in range(i + 1, 3))
        total += (
            (-1) ** swaps * rows[0][order[0]] * rows[1][order[1]] * rows[2][order[2]]
        )
    return total


def test_orientation_is_the_determinant_of_three_edges(rng):
    for _ in range(20):
        p, *others = [tuple(map(Fraction, x)) for x in rng.normal(size=(4, 3))]
        edges = [[x - y for x, y in zip(q, p, strict=True)] for q in others]
        assert orientation(p, *others) == leibniz(edges) != 0


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("turned", [False, True])
def test_a_cause_rests_neither_on_size_nor_on_the_order_of_corners(size, turned):
    order = [0, 2, 1] if turned else [0, 1, 2]
    first, second = size * SPIKE, size * PLATE[order]
    verdicts = verdicts_of(first, second)
    assert cause_of(first, second, verdicts) == (True, "one-sided test")
    swapped = {
        **verdicts,
        "paper:robot": verdicts["paper:scanner"],
        "paper:scanner": verdicts["paper:robot"],
    }
    assert cause_of(second, first, swapped) == (True, "one-sided test")


def test_orientation_is_exact():
    tiny = Fraction(1, 10**40)
    p, q, r = ((Fraction(0),) * 3, (Fraction(1), 0, 0), (Fraction(0), 1, 0))
    assert orientation(p, q, r, (Fraction(0), Fraction(0), tiny)) == tiny


def test_signed_determinants_show_who_crosses_whom():
    named = signed_determinants(SPIKE, PLATE)
    heights = [named[f"f_beta(alpha{i})"] for i in (1, 2, 3)]
    assert heights[0] < 0 < heights[1] == heights[2]


@pytest.mark.parametrize("swap", [False, True])
def test_no_disagreement_has_no_cause(swap):
    first, second = (PLATE, SPIKE) if swap else (SPIKE, PLATE)
    verdicts = dict.fromkeys(verdicts_of(first, second), True)
    assert cause_of(first, second, verdicts) == (True, None)
