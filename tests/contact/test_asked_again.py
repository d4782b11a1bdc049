"""What another checker calls clear is asked again with everything that was asked.

Walls are single large triangles: the one-sided test of [Matsuno2020] looks for edges
of one mesh within triangles of the other, and a large triangle has its edges elsewhere.
"""

from dataclasses import replace

import numpy as np
import pytest

import borecheck as bc
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.plans.corridor import SLACK, Corridor
from borecheck.robots.needle import Needle
from borecheck.robots.scene import Obstacle, Scene

ROD, LENGTH = 0.02, 0.4
RADIUS = ROD / np.sqrt(2)
PAPERS = ("paper:robot", "paper:scanner")

LINK = (
    '<link name="{}"><collision><geometry><box size="{}"/></geometry></collision>'
    "</link>"
)
JOINT = """<joint name="{0}" type="prismatic"><parent link="{1}"/><child link="{2}"/>
<origin xyz="{3}"/><axis xyz="{4}"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>"""


def loaded(folder, *parts):
    file = folder / "robot.urdf"
    file.write_text(f'<robot name="r">{"".join(parts)}</robot>')
    return bc.load_robot(file)


@pytest.fixture(scope="module")
def rod(tmp_path_factory):
    """One rod along z that slides along x from the origin, on a link without shape."""
    return loaded(
        tmp_path_factory.mktemp("rod"),
        '<link name="world"/>',
        LINK.format("rod", f"{ROD} {ROD} {LENGTH}"),
        JOINT.format("x", "world", "rod", "0 0 0", "1 0 0"),
    )


@pytest.fixture(scope="module")
def crossing(tmp_path_factory):
    """A rod and a plate that no joint joins directly: the rod slides through it."""
    return loaded(
        tmp_path_factory.mktemp("crossing"),
        LINK.format("plate", "2 2 0.01"),
        LINK.format("between", "0.01 0.01 0.01"),
        LINK.format("rod", f"{ROD} {ROD} {LENGTH}"),
        JOINT.format("a", "plate", "between", "0 0 2", "1 0 0"),
        JOINT.format("b", "between", "rod", "0.3 0.21 -1", "0 0 1"),
    )


def scene_of(*bodies):
    obstacles = tuple(Obstacle(m.name, role, m, "t") for role, m in bodies)
    return Scene("s", None, {}, "t", obstacles, {}, (), ())


def wall(x, name="wall"):
    corners = [[x, -9.0, -9.0], [x, 9.0, -9.0], [x, 0.0, 9.0]]
    return TriangleMesh(name, np.array(corners), np.array([[0, 1, 2]]))


def test_growth_is_asked_again(rod):
    """The wall stands within the margin, and only the grown rod meets it."""
    scene = scene_of(("other", wall(0.5 * ROD + 0.01)))
    blind = 0
    for checker in PAPERS:
        found = bc.check(
            rod, scene, [0.0], checker=checker, margin=0.02, margin_kind="enlarge-axes"
        )
        assert found.verdict != "clear"
        blind += found.checker_verdict == "clear"
        if found.checker_verdict == "clear":
            assert found.verdict == "unknown"
            assert f"{checker} sees no contact, but exact sees rod meet" in found.reason
        without = bc.check(rod, scene, [0.0], checker=checker)
        assert without.verdict == "clear"
    assert blind


def test_self_pairs_are_asked_again(crossing):
    far = scene_of(("other", wall(50.0)))
    blind = 0
    for checker in PAPERS:
        found = bc.check(crossing, far, [0.0, -1.0], checker=checker)
        assert found.verdict != "clear"
        blind += found.checker_verdict == "clear"
        assert bc.check(crossing, far, [0.0, 0.0], checker=checker).verdict == "clear"
    assert blind == 1
    assert bc.check(crossing, far, [0.0, -1.0]).self_contacts


@pytest.fixture(scope="module")
def needle(rod):
    return replace(rod, stated_needle=Needle("rod"))


def skin(size=1.0):
    """A patient below z = 0, or with a size of None its skin alone."""
    mesh = box("belly", (size, size, size))
    return TriangleMesh("belly", mesh.vertices - [0, 0, size / 2], mesh.triangles)


def corridor(depth, x=0.0):
    """From the skin downwards; the rod's tip is LENGTH / 2 deep."""
    return Corridor(np.array([x, 0.0, 0.0]), np.array([x, 0.0, -depth]), RADIUS)


def checks(robot, scene, q, way, **given):
    for checker in ("exact", "two-sided", *PAPERS, "coal"):
        yield checker, bc.check(robot, scene, [q], corridor=way, checker=checker)


def test_a_puncture_as_planned_is_clear_to_all(needle):
    scene = scene_of(("patient", skin()), ("other", wall(5.0)))
    for _, found in checks(needle, scene, 0.0, corridor(LENGTH / 2)):
        assert found.verdict == "clear"
        assert found.contacts == ()
    exact = bc.check(needle, scene, [0.0], corridor=corridor(LENGTH / 2))
    assert exact.corridor_contacts >= 8
    assert bc.check(needle, scene, [0.0]).verdict == "contact"


