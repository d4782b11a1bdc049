"""One draw of the errors, judged as a whole: is the disturbed motion clear?

A draw is a motion of its own. It is looked at at some instants first, where contact is
found fast; what is not decided there goes through the certified search, which answers
for every instant: obstacles, the robot itself, solids, and the needle in its corridor.
"""

from collections.abc import Mapping
from dataclasses import replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.verdict import CLEAR, CONTACT
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.motion.halving import TOUCHED
from borecheck.motion.outcome import PathVerdict
from borecheck.motion.passage_search import PassageSearch
from borecheck.motion.problem import Body, PathProblem, path_motion
from borecheck.motion.search import search
from borecheck.robots.kinematics.chain import JointChain
from borecheck.uncertainty.disturbed import Disturbance
from borecheck.uncertainty.needle import NeedleRoom
from borecheck.uncertainty.reach import effects_of, sizes
from borecheck.uncertainty.room import restricted

Array = NDArray[np.float64]
Names = tuple[str, str]

# Instants of a draw that are looked at before it is searched, beside its waypoints.
INSTANTS = 5


class State(Enum):
    """What is known of a draw."""

    CLEAR = "clear"
    CONTACT = "contact"
    UNDECIDED = "undecided"


class Judge:
    """Judges draws of the errors of one motion.

    Args:
        disturbance: What errors do.
        problem: Nominal robot and scene, without doubt.
        points: The nominal motion's waypoints, (k, n).
        needles: Rooms of the passages by their number, where they are known.
    """

    def __init__(
        self,
        disturbance: Disturbance,
        problem: PathProblem,
        points: Array,
        needles: Mapping[int, NeedleRoom] | None = None,
    ) -> None:
        self.disturbance, self.problem, self.points = disturbance, problem, points
        self._needles = dict(needles or {})
        self._effects = effects_of(disturbance)
        self._times = _instants(len(points))
        self._shaped = set(disturbance.dimensions.shapes)
        self._obstacles = self._links(of_obstacles=True)
        self._itself = self._links(of_obstacles=False)

    def judge(self, x: Array, numbers: set[int]) -> tuple[State, Names | None]:
        """What is known of errors x, and who meets whom.

        Args:
            x: The errors, (n,).
            numbers: Pairs and passages that are not known to be clear.
        """
        if not numbers:
            return State.CLEAR, None
        points = self.points + self.disturbance.joints(x)
        problem = self._problem(x)
        numbers = numbers - self._kept(x, problem, points, numbers)
        if not numbers:
            return State.CLEAR, None
        problem = restricted(problem, numbers)
        seen = self._seen(problem.chain, points) or _strays(problem, points)
        if seen is not None:
            return State.CONTACT, seen
        found = search(problem, points)
        if found.verdict == CONTACT:
            return State.CONTACT, _whose(found)
        return (State.CLEAR if found.verdict == CLEAR else State.UNDECIDED), None

    def _kept(
        self, x: Array, problem: PathProblem, points: Array, numbers: set[int]
    ) -> set[int]:
        """Passages that are proven to keep to their corridor."""
        asked = numbers & set(self._needles)
        if not asked:
            return set()
        moved = sizes(self._effects, x[None])[0]
        return {k for k in asked if self._needles[k].keeps(problem, points, moved)}

    def _problem(self, x: Array) -> PathProblem:
        """Robot and scene with the errors."""
        parts = list(self.problem.parts)
        p = x[self.disturbance.of_dimensions]
        for k in self._shaped:
            mesh: TriangleMesh = self.disturbance.dimensions.reshaped(
                k, parts[k].mesh, p
            )
            parts[k] = Body(parts[k].name, mesh, parts[k].frame)
        chain = self.disturbance.chain(x)
        return replace(self.problem, chain=chain, parts=tuple(parts))

    def _seen(self, chain: JointChain, points: Array) -> Names | None:
        """Surfaces that meet at one of the instants."""
        frames = [part.frame for part in self.problem.parts]
        qs = _at(points, self._times)
        placements = chain.placements(qs, frames)
        for links, others in (
            (self._obstacles, self.problem.obstacles),
            (self._itself, self.problem.parts),
        ):
            hits = links.first_pairs(placements) if links is not None else None
            if hits is not None and links is not None and (hits >= 0).any():
                i, j = links.pairs[int(hits[np.argmax(hits >= 0)])]
                return self.problem.parts[i].name, others[j].name
        return None

    def _links(self, *, of_obstacles: bool) -> MovingLinks | None:
        """Surfaces that must not meet and whose shape no error changes."""
        problem = self.problem
        apart = problem.excluded | {(p.part, p.obstacle) for p in problem.passages}
        own = [part.tree for part in problem.parts]
        if of_obstacles:
            pairs = [
                (i, j)
                for i in range(len(problem.parts))
                for j in range(len(problem.obstacles))
                if (i, j) not in apart and i not in self._shaped
            ]
        else:
            pairs = [p for p in problem.self_pairs if not self._shaped & set(p)]
        if not pairs:
            return None
        if not of_obstacles:
            return MovingLinks.among(own, np.array(pairs))
        all_pairs = MovingLinks.against(
            own,
            [obstacle.tree for obstacle in problem.obstacles],
            np.stack([obstacle.T_frame_mesh for obstacle in problem.obstacles]),
        )
        return replace(all_pairs, pairs=np.array(pairs, np.int64))


def _strays(problem: PathProblem, points: Array) -> Names | None:
    """A needle that is outside its corridor at a waypoint."""
    for passage in problem.passages:
        needle = problem.parts[passage.part]
        patient = problem.obstacles[passage.obstacle]
        motion = path_motion(problem, points)
        look = PassageSearch(problem.chain, needle, patient, passage.corridor, motion)
        for time in range(len(points) - 1, -1, -1):  # the target first
            if look.judge(float(time))[0] == TOUCHED:
                return needle.name, patient.name
    return None


def _whose(found: PathVerdict) -> Names | None:
    """Who meets first."""
    if found.first_contact is not None:
        return found.first_contact[2]
    touching = [s for s in found.intervals if s.verdict == CONTACT and s.pairs]
    return touching[0].pairs[0] if touching else None


def _instants(waypoints: int) -> Array:
    """Waypoints and some instants between, in units of waypoints."""
    last = float(waypoints - 1)
    return np.unique([*np.linspace(0.0, last, INSTANTS), *np.arange(waypoints)])


def _at(points: Array, times: Array) -> Array:
    first = np.minimum(times.astype(int), max(len(points) - 2, 0))
    after = np.minimum(first + 1, len(points) - 1)
    share = (times - first)[:, None]
    return np.asarray(points[first] + share * (points[after] - points[first]))
