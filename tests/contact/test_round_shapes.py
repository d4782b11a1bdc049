"""Spheres, capsules and cylinders against what is known of them in closed form."""

import json
from dataclasses import fields as dataclass_fields
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import borecheck as bc
from borecheck.contact import round_shapes
from borecheck.contact.verdict import (
    Answer,
    Closest,
    Containment,
    TrianglePair,
    Verdict,
)
from borecheck.geometry.mesh.primitives import TOLERANCE, box, sphere
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.certify import write_path_certificate
from borecheck.robots.scene import Obstacle, Scene
from borecheck.verify.check import verify
from tests.places import ROBOTS

LENGTH = 0.12
SHAPES = {
    "sphere": '<sphere radius="{r}"/>',
    "capsule": '<capsule radius="{r}" length="0.12"/>',
    "cylinder": '<cylinder radius="{r}" length="0.12"/>',
}
SLIDE = (
    '<joint name="x" type="prismatic"><parent link="base"/><child link="round"/>'
    '<origin rpy="{} {} {}"/><axis xyz="{} {} {}"/>'
    '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
)


def robot_of(tmp_path, kind, r, turn):
    """One round link, turned, that slides along the world's x."""
    rpy = turn.as_euler("xyz")
    axis = turn.inv().apply([1.0, 0.0, 0.0])
    shape = SHAPES[kind].format(r=r)
    link = (
        f'<link name="round"><collision><geometry>{shape}</geometry></collision></link>'
    )
    joint = SLIDE.format(*rpy, *axis)
    file = tmp_path / f"{kind}.urdf"
    file.write_text(f'<robot name="r"><link name="base"/>{link}{joint}</robot>')
    return bc.load_robot(file)


def reach(kind, r, turn):
    """How far the shape reaches along x from its middle."""
    along = abs(turn.apply([0.0, 0.0, 1.0])[0])
    half = LENGTH / 2
    return {
        "sphere": r,
        "capsule": along * half + r,
        "cylinder": along * half + r * np.sqrt(max(0.0, 1.0 - along**2)),
    }[kind]


def wall_at(x, name="wall"):
    wall = box(name, (0.2, 2.0, 2.0))
    mesh = TriangleMesh(name, wall.vertices + [x + 0.1, 0.0, 0.0], wall.triangles)
    obstacle = Obstacle(name, "other", mesh, "")
    return Scene("s", None, {}, "test", (obstacle,), {}, (), ())


def right(verdict, gap, band):
    """Whether a verdict is right of a gap; within the band it may be unknown."""
    if verdict == "unknown":
        return abs(gap) <= band
    return verdict == ("clear" if gap > 0.0 else "contact")


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("r", [0.003, 0.05, 0.4])
def test_against_a_wall_at_any_turn(tmp_path, rng, kind, r):
    for turn in [Rotation.identity(), Rotation.random(rng=rng)]:
        robot = robot_of(tmp_path, kind, r, turn)
        (part,) = robot.parts
        band = part.mesh.excess
        assert band <= max(TOLERANCE, 4e-4 * r)
        scene = wall_at(reach(kind, r, turn))
        gaps = band * np.array([-1.01, *rng.uniform(-1, 1, 2), 1.01])
        verdicts = [bc.check(robot, scene, [-gap]) for gap in gaps]
        assert all(
            right(v.verdict, g, band) for v, g in zip(verdicts, gaps, strict=True)
        )
        batch = bc.first_contacts(robot, scene, -gaps[:, None])
        assert batch.tolist() == [not v.clear for v in verdicts]
        for verdict, gap in zip(verdicts, gaps, strict=True):
            if gap > 0.0:
                assert (
                    verdict.clearance_m <= gap + 1e-12 <= verdict.closest.upper + 2e-12
                )
                assert verdict.clearance_m >= gap - band - 1e-12
        for gap in gaps[1::2]:
            motion = bc.check_path(robot, scene, [[-0.2], [-gap]])
            assert right(motion.verdict, gap, band)


