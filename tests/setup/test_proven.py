"""Bounds over boxes against points in them, and proofs against brute force."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import UsageError
from borecheck.plans.plan_file import read_plans
from borecheck.setup.boxes import Boxes
from borecheck.setup.cone import rim
from borecheck.setup.family import family_of
from borecheck.setup.field import field, is_within, sampled
from borecheck.setup.mechanics import twists
from borecheck.setup.requirements import requirements
from borecheck.setup.room import fields_of
from borecheck.setup.terms import CONE, NOTHING, Terms
from borecheck.setup.witnesses import witnesses
from tests.places import PROJECT

RNG = np.random.default_rng(31)
PLANS = read_plans(PROJECT / "urdf/crane/examples/plans.csv")


@pytest.fixture(scope="module")
def terms():
    robot = bc.load_robot("crane")
    scene = bc.load_scene("ct_gantry", bore="0.70")
    return Terms(robot, scene, requirements(padding=0.03))


def test_nothing_in_a_box_goes_farther_than_its_bound(terms):
    """Joints, axes and points of every body, the needle tilted or not."""
    family = family_of(terms.robot, 0.0)
    plan, parts = PLANS[1], terms.robot.parts
    for k in range(12):
        x = RNG.uniform(family.lower, family.upper, (1, 3))
        half = 10.0 ** RNG.uniform(-3, -0.7, (1, 3)) * (1.0, 1.0, 0.05)
        turn = np.cross(plan.direction, RNG.normal(size=3))
        turn *= (k % 2) * 0.17 / np.linalg.norm(turn)
        spread = family.spread_tilted(plan.entry, plan.direction, x, half, turn)
        inside = x + RNG.uniform(-1, 1, (40, 3)) * half
        qs = family.tilted(plan.entry, plan.direction, inside, turn[None])[:, 0]
        away = np.abs((qs - spread.q + np.pi) % (2 * np.pi) - np.pi).max(axis=0)
        assert (away <= spread.joints[0] + 1e-9).all()
        here, there = twists(terms.robot, spread.q), twists(terms.robot, qs)
        assert (np.abs(there.reach - here.reach) <= spread.origins + 1e-9).all()
        for part in parts:
            at = np.array([terms.robot.placements(q)[part.link] for q in qs[:8]])
            middle = terms.robot.placements(spread.q[0])[part.link]
            points = np.c_[
                part.mesh.vertices[::9], np.ones(len(part.mesh.vertices[::9]))
            ]
            way = np.linalg.norm(((at - middle) @ points.T)[:, :3], axis=1).max(axis=0)
            bound = spread.points(part.link, (points @ middle.T)[None, :, :3])
            assert (way <= bound[0] + 1e-9).all(), part.link


def test_what_keeps_the_constraints_is_in_no_box_that_is_closed(terms):
    """And costs no less than its box's bound."""
    family, plan = family_of(terms.robot, PLANS[0].length), PLANS[0]
    boxes = Boxes(terms, family, plan)
    x = RNG.uniform(family.lower, family.upper, (400, 3))
    qs = family.configurations(plan.entry, plan.direction, x)
    good = terms.broken(qs) == NOTHING
    x, qs = x[good], qs[good]
    costs = terms.costs(qs, 0.0).total
    half = 10.0 ** RNG.uniform(-3, -0.5, (len(x), 3)) * (1.0, 1.0, 0.05)
    middles = x + RNG.uniform(-1, 1, x.shape) * half
    said = boxes.judge(middles, half, np.inf)
    assert np.isin(said.against, (NOTHING, CONE)).all()
    open_ = said.against == NOTHING
    assert (said.least[open_] <= costs[open_]).all()
    # they are no idle bounds: some come near
    assert (costs[open_] - said.least[open_]).min() < 0.1


def test_a_field_is_never_less_than_the_distance(terms):
    torso = [o.mesh for o in terms.scene.obstacles if o.role == "patient"]
    found = fields_of(terms.scene)["patient"]
    points = np.random.default_rng(7).uniform(-0.35, 0.35, (200, 3))
    samples, cover = sampled(torso[0], 6e-3)
    near = np.linalg.norm(points[:, None] - samples[None], axis=2).min(axis=1)
    within = np.array([is_within(point, torso) for point in points])
    bound = found.at_most(points)
    # the samples' distance is up to `cover` more than the surface's
    assert (bound[~within] >= near[~within] - cover).all()
    assert (bound[within] >= -near[within]).all()
    # and it is no idle bound: where a side is not known it is off by twice a band
    assert (bound < 0.0).any()
    assert np.abs(bound - np.where(within, -near, near)).max() < 0.06
    assert np.isinf(field([], np.zeros(3), np.ones(3)).at_most(points)).all()


def test_witnesses_are_within_their_parts(terms):
    from borecheck.geometry.triangles.solid import Side, is_inside

    for part, found in zip(terms.robot.parts, witnesses(terms.robot), strict=True):
        balls = found.radii > 0.0
        for middle, radius in zip(
            found.points[balls][:3], found.radii[balls][:3], strict=True
        ):
            ways = RNG.normal(size=(6, 3))
            ways *= 0.999 * radius / np.linalg.norm(ways, axis=1, keepdims=True)
            assert all(is_inside(middle + w, part.mesh) is Side.INSIDE for w in ways)


UNDER = bc.NeedlePlan("under", (0.0, 0.0, -0.2231), (0.0, 0.0, -0.19))


@pytest.mark.parametrize(
    ("plan", "asked", "closing"),
    [
        (UNDER, {}, "cone"),
        (PLANS[0], {"force": 20.0, "moment": 1.2}, "torque"),
    ],
)
def test_what_is_proven_away_brute_force_does_not_find(terms, plan, asked, closing):
    robot, scene = terms.robot, terms.scene
    answer = bc.setup(robot, scene, plan, solver="proven", boxes=3000, **asked)[0]
    assert answer.status == "unreachable"
    closed = answer.constraints["closed"]
    assert closed[closing] > 0.1
    assert np.isclose(sum(closed.values()), 1.0)
    family = family_of(robot, plan.length)
    x = RNG.uniform(family.lower, family.upper, (3000, 3))
    brute = Terms(robot, scene, requirements(**asked))
    qs = family.configurations(plan.entry, plan.direction, x)
    good = x[brute.broken(qs) == NOTHING]
    around = rim(plan.direction, brute.asked.cone, 24)
    tilted = family.tilted(plan.entry, plan.direction, good, around)
    codes = brute.broken(tilted.reshape(-1, 8)).reshape(len(good), 24)
    assert not (codes == NOTHING).all(axis=1).any()


def test_the_bound_is_below_every_answer(terms):
    robot, scene, plan = terms.robot, terms.scene, PLANS[0]
    asked = {"solver": "proven", "gap": 0.4, "boxes": 4000}
    answer = bc.setup(robot, scene, plan, **asked)[0]
    assert answer.reachable
    assert answer.gap is not None
    assert answer.lower_bound <= answer.cost
    assert answer.lower_bound <= bc.setup(robot, scene, plan)[0].cost


def test_no_gap_is_told(terms):
    with pytest.raises(UsageError, match="gap is 0"):
        bc.setup(terms.robot, terms.scene, PLANS[0], solver="proven", gap=0.0)
