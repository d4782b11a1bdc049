"""Is the needle in the patient only where its plan allows, at every instant?

A leg between two waypoints is tried as a whole: every point of the needle stays within
s of the chord between its places at both ends (`motion.bounds`). Depth along the
corridor is linear and the distance aside of it convex, along chords and over triangles;
so at every instant a triangle lies between its corners' least and largest depth at both
ends less and plus s, and no farther aside than their largest plus s. If the corridor
and what lies before it allow these slabs (`passage`), all of the leg is clear.

What stays open is halved. A short piece is judged at a pose, by the exact test and as a
single configuration is; if that shows no contact either, it is `unknown`.

Where the needle is plainly clear of the patient nothing of this is asked (`beside`).
With a margin it must be farther away there; a tip aside of the corridor's line that is
nearer is contact, as that of any part.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.triangles.placing import place_mesh
from borecheck.geometry.triangles.solid import contained
from borecheck.motion.bounds import Route, chord_slack, displacement, gains, route
from borecheck.motion.halving import CERTIFIED, TOUCHED, UNDECIDED
from borecheck.motion.outcome import Timeline
from borecheck.motion.passage import RESERVE, Approach, Slabs, depth_and_aside
from borecheck.plans.corridor import Corridor
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import WORLD

if TYPE_CHECKING:
    from borecheck.motion.problem import Body, Motion

Array = NDArray[np.float64]

# Lengths differ between frames by what `check_transform` lets pass.
GENEROUS = 1.0 + 1e-5
# Pieces with less motion are not halved, [m]: where nothing is decided, and what the
# first contact is narrowed to; with the first of either found, the rest goes coarser.
FINEST, FIRST_CONTACT, COARSE = 1e-6, 1e-5, 2e-3
# Pieces looked at, besides one for every leg, before the rest is left undecided.
PIECE_LIMIT = 2_000
# Poses judged before the rest is left undecided.
POSE_LIMIT = 200

EYE = np.eye(4)


def examine_passage(
    chain: JointChain,
    needle: "Body",
    patient: "Body",
    corridor: Corridor,
    motion: "Motion",
    timeline: Timeline,
    stretches: Sequence[tuple[float, float]],
    margin: float,
) -> None:
    """Adds to the timeline where the needle is not shown to keep to its corridor.

    Args:
        chain: The robot's joints.
        needle: The part that may be in the patient.
        patient: An obstacle: fixed to the world, its mesh in the world's frame.
        corridor: Where it may be there.
        motion: The whole motion.
        timeline: Gathers the findings.
        stretches: Where that is asked, in waypoints, in order; elsewhere the needle is
            known to be plainly clear of the patient.
        margin: As near as this the needle's tip may come in line with its corridor
            alone, [m].
    """
    asked = PassageSearch(chain, needle, patient, corridor, motion, margin)
    asked.run(timeline, stretches)


class PassageSearch:
    """One passage, halved in time until it is decided; arguments as above."""

    def __init__(
        self,
        chain: JointChain,
        needle: "Body",
        patient: "Body",
        corridor: Corridor,
        motion: "Motion",
        margin: float = 0.0,
    ) -> None:
        self.chain, self.motion, self.margin = chain, motion, margin
        self.needle, self.patient, self.corridor = needle, patient, corridor
        self.approach = Approach(patient, corridor, margin)
        self.way: Route = route(chain, WORLD, needle.frame)
        self.gain = gains(chain, self.way, needle.radius, motion.largest) * GENEROUS
        self.names = (needle.name, patient.name)
        self.doubt = "not shown to keep to the plan's corridor"
        self.enough, self.finest = FIRST_CONTACT, FINEST
        self.judged = 0

    def run(self, timeline: Timeline, stretches: Sequence[tuple[float, float]]) -> None:
        """Examines stretches leg by leg, in order."""
        waiting = legs_of(stretches)[::-1]
        legs = len(waiting)
        rows: list[tuple[float, float, float]] = []
        looked = 0
        while waiting:
            begin, end = waiting.pop()
            looked += 1
            outcome: int | None = UNDECIDED
            if looked <= PIECE_LIMIT + legs:
                outcome = self._outcome(begin, end, timeline)
            if outcome is None:
                middle = 0.5 * (begin + end)
                waiting += [(middle, end), (begin, middle)]
            elif outcome != CERTIFIED:
                rows.append((begin, end, outcome))
        timeline.count(looked, self.judged)
        if rows:
            timeline.add(self.names, np.array(rows, dtype=np.float64))
        if looked > PIECE_LIMIT + legs or self.judged >= POSE_LIMIT:
            self.doubt += ", gave up"
        timeline.note(self.names, self.doubt)

    def _outcome(self, begin: float, end: float, timeline: Timeline) -> int | None:
        """What is known of a piece; None: it must be halved."""
        middle = 0.5 * (begin + end)
        if self.stays(begin, end):
            return CERTIFIED
        moved = self._moved(begin, end)
        if moved > self.enough and begin < middle < end:
            return None
        if self.judged >= POSE_LIMIT:
            return UNDECIDED
        outcome, reason = self.judge(middle)
        self.judged += 1
        if outcome == CERTIFIED and end == int(end):  # a waypoint is worth a look
            outcome, reason = self.judge(end)
            self.judged += 1
        if outcome == CERTIFIED:  # at that instant; the piece is not proven
            if moved > self.finest and begin < middle < end:
                return None
            outcome = UNDECIDED
        if outcome == UNDECIDED:
            self.doubt = reason or self.doubt
        self.enough = self.finest = COARSE
        if outcome == TOUCHED and reason:
            span = timeline.span
            timeline.add_contained(self.names, reason, begin / span, end / span)
            return CERTIFIED  # known already
        return outcome

    def stays(self, begin: float, end: float) -> bool:
        """Whether the needle keeps to the corridor during a piece of a leg: a proof."""
        return self.approach.allows(self.sweep(begin, end))

    def sweep(self, begin: float, end: float) -> Slabs:
        """What holds the needle at every instant of a piece of a leg."""
        change = self.motion.joints_at(end) - self.motion.joints_at(begin)
        slack = float(chord_slack(self.chain, self.way, self.gain, change))
        ends = [self._depth_and_aside(time) for time in (begin, end)]
        depth = np.stack([depth for depth, _ in ends])
        aside = np.stack([aside for _, aside in ends])
        return Slabs.of(depth, aside, slack * GENEROUS + RESERVE)

    def _depth_and_aside(self, time: float) -> tuple[Array, Array]:
        T = self.motion.place(self.chain, time)[self.needle.frame]
        return depth_and_aside(self.needle, self.corridor, T)

    def _moved(self, begin: float, end: float) -> float:
        change = self.motion.joints_at(end) - self.motion.joints_at(begin)
        return float(displacement(self.way, self.gain, change))

    def judge(self, time: float) -> tuple[int, str]:
        """What is known of an instant, and why if one holds the other or may do so."""
        T = self.motion.place(self.chain, time)[self.needle.frame]
        placed = place_mesh(T, self.needle.mesh)
        patient = self.patient.mesh
        pairs = self.needle.tree.contacts(self.patient.tree, T, EYE)
        if len(pairs) == 0:
            topologies = self.needle.topology, self.patient.topology
            found = contained(placed, patient, *topologies)
            if found.kind == "none":
                return (TOUCHED if self._is_too_near(T) else CERTIFIED), ""
            return (UNDECIDED if found.kind == "unknown" else TOUCHED), found.reason
        if not self.corridor.allows(placed, patient, pairs).all():
            return TOUCHED, ""
        stray = self.corridor.stray(placed, patient, self.patient.topology)
        if stray is None:
            return CERTIFIED, ""
        return (TOUCHED if stray.certain else UNDECIDED), stray.reason

    def _is_too_near(self, T: Array) -> bool:
        """Whether the tip is aside of its line, and the patient nearer than allowed."""
        if self.margin == 0.0:
            return False
        depth, aside = depth_and_aside(self.needle, self.corridor, T)
        tip = np.unravel_index(depth.argmax(), depth.shape)
        if aside[tip] <= self.corridor.radius + self.corridor.slack:
            return False
        found = self.needle.tree.within(self.patient.tree, T, EYE, self.margin)
        return bool(found.verdict != "clear")


def legs_of(stretches: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Stretches cut at the waypoints in them, in order."""
    found = []
    for begin, end in stretches:
        inside = range(int(begin) + 1, int(np.ceil(end)))
        cuts = [begin, *(float(k) for k in inside), end]
        found += list(pairwise(cuts))
    return found
