"""Maps of directions: what is proven of cells is held against single directions."""

from itertools import pairwise

import numpy as np
import pytest

import borecheck as bc
from borecheck.directions.ask import maps
from borecheck.directions.blockers import blockers, free_needle
from borecheck.directions.leaves import IS_CLEAR, IS_CONTACT, IS_OUT
from borecheck.errors import UsageError
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_file import read_plans, save_plans
from borecheck.plans.plan_motion import UnreachableError, plan_motion

TARGET = (0.05, 0.06, -0.08)
RNG = 20261128


@pytest.fixture(scope="module")
def found(robot, scene):
    return bc.directions(robot, scene, TARGET, resolution="2deg")


def some(found, state, count, rng):
    """Directions in cells of a state, a third of them at a corner: angles, cells."""
    rows = np.flatnonzero(found.leaves.state == state)
    weight = found.solid_angle[rows] / found.solid_angle[rows].sum()
    cells = rng.choice(rows, count, p=weight)
    share = rng.uniform(0.0, 1.0, (count, 2))
    share[::3] = rng.integers(0, 2, (len(share[::3]), 2))
    low, high = found.leaves.low[cells], found.leaves.high[cells]
    return low + share * (high - low), cells


def depths_by_rays(scene, target, directions):
    """Where rays out of the target leave the torso, (k,): all triangles, one by one."""
    (torso,) = [o.mesh for o in scene.obstacles if o.role == "patient"]
    a, b, c = (torso.corners[:, k] - np.array(target) for k in range(3))
    found = []
    for ray in -directions:
        normal = np.cross(b - a, c - a)
        at = np.einsum("td,td->t", a, normal) / (normal @ ray)
        p = at[:, None] * ray
        sides = [
            np.einsum("td,td->t", np.cross(v - u, p - u), normal)
            for u, v in ((a, b), (b, c), (c, a))
        ]
        hit = (np.array(sides) >= 0.0).all(axis=0) & (at > 0.0)
        found.append(at[hit].max())
    return np.array(found)


def plans_along(found, scene, angles):
    directions = found.setup.chart.directions(angles)
    depths = depths_by_rays(scene, found.target, directions)
    return [
        NeedlePlan(f"p{k}", found.target - d * n, found.target)
        for k, (d, n) in enumerate(zip(depths, directions, strict=True))
    ], depths


def poses_of(robot, plan, count=12):
    """Poses of the plan's approach and insertion, as `check --plan` drives it."""
    waypoints = plan_motion(robot, plan).waypoints
    steps = pairwise(waypoints)
    share = np.linspace(0.0, 1.0, count)[:, None]
    return np.concatenate([a + share * (b - a) for a, b in steps])


def test_states_hold_for_single_directions(robot, scene, found):
    """An independent road: own rays, plans' own motions, contact and containment."""
    rng = np.random.default_rng(RNG)
    asked = bc.queries(robot, scene, skip=[("needle", "torso")])
    angles, cells = some(found, IS_CLEAR, 100, rng)
    plans, depths = plans_along(found, scene, angles)
    low, high = found.leaves.depth[cells].T
    assert ((depths >= low) & (depths <= high)).all()
    poses = np.concatenate([poses_of(robot, plan) for plan in plans])
    assert not asked.touches(poses).any()
    angles, cells = some(found, IS_CONTACT, 100, rng)
    poses = found.setup.chart.in_urdf(
        found.setup.chart.own(angles, found.leaves.station[cells])
    )
    poses = np.clip(poses, robot.model.lower, robot.model.upper)
    assert asked.touches(poses).all()
    angles, cells = some(found, IS_OUT, 100, rng)
    plans, _ = plans_along(found, scene, angles)
    for plan in plans:
        with pytest.raises(UnreachableError):
            plan_motion(robot, plan)


def certified(robot, scene, plan):
    """What the certified path says of a plan's own motion; None out of reach."""
    try:
        motion = plan_motion(robot, plan)
    except UnreachableError:
        return None
    asked = dict(corridor=motion.corridor, clearance=False)
    return bc.check_path(robot, scene, motion.waypoints, **asked).verdict


