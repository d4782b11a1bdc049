"""Bounds hold the true distance, at any size, place and tolerance."""

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.errors import GeometryError
from borecheck.geometry.tree.clearance import farther, pair_error
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.triangles.distance import pair_distance
from borecheck.geometry.triangles.placing import place_vertices

EYE = np.eye(4)
# Errors of the plain distance and of the bounds together, relative to the size of
# what is measured: some hundred units in the last place.
ROUNDING = 1e-13


def random_transform(rng, shift=1.0):
    return transform(rng.uniform(-shift, shift, 3), rng.uniform(-np.pi, np.pi, 3))


def soup(rng, count, size=0.1, spread=1.0):
    centres = rng.uniform(-spread, spread, (count, 1, 3))
    scale = size * 10.0 ** rng.uniform(-2.0, 0.5, (count, 1, 1))
    corners = centres + scale * rng.normal(size=(count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def rows(T, vertices, triangles):
    return place_vertices(T, np.ascontiguousarray(vertices))[triangles].reshape(-1, 9)


def plain_distances(mesh_a, T_a, mesh_b, T_b):
    """Distance of every pair, (n, m)."""
    a, b = rows(T_a, *mesh_a), rows(T_b, *mesh_b)
    return np.array([[pair_distance(tuple(p), tuple(q))[0] for q in b] for p in a])


def apart(rng, scale=1.0, offset=0.0, count=25):
    """Two soups that mostly do not touch, and their placements."""
    a, ids = soup(rng, count, 0.03)
    b, _ = soup(rng, count, 0.03)
    T_a, T_b = random_transform(rng, 1.5 * scale), random_transform(rng, 0.5 * scale)
    shift = offset * np.array([1.0, -0.6, 0.3])
    return (scale * (a + shift), ids), T_a, (scale * (b + shift), ids), T_b


@pytest.mark.parametrize("tolerance", [0.0, 0.01, 0.1, 0.5, 3.0])
def test_bounds_hold_the_distance_and_keep_the_tolerance(tolerance):
    rng = np.random.default_rng(11)
    separated, poses = 0, 25
    for _ in range(poses):
        a, T_a, b, T_b = apart(rng)
        distance = plain_distances(a, T_a, b, T_b).min()
        lower, upper = MeshTree(*a).clearance(MeshTree(*b), T_a, T_b, tolerance)
        assert lower <= distance * (1 + ROUNDING) + ROUNDING
        assert distance <= upper * (1 + ROUNDING)
        assert upper <= (1.0 + tolerance) * lower + ROUNDING
        separated += distance > 0.0
        if distance == 0.0:
            assert (lower, upper) == (0.0, 0.0)
    assert poses // 2 <= separated


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize("offset", [0.0, 1e4])
def test_bounds_hold_at_any_size_and_far_from_the_origin(scale, offset):
    rng = np.random.default_rng(12)
    for _ in range(8):
        a, T_a, b, T_b = apart(rng, scale, offset)
        if offset:  # bring both to one place in the world
            centre = T_a[:3, :3] @ a[0][0] + T_a[:3, 3]
            T_b[:3, 3] += centre - (T_b[:3, :3] @ b[0][0] + T_b[:3, 3])
        distance = plain_distances(a, T_a, b, T_b).min()
        for tolerance in (0.0, 0.1):
            lower, upper = MeshTree(*a).clearance(MeshTree(*b), T_a, T_b, tolerance)
            room = ROUNDING * scale
            assert lower - room <= distance <= upper + room
            assert upper <= (1.0 + tolerance) * lower + room


def test_contact_by_the_exact_predicate_is_zero_and_zero_only_then():
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    one = np.arange(3)[None]
    shift = np.array([0.25, 0.25, 0.0])
    below, touching = MeshTree(flat, one), MeshTree(flat + shift, one)
    assert below.clearance(touching, EYE, EYE) == (0.0, 0.0)
    for gap in (1e-300, 1e-15, 1e-9, 1e-3):
        above = MeshTree(flat + np.array([0.25, 0.25, gap]), one)
        lower, upper = below.clearance(above, EYE, EYE)
        assert lower <= gap <= upper
        assert upper > 0.0
        assert upper - lower <= ROUNDING


def test_closest_points_lie_on_their_triangles_and_are_that_far_apart():
    rng = np.random.default_rng(13)
    for _ in range(15):
        a, T_a, b, T_b = apart(rng)
        distances = plain_distances(a, T_a, b, T_b)
        nearest = MeshTree(*a).closest(MeshTree(*b), T_a, T_b)
        assert nearest.distance == pytest.approx(distances.min(), abs=ROUNDING)
        pair = nearest.triangle_self, nearest.triangle_other
        assert distances[pair] == pytest.approx(distances.min(), abs=ROUNDING)
        if distances.min() > 0.0:
            between = np.linalg.norm(nearest.point_self - nearest.point_other)
            assert between == pytest.approx(nearest.distance, abs=ROUNDING)
        for T, mesh, triangle, point in (
            (T_a, a, nearest.triangle_self, nearest.point_self),
            (T_b, b, nearest.triangle_other, nearest.point_other),
        ):
            corners = rows(T, *mesh)[triangle]
            speck = tuple(np.tile(point, 3))
            assert pair_distance(tuple(corners), speck)[0] < 1e-12


def test_closest_of_touching_meshes_names_a_pair_in_contact():
    rng = np.random.default_rng(14)
    a, b = soup(rng, 60, 0.3), soup(rng, 60, 0.3)
    tree_a, tree_b = MeshTree(*a), MeshTree(*b)
    nearest = tree_a.closest(tree_b, EYE, EYE)
    assert nearest.distance == 0.0
    pairs = tree_a.contacts(tree_b, EYE, EYE)
    assert [nearest.triangle_self, nearest.triangle_other] in pairs.tolist()


def test_within_decides_both_ways_around_the_margin():
    rng = np.random.default_rng(15)
    verdicts = set()
    for _ in range(20):
        a, T_a, b, T_b = apart(rng)
        tree_a, tree_b = MeshTree(*a), MeshTree(*b)
        distance = plain_distances(a, T_a, b, T_b).min()
        for factor in (0.0, 0.5, 1.0 - 1e-9, 1.0 + 1e-9, 2.0):
            margin = factor * distance
            answer = tree_a.within(tree_b, T_a, T_b, margin)
            verdicts.add(answer.verdict)
            assert answer.lower <= distance * (1 + ROUNDING)
            assert distance <= answer.upper * (1 + ROUNDING)
            if distance == 0.0 or factor > 1.0:
                assert answer.verdict == "contact"
                assert answer.upper <= margin
            else:
                assert answer.verdict == "clear"
                assert answer.lower > margin or margin == 0.0
    assert verdicts == {"clear", "contact"}


def test_within_says_so_when_the_numbers_allow_both():
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    one = np.arange(3)[None]
    a, b = MeshTree(flat, one), MeshTree(flat + np.array([0.25, 0.25, 0.1]), one)
    assert a.within(b, EYE, EYE, 0.1).verdict == "undecided"
    assert a.within(b, EYE, EYE, 0.1 - 1e-12).verdict == "clear"
    assert a.within(b, EYE, EYE, 0.1 + 1e-12).verdict == "contact"


def test_the_quick_rejection_never_drops_a_nearer_pair():
    rng = np.random.default_rng(16)
    dropped, pairs = 0, 4000
    for _ in range(pairs):
        a = rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-3, 1, 3)
        b = rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-3, 1, 3)
        b += rng.normal(size=3) * 10.0 ** rng.uniform(-2, 2)
        a, b = tuple(a.reshape(-1)), tuple(b.reshape(-1))
        distance = pair_distance(a, b)[0]
        error = pair_error(a, b)
        assert not farther(a, b, distance + 2.0 * error)
        dropped += farther(a, b, 0.5 * distance)
    assert dropped > pairs // 2


def test_tolerances_and_margins_without_meaning_are_refused():
    tree = MeshTree(np.eye(3), [[0, 1, 2]])
    for bad in (-0.1, np.nan, np.inf):
        with pytest.raises(GeometryError, match="relative_tolerance"):
            tree.clearance(tree, EYE, EYE, bad)
        with pytest.raises(GeometryError, match="margin"):
            tree.within(tree, EYE, EYE, bad)
    for call in (tree.clearance, tree.closest, lambda *x: tree.within(*x, 0.1)):
        with pytest.raises(GeometryError, match="T_self"):
            call(tree, np.zeros((4, 4)), EYE)
        with pytest.raises(GeometryError, match="T_other"):
            call(tree, EYE, np.diag([1.0, 1.0, -1.0, 1.0]))


@pytest.mark.parametrize("count", [1, 2, 9])
def test_small_and_duplicate_meshes(count):
    triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    mesh = MeshTree(triangle, np.tile(np.arange(3), (count, 1)))
    lower, upper = mesh.clearance(mesh, EYE, transform((0.0, 0.0, 2.0)))
    assert lower <= 2.0 <= upper
    assert upper - lower < ROUNDING * 10
