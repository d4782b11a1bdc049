"""Intervals that cover a motion, each with what proves it: the body of a certificate.

A pair is placed in the middle of an interval. If its clearance there exceeds the margin
and how far any of its points moves within the interval, the interval is clear; if not,
it is halved. Of a passage an interval may also have the needle in its corridor: what
its slabs of depth and distance aside hold is allowed. Which of both it is, its length
says.
"""

from collections.abc import Callable
from functools import partial

from borecheck.motion.bounds import Route, route
from borecheck.motion.by_distance import displacement_about
from borecheck.motion.passage import Approach, Slabs, depth_and_aside
from borecheck.motion.problem import Motion, Pair, Passage, PathProblem
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import WORLD

Interval = list[float]
Proof = Callable[[float, float, float], Interval | None]

# Intervals of one pair before giving up: a motion that grazes needs too many.
MOST_INTERVALS = 5_000
# By how much the clearance must exceed margin and displacement, [m].
RESERVE = 1e-8
# A needle farther from its patient, beyond the margin, needs no corridor, [m].
AT_THE_SKIN = 2e-3


def cover(motion: Motion, proven: Proof) -> list[Interval] | None:
    """Intervals that cover the motion, in order; None if there are too many."""
    waiting = [(0.0, len(motion.theta) - 1.0)]
    covered: list[Interval] = []
    tried = 0
    while waiting:
        begin, end = waiting.pop()
        tried += 1
        if tried > MOST_INTERVALS:
            return None
        middle = 0.5 * (begin + end)
        interval = proven(begin, middle, end)
        if interval is not None:
            covered.append(interval)
        else:
            waiting += [(middle, end), (begin, middle)]
    return covered


def apart(
    chain: JointChain,
    pair: Pair,
    way: Route,
    motion: Motion,
    begin: float,
    middle: float,
    end: float,
) -> Interval | None:
    """An interval of a pair whose clearance exceeds its displacement."""
    placed = motion.place(chain, middle)
    moved = displacement_about(chain, pair, way, motion, placed, begin, middle, end)
    T_b = pair.standing.T_frame_mesh
    if pair.standing.frame != WORLD:
        T_b = placed[pair.standing.frame]
    T_a = placed[pair.moving.frame]
    need = moved + pair.margin + 2.0 * RESERVE
    answer = pair.moving.tree.within(pair.standing.tree, T_a, T_b, need)
    if answer.verdict != "clear":
        return None
    clearance = min(float(answer.lower), 2.0 * need)
    return [begin, end, middle, clearance, moved]


def beside_or_within(problem: PathProblem, passage: Passage, motion: Motion) -> Proof:
    """What proves an interval of a passage: plainly clear first, else by its corridor.

    The interval is that of `apart`, or else of `keeps`, which has no clearance.
    """
    pair = problem.passage_pair(passage)
    way = route(problem.chain, WORLD, pair.moving.frame)
    clear = partial(apart, problem.chain, pair, way, motion)
    within = keeps(problem, passage, motion)

    def proven(begin: float, middle: float, end: float) -> Interval | None:
        interval = clear(begin, middle, end)
        if interval is not None:
            return interval
        T_world_needle = motion.place(problem.chain, middle)[pair.moving.frame]
        near = pair.margin + AT_THE_SKIN
        patient, T = pair.standing.tree, pair.standing.T_frame_mesh
        if pair.moving.tree.within(patient, T_world_needle, T, near).verdict == "clear":
            return None  # its halves are plainly clear, no corridor is needed
        return within(begin, middle, end)

    return proven


def keeps(problem: PathProblem, passage: Passage, motion: Motion) -> Proof:
    """What proves an interval of a passage by its corridor."""
    chain = problem.chain
    needle = problem.parts[passage.part]
    patient = problem.obstacles[passage.obstacle]
    approach = Approach(patient, passage.corridor, problem.margin)
    pair, way = Pair(needle, patient, 0.0), route(chain, WORLD, needle.frame)

    def proven(begin: float, middle: float, end: float) -> Interval | None:
        placed = motion.place(chain, middle)
        moved = displacement_about(chain, pair, way, motion, placed, begin, middle, end)
        depth, aside = depth_and_aside(needle, passage.corridor, placed[needle.frame])
        slabs = Slabs.of(depth[None], aside[None], moved + 2.0 * RESERVE)
        return [begin, end, middle, moved] if approach.allows(slabs) else None

    return proven
