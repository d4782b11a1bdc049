"""What is proven of a cone holds at tilts a thousand times finer; bounds are bounds."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.plans.plan_file import read_plans
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.setup.cone import _nearest, prove_cone, rim
from borecheck.setup.family import family_of
from borecheck.setup.grid import grid
from borecheck.setup.requirements import requirements
from borecheck.setup.sweeps import Sweeps, _Moved
from borecheck.setup.terms import NOTHING, Terms
from tests.places import PROJECT

RNG = np.random.default_rng(23)
PLAN = read_plans(PROJECT / "urdf/crane/examples/plans.csv")[1]


@pytest.fixture(scope="module")
def terms():
    robot = bc.load_robot("crane")
    return Terms(robot, bc.load_scene("ct_gantry", bore="0.70"), requirements())


@pytest.fixture(scope="module")
def best(terms):
    return grid(terms, family_of(terms.robot, PLAN.length), PLAN).best[0]


def test_a_proven_cone_holds_at_fine_tilts(terms, best):
    proof = prove_cone(terms, PLAN.direction, best.arm.follow)
    assert proof.certified
    assert proof.off <= 2e-3
    around = rim(PLAN.direction, terms.asked.cone, 400)
    tilts = around * np.sqrt(RNG.uniform(size=(400, 1)))
    assert (terms.broken(best.arm.follow(tilts)) == NOTHING).all()


def test_between_corners_the_joints_keep_the_constraints_too(terms, best):
    corners = rim(PLAN.direction, terms.asked.cone / 4, 3)
    qs = best.arm.follow(corners)
    sweeps = Sweeps(terms, 2e-3)
    proven, off = sweeps.proven(qs[None])
    assert proven.all()
    inside = RNG.dirichlet(np.ones(3), 300) @ qs
    assert (terms.broken(inside) == NOTHING).all()
    tips = np.array([terms.robot.placements(q)["needle_tip"][:3, 3] for q in inside])
    assert np.linalg.norm(tips - PLAN.entry, axis=1).max() <= off[0]


def test_no_point_goes_farther_than_its_bound(terms):
    """Corners of every part, seen from the world and from other parts."""
    robot, sweeps = terms.robot, Sweeps(terms, 1.0)
    _, chain = chain_of(robot)
    nearest = np.inf
    for _ in range(6):
        q = bc.random_configurations(robot, 1, seed=int(RNG.integers(1000)))[0]
        qs = q + RNG.uniform(-0.1, 0.1, (3, 8))
        moved = _Moved(chain, qs[None])
        followers = [*sweeps._parts, *sweeps._pairs]
        bounds = moved.ways(followers)[0]
        inside = np.concatenate([qs, RNG.dirichlet(np.ones(3), 60) @ qs])
        T, T_m = chain.placements(inside), chain.placements(moved.middle)
        for body, bound in zip(followers, bounds, strict=True):
            there, middle = T[:, body.frame], T_m[:, body.frame]
            if body.seen_from >= 0:
                there = np.linalg.inv(T[:, body.seen_from]) @ there
                middle = np.linalg.inv(T_m[:, body.seen_from]) @ middle
            points = np.c_[body.corners, np.ones(len(body.corners))]
            way = np.linalg.norm(((there - middle) @ points.T)[:, :3], axis=1).max()
            assert way <= bound + 1e-12
            nearest = min(nearest, bound / max(way, 1e-9))
    assert nearest < 2.0  # they are not idle: some point comes within half of one


def test_a_cone_that_meets_the_padding_has_no_proof(terms, best):
    clearance = float(terms.costs(best.q[None], 0.0).patient[0])
    tight = Terms(terms.robot, terms.scene, requirements(padding=clearance - 1e-3))
    proof = prove_cone(tight, PLAN.direction, best.arm.follow)
    assert not proof.certified
    assert "patient" in proof.reason or "proof" in proof.reason


def test_a_triangle_is_left_out_only_beyond_the_disk():
    fans = RNG.normal(size=(50, 3, 2))
    fans = np.concatenate([fans, np.zeros((50, 3, 1))], axis=2)
    share = RNG.dirichlet(np.ones(3), (50, 4000))
    points = np.einsum("nki,nij->nkj", share, fans)
    sampled = np.linalg.norm(points, axis=2).min(axis=1)
    around = np.array([_holds_origin(fan[:, :2]) for fan in fans])
    assert (_nearest(fans)[~around] <= sampled[~around] + 1e-12).all()


def _holds_origin(corners):
    a, b, c = corners
    turns = [np.cross(np.r_[p, 0], np.r_[q, 0])[2] for p, q in ((a, b), (b, c), (c, a))]
    return min(turns) > 0 or max(turns) < 0