@pytest.mark.parametrize("checker", ["two-sided", "coal"])
def test_other_checkers_say_contact_by_the_inner_polyhedron_too(tmp_path, checker):
    robot = robot_of(tmp_path, "sphere", 0.05, Rotation.identity())
    band = robot.parts[0].mesh.excess
    for share in (-1.1, -0.5, 0.5, 0.9, 1.1):
        verdict = bc.check(robot, wall_at(0.05), [-share * band], checker=checker)
        assert right(verdict.verdict, share * band, band)


@pytest.mark.parametrize("kind", ["offset", "enlarge-axes"])
def test_a_margin_is_decided_outside_the_band_alone(tmp_path, kind):
    robot = robot_of(tmp_path, "sphere", 0.05, Rotation.identity())
    band = robot.parts[0].mesh.excess
    for gap in band * np.array([-1.1, -0.5, 0.5, 1.1]):
        verdict = bc.check(
            robot, wall_at(0.06 + gap), [0.0], margin=0.01, margin_kind=kind
        )
        assert right(verdict.verdict, gap, band)


def test_two_spheres_and_a_box_corner(tmp_path, rng):
    """Self contact, and the corner of an obstacle from any side."""
    links = "".join(
        f'<link name="{name}"><collision><geometry><sphere radius="0.03"/>'
        "</geometry></collision></link>"
        for name in "ab"
    )
    joints = "".join(
        f'<joint name="{name}{k}" type="prismatic"><parent link="{p}"/>'
        f'<child link="{c}"/><axis xyz="{a}"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for name in "ab"
        for k, (p, c, a) in enumerate(
            [
                ("base", f"{name}1", "1 0 0"),
                (f"{name}1", f"{name}2", "0 1 0"),
                (f"{name}2", name, "0 0 1"),
            ]
        )
    )
    between = "".join(f'<link name="{n}{k}"/>' for n in "ab" for k in (1, 2))
    stand = '<collision><origin xyz="0 0 -0.9"/><geometry><box size="0.1 0.1 0.1"/>'
    base = f'<link name="base">{stand}</geometry></collision></link>'
    file = tmp_path / "two.urdf"
    file.write_text(f'<robot name="r">{base}{links}{between}{joints}</robot>')
    robot = bc.load_robot(file)
    corner = box("block", (0.2, 0.2, 0.2))
    block = TriangleMesh("block", corner.vertices - 0.6, corner.triangles)
    far = Obstacle("block", "other", block, "")
    scene = Scene("s", None, {}, "test", (far,), {}, (), ())
    band = robot.parts[1].mesh.excess
    for share in (-2.2, -1.0, 0.5, 1.9, 2.2):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        second = (0.06 + share * band) * direction
        verdict = bc.check(robot, scene, [0.0, 0.0, 0.0, *second])
        assert right(verdict.verdict, share * band, 2 * band)
        out = np.abs(direction)  # from the block's corner at -0.5
        first = -0.5 + (0.03 + 0.5 * share * band) * out
        verdict = bc.check(robot, scene, [*first, 0.5, 0.5, 0.5])
        assert right(verdict.verdict, 0.5 * share * band, band)


def test_unknown_says_how_well_the_shape_is_known(tmp_path):
    robot = robot_of(tmp_path, "sphere", 0.05, Rotation.identity())
    verdict = bc.check(robot, wall_at(0.05), [-2e-5])
    assert verdict.unknown
    assert verdict.reason == (
        "round and wall: 0 to 0.049 mm apart; round is round and known to 0.049 mm"
    )
    assert verdict.contacts == ()
    assert verdict.clearance_m == 0.0
    assert verdict.closest.upper >= 2e-5
    motion = bc.check_path(robot, wall_at(0.05), [[-0.1], [-2e-5]])
    assert motion.unknown
    assert "round is round and known to 0.049 mm" in motion.reason
    assert motion.intervals[0].verdict == "clear"
    assert motion.intervals[-1].verdict == "unknown"


