"""Certifies a motion between its waypoints: clear only if every instant is.

The motion is straight in the configuration between waypoints. The whole of it is tried
at once: how far points stray from the chord between both ends is bounded
(`motion.bounds`), and if boxes or planes separate the surfaces by more than that, all
of it is clear (`swept_boxes`). What stays open is halved in time (`halving`) until
it is proven clear, shown to be in contact, or too short to go on: that is `unknown`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import UsageError
from borecheck.motion import halving
from borecheck.motion.beside import not_beside
from borecheck.motion.bounds import Route, route
from borecheck.motion.broadphase import rooms_of_pairs
from borecheck.motion.by_distance import by_distance
from borecheck.motion.containment import examine_containment
from borecheck.motion.outcome import (
    PathVerdict,
    Stretch,
    Timeline,
    in_doubt,
    path_verdict,
)
from borecheck.motion.passage_search import examine_passage
from borecheck.motion.problem import (
    Body,
    Motion,
    Pair,
    Passage,
    PathProblem,
    path_motion,
)
from borecheck.motion.round_shapes import between
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import WORLD

Array = NDArray[np.float64]

# Pieces during which nothing moves farther are not halved, [m].
RESOLUTION = 1e-6
# Nor pieces with contact at both ends during which nothing moves farther than this:
# inside a stretch of contact, where exactly there is contact matters little.
CONTACT_LENGTH = 2e-3
# Pieces looked at for one pair before the rest is left undecided.
PIECE_LIMIT = 20_000
# Of these so many by boxes and planes: where that does not do, more of it will not.
QUICK_LIMIT = 1_000


def search(
    problem: PathProblem,
    waypoints: ArrayLike,
    *,
    resolution: float = RESOLUTION,
    piece_limit: int = PIECE_LIMIT,
    broadphase: bool = True,
) -> PathVerdict:
    """The verdict for every instant of a motion.

    Args:
        problem: Who must not touch whom.
        waypoints: Configurations, (n, nq), [rad] and [m]; straight in between.
        resolution: Stretches during which nothing moves farther are not halved, [m].
        piece_limit: Pieces looked at for one pair before the rest is `unknown`.
        broadphase: Whether boxes first tell which pairs stay apart all the way; the
            verdict is the same, see `motion.broadphase`.

    Raises:
        UsageError: No waypoint, wrong length, or numbers that are not finite.
        GeometryError: Farther from the origin than rounding bounds allow.
    """
    if not (np.isfinite(resolution) and resolution > 0.0):
        raise UsageError(f"resolution is {resolution}, not a distance in metres")
    motion = path_motion(problem, waypoints)
    timeline = Timeline(len(motion.theta) - 1.0)
    chain, rooms = problem.chain, np.full(len(problem.pairs), -np.inf)
    if broadphase:
        rooms = rooms_of_pairs(problem, motion).least
    pairs = list(zip(problem.pairs, problem.routes, rooms, strict=True))
    for pair, way, room in pairs:
        if room > pair.margin:
            timeline.count(1, 0)
        else:
            _examine(chain, pair, way, motion, resolution, piece_limit, timeline)
    for pair, way, room in pairs:
        if not room > 0.0:
            examine_containment(chain, pair, way, motion, timeline)
    for passage in problem.passages:
        _examine_passage(problem, passage, motion, resolution, piece_limit, timeline)
    verdict = path_verdict(timeline, len(problem.pairs) + len(problem.passages))
    if problem.doubt is not None:
        verdict = in_doubt(verdict, problem.doubt)
    if verdict.contact and (shapes := problem.within) is not None:
        inside = search(
            shapes,
            waypoints,
            resolution=resolution,
            piece_limit=piece_limit,
            broadphase=broadphase,
        )
        verdict = between(verdict, inside, problem.excess)
    return verdict


@dataclass(frozen=True, eq=False)
class Examined:
    """What is known of one pair over the whole motion.

    Attributes:
        rows: (begin, end, TOUCHED or UNDECIDED), times in waypoints, in order. The
            rest is proven clear by more than the pair's margin.
        pieces: Pieces of time tried.
        poses: Poses judged exactly.
        gave_up: Whether a limit ended it.
    """

    rows: Array
    pieces: int
    poses: int
    gave_up: bool


def _examine(
    chain: JointChain,
    pair: Pair,
    way: Route,
    motion: Motion,
    resolution: float,
    piece_limit: int,
    timeline: Timeline,
) -> None:
    """Adds what is found about a pair to the timeline."""
    found = examine_pair(
        chain, pair, way, motion, resolution, piece_limit, timeline.settled()
    )
    timeline.count(found.pieces, found.poses)
    if len(found.rows):
        timeline.add(pair.names, found.rows)
    if found.gave_up:
        timeline.note(pair.names, f"gave up after {found.pieces} pieces")


def _examine_passage(
    problem: PathProblem,
    passage: Passage,
    motion: Motion,
    resolution: float,
    piece_limit: int,
    timeline: Timeline,
) -> None:
    """A needle is clear of the patient as any part, or keeps to its corridor."""
    chain = problem.chain
    pair = problem.passage_pair(passage)
    way = route(chain, WORLD, pair.moving.frame)
    nowhere = np.zeros((0, 2))
    found = examine_pair(chain, pair, way, motion, resolution, piece_limit, nowhere)
    timeline.count(found.pieces, found.poses)
    examine_passage(
        chain,
        pair.moving,
        pair.standing,
        passage.corridor,
        motion,
        timeline,
        not_beside(chain, pair, motion, found.rows),
        pair.margin,
    )


def examine_pair(
    chain: JointChain,
    pair: Pair,
    way: Route,
    motion: Motion,
    resolution: float,
    piece_limit: int,
    settled: Array,
    quick_limit: int | None = None,
) -> Examined:
    """One pair over the whole motion: by boxes and planes, then by true distances.

    Args:
        chain: The robot's joints.
        pair: Who must not come nearer than its margin.
        way: The route between their frames.
        motion: The whole motion.
        resolution: Pieces with less motion are not halved, [m].
        piece_limit: Pieces looked at before the rest is left undecided.
        settled: Stretches that are not looked at, in waypoints, (k, 2).
        quick_limit: Of the pieces, so many by boxes and planes; QUICK_LIMIT by default.
    """
    quick = min(piece_limit, QUICK_LIMIT if quick_limit is None else quick_limit)
    rows, looked, judged = _by_boxes_and_planes(
        chain, pair, way, motion, resolution, quick, settled
    )
    # Planes give up where pieces are too many, and at pairs that hardly move at all
    # and that no plane tried separates: a rod beside its twin.
    only_open = len(rows) > 0 and bool((rows[:, 2] == halving.UNDECIDED).all())
    if looked <= quick and not only_open:
        return Examined(rows, looked, judged, False)
    rows, further = _examined_by_distance(
        chain, pair, way, motion, rows, resolution, piece_limit
    )
    gave_up = further > piece_limit
    return Examined(rows, looked + further, judged + further, gave_up)


def _by_boxes_and_planes(
    chain: JointChain,
    pair: Pair,
    way: Route,
    motion: Motion,
    resolution: float,
    quick: int,
    settled: Array,
) -> tuple[Array, int, int]:
    """Findings of a pair, pieces looked at, and instants judged, in a compiled call."""
    a, b = pair.moving, pair.standing
    findings, found, looked, judged = halving.examine(
        motion.theta,
        chain.parent,
        chain.kind,
        chain.parts,
        chain.length,
        way.joints,
        way.forward,
        a.radius,
        motion.largest,
        a.frame,
        b.frame,
        b.undo,
        b.T_frame_mesh,
        pair.margin,
        resolution,
        CONTACT_LENGTH,
        quick,
        a.tree.nodes,
        a.tree.corners,
        a.tree.frames[0],
        b.tree.nodes,
        b.tree.corners,
        b.tree.frames[0],
        a.tree.depth + b.tree.depth,
        motion.placed,
        motion.is_placed,
        motion.bends,
        motion.has_bend,
        settled,
        np.zeros((64, 3)),
    )
    return findings[:found], looked, judged


def _examined_by_distance(
    chain: JointChain,
    pair: Pair,
    way: Route,
    motion: Motion,
    findings: Array,
    resolution: float,
    limit: int,
) -> tuple[Array, int]:
    """Findings in which what was left undecided is examined by true distances."""
    rows: list[tuple[float, float, float]] = []
    looked = 0
    for begin, end, outcome in joined(findings):
        if outcome != halving.UNDECIDED:
            rows.append((begin, end, outcome))
            continue
        found, count = by_distance(
            chain,
            pair,
            way,
            motion,
            (begin, end),
            (resolution, CONTACT_LENGTH),
            max(limit - looked, 0),
        )
        rows += found
        looked += count
    return np.array(rows, dtype=np.float64).reshape(-1, 3), looked


def joined(findings: Array) -> list[tuple[float, float, float]]:
    """Findings in order, neighbouring ones of equal outcome as one."""
    joined: list[tuple[float, float, float]] = []
    for row in findings:
        begin, end, outcome = (float(x) for x in row)
        if joined and joined[-1][1] == begin and joined[-1][2] == outcome:
            joined[-1] = (joined[-1][0], end, outcome)
        else:
            joined.append((begin, end, outcome))
    return joined


__all__ = ["Body", "Pair", "PathProblem", "PathVerdict", "Stretch", "search"]
