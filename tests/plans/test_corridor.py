"""The needle in the patient: allowed along the plan, and nowhere else."""

import numpy as np
import pytest

from borecheck.geometry.mesh.primitives import box, cylinder, sphere
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.exact import exact
from borecheck.geometry.triangles.topology import topology
from borecheck.plans.corridor import SLACK, Corridor, common_points

RADIUS = 0.00055
ENTRY = np.array([0.0, 0.0, 0.1])
TARGET = np.array([0.0, 0.0, 0.05])
CORRIDOR = Corridor(ENTRY, TARGET, RADIUS)


def moved(mesh, shift, name=None):
    return TriangleMesh(name or mesh.name, mesh.vertices + shift, mesh.triangles)


def body():
    """A patient whose skin is the plane z = 0.1, of two large triangles."""
    return box("body", (0.4, 0.4, 0.2))


def needle(tip, length=0.15, tilt=0.0):
    """A needle of 1.1 mm that points down, its tip at a point, turned about it."""
    mesh = cylinder("needle", RADIUS, length)
    up = mesh.vertices + np.array([0.0, 0.0, length / 2])
    c, s = np.cos(tilt), np.sin(tilt)
    R = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return TriangleMesh("needle", up @ R.T + tip, mesh.triangles)


def crossing_pairs(a, b):
    rows = np.repeat(np.arange(len(a.triangles)), len(b.triangles))
    columns = np.tile(np.arange(len(b.triangles)), len(a.triangles))
    meet = exact(a.corners[rows], b.corners[columns])
    return np.column_stack([rows[meet], columns[meet]])


def asked(needle_mesh, patient, corridor=CORRIDOR):
    """(pairs, which are allowed, stray) as the contact check asks for them."""
    pairs = crossing_pairs(needle_mesh, patient)
    allowed = corridor.allows(needle_mesh, patient, pairs)
    return pairs, allowed, corridor.stray(needle_mesh, patient, topology(patient))


def test_a_needle_as_planned_is_allowed():
    pairs, allowed, stray = asked(needle(TARGET), body())
    assert len(pairs) > 50
    assert allowed.all()
    assert stray is None


def test_on_its_way_too():
    pairs, allowed, stray = asked(needle([0.0, 0.0, 0.08]), body())
    assert len(pairs) > 50
    assert allowed.all()
    assert stray is None


def test_a_tip_beyond_the_target_is_a_stray_though_the_skin_is_crossed_as_planned():
    for beyond in (SLACK + 1e-4, 0.03):
        pairs, allowed, stray = asked(needle(TARGET - [0, 0, beyond]), body())
        assert len(pairs) > 50
        assert allowed.all()
        assert stray is not None
        assert stray.certain
        assert f"{1e3 * beyond:.1f} mm beyond the target" in stray.reason


def test_a_tilted_needle_through_the_right_hole_is_a_stray():
    tilt = np.radians(12.0)
    through_entry = ENTRY - 0.04 * np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    pairs, allowed, stray = asked(needle(through_entry, tilt=tilt), body())
    assert len(pairs) > 50
    assert allowed.all()
    assert stray is not None
    assert stray.reason.endswith("aside of its line")


def test_the_slack_is_two_millimetres():
    assert asked(needle(TARGET - [0, 0, 0.9 * SLACK]), body())[2] is None
    aside = needle(TARGET + np.array([0.9 * SLACK, 0, 0]))
    pairs, allowed, stray = asked(aside, body())
    assert allowed.all()
    assert stray is None
    pairs, allowed, _ = asked(
        needle(TARGET + np.array([SLACK + 2 * RADIUS, 0, 0])), body()
    )
    assert len(pairs) > 50
    assert not allowed.any()


def test_large_triangles_are_judged_where_they_are_crossed():
    """The skin's triangles reach 0.2 m out of the corridor; the crossing does not."""
    pairs, allowed, _ = asked(needle(TARGET), body())
    corners = body().corners[np.unique(pairs[:, 1])].reshape(-1, 3)
    assert not CORRIDOR.holds(corners).any()
    assert allowed.all()


def test_a_second_part_before_the_entry_is_no_puncture():
    """A forearm above the belly, in the needle's way."""
    forearm = moved(box("forearm", (0.3, 0.06, 0.03)), [0.0, 0.0, 0.16])
    pairs, allowed, _ = asked(needle(TARGET), forearm)
    assert len(pairs) > 50
    assert not allowed.any()


def test_out_of_the_far_side_is_no_puncture():
    thin = moved(box("thin", (0.4, 0.4, 0.07)), [0.0, 0.0, 0.065])
    pairs, allowed, _ = asked(needle(TARGET - [0, 0, 0.03]), thin)
    assert 0 < allowed.sum() < len(pairs)


def test_an_organ_on_the_way_may_be_crossed():
    organ = moved(sphere("liver", 0.03), [0.0, 0.0, 0.05])
    pairs, allowed, stray = asked(needle(TARGET), organ)
    assert len(pairs) > 20
    assert allowed.all()
    assert stray is None


def test_coplanar_contact_is_never_taken_as_planned():
    flat = np.array([[-1.0, -1, 0.1], [1, -1, 0.1], [0, 1, 0.1]])
    same = np.array([[-1e-4, 0, 0.1], [1e-4, 0, 0.1], [0, 1e-4, 0.1]])
    assert exact(flat[None], same[None])[0]
    assert len(common_points(same, flat)) == 0
    a = TriangleMesh("needle", same, np.array([[0, 1, 2]]))
    b = TriangleMesh("skin", flat, np.array([[0, 1, 2]]))
    assert not CORRIDOR.allows(a, b, np.array([[0, 0]])).any()


def test_an_edge_in_the_plane_shows_both_its_ends():
    """The common segment runs from the corridor far out of it, along an edge."""
    skin = np.array([[-1.0, -1, 0.1], [1, -1, 0.1], [0, 1, 0.1]])
    for z in (0.05, 0.15):
        blade = np.array([[0.0, 0, 0.1], [0.1, 0, 0.1], [0.0, 0, z]])
        points = common_points(blade, skin)
        assert np.ptp(points[:, 0]) == pytest.approx(0.1)
        assert not CORRIDOR.holds(points).all()


def test_common_points_span_the_common_segment(rng):
    """Random pairs: both points lie in both planes, and there are two of them."""
    a, b = rng.uniform(-1.0, 1.0, (2, 400, 3, 3))
    meet = exact(a, b)
    assert meet.sum() > 60
    for first, second in zip(a[meet], b[meet], strict=True):
        points = common_points(first, second)
        assert len(points) == 2
        for corner in (first, second):
            normal = np.cross(corner[1] - corner[0], corner[2] - corner[0])
            heights = (points - corner[0]) @ (normal / np.linalg.norm(normal))
            assert np.abs(heights).max() < 1e-9  # rounding of sizes around 1


def test_of_an_open_skin_it_cannot_be_told_how_far_the_needle_is_in():
    whole = body()
    skin = TriangleMesh("skin", whole.vertices, whole.triangles[1:])
    assert not topology(skin).is_closed
    planned = asked(needle(TARGET), skin)
    assert planned[1].all()
    assert planned[2] is None
    deep = asked(needle(TARGET - [0, 0, 0.03]), skin)
    assert deep[2] is not None
    assert not deep[2].certain
    assert "open" in deep[2].reason


def test_unused_vertices_of_the_needle_do_not_count():
    good = needle(TARGET)
    vertices = np.vstack([good.vertices, [[0.05, 0.0, 0.0]]])
    extra = TriangleMesh("needle", vertices, good.triangles)
    assert asked(extra, body())[2] is None
