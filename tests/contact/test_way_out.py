"""The way out of a contact: known from boxes, and really apart where it ends."""

import numpy as np
import pytest

from borecheck.contact.way_out import LONGEST, STEP, Placed, way_out
from borecheck.core.se3 import rpy_matrix, transform
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.surfaces import surface
from borecheck.report.way_words import LONGEST_MM, way_out_words


def placed(size, at=(0.0, 0.0, 0.0), R=None):
    T = transform(at)
    T[:3, :3] = np.eye(3) if R is None else R
    return Placed(box("box", size), T)


def corners_met(first, second):
    """Triangles of both that meet, (n, 2, 3, 3)."""
    a, b = surface(first.mesh).tree, surface(second.mesh).tree
    pairs = a.contacts(b, first.T, second.T)
    meshes = [(x.mesh.corners @ x.T[:3, :3].T + x.T[:3, 3]) for x in (first, second)]
    return np.stack([meshes[k][pairs[:, k]] for k in range(2)], axis=1)


def test_of_boxes_it_is_the_least_overlap_of_an_axis(rng):
    """Separating axes: boxes along the axes part by the least overlap, and no less."""
    for _ in range(25):
        sizes = rng.uniform(0.02, 0.06, (2, 3))
        second = placed(sizes[1])
        at = rng.uniform(-0.5, 0.5, 3) * sizes.sum(axis=0)
        first = placed(sizes[0], at)
        corners = corners_met(first, second)
        if not len(corners):  # one holds the other
            continue
        overlap = 0.5 * sizes.sum(axis=0) - np.abs(at)
        shift = way_out(first, second, corners)
        assert np.linalg.norm(shift) == pytest.approx(overlap.min(), abs=1.01 * STEP)
        assert np.linalg.norm(shift) > overlap.min()
        # opened by another test of boxes: apart along the axis it goes along
        k = int(np.abs(shift).argmax())
        assert abs(at[k] + shift[k]) > 0.5 * sizes[:, k].sum()


def test_a_turned_box_leaves_along_the_face_it_is_in():
    R = rpy_matrix(0.3, -0.4, 0.5)
    wall = placed((0.4, 0.4, 0.4), R=R)
    first = placed((0.02, 0.02, 0.02), R @ [0.0, 0.0, 0.207], R)
    shift = way_out(first, wall, corners_met(first, wall))
    # 3 mm deep, along the face's normal; steps along the axes round it a little
    assert 0.003 < np.linalg.norm(shift) < 0.0032
    assert shift @ R[:, 2] > 0.003


def test_it_does_not_go_into_the_other():
    """Inwards the surfaces would part sooner, and the one be inside the other."""
    wall = placed((1.0, 1.0, 1.0))
    first = placed((0.02, 0.02, 0.02), (0.0, 0.0, 0.493))
    shift = way_out(first, wall, corners_met(first, wall))
    assert shift == pytest.approx((0.0, 0.0, 0.0171), abs=1e-4)


@pytest.mark.parametrize("margin", [0.0, 0.004])
def test_a_margin_is_kept_there(margin):
    wall, first = placed((1.0, 1.0, 1.0)), placed((0.1, 0.1, 0.1), (0.0, 0.0, 0.545))
    shift = way_out(first, wall, corners_met(first, wall), margin)
    assert shift == pytest.approx((0.0, 0.0, 0.0051 + margin), abs=1e-9)


def test_where_none_is_short_enough_none_is_told():
    wall, first = placed((1.0, 1.0, 1.0)), placed((0.2, 0.2, 1.2))
    assert way_out(first, wall, corners_met(first, wall)) is None
    assert 1e3 * LONGEST == LONGEST_MM
    assert way_out_words({"way_out_m": None}) == "none found within 50 mm"
    assert way_out_words({"way_out_m": [0.003, 0.0, -0.004]}) == (
        "5.0 by (3.0, 0.0, -4.0)"
    )
    assert way_out_words({"way_out_m": [0.003, 0.0, -0.0041]}).startswith("5.1 by")
    assert way_out_words({}) == ""
