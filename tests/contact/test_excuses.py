"""How far a checker's excuse reaches: Coal's tolerance, rounding, flatness, by hand."""

import numpy as np
import pytest

from borecheck.contact.causes import cause_of, signed_determinants

PLATE = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
# Coal's iteration ends at 1e-9 m or so; twice that is the last that it excuses.
REACH = 2e-9


def above(gap):
    """A triangle parallel to the plate."""
    return PLATE * 0.5 + [0.0, 0.0, gap]


@pytest.mark.parametrize(
    ("gap", "excuse"),
    [
        (0.9 * REACH, "Coal tolerance"),
        (1.1 * REACH, None),
        (4.0 * REACH, None),
        (1e-10, "Coal tolerance"),
    ],
)
@pytest.mark.parametrize("swap", [False, True])
def test_coal_may_be_two_nanometres_early(gap, excuse, swap):
    first, second = (PLATE, above(gap)) if swap else (above(gap), PLATE)
    said = {"exact": False, "coal": True, "two-sided": False}
    assert cause_of(first, second, said) == (False, excuse)


# in general position, its lowest corner over the plate
SKEW = np.array([[-0.3, -0.35, 0.0], [0.41, -0.2, 0.13], [0.05, 0.37, 0.21]])


def test_what_others_see_where_nothing_is_is_rounding_or_nothing():
    """Corners a hair over the plate, and 1e-3 over it."""
    for gap, excuse in ((1e-17, "rounding"), (1e-3, None)):
        said = {"exact": False, "two-sided": True}
        assert cause_of(SKEW + [0, 0, gap], PLATE, said) == (False, excuse)
    both = {"exact": False, "two-sided": True, "coal": True}
    assert cause_of(above(1e-17), PLATE, both)[1] == "Coal tolerance, rounding"
    # a nanometre: Coal is excused, the other is not
    assert cause_of(SKEW + [0, 0, 1e-9], PLATE, both) == (False, None)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_rounding_goes_with_the_size(scale):
    """A determinant of a few units in the last place of the sizes' third power."""
    said = {"exact": False, "two-sided": True}
    for gap, excuse in ((2.0**-50, "rounding"), (1e-10, None)):
        first = scale * (SKEW + [0.0, 0.0, gap])
        assert cause_of(first, scale * PLATE, said)[1] == excuse


def test_far_from_the_origin_rounding_is_larger():
    said = {"exact": False, "two-sided": True}
    near, far = np.zeros(3), np.array([1000.0, 0.0, 0.0])
    above_it = SKEW + [0.0, 0.0, 2.0**-40]
    assert cause_of(above_it + near, PLATE + near, said)[1] is None
    assert cause_of(above_it + far, PLATE + far, said)[1] == "rounding"


def test_flat_triangles_on_either_side():
    segment = np.array([[0.0, 0, -0.5], [0, 0, 0.5], [0, 0, 0.25]])
    point = np.zeros((3, 3))
    slanted = np.array([[-0.3, 0.1, -0.5], [0.3, -0.1, 0.5], [0.0, 0.0, 0.0]])
    said = {"exact": True, "two-sided": False}
    for flat in (segment, point, slanted, segment[:, [2, 0, 1]] * [1, 1, 0.5]):
        assert cause_of(flat, PLATE, said) == (True, "zero-area")
        assert cause_of(PLATE, flat, said) == (True, "zero-area")
    # a thin one has an area
    thin = segment + [[0.0, 0, 0], [0, 0, 0], [1e-9, 0, 0]]
    assert cause_of(thin, PLATE, said)[1] != "zero-area"


@pytest.mark.parametrize("turn", [0, 1, 2])
@pytest.mark.parametrize("turned_over", [False, True])
def test_who_is_blind_does_not_depend_on_the_order_of_corners(turn, turned_over):
    """The spike's edges cross the plate; the plate's edges do not cross the spike."""
    spike = np.array([[0, 0, -0.01], [0.0005, 0, 0.1], [-0.0005, 0.0002, 0.1]])
    plate = np.roll(PLATE, turn, axis=0)[:: -1 if turned_over else 1]
    spike = np.roll(spike, turn, axis=0)
    said = {"exact": True, "paper:robot": False, "paper:scanner": True}
    assert cause_of(spike, plate, said) == (True, "one-sided test")
    swapped = {"exact": True, "paper:robot": True, "paper:scanner": False}
    assert cause_of(plate, spike, swapped) == (True, "one-sided test")
    # who looks from the side that sees the crossing has no such excuse
    assert cause_of(plate, spike, said) == (True, None)
    assert cause_of(spike, plate, swapped) == (True, None)


def test_a_blind_one_and_one_without_excuse_have_none_together():
    spike = np.array([[0.01, 0.02, -0.01], [0.0105, 0.021, 0.1], [0.009, 0.025, 0.1]])
    said = {"exact": True, "paper:robot": False, "two-sided": False}
    assert cause_of(spike, PLATE, said) == (True, None)


def test_coplanar_is_all_three_corners_in_the_plane():
    said = {"exact": True, "two-sided": False}
    for lifted in range(3):
        beside = PLATE * 0.5
        assert cause_of(beside, PLATE, said) == (True, "coplanar")
        beside[lifted, 2] = 0.25
        assert cause_of(beside, PLATE, said) == (True, "touching")


def test_determinants_are_six_times_the_volume():
    named = signed_determinants(above(0.5), PLATE)
    area = 2.0  # of the plate
    for i in (1, 2, 3):
        assert named[f"f_beta(alpha{i})"] == pytest.approx(2.0 * area * 0.5)
        assert named[f"f_alpha(beta{i})"] == pytest.approx(-2.0 * area / 4.0 * 0.5)
    one = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    other = np.array([[2.0, 3, 4], [5, 7, 11], [13, 17, -19]])
    expected = other[:, 2]  # heights over z = 0 times twice the area of the first
    found = signed_determinants(one, other)
    for i in (1, 2, 3):
        assert found[f"f_alpha(beta{i})"] == expected[i - 1]
