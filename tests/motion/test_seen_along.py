"""How near triangles come to a line, what is cut off, when a needle is outside."""

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.passage import Approach, Slabs, cut_off, distances_across
from borecheck.motion.problem import Body
from borecheck.plans.corridor import Corridor

ROUNDING = 1e-12


def test_distances_across_are_those_of_dense_points(rng):
    """Corners are (depth, y, z); what is through the line is 0."""
    corners = rng.uniform(-1.0, 1.0, (120, 3, 3))
    corners[:, :, 1] += rng.uniform(-1.2, 1.2, (120, 1))
    weights = np.vstack([rng.dirichlet(np.full(3, 0.4), 4000), np.eye(3)])
    seen = np.einsum("kw,mwx->mkx", weights, corners)[:, :, 1:]
    sampled = np.linalg.norm(seen, axis=2).min(axis=1)
    told = distances_across(corners)
    assert (told <= sampled + ROUNDING).all()
    assert (told >= sampled - 0.06).all()
    assert 5 < (told == 0.0).sum() < 110
    together = [float(distances_across(c[None])[0]) for c in corners]
    np.testing.assert_array_equal(told, together)


def test_distances_across_by_hand():
    rows = [
        ([[0, 3, 4], [0, 6, 8], [0, 9, 12]], 5.0),  # seen edge on, towards the line
        ([[0, 3, -1], [1, 3, 1], [2, 3, 0]], 3.0),  # edge on, across
        ([[0, -1, -1], [5, 1, -1], [9, 0, 2]], 0.0),
        ([[0, -1, -1], [9, 0, 2], [5, 1, -1]], 0.0),
        ([[0, -1, 2], [0, 1, 2], [0, 0, 5]], 2.0),
        ([[0, 1, 1], [0, 1, 1], [0, 1, 1]], np.sqrt(2.0)),
    ]
    corners = np.array([row for row, _ in rows], dtype=float)
    np.testing.assert_allclose(distances_across(corners), [d for _, d in rows])


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]])
def test_cut_off_keeps_what_is_up_to_the_limit(order):
    """A right triangle with depth 0, 0, 1: areas by hand, whatever the order."""
    triangle = np.array([[0.0, 0, 0], [2.0, 0, 0], [0, 0, 1.0]])[order]

    def kept(limit, sign):
        parts = cut_off(triangle[None], sign * triangle[None, :, 2], limit)
        sides = parts[:, 1:] - parts[:, :1]
        return np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2

    assert kept(0.5, 1.0) == pytest.approx(0.75)
    assert kept(0.25, 1.0) == pytest.approx(1.0 - 0.75**2)
    assert kept(-0.5, -1.0) == pytest.approx(0.25)
    assert kept(1.0, 1.0) == pytest.approx(1.0)
    assert kept(0.0, -1.0) == pytest.approx(1.0)
    assert kept(-0.1, 1.0) == 0.0
    assert kept(-1.1, -1.0) == 0.0


def test_slabs_by_hand():
    """Two instants of two triangles."""
    depth = np.array([[[0.0, 1, 2], [5, 6, 7]], [[-1.0, 1, 2], [5, 8, 7]]])
    aside = np.array([[[1.0, 2, 1], [3, 3, 3]], [[1.0, 1, 4], [3, 5, 3]]])
    made = Slabs.of(depth, aside, 0.5)
    assert made.low.tolist() == [-1.5, 4.5]
    assert made.high.tolist() == [2.5, 8.5]
    assert made.aside.tolist() == [4.5, 5.5]
    assert made.tail == 0.5  # the least of the largest depths of a corner
    before = made.before(2.0)
    assert before.low.tolist() == [-1.5]
    assert before.high.tolist() == [2.0]
    assert before.aside.tolist() == [4.5]
    assert before.tail == made.tail
    assert made.before(4.5).low.tolist() == [-1.5]
    assert made.before(9.0).high.tolist() == [2.5, 8.5]


CORRIDOR = Corridor(np.zeros(3), np.array([0.0, 0.0, -0.05]), 0.0005)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_line_beside_the_patients_box_is_outside(axis, side):
    """On each side of a body that is open, so that its box alone can tell."""
    shift = np.zeros(3)
    shift[axis] = side * 0.4
    whole = box("body", (0.6, 0.6, 0.6)).moved(transform(shift + [0, 0, 0.4]))
    opened = TriangleMesh("body", whole.vertices, whole.triangles[:-1])
    for moved, outside in ((0.0, False), (-0.1, False), (0.2, True)):
        place = np.zeros(3)
        place[axis] = side * moved  # farther away, or nearer
        body = Body("body", opened.moved(transform(place)))
        assert Approach(body, CORRIDOR)._is_outside(-0.4) == (
            outside or abs(0.4 + moved) > 0.3
        )
    above = Body("body", opened.moved(transform(-shift)))
    assert not Approach(above, CORRIDOR)._is_outside(-0.4)
    assert Approach(above, CORRIDOR)._is_outside(-0.71)
    assert Approach(above, CORRIDOR)._is_outside(-0.09)
