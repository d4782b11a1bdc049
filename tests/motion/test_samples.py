"""Motions of robots: samples never make one clear, certificates agree with samples."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.check import check_with
from borecheck.contact.settings import settings
from borecheck.errors import JointLimitError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.check import check_motion
from borecheck.motion.robot_problem import path_problem
from borecheck.motion.samples import configurations_at, sample_fractions, sample_motion
from borecheck.plans.corridor import Corridor
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.scene import Obstacle, Scene
from tests.places import ROBOTS

EXACT = settings()

# a dozen products of transforms of a few metres
ROUNDING = 1e-12


def scene_of(*meshes, role="other"):
    obstacles = tuple(Obstacle(m.name, role, m, "test") for m in meshes)
    return Scene("test", None, {}, "test", obstacles, {}, (), ())


def block(centre, size, name="block"):
    mesh = box(name, np.broadcast_to(size, 3))
    return TriangleMesh(name, mesh.vertices + np.array(centre), mesh.triangles)


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(ROBOTS / "two_link.urdf")


@pytest.fixture(scope="module")
def mimics():
    return bc.load_robot(ROBOTS / "mimic_chain.urdf")


FAR = scene_of(block([9.0, 0, 0], 0.1))


# A sheet of 1 mm that the arm's tip sweeps through between two samples.
SHEET = scene_of(block([0.35, 0.0, 0.65], [0.001, 0.2, 0.02]))


def test_samples_alone_are_never_clear(arm):
    motion = check_motion(arm, FAR, [[-1.0], [1.0]], EXACT, certify=False)
    assert motion.sampled_clear == len(motion.poses) == 41
    assert motion.verdict == "unknown"
    assert not motion.certified
    assert "not certified between" in motion.reason


@pytest.mark.parametrize("margin", [0.0, 0.05])
def test_the_worst_sample_meets_before_others_come_within_the_margin(arm, margin):
    beside = scene_of(block([0.2, 0.0, 0.6], 0.2))
    motion = check_motion(arm, beside, [[-0.5], [0.5]], settings(margin=margin))
    found = [pose for pose in motion.poses if pose.verdict == "contact"]
    near = [pose for pose in found if pose.qualifiers == ("within_margin",)]
    assert len(found) > len(near)
    assert bool(near) == (margin > 0.0)
    worst = motion.poses[motion.worst]
    assert worst.contacts
    assert worst.clearance_m is None


def test_with_a_certificate_it_is(arm):
    motion = check_motion(arm, FAR, [[-1.0], [1.0]], EXACT)
    assert (motion.verdict, motion.certified) == ("clear", True)
    assert [(i.start, i.end, i.verdict) for i in motion.intervals] == [(0, 1, "clear")]


def test_contact_between_samples_is_not_called_clear(arm):
    """Two samples miss the sheet; a denser look finds it, where it is."""
    waypoints = [[-1.0], [1.0]]
    sampled = sample_motion(arm, SHEET, waypoints, EXACT, samples=2)
    assert sampled.sampled_clear == 2
    assert sampled.verdict == "unknown"
    denser = check_motion(arm, SHEET, waypoints, EXACT)
    assert denser.verdict == "contact"
    swept = np.arctan2(0.35, 0.45)  # the sheet's middle, as seen from the hinge
    assert 2.0 * denser.first_contact - 1.0 == pytest.approx(swept, abs=0.15)


@pytest.mark.parametrize("checker", ["paper", "coal"])
def test_checkers_that_cannot_be_certified_stay_unknown(arm, checker):
    motion = check_motion(arm, FAR, [[-1.0], [1.0]], settings(checker))
    assert motion.verdict == "unknown"
    assert not motion.certified


@pytest.mark.parametrize("kind", ["enlarge-axes", "enlarge-axes:world"])
def test_margins_that_cannot_be_certified_stay_unknown(arm, kind):
    grown = settings(margin=0.02, margin_kind=kind)
    assert (
        check_motion(arm, FAR, [[-0.1], [0.1]], grown, samples=3).verdict == "unknown"
    )


def test_a_margin_is_kept_at_every_instant(arm):
    """The tip passes the block's face at 0 rad, between samples."""
    near = scene_of(block([0.0, 0.0, 1.3], [0.5, 0.5, 0.1]))
    waypoints = [[-1.0], [1.0]]
    passing = [check_with(arm, near, [q], EXACT) for q in np.linspace(-0.1, 0.1, 41)]
    room = min(verdict.clearance_m for verdict in passing)
    assert room > 0.05
    for margin, verdict in ((room - 1e-3, "clear"), (room + 1e-3, "contact")):
        motion = check_motion(arm, near, waypoints, settings(margin=margin), samples=2)
        assert motion.verdict == verdict


