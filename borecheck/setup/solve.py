"""The set-up of needle plans: the solver that fits, the cone, the exact check."""

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.verdict import Verdict
from borecheck.errors import UnknownNameError, UsageError
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_file import given_plans
from borecheck.plans.plan_motion import STANDOFF, check_mount, has_closed_form
from borecheck.robots.given import refuse_others
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from borecheck.setup.answer import REACHABLE, UNDECIDED, UNREACHABLE, Setup
from borecheck.setup.candidates import Candidate, Tried
from borecheck.setup.cone import prove_cone
from borecheck.setup.enumeration import enumerated, none_tilted
from borecheck.setup.exact import said_of, verified
from borecheck.setup.family import Family, family_of
from borecheck.setup.grid import grid
from borecheck.setup.null_space import searched
from borecheck.setup.proven import MOST_BOXES, Proof, prove
from borecheck.setup.requirements import Requirements
from borecheck.setup.terms import CONE, NAMES, Terms

Array = NDArray[np.float64]

DEFAULTS = Requirements()
SOLVERS = ("grid", "proven")
# How much cheaper another configuration may be, of the cost, where that is proven.
GAP = 0.05
# How an arm without a family is solved.
ENUMERATION, NULL_SPACE = "enumeration", "null space"
# Candidates whose cone and exact verdict are asked, best first.
MOST_SHOWN = 6
# Stations of the approach before the entry, [m].
STEP = 0.01
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Effort:
    """How far `proven` goes: to that gap, or to so many boxes."""

    gap: float = GAP
    most_boxes: int = MOST_BOXES


EFFORT = Effort()


def setups(
    robot: Robot,
    scene: Scene,
    plans: str | Path | NeedlePlan | Iterable[NeedlePlan],
    asked: Requirements = DEFAULTS,
    solver: str | None = None,
    progress: Progress | None = None,
    gap: float = GAP,
    most_boxes: int = MOST_BOXES,
) -> tuple[Setup, ...]:
    """The set-up of every plan, in their order.

    Args:
        robot: A robot with a needle that has a tip.
        scene: From `load_scene`.
        plans: A file of plans, a plan, or several.
        asked: What a set-up must fulfil.
        solver: Of a redundant arm with a closed form: "grid" or "proven". Other arms
            have one way.
        progress: Called with plans done, and how many there are.
        gap: Of `proven`: how much cheaper another configuration may be.
        most_boxes: Of `proven`: boxes looked at before it is given up.

    Raises:
        UsageError: No needle, an obstacle of guessed unit, or a plan for another mount.
        UnknownNameError: No such solver.
        PlanError: The file of plans cannot be used.
    """
    refuse_others(robot, scene)
    if solver is not None and solver not in SOLVERS:
        raise UnknownNameError("solver", solver, SOLVERS)
    if not (np.isfinite(gap) and gap > 0.0):
        raise UsageError(f"gap is {gap}, not a number above 0")
    effort = Effort(gap, most_boxes)
    terms = Terms(robot, scene, asked)
    listed = given_plans(plans)
    found = []
    for k, plan in enumerate(listed):
        found.append(one_setup(terms, plan, solver, effort))
        if progress is not None:
            progress(k + 1, len(listed))
    return tuple(found)


def one_setup(
    terms: Terms, plan: NeedlePlan, solver: str | None = None, effort: Effort = EFFORT
) -> Setup:
    """The set-up of one plan.

    Raises:
        UsageError: The plan is for another mount.
    """
    start = time.perf_counter()
    check_mount(terms.robot, plan)
    deep = plan.length if terms.asked.depth is None else terms.asked.depth
    short = _too_short(terms.robot, deep)
    if short is not None:
        answer = _none(terms, plan, solver or "", UNREACHABLE, short, {})
        return replace(answer, seconds=time.perf_counter() - start)
    family = family_of(terms.robot, deep)
    if family is not None and solver == "proven":
        answer = _proven(terms, family, plan, effort)
    else:
        used, tried = _tried(terms, family, plan, solver)
        answer = _answered(terms, plan, used, tried)
    return replace(answer, seconds=time.perf_counter() - start)


def _too_short(robot: Robot, deep: float) -> str | None:
    """Why the insertion joint cannot drive the needle so deep, if it cannot."""
    name = robot.needle_with_tip().insertion
    if name is None:
        return None
    if name not in robot.model.joint_names:
        raise UnknownNameError("joint", name, robot.model.joint_names)
    index = robot.model.joint_names.index(name)
    travel = float(robot.model.upper[index] - robot.model.lower[index])
    if deep <= travel:
        return None
    return (
        f"the needle goes {1e3 * deep:.1f} mm deep, but {name} drives it "
        f"{1e3 * travel:.1f} mm"
    )


def _tried(
    terms: Terms, family: Family | None, plan: NeedlePlan, solver: str | None
) -> tuple[str, Tried]:
    """What the solver that fits the arm finds, and its name."""
    robot = terms.robot
    if family is not None:
        return "grid", grid(terms, family, plan)
    if solver == "proven":
        raise UsageError(f"{robot.name} has no family in closed form: nothing to prove")
    if has_closed_form(robot):
        return ENUMERATION, enumerated(terms, plan)
    drive = terms.needle.insertion
    held = None
    if drive is not None:
        held = float(robot.model.lower[robot.model.joint_names.index(drive)])
    return NULL_SPACE, searched(terms, plan, held)