def test_contact_of_shapes_that_are_not_round_is_not_asked_again(monkeypatch):
    robot = bc.load_robot(ROBOTS / "two_link.urdf")  # a box, and a rod above it
    base = bc.check(robot, wall_at(0.09), [0.0])
    assert base.contact
    assert {pair.link for pair in base.contacts} == {"base"}
    monkeypatch.setattr(round_shapes, "within", lambda *_: 1 / 0)
    assert bc.check(robot, wall_at(0.09), [0.0]).contacts == base.contacts
    at_the_rod = box("b", (0.2, 0.2, 0.2))
    mesh = TriangleMesh("b", at_the_rod.vertices + [0.14, 0, 0.7], at_the_rod.triangles)
    scene = Scene("s", None, {}, "t", (Obstacle("b", "other", mesh, ""),), {}, (), ())
    with pytest.raises(ZeroDivisionError):
        bc.check(robot, scene, [0.0])


def test_where_contact_begins_is_where_the_true_shape_touches(tmp_path):
    robot = robot_of(tmp_path, "sphere", 0.05, Rotation.identity())
    motion = bc.check_path(robot, wall_at(0.05), [[-0.1], [0.1]])
    assert motion.contact
    start, end, names = motion.first_contact
    assert names == ("round", "wall")
    assert start <= 0.5 <= end
    assert end - start < 1e-3
    states = [s.verdict for s in motion.intervals]
    assert states[0] == "clear"
    assert states[-1] == "contact"


def test_inside_a_room_and_a_speck_within(tmp_path):
    robot = robot_of(tmp_path, "sphere", 0.05, Rotation.identity())
    for size in (2.0, 0.01):
        mesh = box("b", (size, size, size))
        scene = Scene(
            "s", None, {}, "t", (Obstacle("b", "other", mesh, ""),), {}, (), ()
        )
        assert bc.check(robot, scene, [0.0]).contact
        assert bc.check_path(robot, scene, [[0.0], [0.001]]).contact


def test_a_certificate_speaks_of_the_polyhedron_around(tmp_path):
    robot = robot_of(tmp_path, "capsule", 0.02, Rotation.identity())
    file = tmp_path / "c.json"
    waypoints = [[-0.3], [-2e-4]]
    write_path_certificate(robot, wall_at(0.02), waypoints, 0.0, file)
    assert verify(file).accepted
    nearer = json.loads(file.read_text())
    with np.load(file.with_suffix(".npz")) as meshes:
        widths = [np.ptp(meshes[n][:, 0]) for n in meshes if n.endswith("vertices")]
    assert len(nearer["bodies"]) == 2
    assert 0.04 <= min(widths) < 0.04 + 2 * TOLERANCE  # the capsule's, from outside


def answer(verdict):
    return Answer(verdict, f"it is {verdict}", ("q",), (("a", "b"),))


# names and how far they may be larger than their shapes
BAND = {"flat": 0.0, "ball": 1e-4, "rod": 2e-4}


def bodies():
    """A robot and a scene of bodies with the same names and bands."""
    meshes = [SimpleNamespace(name=n, excess=width) for n, width in BAND.items()]
    parts = [SimpleNamespace(mesh=mesh) for mesh in meshes]
    others = [SimpleNamespace(name=mesh.name, mesh=mesh) for mesh in meshes]
    return SimpleNamespace(parts=parts), SimpleNamespace(obstacles=others)


def found(obstacles="clear", itself="clear", **more):
    fields = {
        "margin_m": 0.0,
        "clearance_m": 0.25,
        "closest": None,
        "contacts": (),
        "self_contacts": (),
        "contained": (),
        "verdict": "contact",
        "reason": "as found",
        "qualifiers": ("q",),
        **more,
    }
    names = [f.name for f in dataclass_fields(Verdict)]
    rest = dict.fromkeys(names)
    both = {"obstacles": answer(obstacles), "itself": answer(itself)}
    return Verdict(**{**rest, **fields, **both})


def touch(*names):
    return TrianglePair(*names, 0, 0)


def held(first, second, state="a_in_b", role="scanner"):
    return Containment(first, second, role, state, f"{first} in {second}")


FLAT, ROUND = ("flat", "flat"), ("flat", "ball")


