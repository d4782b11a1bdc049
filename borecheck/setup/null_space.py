"""A stranger's arm: descents from many starts, then walks along the arm's own freedom.

Where none is found nothing is said: there may be one.
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.plans.needle_plan import NeedlePlan
from borecheck.robots.kinematics.needle_inverse import NumericalInverse
from borecheck.robots.kinematics.needle_task import NeedleTask
from borecheck.setup.candidates import REACHED, Tried, noted
from borecheck.setup.mechanics import twists
from borecheck.setup.terms import LIMITS, NO_ANSWER, NOTHING, Terms

Array = NDArray[np.float64]

# Starts of the descents, all at once.
STARTS = 128
# Rounds of walks from every solution, and how far the first goes, [rad] or [m].
ROUNDS, STRIDE = 16, 0.3


def searched(
    terms: Terms, plan: NeedlePlan, insertion: float | None, seed: int = 0
) -> Tried:
    """Solutions that descents find, and better ones along the arm's own freedom.

    Args:
        terms: What is asked.
        plan: The needle; its tip is at the entry.
        insertion: Where the insertion joint stands, [m].
        seed: Of the walks.
    """
    solver = NumericalInverse.of(terms.robot)
    found = solver.solutions(plan.entry, plan.direction, insertion, STARTS)
    tried = Tried(said=found.rejected)
    if not found.configurations:
        tried.add([LIMITS if "limit" in " ".join(found.rejected) else NO_ANSWER])
        return tried
    qs = np.array(found.configurations)
    _, task = solver.standing(insertion)
    codes = terms.broken(qs)
    tried.add(codes)
    if task.is_redundant:
        qs, codes = _walked(terms, plan, task, tried, (qs, codes), seed)
    noted(terms, tried, qs, codes, plan)
    return tried


def _walked(
    terms: Terms,
    plan: NeedlePlan,
    task: NeedleTask,
    tried: Tried,
    start: tuple[Array, NDArray[np.int8]],
    seed: int,
) -> tuple[Array, NDArray[np.int8]]:
    """Each solution walked to where less stands against it, or it costs less."""
    (qs, codes), rng = start, np.random.default_rng(seed)
    costs = _costs(terms, qs, codes)
    for round_ in range(ROUNDS):
        stride = STRIDE * 0.8**round_
        ahead = qs + stride * _free_steps(terms, task, qs, rng)
        ahead, rest = task.descend(
            np.clip(ahead, task.lower, task.upper),
            np.tile(plan.entry, (len(qs), 1)),
            np.tile(plan.direction, (len(qs), 1)),
        )
        ahead[rest > REACHED] = np.nan
        then = terms.broken(ahead)
        tried.add(then)
        cost = _costs(terms, ahead, then)
        better = (then == NOTHING) & (cost < costs)
        # farther along the list of constraints is nearer to none
        better |= (codes != NOTHING) & (then > codes)
        qs = np.where(better[:, None], ahead, qs)
        codes, costs = np.where(better, then, codes), np.where(better, cost, costs)
    return qs, codes


def _costs(terms: Terms, qs: Array, codes: NDArray[np.int8]) -> Array:
    costs = np.full(len(qs), np.inf)
    good = codes == NOTHING
    if good.any():
        costs[good] = terms.costs(qs[good]).total
    return costs


def _free_steps(
    terms: Terms, task: NeedleTask, qs: Array, rng: np.random.Generator
) -> Array:
    """Steps (n, joints) of length 1 that at first order do not move the needle."""
    moved = twists(terms.robot, qs)
    aim = np.cross(moved.angular, moved.axis[:, None])
    J = np.concatenate([moved.linear, aim], axis=2).transpose(0, 2, 1)
    J = J[:, :, task.active]
    _, sizes, V = np.linalg.svd(J, full_matrices=True)
    steps = rng.normal(size=(len(qs), len(task.active)))
    for k in range(len(qs)):
        rank = int((sizes[k] > 1e-9 * sizes[k][0]).sum())
        free = V[k, rank:]
        steps[k] = free.T @ (free @ steps[k])
    size = np.linalg.norm(steps, axis=1, keepdims=True)
    whole = np.zeros_like(qs)
    whole[:, task.active] = steps / np.maximum(size, 1e-12)
    return whole