def test_certified_plans_agree(robot, scene, found):
    """Contact may be where the robot cannot go either: then it is out of reach."""
    rng = np.random.default_rng(RNG)
    expected = {IS_CLEAR: {"clear"}, IS_CONTACT: {"contact", None}, IS_OUT: {None}}
    for state, verdicts in expected.items():
        angles, _ = some(found, state, 10, rng)
        for plan in plans_along(found, scene, angles)[0]:
            assert certified(robot, scene, plan) in verdicts


def test_cells_tile_the_chart(found):
    leaves, limits = found.leaves, found.setup.chart.limits
    area = np.prod(leaves.high - leaves.low, axis=1).sum()
    assert area == pytest.approx(np.prod(limits[1] - limits[0]), rel=1e-12)
    q5 = found.setup.chart.limits[:, 1]
    whole = (limits[1, 0] - limits[0, 0]) * np.diff(np.sin(q5))[0]
    assert found.solid_angle.sum() == pytest.approx(whole, rel=1e-3)
    rng = np.random.default_rng(RNG)
    points = rng.uniform(limits[0], limits[1], (300, 2))
    inside = (points[:, None] >= leaves.low) & (points[:, None] <= leaves.high)
    assert (inside.all(axis=2).sum(axis=1) == 1).all()
    for point, holds in zip(points, inside.all(axis=2), strict=True):
        n = found.setup.chart.directions(point[None])[0]
        assert found.at(3.0 * n).number == int(np.flatnonzero(holds)[0])


def test_every_round_is_true_and_later_ones_decide_more(robot, scene):
    rounds = list(maps(robot, scene, TARGET, resolution="4deg"))
    assert len(rounds) == 4
    shares = [found.shares["undecided"] for found in rounds]
    assert shares == sorted(shares, reverse=True)
    for before, after in pairwise(rounds):
        decided = np.flatnonzero(before.leaves.state != 3)
        for k in decided:
            n = before.setup.chart.directions(before.leaves.centre[k : k + 1])[0]
            assert after.at(n).state == before.cell(int(k)).state


def clear_places(found, points):
    directions = found.setup.chart.directions(points)
    return np.array([found.at(n).clear for n in directions])


def test_more_margin_or_target_error_is_never_clearer(robot, scene, found):
    limits = found.setup.chart.limits
    points = np.random.default_rng(RNG).uniform(limits[0], limits[1], (400, 2))
    plain = clear_places(bc.directions(robot, scene, TARGET, resolution="4deg"), points)
    for asked in ({"margin": "6mm"}, {"target_error": "4mm"}, {"max_depth": "90mm"}):
        more = bc.directions(robot, scene, TARGET, resolution="4deg", **asked)
        stricter = clear_places(more, points)
        assert not (stricter & ~plain).any()
        assert stricter.sum() < plain.sum()


def test_targets_off_by_the_error_are_clear(robot, scene):
    rng = np.random.default_rng(RNG)
    robust = bc.directions(robot, scene, TARGET, resolution="4deg", target_error="3mm")
    angles, _ = some(robust, IS_CLEAR, 10, rng)
    asked = bc.queries(robot, scene, skip=[("needle", "torso")])
    for angle in angles:
        off = rng.normal(size=3)
        target = robust.target + 0.003 * off / np.linalg.norm(off)
        n = robust.setup.chart.directions(angle[None])
        depth = depths_by_rays(scene, target, n)[0]
        plan = NeedlePlan("off", target - depth * n[0], target)
        assert not asked.touches(poses_of(robot, plan)).any()


def test_a_mirrored_scene_has_the_mirrored_map(robot, scene):
    """Mount -90 is the robot turned half round z: so is the scene, then."""
    turned = np.diag([-1.0, -1.0, 1.0])
    found = bc.directions(robot, scene, TARGET, resolution="4deg")
    half = [
        type(o)(o.name, o.role, o.mesh.moved(_pose(turned)), o.source, o.doubt)
        for o in scene.obstacles
    ]
    bare = type(scene)("turned", None, {}, "coarse", (), {}, (), ())
    other = bc.directions(
        bc.load_robot("zerobot", mount="-90"),
        bare.with_obstacles(half),
        turned @ np.array(TARGET),
        resolution="4deg",
    )
    for name, share in found.shares.items():
        assert other.shares[name] == pytest.approx(share, abs=4e-3)
    limits = found.setup.chart.limits
    points = np.random.default_rng(RNG).uniform(limits[0], limits[1], (200, 2))
    differ = 0
    for n in found.setup.chart.directions(points):
        here, there = found.at(n).state, other.at(turned @ n).state
        assert {here, there} not in ({"clear", "contact"}, {"clear", "out"})
        differ += here != there
    assert differ <= 4