@pytest.mark.parametrize("own", [False, True])
def test_contact_is_sure_if_one_pair_is_of_no_round_shape(own):
    role, field = ("self", "self_contacts") if own else ("scanner", "contacts")
    other = "contacts" if own else "self_contacts"
    sure = [
        {field: (touch(*FLAT),)},
        {field: (touch(*ROUND), touch(*FLAT))},
        {field: (touch(*ROUND),), "contained": (held(*FLAT, role=role),)},
    ]
    unsure = [
        {},
        {field: (touch(*ROUND),)},
        {field: (touch(*ROUND[::-1]),)},
        {field: (touch("ball", "ball"),)},
        {field: (touch("ball", "rod"),)},
        {other: (touch(*FLAT),)},
        {"contained": (held(*FLAT, state="unknown", role=role),)},
        {"contained": (held(*FLAT, role="self" if role != "self" else "couch"),)},
        {"contained": (held(*ROUND, role=role),)},
    ]
    for fields, expected in [*((f, True) for f in sure), *((f, False) for f in unsure)]:
        verdict = found("contact", "contact", **fields)
        assert round_shapes.is_sure(verdict, *bodies(), own) is expected, fields


def nearest(link="ball", obstacle="rod", distance=0.125):
    points = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    return Closest(link, obstacle, "scanner", distance, 0.25, points, (0, 0))


HELD_OUT, HELD_IN = held("ball", "flat"), held("ball", "flat", role="self")
IN_OUT = held("rod", "flat", "unknown")
IN_IN = held("rod", "flat", "unknown", role="self")


def both_ways(own, *, inside="clear", **more):
    around = found(
        "contact",
        "contact",
        contacts=(touch("ball", "rod"),),
        self_contacts=(touch("rod", "flat"),),
        contained=(HELD_OUT, HELD_IN),
        **more,
    )
    inner = found(
        inside, inside, contained=(IN_OUT, IN_IN), closest=nearest("rod", "flat")
    )
    return around, round_shapes.between(around, inner, *bodies(), own)


def test_about_obstacles_what_lies_in_the_band_is_unknown():
    around, verdict = both_ways(False)
    assert verdict.obstacles == Answer(
        "unknown",
        "ball and rod: 0 to 0.300 mm apart; ball is round and known to 0.100 mm and "
        "rod is round and known to 0.200 mm",
    )
    assert verdict.itself == around.itself
    assert (verdict.contacts, verdict.self_contacts) == ((), around.self_contacts)
    assert verdict.contained == (HELD_IN, IN_OUT)
    assert verdict.closest == nearest("rod", "flat", 0.0)
    assert verdict.clearance_m == 0.0
    # the robot itself decides
    assert (verdict.verdict, verdict.reason) == ("contact", "it is contact")
    assert verdict.qualifiers == ("q",)


def test_about_itself_the_obstacles_keep_their_answer():
    around, verdict = both_ways(True)
    assert verdict.itself == Answer(
        "unknown",
        "rod and flat: 0 to 0.200 mm apart; rod is round and known to 0.200 mm",
    )
    assert verdict.obstacles == around.obstacles
    assert (verdict.contacts, verdict.self_contacts) == (around.contacts, ())
    assert verdict.contained == (HELD_OUT, IN_IN)
    assert (verdict.closest, verdict.clearance_m) == (None, None)


def test_the_qualifiers_are_those_of_the_worse_answer():
    around, verdict = both_ways(False, qualifiers=("of another question",))
    assert around.qualifiers == ("of another question",)
    assert verdict.qualifiers == around.itself.qualifiers == ("q",)


def test_nearest_points_that_are_known_stay():
    for own in (False, True):
        _, verdict = both_ways(own, closest=nearest())
        assert verdict.closest == nearest()
        assert verdict.clearance_m == 0.125


def test_contact_of_what_lies_within_is_contact():
    for own in (False, True):
        around, verdict = both_ways(own, inside="contact")
        assert verdict is around


@pytest.mark.parametrize("own", [False, True])
def test_with_a_margin_the_band_lies_outside_it(own):
    _, verdict = both_ways(own, margin_m=0.005)
    reason = (verdict.itself if own else verdict.obstacles).reason
    assert ("more than the margin of 5 mm apart" in reason) is not own