@pytest.mark.parametrize("robot", ["arm", "mimics", "zerobot"])
def test_the_certificates_chain_is_the_models(robot, request, rng):
    """The search has a chain of its own; both must place every link alike."""
    robot = request.getfixturevalue(robot)
    frame_of, chain = chain_of(robot)
    for q in robot.model.random_configurations(rng, 10):
        theta = chain.thetas(q[None])[0]
        placed = chain.placed(theta)
        for link, T in robot.placements(q).items():
            assert np.abs(placed[frame_of[link]] - T).max() < ROUNDING


def test_random_motions_agree_with_dense_samples(mimics, rng):
    """A mimic chain past random blocks: nothing certified clear shows contact."""
    counts = {"clear": 0, "contact": 0, "unknown": 0}
    for _ in range(25):
        scene = scene_of(
            *(
                block(rng.uniform([-0.1, -0.1, -0.1], [0.5, 1.0, 0.4]), 0.1, f"b{k}")
                for k in range(2)
            )
        )
        waypoints = rng.uniform(0.0, 0.35, (3, 1))
        motion = check_motion(mimics, scene, waypoints, EXACT, samples=2)
        dense = configurations_at(waypoints, np.linspace(0.0, 1.0, 60))
        seen = {check_with(mimics, scene, q, EXACT).verdict for q in dense}
        counts[motion.verdict] += 1
        if motion.verdict == "clear":
            assert seen == {"clear"}
        if "contact" in seen:
            assert motion.verdict == "contact"
    assert counts["clear"] >= 4
    assert counts["contact"] >= 4


def test_self_contact_on_the_way_is_found(tmp_path):
    """`two` slides through `base` between two waypoints that are clear."""
    text = (ROBOTS / "mimic_chain.urdf").read_text()
    path = tmp_path / "through.urdf"
    through = text.replace(
        'multiplier="2" offset="0.25"', 'multiplier="-8" offset="0.4"'
    )
    assert through != text
    path.write_text(through)
    robot = bc.load_robot(path)
    waypoints = [[0.0], [0.11]]
    ends = [check_with(robot, FAR, q, EXACT).verdict for q in waypoints]
    assert ends == ["clear", "clear"]
    assert check_with(robot, FAR, [0.05], EXACT).self_contacts
    assert check_motion(robot, FAR, waypoints, EXACT, samples=2).verdict == "contact"


def test_limits_of_mimic_joints_hold_at_waypoints_and_so_between(mimics, rng):
    """c = 0.5 - (0.25 + 2 a) within [-5, 1]; both ends within, all within."""
    with pytest.raises(JointLimitError, match="waypoint 2"):
        check_motion(mimics, FAR, [[0.0], [1.5]], EXACT)
    low, high = np.array([0.0]), np.array([1.0])
    for f in np.linspace(0.0, 1.0, 50):
        mimics.model.check_limits(low + f * (high - low))


def test_one_waypoint_is_a_pose(arm):
    motion = check_motion(arm, FAR, [[0.3]], EXACT)
    pose = check_with(arm, FAR, [0.3], EXACT)
    assert motion.verdict == pose.verdict == "clear"
    assert len(motion.poses) == 1
    assert motion.poses[0].clearance_m == pose.clearance_m