def test_a_puncture_beside_the_plan_is_clear_to_none(needle):
    scene = scene_of(("patient", skin()), ("other", wall(5.0)))
    for checker, found in checks(needle, scene, 0.1, corridor(LENGTH / 2)):
        assert found.verdict != "clear", checker
        assert (found.verdict == "contact") == (found.checker_verdict == "contact")
        assert found.corridor_contacts == 0
        if checker == "exact":  # it goes through, neither touching nor by a tolerance
            assert (found.verdict, found.qualifiers) == ("contact", ())


def test_where_the_tip_is_does_not_rest_on_a_blind_checker(needle):
    """In through the right hole, too deep; whoever sees the hole or not."""
    scene = scene_of(("patient", skin()), ("other", wall(5.0)))
    deepest = LENGTH / 2
    for depth, verdict in (
        (deepest - SLACK - 1e-6, "contact"),
        (deepest - SLACK + 1e-6, "clear"),
    ):
        for checker, found in checks(needle, scene, 0.0, corridor(depth)):
            assert found.verdict == verdict, checker
            if verdict == "contact":
                ((pair),) = found.contained
                assert (pair.link, pair.obstacle) == ("rod", "belly")
                assert (pair.role, pair.state) == ("patient", "a_in_b")


def test_of_an_open_patient_the_depth_is_unknown_not_contact(needle):
    whole = skin()
    opened = TriangleMesh("belly", whole.vertices, whole.triangles[:-1])
    scene = scene_of(("patient", opened), ("other", wall(5.0)))
    found = bc.check(needle, scene, [0.0], corridor=corridor(0.1))
    assert found.contacts == ()
    assert found.verdict == "unknown"
    assert {c.state for c in found.contained} == {"unknown"}


def test_only_the_needle_may_enter_and_only_the_patient(rod, needle):
    patient, other = scene_of(("patient", skin())), scene_of(("other", skin()))
    assert bc.check(rod, patient, [0.0], corridor=corridor(0.2)).verdict == "contact"
    assert bc.check(needle, other, [0.0], corridor=corridor(0.2)).verdict == "contact"


@pytest.mark.parametrize("checker", ["exact", "two-sided", "coal"])
def test_a_contact_counts_every_pair_once_and_tells_its_depth(rod, checker):
    """A rod through a wall crosses it; against it, it touches."""
    deep = bc.check(rod, scene_of(("other", wall(0.003))), [0.0], checker=checker)
    assert deep.verdict == "contact"
    assert deep.qualifiers == ()
    assert len(set(deep.contacts)) == len(deep.contacts)
    assert deep.pairs_examined + deep.pairs_pruned == 12
    flush = bc.check(rod, scene_of(("other", wall(ROD / 2))), [0.0], checker=checker)
    assert flush.verdict == "contact"
    assert flush.qualifiers == ("touching",)


def test_a_spike_that_enters_a_face_crosses_it_whoever_is_large(rod):
    """The rod's edges meet nothing: those of the spike go through its large face."""
    corners = [[0.0095, 0.001, 0.05], [0.05, 0.0, 0.05], [0.05, 0.003, 0.052]]
    spike = TriangleMesh("spike", np.array(corners), np.array([[0, 1, 2]]))
    found = bc.check(rod, scene_of(("other", spike)), [0.0])
    assert (found.verdict, found.qualifiers) == ("contact", ())


def test_grown_or_not_a_pair_of_triangles_is_told_once(rod):
    block = box("block", (0.1, 0.1, 0.1))
    beside = TriangleMesh("block", block.vertices + [0.065, 0, 0], block.triangles)
    scene = scene_of(("other", beside))
    for kind in ("enlarge-axes", "enlarge-axes:world"):
        found = bc.check(rod, scene, [0.0], margin=0.02, margin_kind=kind)
        pairs = [(c.link_triangle, c.obstacle_triangle) for c in found.contacts]
        assert found.qualifiers == ("within_margin",)
        assert len(set(pairs)) == len(pairs) > 0
        assert max(first for first, _ in pairs) < 12
        assert max(second for _, second in pairs) < 12


def test_coals_tolerance_is_told(rod):
    """Coal stops at 1e-9 m or so: contact to it, not to the exact test."""
    near = scene_of(("other", wall(ROD / 2 + 2e-10)))
    assert bc.check(rod, near, [0.0]).verdict == "clear"
    found = bc.check(rod, near, [0.0], checker="coal")
    assert (found.verdict, found.qualifiers) == ("contact", ("within_tolerance",))


def test_both_kinds_of_contact_and_no_clearance_by_the_side(crossing):
    """With itself it leaves the distance to obstacles; with one of them it does not."""
    beside = scene_of(("other", wall(3.0)))
    found = bc.check(crossing, beside, [0.0, -1.0])
    assert found.verdict == "contact"
    assert found.clearance_m == pytest.approx(2.0)
    through = bc.check(crossing, scene_of(("other", wall(0.9))), [0.0, 0.0])
    assert through.verdict == "contact"
    assert through.clearance_m is None
