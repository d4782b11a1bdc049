"""The certified least clearance: where it is known by hand, and by other libraries."""

import json

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.settings import settings
from borecheck.core.se3 import transform
from borecheck.errors import UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.motion import least_clearance as least_of
from borecheck.motion.check import check_motion, check_path
from borecheck.motion.least_clearance import Tolerance, least_clearance
from borecheck.motion.problem import Body, Passage, PathProblem
from borecheck.motion.search import search
from borecheck.plans.corridor import Corridor
from borecheck.report.document import motion_block
from borecheck.report.motion_words import at_least, at_most
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES
from borecheck.robots.scene import Obstacle, Scene
from studies import resampled_motions
from tests.chains import hinge, slider
from tests.places import ROBOTS

# Distances of some metres in float64, and the reserve of the search.
ROUNDING = 1e-8


SLIDER, HINGE = slider(), hinge()


def cube(name, edge=0.1):
    return box(name, [edge] * 3)


def standing(mesh, *place, name=None):
    return Body(name or mesh.name, mesh, T_frame_mesh=transform(place))


def certified(problem, waypoints, **more):
    return least_clearance(problem, waypoints, search(problem, waypoints), **more)


def passing(gap, margin=0.0):
    """A cube that slides past the edge of another, which is a gap beside its way."""
    wall = standing(cube("wall"), 0.5, 0.1 + gap, 0.0)
    part = Body("part", cube("part"), 0)
    return PathProblem(SLIDER, (part,), (wall,), margin=margin)


@pytest.mark.parametrize("gap", [1e-5, 1e-3, 0.02, 0.3])
def test_the_gap_beside_a_straight_way_is_found(gap):
    found = certified(passing(gap), [[0.0], [1.1]])
    assert gap * 0.95 - 1e-4 <= found.lower < gap
    assert found.upper == pytest.approx(gap, abs=ROUNDING)
    # the faces are beside each other while the slider goes from 0.4 to 0.6 m
    assert 0.4 - 1e-6 <= 1.1 * found.at <= 0.6 + 1e-6
    assert found.names == ("part", "wall")
    assert found.within_tolerance


def test_it_is_found_between_samples(monkeypatch):
    """A bar passes a pin where none of the 41 poses is near: a turn by 2.4 rad."""
    monkeypatch.setattr(least_of, "INSTANTS", 2)
    tip, pin = 0.3, 0.002
    bar = Body(
        "bar", box("bar", [tip, 1e-3, 1e-3]).moved(transform([tip / 2, 0, 0])), 0
    )
    post = standing(box("post", [pin, pin, 0.1]), tip + 0.01 + pin / 2, 0.0, 0.0)
    problem = PathProblem(HINGE, (bar,), (post,))
    start, end = -1.2 - 0.7 * 2.4 / 40, 1.2 - 0.7 * 2.4 / 40 + 0.05
    found = certified(problem, [[start], [end]])
    # the bar's corner is 0.5 mm aside of its axis: nearest along the post's face
    reach = np.hypot(tip, 5e-4)
    assert found.upper == pytest.approx(tip + 0.01 - reach, rel=1e-4)
    assert 0.95 * found.upper - 1e-4 <= found.lower <= tip + 0.01 - reach


def test_clear_with_a_margin_and_the_clearance_agree():
    gap = 0.02
    for margin in (0.0, 0.5 * gap, 0.97 * gap, gap - 1e-6):
        found = certified(passing(gap, margin), [[0.0], [1.1]])
        assert found.lower > margin
    for margin in (gap, gap + 1e-7, 2 * gap):
        verdict = search(passing(gap, margin), [[0.0], [1.1]])
        assert verdict.verdict == "contact"
        found = least_clearance(passing(gap, margin), [[0.0], [1.1]], verdict)
        assert found.lower < gap <= margin  # within the margin there is a clearance