def test_the_pair_that_is_told_is_the_first_in_contact():
    pair = round_shapes._pair
    both = {"contacts": (touch("a", "b"), touch("c", "d"))}
    both["self_contacts"] = (touch("e", "f"),)
    assert pair(found(**both), False) == ("a", "b")
    assert pair(found(**both), True) == ("e", "f")
    solids = (HELD_IN, held("rod", "ball"), HELD_OUT)
    assert pair(found(contained=solids), False) == ("rod", "ball")
    assert pair(found(contained=solids[1:] + solids[:1]), True) == ("ball", "flat")
    assert pair(found(contained=(HELD_IN,), closest=nearest()), False) == (
        *("ball", "rod"),
    )


def test_only_the_questions_that_are_unsure_are_asked_again(monkeypatch):
    """And nothing where there are no polyhedra within."""
    sure = {False: False, True: False}
    changed = []

    def between(around, inside, robot, scene, own):
        assert inside == ("examined", "parts", "others")
        changed.append(own)
        return replace(around, reason=f"{around.reason} {own}")

    shapes = ("parts", "others")
    monkeypatch.setattr(round_shapes, "is_sure", lambda *given: sure[given[-1]])
    monkeypatch.setattr(round_shapes, "within", lambda *given: shapes)
    monkeypatch.setattr(round_shapes, "between", between)

    def asked(obstacles, itself):
        del changed[:]
        verdict = found(obstacles, itself)
        new = round_shapes.confirmed(
            verdict, None, None, lambda *given: ("examined", *given)
        )
        assert new.reason == " ".join(["as found", *map(str, changed)])
        return list(changed)

    assert asked("contact", "contact") == [False, True]
    assert asked("contact", "unknown") == [False]
    assert asked("clear", "contact") == [True]
    assert asked("clear", "unknown") == []
    sure[False] = True
    assert asked("contact", "contact") == [True]
    shapes = None
    assert asked("contact", "contact") == []


def test_robot_and_scene_within_have_every_inner_mesh(tmp_path):
    robot = robot_of(tmp_path, "sphere", 0.05, Rotation.identity())
    scene = wall_at(0.5)
    parts, others = round_shapes.within(robot, scene)
    assert [p.mesh for p in parts.parts] == [p.mesh.inner for p in robot.parts]
    assert parts.parts[0].mesh is not robot.parts[0].mesh
    assert [o.mesh for o in others.obstacles] == [scene.obstacles[0].mesh]
    flat = replace(robot, parts=())
    assert round_shapes.within(flat, scene) is None
    ball = replace(scene.obstacles[0], mesh=robot.parts[0].mesh)
    _, others = round_shapes.within(flat, replace(scene, obstacles=(ball,)))
    assert others.obstacles[0].mesh is robot.parts[0].mesh.inner


def test_polyhedra_of_a_pair_are_too_large_by_both_of_their_bands(tmp_path):
    """As `queries` allow for it: with obstacles alone, in the order of the pairs."""
    robot = robot_of(tmp_path, "sphere", 0.05, Rotation.identity())
    scene = wall_at(0.5)
    ball = Obstacle("ball", "other", sphere("ball", 0.07), "")
    both = replace(scene, obstacles=(*scene.obstacles, ball))
    own, other = robot.parts[0].mesh.excess, ball.mesh.excess
    assert own > 0.0
    assert other > 0.0
    asked = bc.queries(robot, both)
    np.testing.assert_allclose(asked._excess, [own, own + other])
    assert bc.queries(robot, replace(scene, obstacles=()))._excess.shape == (0,)


@pytest.mark.parametrize("seed", range(4))
def test_bounds_of_a_ball_hold_its_distance_and_are_nothing_in_contact(tmp_path, seed):
    """From the first pair on; the ball is turned, so that no face looks at the wall."""
    turn = Rotation.random(rng=seed)
    robot = robot_of(tmp_path, "sphere", 0.05, turn)
    asked = bc.queries(robot, wall_at(0.5))
    band = robot.parts[0].mesh.excess
    low, high = asked.clearance([[0.0], [0.3], [0.46]]).T
    gaps = np.array([0.45, 0.15])
    assert (low[:2] <= gaps).all()
    assert (high[:2] >= gaps).all()
    assert (high - low <= band + 1e-9)[:2].all()
    assert (low[2], high[2]) == (0.0, 0.0)
