"""Set-ups of all kinds of arms: what is given holds, what is denied is not there."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UnknownNameError, UsageError
from borecheck.plans.corridor import Corridor
from borecheck.plans.plan_file import read_plans
from borecheck.setup.requirements import requirements
from borecheck.setup.terms import Terms
from tests.places import PROJECT, ROBOTS

CRANE = read_plans(PROJECT / "urdf/crane/examples/plans.csv")
ZEROBOT = read_plans(PROJECT / "urdf/zerobot/examples/plans.csv")


@pytest.fixture(scope="module")
def bore():
    return bc.load_scene("ct_gantry", bore="0.70")


@pytest.fixture(scope="module")
def crane():
    return bc.load_robot("crane")


@pytest.fixture(scope="module")
def left(crane, bore):
    return bc.setup(crane, bore, CRANE[1])[0]


def test_a_reachable_one_holds_by_other_means(crane, bore, left):
    assert left.reachable
    plan = left.plan
    corridor = Corridor(plan.entry, plan.target, 0.915e-3)
    assert bc.check(crane, bore, left.q, margin=0.01, corridor=corridor).clear
    T = crane.placements(left.q)["needle_tip"]
    assert np.linalg.norm(T[:3, 3] - plan.entry) < 1e-9
    assert left.constraints["cone"]["certified"]
    torque = left.constraints["torque"]
    assert all(t["needed"] <= t["effort"] for t in torque.values())
    cost = Terms(crane, bore, requirements()).costs(left.q[None], 0.0).total[0]
    assert left.cost == cost


def test_it_is_better_than_what_random_coordinates_give(crane, bore, left):
    from borecheck.setup.family import family_of
    from borecheck.setup.terms import NOTHING

    terms, family = Terms(crane, bore, requirements()), family_of(crane, 0.0)
    x = np.random.default_rng(5).uniform(family.lower, family.upper, (1500, 3))
    qs = family.configurations(left.plan.entry, left.plan.direction, x)
    qs = qs[terms.broken(qs) == NOTHING]
    assert len(qs) > 100
    # the cone is not asked of these: some may be a little better
    assert (terms.costs(qs).total < left.cost - 0.02).mean() < 0.01


def test_its_motion_is_certified_along_the_plan(crane, bore, left):
    plan, way = left.plan, left.motion
    ends = [crane.placements(q)["needle_tip"][:3, 3] for q in way[[0, -1]]]
    np.testing.assert_allclose(ends[0], plan.entry - 0.05 * plan.direction, atol=1e-9)
    np.testing.assert_allclose(ends[1], plan.target, atol=1e-9)
    corridor = Corridor(plan.entry, plan.target, 0.915e-3)
    assert bc.check_path(crane, bore, way, corridor=corridor).clear


def test_branches_that_are_all_are_a_proof():
    """Zerobot: one is reached, one is not, and brute force agrees."""
    robot, scene = bc.load_robot("zerobot"), bc.load_scene("ct_gantry")
    far, near = bc.setup(robot, scene, [ZEROBOT[5], ZEROBOT[0]])
    assert (far.status, near.status) == ("unreachable", "reachable")
    assert "cone" in far.reason
    lost = bc.NeedlePlan("lost", (0.9, 0.9, 0.9), (0.9, 0.9, 0.86))
    answer = bc.setup(robot, scene, lost)[0]
    assert answer.status == "unreachable"
    assert answer.constraints["against"] == {"joint limits": 2}
    assert answer.q is None
    assert answer.motion is None


def test_what_the_drive_cannot_reach_is_said_at_once(crane, bore):
    deep = bc.NeedlePlan("deep", CRANE[0].entry, CRANE[0].entry - (0.0, 0.0, 0.06))
    answer = bc.setup(crane, bore, deep)[0]
    assert answer.status == "unreachable"
    assert "60.0 mm deep, but q8 drives it 47.5 mm" in answer.reason
    assert bc.setup(crane, bore, deep, depth="0mm", cone=0.0)[0].reachable


def test_a_strangers_arm_is_found_or_undecided():
    robot = bc.load_robot(
        PROJECT / "borecheck/examples/arm.urdf",
        base="550mm,0,-350mm,0,0,180deg",
        needle="needle_link",
        tip="needle_tip",
    )
    examples = PROJECT / "borecheck/examples"
    scene = bc.load_scene(
        f"{examples / 'gantry.stl'}:mm",
        patients=[f"{examples / 'torso.stl'}:mm@0,0,-0.1"],
    )
    plan = read_plans(examples / "plans.csv")[0]
    found = bc.setup(robot, scene, plan, cone=0.05)[0]
    assert found.reachable
    assert found.solver == "null space"
    lost = bc.NeedlePlan("lost", (2.0, 2.0, 2.0), (2.0, 2.0, 1.9))
    assert bc.setup(robot, scene, lost)[0].status == "undecided"


def test_excluded_pairs_need_no_padding_but_may_not_touch(crane, bore, left):
    """A padding no arm keeps from the couch and the bore, but for pairs left out."""
    none = bc.setup(crane, bore, CRANE[1], margin=0.06)[0]
    assert none.status == "undecided"
    links = {part.link for part in crane.parts}
    pairs = [(link, "torso") for link in links - {"needle"}]
    found = bc.setup(crane, bore, CRANE[1], margin=0.06, excluded=pairs)[0]
    assert found.reachable
    corridor = Corridor(found.plan.entry, found.plan.target, 0.915e-3)
    assert bc.check(crane, bore, found.q, corridor=corridor).clear


@pytest.mark.parametrize(
    ("asked", "saying"),
    [
        ({"solver": "magic"}, "unknown solver 'magic'"),
        ({"force": -1.0}, "force is -1.0"),
        ({"cone": float("nan")}, "cone is nan"),
        ({"margin": "10deg"}, "10deg"),
        ({"weights": {"speed": 1.0}}, "no weight is called 'speed'"),
        ({"excluded": [("needle", "tors")]}, "did you mean 'torso'"),
    ],
)
def test_what_is_no_request_is_one_line(crane, bore, asked, saying):
    with pytest.raises((UsageError, UnknownNameError), match=saying):
        bc.setup(crane, bore, CRANE[0], **asked)


def test_a_robot_without_needle_is_told(bore):
    with pytest.raises(UsageError, match="needle"):
        bc.setup(bc.load_robot(ROBOTS / "two_link.urdf"), bore, CRANE[0])
