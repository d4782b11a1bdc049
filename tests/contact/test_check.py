import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.check import check_with
from borecheck.contact.settings import settings
from borecheck.errors import JointLimitError, UnknownNameError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.plans.corridor import Corridor
from borecheck.robots.scene import Obstacle, Scene
from tests.places import ROBOTS

# The arm of two_link.urdf at q = 0: a cylinder of radius 50 mm (circumscribed: 50.06)
# about z, from 0.3 to 1.1 m.
ARM_RADIUS = 0.05 / np.cos(np.pi / 72)
# distances of some 1 m in float64
ROUNDING = 1e-12


def scene_of(*meshes, role="other"):
    obstacles = tuple(Obstacle(mesh.name, role, mesh, "test") for mesh in meshes)
    return Scene("test", None, {}, "test", obstacles, {}, (), ())


def block(x, name="block", size=0.2, z=0.6):
    """A box whose near face is x away from the arm's axis."""
    mesh = box(name, (size, size, size))
    shift = np.array([x + size / 2, 0.0, z])
    return TriangleMesh(name, mesh.vertices + shift, mesh.triangles)


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(ROBOTS / "two_link.urdf")


def test_clear_says_how_far_and_where(arm):
    verdict = bc.check(arm, scene_of(block(0.1)), [0.0])
    assert verdict.verdict == "clear"
    assert verdict.clearance_m == pytest.approx(0.1 - ARM_RADIUS, abs=ROUNDING)
    assert (verdict.closest.link, verdict.closest.obstacle) == ("arm", "block")
    first, second = map(np.array, verdict.closest.points)
    assert np.linalg.norm(first - second) == pytest.approx(verdict.clearance_m)
    assert verdict.pairs_examined + verdict.pairs_pruned == 12 * (4 * 72 + 12)


@pytest.mark.parametrize("pruning", ["none", "coal", "bvh"])
@pytest.mark.parametrize("checker", ["exact", "two-sided", "coal"])
def test_contact_by_every_checker_and_pruning(arm, checker, pruning):
    scene = scene_of(block(0.04))
    verdict = bc.check(arm, scene, [0.0], checker=checker, pruning=pruning)
    reference = bc.check(arm, scene, [0.0], pruning="none")
    assert verdict.verdict == "contact"
    assert len(verdict.contacts) > 10
    assert verdict.contacts == reference.contacts


def test_paper_clear_is_unknown_when_exact_sees_contact(arm):
    """A wall of two large triangles: no edge of it meets a small robot triangle."""
    wall = TriangleMesh(
        "wall",
        np.array([[0.03, -9.0, -9.0], [0.03, 9.0, -9.0], [0.03, 0.0, 9.0]]),
        np.array([[0, 1, 2]]),
    )
    verdict = bc.check(arm, scene_of(wall), [0.0], checker="paper")
    assert verdict.checker_verdict == "clear"
    assert verdict.verdict == "unknown"
    assert "exact sees" in verdict.reason or "surfaces meet" in verdict.reason
    assert bc.check(arm, scene_of(wall), [0.0]).verdict == "contact"


def test_inside_a_solid_is_contact(arm):
    verdict = bc.check(arm, scene_of(block(-5.0, size=10.0, z=0.0)), [0.0])
    assert verdict.verdict == "contact"
    assert verdict.qualifiers == ("contained",)
    assert {c.link for c in verdict.contained} == {"arm", "base"}
    assert {(c.role, c.state) for c in verdict.contained} == {("other", "a_in_b")}


def test_inside_a_solid_there_is_no_clearance(arm):
    """The surfaces are metres apart; a number beside CONTACT would mislead."""
    scene = scene_of(block(-5.0, size=10.0, z=0.0))
    verdict = bc.check(arm, scene, [0.0])
    assert verdict.clearance_m is None
    assert verdict.closest is None
    shown = check_with(arm, scene, [0.0], settings(link_clearance=True))
    assert shown.clearance_m == 0.0
    assert shown.closest is None
    assert shown.link_clearance == {"arm": 0.0, "base": 0.0}


def test_an_obstacle_inside_a_part_takes_only_that_parts_clearance(arm):
    inside = block(-0.005, size=0.01)
    shown = check_with(arm, scene_of(inside), [0.0], settings(link_clearance=True))
    assert shown.qualifiers == ("contained",)
    assert {(c.link, c.state) for c in shown.contained} == {("arm", "b_in_a")}
    assert shown.link_clearance["arm"] == 0.0
    assert shown.link_clearance["base"] > 0.1