def test_in_contact_there_is_none():
    problem = PathProblem(
        SLIDER, (Body("part", cube("part"), 0),), (standing(cube("wall"), 0.5, 0, 0),)
    )
    assert certified(problem, [[0.0], [1.0]]) is None
    inside = PathProblem(
        SLIDER,
        (Body("part", cube("part"), 0),),
        (standing(cube("room", 3.0), 0.5, 0, 0),),
        margin=1e-3,
    )
    assert certified(inside, [[0.0], [0.1]]) is None
    alone = PathProblem(SLIDER, (Body("part", cube("part"), 0),), ())
    assert certified(alone, [[0.0], [0.1]]) is None


def test_parts_among_themselves_do_not_count():
    frame = JointChain(
        parent=np.array([-1, -1]),
        origin=np.stack([np.eye(4), transform([0.0, 0.11, 0.0])]),
        kind=np.array([SLIDES, SLIDES]),
        axis=np.array([(1.0, 0.0, 0.0)] * 2),
        source=np.array([0, 0]),
        factor=np.array([1.0, 1.0]),
        offset=np.zeros(2),
    )
    parts = (Body("a", cube("a"), 0), Body("b", cube("b"), 1))
    wall = standing(cube("wall"), 0.0, -0.4, 0.0)
    problem = PathProblem(frame, parts, (wall,), ((0, 1),))
    found = certified(problem, [[-0.2], [0.3]])
    assert found.names == ("a", "wall")
    assert found.upper == pytest.approx(0.3, abs=ROUNDING)


def test_a_needle_in_its_patient_does_not_count():
    needle = Body("needle", box("needle", [0.1, 1e-3, 1e-3]), 0)
    patient = Body("patient", cube("patient", 0.2).moved(transform([0.3, 0, 0])))
    stand = Body("stand", cube("stand").moved(transform([0.2, 0.3, 0])))
    corridor = Corridor(np.array([0.2, 0, 0]), np.array([0.3, 0, 0]), 1e-3)
    problem = PathProblem(
        SLIDER, (needle,), (patient, stand), passages=(Passage(0, 0, corridor),)
    )
    found = certified(problem, [[0.0], [0.2]])
    assert found.names == ("needle", "stand")
    assert found.pair == (0, 1)
    assert found.upper == pytest.approx(0.25 - 5e-4, abs=ROUNDING)


def test_a_finer_tolerance_is_kept():
    for relative in (0.2, 0.01, 1e-3):
        found = certified(
            passing(0.05), [[0.0], [1.1]], tolerance=Tolerance(relative, 0.0)
        )
        assert found.within_tolerance
        assert 0.05 * (1.0 - relative) - ROUNDING <= found.lower < 0.05


@pytest.mark.parametrize("wrong", [(0.0, 0.0), (-0.1, 1.0), (1.0, 0.1), (0.1, np.nan)])
def test_a_tolerance_that_is_none_is_refused(wrong):
    with pytest.raises(UsageError):
        Tolerance(*wrong)


def test_what_is_not_reached_is_said(monkeypatch):
    """Too few pieces to show more than the verdict did: the margin is what is known."""
    monkeypatch.setattr(least_of, "PIECE_LIMIT", 1)
    monkeypatch.setattr(least_of, "QUICK_LIMIT", 1)
    arm = bc.load_robot(ROBOTS / "two_link.urdf")
    found = check_path(arm, scene_beside(), [[-1.0], [1.0]], margin=1e-3)
    assert found.clear
    assert found.least.lower == np.nextafter(1e-3, 1.0)
    assert not found.least.within_tolerance
    assert found.least.lower < found.least.upper


def scene_beside():
    mesh = box("plate", (0.001, 0.2, 0.02)).moved(transform([0.28, 0, 1.08]))
    return Scene(
        "s", None, {}, "t", (Obstacle("plate", "other", mesh, "t"),), {}, (), ()
    )


