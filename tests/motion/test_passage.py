"""Slabs about the corridor's line, and the patient before its entry."""

import itertools

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.passage import RESERVE, Approach, Slabs, cut_off
from borecheck.motion.problem import Body
from borecheck.plans.corridor import SLACK, Corridor

RADIUS = 0.00055
LENGTH = 0.05
CORRIDOR = Corridor(np.zeros(3), np.array([0.0, 0.0, -LENGTH]), RADIUS)
# rounding of sizes around 1
ROUNDING = 1e-12


def patient(*boxes):
    """Boxes as one mesh; by default a block whose skin is z = 0."""
    parts = boxes or (block(),)
    starts = np.cumsum([0, *(len(p.vertices) for p in parts)])
    vertices = np.concatenate([p.vertices for p in parts])
    triangles = [p.triangles + s for p, s in zip(parts, starts[:-1], strict=True)]
    return Body("body", TriangleMesh("body", vertices, np.concatenate(triangles)))


def block(low=(-0.2, -0.2, -0.2), high=(0.2, 0.2, 0.0)):
    low, high = np.array(low), np.array(high)
    return box("block", high - low).moved(transform((low + high) / 2))


def slabs(*rows, tail=-0.1):
    low, high, aside = np.array(rows).T
    return Slabs(low, high, aside, tail)


def area(corners):
    sides = corners[:, 1:] - corners[:, :1]
    return float(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2)


def test_cutting_off_leaves_two_parts_of_the_whole(rng):
    corners = rng.uniform(-1.0, 1.0, (300, 3, 3))
    depth = corners @ np.array([0.6, 0.0, 0.8])
    below, above = cut_off(corners, depth, 0.1), cut_off(corners, -depth, -0.1)
    crossing = (depth.min(axis=1) < 0.1) & (depth.max(axis=1) > 0.1)
    assert crossing.sum() > 100
    assert (below @ np.array([0.6, 0.0, 0.8])).max() < 0.1 + ROUNDING
    assert area(below) + area(above) == pytest.approx(area(corners), rel=ROUNDING)


def test_nothing_is_left_behind_a_cut():
    corners = block().corners
    assert len(cut_off(corners, np.full((len(corners), 3), 0.2), 0.1)) == 0
    whole = cut_off(corners, np.full((len(corners), 3), 0.1), 0.1)
    assert np.array_equal(whole, corners)


def test_slabs_hold_what_they_are_made_of(rng):
    depth, aside = rng.uniform(0.0, 1.0, (2, 2, 40, 3))
    made = Slabs.of(depth, aside, 0.01)
    assert (made.low <= depth.min(axis=(0, 2)) - 0.01).all()
    assert (made.high >= depth.max(axis=(0, 2)) + 0.01).all()
    assert (made.aside >= aside.max(axis=(0, 2)) + 0.01).all()
    first = made.before(0.2)
    assert 0 < len(first.low) < 40
    assert first.high.max() == 0.2
    assert (first.low < 0.2).all()


def test_in_the_corridor_the_patient_may_be_touched():
    approach = Approach(patient(), CORRIDOR)
    assert approach.allows(slabs((-0.1, LENGTH, RADIUS)))
    for wrong in (
        (-0.1, LENGTH + SLACK + RESERVE, RADIUS),
        (-0.1, LENGTH, RADIUS + SLACK + RESERVE),
    ):
        assert not approach.allows(slabs(wrong))
    outermost = slabs((-0.1, LENGTH + SLACK, RADIUS + SLACK))
    assert approach.allows(outermost)


def test_a_tail_in_the_skin_is_not_allowed():
    approach = Approach(patient(), CORRIDOR)
    inside = (-0.0019, LENGTH, RADIUS)
    assert not approach.allows(slabs(inside, tail=-0.001))
    assert approach.allows(slabs((-0.0021, LENGTH, RADIUS), tail=-0.0021))


@pytest.mark.parametrize("gap", [1e-6, -1e-6])
def test_a_fold_beside_the_line_is_seen_to_a_micrometre(gap):
    fold = block((RADIUS + gap, -0.05, 0.01), (0.1, 0.05, 0.02))
    approach = Approach(patient(block(), fold), CORRIDOR)
    assert approach.allows(slabs((-0.1, LENGTH, RADIUS))) == (gap > 0)


@pytest.mark.parametrize("gap", [1e-6, -1e-6])
def test_skin_may_come_up_to_the_near_end(gap):
    """Half a millimetre beside the line the skin rises to the corridor's end."""
    rise = block((-0.1, -0.1, -0.1), (0.1, 0.1, SLACK - gap))
    approach = Approach(patient(rise), CORRIDOR)
    assert approach.allows(slabs((-0.1, LENGTH, RADIUS))) == (gap > 0)


def test_a_slanted_skin_is_cut_off_not_rounded_up():
    """At 70 degrees the end of a rounded slab would reach 0.2 mm into the skin."""
    angle = np.radians(70.0)
    down = np.array([np.sin(angle), 0.0, -np.cos(angle)])
    slanted = Corridor(np.zeros(3), LENGTH * down, RADIUS)
    wide = 0.0007
    near = Approach(patient(), slanted)
    assert near.allows(slabs((-0.1, LENGTH, wide)))
    assert SLACK * np.cos(angle) < wide


