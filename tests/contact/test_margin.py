"""Margins: three different sets, by name."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.margin import (
    ENLARGE_BODY,
    ENLARGE_WORLD,
    KINDS,
    OFFSET,
    Margin,
    enlarged,
    margin_for,
)
from borecheck.core.se3 import rpy_matrix
from borecheck.errors import UnknownNameError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import CHECKERS
from borecheck.robots.scene import Obstacle, Scene
from tests.places import ROBOTS

ARM_RADIUS = 0.05 / np.cos(np.pi / 72)  # two_link.urdf, circumscribed


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(ROBOTS / "two_link.urdf")


def block(gap, size=0.2):
    """A scene with a block so far from the arm at q = 0."""
    mesh = box("block", (size,) * 3)
    shift = np.array([ARM_RADIUS + gap + size / 2, 0.0, 0.6])
    moved = TriangleMesh("block", mesh.vertices + shift, mesh.triangles)
    return Scene(
        "t", None, {}, "t", (Obstacle("block", "other", moved, "t"),), {}, (), ()
    )


# (checker, kind) that go together
FITTING = [
    (checker, kind)
    for checker in CHECKERS
    for kind in KINDS
    if (kind == OFFSET) <= (checker in ("exact", "two-sided"))
    and (kind == "security") <= (checker == "coal")
]


@pytest.mark.parametrize(("checker", "kind"), FITTING)
def test_a_margin_larger_than_the_gap_is_never_clear(arm, checker, kind):
    """One-sided tests may miss it, and are then not believed."""
    near = bc.check(
        arm, block(0.01), [0.0], margin=0.02, margin_kind=kind, checker=checker
    )
    assert near.verdict in ("contact", "unknown")
    assert (near.verdict == "contact") or checker.startswith("paper")
    far = bc.check(
        arm, block(0.03), [0.0], margin=0.02, margin_kind=kind, checker=checker
    )
    assert far.verdict == "clear"
    assert far.margin_kind == kind


@pytest.mark.parametrize(("checker", "kind"), FITTING)
def test_an_obstacle_small_enough_to_lie_within_the_growth(arm, checker, kind):
    small = block(0.008, size=0.002)
    verdict = bc.check(
        arm, small, [0.0], margin=0.02, margin_kind=kind, checker=checker
    )
    assert verdict.verdict == "contact"
    assert "within_margin" in verdict.qualifiers


def test_offset_at_the_margin_itself_is_not_clear(arm):
    distance = bc.check(arm, block(0.02), [0.0]).closest
    assert distance.distance <= distance.upper
    at = bc.check(arm, block(0.02), [0.0], margin=distance.upper)
    assert at.verdict in ("contact", "unknown")
    below = bc.check(arm, block(0.02), [0.0], margin=distance.distance - 1e-12)
    assert below.verdict == "clear"


def test_a_deep_contact_is_not_called_within_margin(arm):
    verdict = bc.check(arm, block(-0.03), [0.0], margin=0.02)
    assert verdict.verdict == "contact"
    assert "within_margin" not in verdict.qualifiers
    assert "meets" in verdict.reason


def test_body_and_world_axes_differ_for_a_turned_part():
    mesh = box("part", (0.2, 0.2, 0.2))
    R = rpy_matrix(0.0, 0.0, np.pi / 4)
    body = enlarged(mesh, Margin(0.1, ENLARGE_BODY), R).mesh
    world = enlarged(mesh, Margin(0.1, ENLARGE_WORLD), R).mesh
    reach = [np.abs(m.vertices @ R.T)[:, 0].max() for m in (body, world)]
    assert reach[0] == pytest.approx(0.2 * np.sqrt(2))
    assert reach[1] == pytest.approx(0.1 * np.sqrt(2) + 0.1)


def test_enlarge_reaches_at_least_as_far_as_offset(arm, rng):
    """A cube of half edge m holds the ball of radius m."""
    counts = {"clear": 0, "contact": 0}
    for _ in range(12):
        scene = block(rng.uniform(0.0, 0.03), size=0.05)
        q = [rng.uniform(-0.01, 0.01)]
        offset = bc.check(arm, scene, q, margin=0.015)
        grown = bc.check(arm, scene, q, margin=0.015, margin_kind=ENLARGE_BODY)
        counts[offset.verdict] += 1
        if offset.verdict == "contact":
            assert grown.verdict == "contact"
    assert min(counts.values()) >= 2


def test_each_checker_has_its_natural_kind():
    kinds = {checker: margin_for(checker, 0.02).kind for checker in CHECKERS}
    assert kinds == {
        "exact": "offset",
        "two-sided": "offset",
        "paper:robot": "enlarge-axes",
        "paper:scanner": "enlarge-axes",
        "coal": "security",
    }


@pytest.mark.parametrize("size", [-1e-9, np.nan, np.inf, 20.0, 1e300])
def test_sizes_that_are_no_margin(size):
    with pytest.raises(UsageError):
        margin_for("exact", size)


def test_kinds_that_do_not_fit():
    with pytest.raises(UsageError, match="takes no offset"):
        margin_for("paper:robot", 0.02, "offset")
    with pytest.raises(UsageError, match="takes no security"):
        margin_for("exact", 0.02, "security")
    with pytest.raises(UnknownNameError):
        margin_for("exact", 0.02, "sphere")