def _pose(R):
    T = np.eye(4)
    T[:3, :3] = R
    return T


def test_what_cannot_be_a_map_is_refused(robot, scene):
    for target, said in (
        ((0, 0), "three"),
        ((0, 0, np.nan), "finite"),
        ((0, 0, -60), "mill"),
    ):
        with pytest.raises(UsageError, match=said):
            bc.directions(robot, scene, target)
    for asked in (
        {"resolution": "0.001deg"},
        {"margin": -1.0},
        {"max_depth": 0.0},
        {"standoff": -0.01},
    ):
        with pytest.raises(UsageError):
            bc.directions(robot, scene, TARGET, **asked)
    with pytest.raises(UsageError, match="no chart"):
        bc.directions(bc.load_robot("mri_arm"), scene, TARGET)
    empty = type(scene)("empty", None, {}, "coarse", (), {}, (), ())
    with pytest.raises(UsageError, match="no patient"):
        bc.directions(robot, empty, TARGET)


def test_ranked_directions_are_clear_plans_that_check_reads(
    robot, scene, found, tmp_path
):
    from borecheck.directions.ranking import ranked

    best = ranked(found, 3)
    assert [row.cost for row in best] == sorted(row.cost for row in best)
    file = tmp_path / "plans.csv"
    save_plans(file, [row.plan for row in best])
    for plan, row in zip(read_plans(file), best, strict=True):
        assert certified(robot, scene, plan) == "clear"
        assert found.at(plan.direction).number == row.cell
        assert plan.length == pytest.approx(row.depth, abs=1e-9)


def test_the_nearest_clear_direction_is_clear_and_none_is_nearer_than_proven(found):
    rng = np.random.default_rng(RNG)
    angles, _ = some(found, IS_CONTACT, 3, rng)
    for n in found.setup.chart.directions(angles):
        near = found.nearest_clear(n)
        assert found.at(near.plan.direction).state in ("clear", "contact", "undecided")
        assert near.none_nearer_than <= near.angle
        cosine = float(near.plan.direction @ n)
        assert np.arccos(min(cosine, 1.0)) == pytest.approx(near.angle, abs=1e-6)
        limits = found.setup.chart.limits
        grid = np.stack(np.meshgrid(*np.linspace(*limits, 60).T), axis=-1).reshape(
            -1, 2
        )
        every = found.setup.chart.directions(grid)
        nearer = np.arccos(np.clip(every @ n, -1, 1)) < near.none_nearer_than
        assert not any(found.at(m).clear for m in every[nearer])


def test_who_blocks_is_told_and_a_longer_needle_opens_it(scene, found):
    """What the needle is short of is added to it: then nothing driven meets skin."""
    told = {(b.part, b.obstacle): b for b in blockers(found)}
    shares = sum(blocker.share for blocker in told.values())
    assert shares == pytest.approx(found.shares["contact"])
    assert told["arm", "gantry"].needle_short is None
    short = told["carriage", "torso"].needle_short
    assert free_needle(found.setup) == pytest.approx(0.12, abs=2e-4)
    assert 0.0 < short < 0.04
    longer = bc.load_robot("zerobot", needle_length=f"{0.12 + short + 0.02:.4f}")
    opened = bc.directions(longer, scene, TARGET, resolution="4deg")
    assert ("carriage", "torso") not in {(b.part, b.obstacle) for b in blockers(opened)}


def test_directions_outside_the_chart_are_out(found):
    assert found.at((0.0, 0.0, 1.0)).state == "out"
    assert found.at((1.0, 0.0, 0.0)).state == "out"
    assert "q5" in found.at((0.9, 0.0, -0.4)).reason
    with pytest.raises(UsageError):
        found.at((0.0, 0.0, 0.0))