def test_a_robot_s_motion_in_verdict_and_document():
    arm, scene = bc.load_robot(ROBOTS / "two_link.urdf"), scene_beside()
    waypoints = [[-1.0], [1.0]]
    path = check_path(arm, scene, waypoints)
    dense = np.linspace(-1.0, 1.0, 2001)
    seen = min(bc.check(arm, scene, [q]).clearance_m for q in dense)
    assert path.clearance_m <= seen
    assert path.clearance_m >= 0.95 * seen
    # a round arm may be thinner than the polyhedron round it
    excess = max(part.mesh.excess for part in arm.parts)
    assert 0.999 * seen <= path.clearance_upper_m - excess <= seen
    assert check_path(arm, scene, waypoints, clearance=False).least is None
    motion = check_motion(arm, scene, waypoints, settings(), samples=3)
    block = json.loads(json.dumps(motion_block(motion, arm.model.joint_names)))
    assert block["clearance_m"] == motion.least.lower
    assert block["clearance_upper_m"] == motion.least.upper
    at = arm.model.configuration(block["q"])
    assert bc.check(arm, scene, at).closest.upper == pytest.approx(
        block["clearance_upper_m"], abs=ROUNDING
    )
    assert block["closest"]["upper"] == pytest.approx(block["clearance_upper_m"])
    worst = block["path"]["worst"]
    assert "clearance_m" not in worst  # a sample's bears another name
    assert worst["sampled_clearance_m"] > block["clearance_m"]


def test_samples_alone_certify_no_clearance():
    arm, scene = bc.load_robot(ROBOTS / "two_link.urdf"), scene_beside()
    for chosen, certify in ((settings(), False), (settings("coal"), True)):
        motion = check_motion(arm, scene, [[-1.0], [1.0]], chosen, certify=certify)
        assert motion.least is None
        block = motion_block(motion, arm.model.joint_names)
        assert block["clearance_m"] is None
        assert block["closest"] is None
        assert block["path"]["worst"]["sampled_clearance_m"] > 0.0


def test_within_the_margin_the_clearance_is_certified_still():
    arm, scene = bc.load_robot(ROBOTS / "two_link.urdf"), scene_beside()
    free = check_path(arm, scene, [[-1.0], [1.0]])
    margin = 2.0 * free.clearance_upper_m
    motion = check_motion(arm, scene, [[-1.0], [1.0]], settings(margin=margin))
    assert motion.contact
    assert motion.least.lower == pytest.approx(free.clearance_m, rel=0.05)


def test_printed_bounds_are_bounds():
    rng = np.random.default_rng(3)
    for length in 10.0 ** rng.uniform(-6, 0, 1000):
        assert float(at_least(length).split()[0]) <= 1e3 * length * (1.0 + 1e-12)
        assert float(at_most(length).split()[0]) >= 1e3 * length * (1.0 - 1e-12)


def test_a_part_of_the_study():
    """Of `python -m studies.resampled_motions`, which runs a thousand motions."""
    result = resampled_motions.run(chains=14, robots=0, seed=7)
    assert result.wrong == []
    assert len(result.below["all"]) >= 5
    assert np.median(result.below["all"]) <= 0.05
    assert max(result.above) < 1e-5


def test_a_trip_builds_every_tree_once_and_searches_once(monkeypatch, tmp_path):
    """Check, motion, least clearance and certificate of Zerobot in its gantry."""
    from borecheck.geometry.tree import kept_trees
    from borecheck.motion import certify, check

    counts = {"trees": 0, "searches": 0}

    def counted(name, real):
        def call(*words, **more):
            counts[name] += 1
            return real(*words, **more)

        return call

    monkeypatch.setattr(kept_trees, "build", counted("trees", kept_trees.build))
    for module in (check, certify):
        real = module.search
        monkeypatch.setattr(module, "search", counted("searches", real))
    robot, scene = bc.load_robot("zerobot", mount="+90"), bc.load_scene("ct_gantry")
    bc.check(robot, scene, robot.home)
    ways = [robot.home, robot.home + 0.02]
    motion = check_motion(robot, scene, ways, settings(), samples=2)
    certify.write_certificate_of(motion.proof, robot, scene, tmp_path / "c.json")
    meshes = {part.mesh for part in robot.parts} | {o.mesh for o in scene.obstacles}
    assert counts == {"trees": len(meshes), "searches": 1}
    assert len(meshes) == 17