def test_a_hub_is_as_wide_as_it_is_only_where_it_is():
    """A fold 3 mm beside the line lets the needle pass, and not its hub."""
    fold = block((0.003, -0.05, 0.0), (0.1, 0.05, 0.02))
    approach = Approach(patient(block(), fold), CORRIDOR)
    needle, hub = (-0.1, LENGTH, RADIUS), (-0.12, -0.03, 0.005)
    assert approach.allows(slabs(needle, hub))
    assert not approach.allows(slabs(needle, (-0.12, -0.02, 0.005)))
    assert not approach.allows(slabs((-0.12, LENGTH, 0.005)))
    many = [(-0.12 + 1e-4 * k, -0.119 + 1e-4 * k, RADIUS) for k in range(200)]
    assert approach.allows(slabs(needle, hub, *many))


def test_parts_far_from_each_other_are_joined_by_the_line():
    """A sheet across the line between two slabs: one point does not speak for both."""
    sheet = block((-0.05, -0.05, 0.049), (0.05, 0.05, 0.05))
    approach = Approach(patient(block(), sheet), CORRIDOR)
    assert not approach.allows(slabs((-0.1, -0.06, RADIUS), (-0.04, 0.0, RADIUS)))


def test_what_the_patient_holds_is_not_free():
    cover = patient(block((-0.3, -0.3, -0.3), (0.3, 0.3, 0.3)))
    assert not Approach(cover, CORRIDOR).allows(slabs((-0.1, LENGTH, RADIUS)))


def test_an_open_patient_has_no_outside_within_its_box():
    skin, tower = block(), block((0.15, 0.15, 0.01), (0.2, 0.2, 0.5))
    needle = slabs((-0.1, LENGTH, RADIUS))
    for parts, inside_box in (((skin,), False), ((skin, tower), True)):
        closed = patient(*parts)
        mesh = closed.mesh
        opened = TriangleMesh("skin", mesh.vertices, mesh.triangles[:-1])
        assert Approach(closed, CORRIDOR).allows(needle)
        assert Approach(Body("skin", opened), CORRIDOR).allows(needle) != inside_box


def watch_stretches(monkeypatch, apart=True):
    """The stretches of the line that are looked at, and how wide."""
    asked = []
    monkeypatch.setattr(Approach, "_is_outside", lambda self, depth: True)
    monkeypatch.setattr(
        Approach, "_is_apart", lambda self, *given: asked.append(given) or apart
    )
    return asked


@pytest.mark.parametrize(("count", "expected"), [(1, 1), (64, 64), (65, 64), (200, 64)])
def test_a_needle_of_many_slabs_is_looked_at_in_a_few(monkeypatch, count, expected):
    asked = watch_stretches(monkeypatch)
    rows = [(-1.0 + k / count, -1.0 + (k + 1) / count, 0.01) for k in range(count)]
    assert Approach(patient(), CORRIDOR).is_free(slabs(*rows))
    assert len(asked) == expected
    assert (asked[0][0], asked[-1][1]) == (-1.0, 0.0)
    assert all(b[0] == a[1] for a, b in itertools.pairwise(asked))


def test_each_stretch_is_as_wide_as_the_widest_slab_there(monkeypatch):
    asked = watch_stretches(monkeypatch)
    rows = ((-1.0, -0.5, 0.25), (-0.75, -0.25, 0.5), (-0.125, 0.0, 0.125))
    assert Approach(patient(), CORRIDOR).is_free(slabs(*rows))
    assert asked == [
        *((-1.0, -0.75, 0.25), (-0.75, -0.5, 0.5), (-0.5, -0.25, 0.5)),
        *((-0.25, -0.125, RESERVE), (-0.125, 0.0, 0.125)),
    ]
    asked = watch_stretches(monkeypatch, apart=False)
    assert not Approach(patient(), CORRIDOR).is_free(slabs(*rows))
    assert len(asked) == 1
    monkeypatch.setattr(Approach, "_is_outside", lambda self, depth: depth != -1.0)
    assert not Approach(patient(), CORRIDOR).is_free(slabs(*rows[::-1]))
    assert len(asked) == 1


def test_a_fold_as_far_from_the_line_as_the_slab_is_wide_meets_it():
    """Exactly so: a face at 1/4 of a metre beside the line, before the entry."""
    fold = Approach(patient(block((0.25, -0.5, 0.5), (0.75, 0.5, 1.0))), CORRIDOR)
    nearest = 0.25
    assert not fold._is_apart(-0.875, -0.75, nearest)
    assert not fold._is_apart(-0.875, -0.75, nearest + 1e-9)
    assert fold._is_apart(-0.875, -0.75, nearest - 1e-9)
    # beyond its ends nothing of it is met, however wide
    for low, high in ((-0.25, -0.125), (-2.0, -1.125)):
        assert fold._is_apart(low, high, 9.0)
    for low, high in ((-0.5, -0.25), (-2.0, -1.0)):
        assert not fold._is_apart(low, high, nearest)