def test_equal_waypoints_stand_still(arm):
    for waypoints in ([[0.3], [0.3]], [[0.3]] * 4):
        motion = check_motion(arm, FAR, waypoints, EXACT, samples=5)
        assert (motion.verdict, motion.certified) == ("clear", True)


def test_every_waypoint_is_a_sample(rng):
    points = rng.uniform(-1.0, 1.0, (7, 2))
    fractions = sample_fractions(points, 4)
    configurations = configurations_at(points, fractions)
    for k, point in enumerate(points):
        assert np.abs(fractions - k / 6).min() < 1e-15
        assert np.abs(configurations - point).max(axis=1).min() < 1e-15
    assert (np.diff(fractions) > 0.0).all()
    assert fractions[0] == 0.0
    assert fractions[-1] == 1.0


@pytest.mark.parametrize(
    "waypoints",
    [[], [[]], [0.0], [[np.nan]], [[np.inf]], [[0.0, 0.0]], "text", None, [["a"]]],
)
def test_waypoints_that_are_none(arm, waypoints):
    with pytest.raises(UsageError):
        check_motion(arm, FAR, waypoints, EXACT)


def test_too_few_samples(arm):
    with pytest.raises(UsageError, match="too few"):
        check_motion(arm, FAR, [[0.0], [0.1]], EXACT, samples=0)


def test_an_open_surface_near_the_robot_is_not_certified(arm):
    around = block([0.0, 0.0, 0.6], 4.0)
    shell = TriangleMesh("shell", around.vertices, around.triangles[1:])
    motion = check_motion(arm, scene_of(shell), [[0.0], [0.2]], EXACT, samples=3)
    assert motion.verdict == "unknown"
    assert "open" in motion.reason


def test_with_a_corridor_needle_and_patient_are_examined_too(zerobot, ct_gantry):
    corridor = Corridor(np.array([0.0, 0, 0]), np.array([0.0, 0, -0.05]), 0.00055)
    home = zerobot.home
    moved = home + [0.001, 0, 0, 0, 0, 0]
    plain = path_problem(zerobot, ct_gantry)
    planned = path_problem(zerobot, ct_gantry, corridor=corridor)
    assert plain.passages == ()
    (passage,) = planned.passages
    assert planned.parts[passage.part].name == "needle"
    assert planned.obstacles[passage.obstacle].name == "torso"
    assert len(planned.pairs) == len(plain.pairs) - 1
    found = check_motion(
        zerobot, ct_gantry, [home, moved], EXACT, corridor=corridor, samples=2
    )
    assert found.not_covered == ()
    assert f"for {len(plain.pairs)} pairs" in found.reason


def test_a_needle_driven_past_its_target_is_contact(zerobot, ct_gantry):
    from borecheck.plans.needle_plan import NeedlePlan
    from borecheck.plans.plan_motion import plan_motion

    plan = NeedlePlan("p", np.array([0.0, 0, -0.0011]), np.array([0.0, 0, -0.05]))
    motion = plan_motion(zerobot, plan)
    planned = check_motion(
        zerobot,
        ct_gantry,
        motion.waypoints,
        EXACT,
        corridor=motion.corridor,
        samples=3,
        certify=False,
    )
    assert planned.sampled_clear == len(planned.poses)
    assert planned.poses[-1].corridor_contacts > 0
    certified = check_motion(
        zerobot, ct_gantry, motion.waypoints, EXACT, corridor=motion.corridor, samples=3
    )
    assert certified.verdict == "clear"
    assert certified.certified
    assert certified.not_covered == ()
    deeper = motion.waypoints.copy()
    deeper[-1, 5] += 0.01
    past = check_motion(
        zerobot,
        ct_gantry,
        deeper,
        EXACT,
        corridor=motion.corridor,
        samples=3,
        certify=False,
    )
    assert past.verdict == "contact"
    assert "10.0 mm beyond the target" in past.reason