def test_inside_an_open_surface_is_unknown(arm):
    room = block(-5.0, size=10.0, z=0.0)
    opened = TriangleMesh("room", room.vertices, room.triangles[1:])
    verdict = bc.check(arm, scene_of(opened), [0.0])
    assert verdict.verdict == "unknown"
    assert "open" in verdict.reason


def test_without_obstacles_nothing_is_clear(arm):
    verdict = bc.check(arm, scene_of(), [0.0])
    assert verdict.verdict == "unknown"


def test_touching_is_contact_of_no_depth(arm):
    placed = place_mesh(arm.placements([0.0])["arm"], arm.parts[1].mesh)
    flat = box("flat", (0.2, 0.2, 0.2))
    vertices = flat.vertices.copy()
    vertices[:, 2] += 0.1 + placed.bounds[1, 2]
    vertices[vertices[:, 2] < 1.2, 2] = placed.bounds[1, 2]  # the very same number
    top = TriangleMesh("top", vertices, flat.triangles)
    verdict = bc.check(arm, scene_of(top), [0.0])
    assert verdict.verdict == "contact"
    assert verdict.qualifiers == ("touching",)


def test_offset_margin_is_decided_by_the_true_distance(arm):
    room = 0.1 - ARM_RADIUS
    scene = scene_of(block(0.1))
    assert bc.check(arm, scene, [0.0], margin=room - 1e-9).verdict == "clear"
    between = bc.check(arm, scene, [0.0], margin=room + 1e-9)
    assert between.verdict == "unknown"  # the true arm may be farther, and is
    near = bc.check(arm, scene, [0.0], margin=0.1 - 0.05 + 1e-9)
    assert near.verdict == "contact"
    assert near.qualifiers == ("within_margin",)


def test_a_margin_equal_to_the_distance_is_never_clear(arm):
    scene = scene_of(block(0.1))
    distance = bc.check(arm, scene, [0.0]).closest
    for margin in (distance.distance, distance.upper):
        assert bc.check(arm, scene, [0.0], margin=margin).verdict != "clear"


@pytest.mark.parametrize("checker", ["exact", "two-sided", "paper", "coal"])
def test_enlarged_arm_meets_what_is_nearer_along_the_axis(arm, checker):
    scene = scene_of(block(0.1))
    gap = 0.1 - ARM_RADIUS
    grown = bc.check(
        arm,
        scene,
        [0.0],
        checker=checker,
        margin=gap + 1e-4,
        margin_kind="enlarge-axes",
    )
    assert grown.verdict == "contact"
    assert grown.qualifiers == ("within_margin",)
    assert all(pair.link_triangle < 256 for pair in grown.contacts)
    less = bc.check(
        arm,
        scene,
        [0.0],
        checker=checker,
        margin=gap - 1e-4,
        margin_kind="enlarge-axes",
    )
    assert less.verdict == "clear"


@pytest.mark.parametrize("kind", ["enlarge-axes", "enlarge-axes:world"])
@pytest.mark.parametrize("checker", ["exact", "two-sided", "paper", "coal"])
def test_a_speck_wholly_within_the_enlargement_is_contact(arm, checker, kind):
    """It lies between the arm and the surface the arm grew to: no surfaces meet."""
    speck = scene_of(block(0.06, size=0.002))
    grown = bc.check(arm, speck, [0.0], checker=checker, margin=0.02, margin_kind=kind)
    assert grown.verdict == "contact"
    assert grown.contacts == ()
    assert "wholly within the margin" in grown.reason


def test_security_margin_is_coals(arm):
    scene = scene_of(block(0.1))
    assert bc.check(arm, scene, [0.0], checker="coal", margin=0.06).verdict == "contact"
    assert bc.check(arm, scene, [0.0], checker="coal", margin=0.04).verdict == "clear"


def test_margins_that_a_checker_cannot_keep_are_refused():
    with pytest.raises(UsageError, match="paper:robot takes no offset margin"):
        settings("paper", margin=0.01, margin_kind="offset")
    with pytest.raises(UsageError):
        settings(margin=-0.01)
    with pytest.raises(UnknownNameError, match="margin kind"):
        settings(margin=0.01, margin_kind="padding")
    with pytest.raises(UnknownNameError, match="known: paper"):
        settings("fcl")
    with pytest.raises(UnknownNameError, match="pruning"):
        settings(pruning="octree")