def _proven(terms: Terms, family: Family, plan: NeedlePlan, effort: Effort) -> Setup:
    """By branch and bound, from what the grid finds."""
    shown: dict[int, tuple[dict[str, Any], Verdict]] = {}

    def holds(one: Candidate) -> bool:
        cone = prove_cone(terms, plan.direction, one.arm.follow)
        if not cone.certified:
            return False
        verdict, against = verified(terms, plan, one.q)
        if against is None:
            shown[id(one)] = said_of(terms, plan, one.q, cone), verdict
        return against is None

    tried = grid(terms, family, plan)
    best = next((one for one in tried.best if holds(one)), None)
    search = (effort.gap, effort.most_boxes)
    proof = prove(terms, family, plan, best, holds, *search)
    shares = {"closed": proof.shares()}
    if proof.best is None:
        return _denied(terms, plan, tried, proof, shares)
    told, verdict = shown[id(proof.best)]
    told = {**told, **shares}
    answer = _found(terms, plan, "proven", tried, proof.best, told, verdict)
    assert answer.cost is not None  # it is reachable
    bound = min(proof.least, answer.cost) if proof.least > -np.inf else None
    return replace(answer, lower_bound=bound, boxes=proof.boxes)


def _denied(
    terms: Terms, plan: NeedlePlan, tried: Tried, proof: Proof, shares: dict[str, Any]
) -> Setup:
    """Without a configuration: that there is none, or that boxes are left."""
    told = ", ".join(f"{k} {100 * v:.1f} %" for k, v in shares["closed"].items())
    against = {"against": tried.named(), **shares}
    if proof.done:
        reason = f"none in {proof.boxes} boxes, closed by {told}"
        answer = _none(terms, plan, "proven", UNREACHABLE, reason, against)
        return replace(answer, boxes=proof.boxes)
    reason = f"none found; after {proof.boxes} boxes closed by {told}, some are left"
    answer = _none(terms, plan, "proven", UNDECIDED, reason, against)
    bound = float(proof.least) if np.isfinite(proof.least) else None
    return replace(answer, boxes=proof.boxes, lower_bound=bound)


def _answered(terms: Terms, plan: NeedlePlan, solver: str, tried: Tried) -> Setup:
    """The best candidate that is shown to keep everything; else what is known."""
    reason, closed = "", tried.complete
    for one in tried.best[:MOST_SHOWN]:
        cone = prove_cone(terms, plan.direction, one.arm.follow)
        if cone.certified:
            verdict, against = verified(terms, plan, one.q)
            if against is None:
                told = said_of(terms, plan, one.q, cone)
                return _found(terms, plan, solver, tried, one, told, verdict)
            reason, closed = reason or against, False
            continue
        reason = reason or f"cone: {cone.reason}"
        tried.add([CONE])
        closed = (
            closed
            and cone.against is not None
            and none_tilted(terms, plan, cone.against)
        )
    closed = closed and len(tried.best) <= MOST_SHOWN
    return _not_found(terms, plan, solver, tried, reason, closed)


def _found(
    terms: Terms,
    plan: NeedlePlan,
    solver: str,
    tried: Tried,
    one: Candidate,
    told: dict[str, Any],
    verdict: Verdict,
) -> Setup:
    room = verdict.clearance_m
    cost = float(terms.costs(one.q[None], within=0.0).total[0])
    least = "" if room is None else f", {1e3 * room:.1f} mm clear"
    return Setup(
        plan,
        REACHABLE,
        f"f = {cost:.3f}{least}",
        solver,
        terms.robot.model.joint_names,
        q=one.q,
        cost=cost,
        clearance=room,
        constraints={**told, "against": tried.named()},
        boxes=tried.count,
        motion=motion_through(terms, plan, one),
    )


def _not_found(
    terms: Terms,
    plan: NeedlePlan,
    solver: str,
    tried: Tried,
    reason: str,
    closed: bool,
) -> Setup:
    """Proven that there is none, or nothing known."""
    against = {"against": tried.named()}
    if closed:
        why = reason or _closing(tried)
        answer = _none(terms, plan, solver, UNREACHABLE, why, against)
        return replace(answer, boxes=tried.count)
    said = reason or "none found; there may be one: " + _closing(tried)
    answer = _none(terms, plan, solver, UNDECIDED, said, against)
    return replace(answer, boxes=tried.count)


def _closing(tried: Tried) -> str:
    """What stands against most of what was tried, in words."""
    if not tried.against:
        return "; ".join(tried.said) or "nothing was tried"
    told = [f"{NAMES[code]} ({n})" for code, n in tried.against.most_common()]
    said = f": {tried.said[0]}" if tried.said else ""
    return f"of {tried.count} configurations " + ", ".join(told) + said


def _none(
    terms: Terms,
    plan: NeedlePlan,
    solver: str,
    status: str,
    reason: str,
    constraints: Mapping[str, Any],
) -> Setup:
    joints = terms.robot.model.joint_names
    return Setup(plan, status, reason, solver, joints, constraints=constraints)


def motion_through(terms: Terms, plan: NeedlePlan, one: Candidate) -> Array | None:
    """Waypoints from before the skin through a set-up to the target; None: it stops.

    An insertion joint drives the needle from the entry on; else the arm does.
    """
    count = int(np.ceil(STANDOFF / STEP))
    before = one.arm.along(-STANDOFF * (np.arange(count) + 1.0) / count)[::-1]
    drive, model = terms.needle.insertion, terms.robot.model
    if drive is None:
        steps = max(1, int(np.ceil(plan.length / STEP)))
        after = one.arm.along(plan.length * (np.arange(steps) + 1.0) / steps)
    else:
        after = one.q[None].copy()
        after[0, model.joint_names.index(drive)] += plan.length
    way = np.concatenate([before, one.q[None], after])
    if not np.isfinite(way).all() or model.beyond_limits(way).any():
        return None
    return way