def test_beyond_a_limit_there_is_no_verdict(arm):
    with pytest.raises(JointLimitError):
        bc.check(arm, scene_of(block(0.1)), [3.0])


def test_self_contact_counts_for_links_that_are_not_neighbours():
    folded = bc.load_robot(ROBOTS / "mimic_chain.urdf")
    names = [(folded.parts[i].link, folded.parts[j].link) for i, j in folded.self_pairs]
    assert names == [("base", "two"), ("base", "three"), ("one", "three")]
    far = scene_of(block(50.0))
    assert bc.check(folded, far, [0.3]).verdict == "clear"
    text = (ROBOTS / "mimic_chain.urdf").read_text()
    assert 'offset="0.25"' in text


def test_self_contact_is_found(tmp_path):
    text = (ROBOTS / "mimic_chain.urdf").read_text()
    near = tmp_path / "near.urdf"
    near.write_text(text.replace('multiplier="2" offset="0.25"', 'multiplier="0"'))
    verdict = bc.check(bc.load_robot(near), scene_of(block(50.0)), [0.05])
    assert verdict.verdict == "contact"
    assert {(p.link, p.obstacle) for p in verdict.self_contacts} == {("base", "two")}
    assert verdict.contacts == ()


def test_every_link_has_its_own_clearance(arm):
    chosen = settings(link_clearance=True)
    verdict = check_with(arm, scene_of(block(0.12), block(0.3, z=0.0)), [0.0], chosen)
    assert verdict.link_clearance == pytest.approx(
        {"arm": 0.12 - ARM_RADIUS, "base": 0.2}, abs=1e-9
    )


def test_a_drawn_link_without_collision_geometry_is_checked_as_drawn(tmp_path):
    text = (ROBOTS / "two_link.urdf").read_text()
    visual = "<visual><geometry><box size='1 1 1'/></geometry></visual>"
    cover = f"<link name='cover'>{visual}</link>"
    fixed = (
        "<joint name='f' type='fixed'><parent link='arm'/><child link='cover'/></joint>"
    )
    bare = tmp_path / "bare.urdf"
    bare.write_text(text.replace("</robot>", f"{cover}{fixed}</robot>"))
    scene = scene_of(block(0.1))
    alone = bc.check(bc.load_robot(ROBOTS / "two_link.urdf"), scene, [0.0])
    assert alone.verdict == "clear"
    verdict = bc.check(bc.load_robot(bare), scene, [0.0])
    assert {contact.link for contact in verdict.contacts} == {"cover"}
    assert any(text.startswith("cover: what differs") for text in verdict.not_modelled)


def test_a_file_moved_in_by_pose_and_unit(arm, tmp_path):
    mesh = box("mm", (200.0, 200.0, 200.0))
    write_stl(tmp_path / "part.stl", mesh)
    scene = bc.load_scene(f"{tmp_path / 'part.stl'}:mm@0.2,0,0.6")
    verdict = bc.check(arm, scene, [0.0])
    assert verdict.clearance_m == pytest.approx(0.1 - ARM_RADIUS, abs=1e-7)


def test_a_strange_mesh_in_mm_is_told_with_a_warning(arm, tmp_path):
    write_stl(tmp_path / "torso.stl", box("mm", (400.0, 300.0, 600.0)))
    scene = bc.load_scene(str(tmp_path / "torso.stl"))
    assert len(scene.warnings) == 1
    assert "millimetres" in scene.warnings[0]
    assert np.ptp(scene.obstacles[0].mesh.bounds, axis=0).max() == pytest.approx(0.6)


def test_the_needle_may_enter_the_patient_along_its_corridor_only():
    skin = TriangleMesh(
        "skin",
        np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]]),
        np.array([[0, 1, 2]]),
    )
    needle = box("needle", (0.001, 0.001, 0.1))
    pairs = np.array([[k, 0] for k in range(12)])
    corridor = Corridor(np.zeros(3), np.array([0.0, 0.0, -0.05]), 0.00055)
    from borecheck.geometry.triangles.exact import exact

    crossing = exact(needle.corners, np.repeat(skin.corners, 12, axis=0))
    assert crossing.sum() == 8
    assert corridor.allows(needle, skin, pairs[crossing]).all()
    aside = TriangleMesh("n", needle.vertices + [0.02, 0, 0], needle.triangles)
    assert not corridor.allows(aside, skin, pairs[crossing]).any()
