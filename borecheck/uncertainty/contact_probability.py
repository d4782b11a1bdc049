"""The probability that a pose or a motion ends in contact, and whether a risk is kept.

Every draw of the errors is a disturbed motion and gets the whole verdict: obstacles,
the robot itself, solids, the needle in its corridor, at every instant. A draw that
cannot be decided counts as contact for upper limits, as clear for lower ones. A risk is
*kept* only if the exact upper limit of the probability is at or below it, *exceeded* if
the lower one is above it; anything else is *not shown*.

Errors that are proven harmless (`room`) need no draws: they are made beyond them
(`draws`), and every share is multiplied by how likely that is.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import UsageError
from borecheck.motion.problem import PathProblem
from borecheck.motion.robot_problem import path_problem
from borecheck.motion.samples import checked_waypoints
from borecheck.plans.corridor import Corridor
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from borecheck.uncertainty.covariance import Uncertainty
from borecheck.uncertainty.disturbed import Disturbance
from borecheck.uncertainty.draws import Shell, enough_radius
from borecheck.uncertainty.intervals import (
    LEVEL,
    draws_needed,
    lower_limit,
    shown_interval,
    upper_limit,
)
from borecheck.uncertainty.judging import Judge, State
from borecheck.uncertainty.reach import effects_of, sizes
from borecheck.uncertainty.room import Rooms, RoomSearch, open_pairs

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]

KEPT, EXCEEDED, NOT_SHOWN = "kept", "exceeded", "not shown"

# Draws at least, and at most unless more are asked for: a minute for a needle plan.
FEWEST, MOST = 300, 20_000
# As many as anybody can wait for.
LIMIT = 10_000_000
# Draws made and judged in one go. Where their number is not set, the first go may end
# the work: if it shows, at this level, that the risk is exceeded.
PIECE, BEYOND_DOUBT = 300, 1.0 - 1e-6


@dataclass(frozen=True)
class ContactProbability:
    """How likely a pose or motion comes into contact, or within the margin.

    Attributes:
        probability: Share of the draws in contact, times `outside`; None undrawn.
        interval: 95 % interval of the probability (Jeffreys), for readers.
        lower: Exact one-sided 95 % limit: the probability is seldom below it.
        upper: The same from above: what a risk is judged by.
        risk: The accepted probability.
        answer: kept, exceeded or not shown.
        why: What `not shown` lacks, one phrase; empty else.
        samples: Draws.
        contacts: Of them in contact.
        undecided: Of them neither shown to be in contact nor to be clear.
        draws_needed: How many would show that the risk is kept if the share of contacts
            stayed; None where none would, or where nothing needs to be shown.
        proven_radius: Errors up to so many standard deviations, all together, are
            proven harmless.
        outside: How likely larger ones are: draws are made among them only.
        meets: Who met in the draws, with the share of all draws, most often first.
        margin_m: Required clearance, [m].
        level: Of the limits.
        seed: Of the draws.
        names: The quantities that are uncertain.
    """

    probability: float | None
    interval: tuple[float, float]
    lower: float
    upper: float
    risk: float
    answer: str
    why: str
    samples: int
    contacts: int
    undecided: int
    draws_needed: int | None
    proven_radius: float
    outside: float
    meets: tuple[tuple[str, str, float], ...]
    margin_m: float
    level: float
    seed: int
    names: tuple[str, ...]

    @property
    def within_risk(self) -> bool | None:
        """True: kept. False: exceeded. None: neither is shown."""
        return {KEPT: True, EXCEEDED: False}.get(self.answer)

    def to_json(self) -> dict[str, Any]:
        """Plain values for `json.dumps`."""
        return {**asdict(self), "within_risk": self.within_risk}


def contact_probability(
    robot: Robot,
    scene: Scene,
    motion: ArrayLike,
    uncertainty: Uncertainty,
    *,
    margin: float = 0.0,
    risk: float = 1e-3,
    samples: int | None = None,
    seed: int = 0,
    corridor: Corridor | None = None,
    progress: Progress | None = None,
) -> ContactProbability:
    """Probability that a pose or motion comes into contact, or within the margin.

    Args:
        robot: The robot.
        scene: What stands around it.
        motion: A configuration (n,), or waypoints (k, n), straight in between; within
            the limits.
        uncertainty: What is not exact.
        margin: Required clearance to the obstacles, [m]; 0 asks for contact.
        risk: Accepted probability.
        samples: Draws; None: as many as show the risk to be kept if none of them is in
            contact (`FEWEST` at least, `MOST` at most). Without draws nothing is shown.
        seed: Of the draws.
        corridor: Where the needle may be in the patient.
        progress: Called with draws done and in all.

    Raises:
        JointLimitError: A configuration beyond a limit.
        UsageError: A risk that is no probability, a number of draws that is none, no
            obstacle, a dimension whose errors cannot be drawn.
    """
    check_request(risk, samples)
    if not scene.obstacles:
        raise UsageError("there is no obstacle to be clear of")
    points = checked_waypoints(robot, np.atleast_2d(np.asarray(motion, dtype=float)))
    problem = path_problem(robot, scene, margin, corridor)
    sample = _Sample(robot, problem, points, uncertainty, risk)
    rng = np.random.default_rng(seed)
    if samples is None:
        sample.draw(FEWEST, rng, progress)
        samples = FEWEST if sample.exceeds(risk) else sample.draws_for(risk)
    sample.draw(samples, rng, progress)
    return _estimated(sample, risk, seed, problem.doubt)


def check_request(risk: float, samples: int | None) -> None:
    """Refuses a risk that is no probability, and a number of draws that is none."""
    if not 0.0 < risk < 1.0:
        raise UsageError(f"risk {risk!r} is no probability between 0 and 1")
    if samples is not None and not 0 <= samples <= LIMIT:
        raise UsageError(f"{samples} draws: it must be 0 or more, at most {LIMIT:,}")


class _Sample:
    """Draws of one motion and what was found of them."""

    def __init__(
        self,
        robot: Robot,
        problem: PathProblem,
        points: Array,
        uncertainty: Uncertainty,
        risk: float,
    ) -> None:
        # a doubt about the scene is for the answer, not for each draw
        known = replace(problem, doubt=None)
        disturbance = Disturbance(robot, uncertainty)
        self.uncertainty, self.margin = uncertainty, problem.margin
        self.root = uncertainty.root
        self.effects = effects_of(disturbance)
        dimensions = self.root.shape[1]
        far = enough_radius(dimensions, 1e-3 * risk)
        self.rooms: Rooms = RoomSearch(disturbance, known, points, far).run()
        self.shell = Shell.beyond(self.rooms.radius, dimensions)
        self.judge = Judge(disturbance, known, points, self.rooms.needles)
        self.samples = self.contacts = self.undecided = 0
        self.meets: Counter[tuple[str, str]] = Counter()

    def draws_for(self, risk: float) -> int:
        """As many as show the risk to be kept if none is in contact."""
        needed = draws_needed(risk / self.shell.outside) or FEWEST
        return min(max(needed, FEWEST), MOST)

    def exceeds(self, risk: float) -> bool:
        """Whether more draws are not needed to call the risk exceeded."""
        lower = lower_limit(self.contacts, self.samples, BEYOND_DOUBT)
        return self.shell.outside * lower > risk

    def draw(
        self, count: int, rng: np.random.Generator, progress: Progress | None
    ) -> None:
        """Makes and judges draws until there are so many."""
        while self.samples < count:
            z = self.shell.draw(rng, min(PIECE, count - self.samples))
            xs = z @ self.root.T
            left = open_pairs(self.rooms, sizes(self.effects, xs))
            for x, row in zip(xs, left, strict=True):
                self._add(*self.judge.judge(x, set(np.flatnonzero(row).tolist())))
                if progress is not None:
                    progress(self.samples, count)

    def _add(self, state: State, names: tuple[str, str] | None) -> None:
        self.samples += 1
        self.contacts += state is State.CONTACT
        self.undecided += state is State.UNDECIDED
        if names is not None:
            self.meets[names] += 1


def _estimated(
    sample: _Sample, risk: float, seed: int, doubt: str | None
) -> ContactProbability:
    """What the draws say."""
    n, hits, most = sample.samples, sample.contacts, sample.contacts + sample.undecided
    outside = sample.shell.outside
    low, high = shown_interval(hits, sample.undecided, n)
    lower = outside * lower_limit(hits, n)
    upper = outside * upper_limit(most, n) if n else outside
    needed = draws_needed(risk / outside, most / n if n else 0.0)
    answer = KEPT if upper <= risk else EXCEEDED if lower > risk else NOT_SHOWN
    why = ""
    if answer == KEPT and n == 0:
        answer, why = NOT_SHOWN, "no draws were made"
    elif answer == KEPT and doubt is not None:
        answer, why = NOT_SHOWN, doubt
    elif answer == NOT_SHOWN:
        why = _lack(n, hits, sample.undecided, needed)
    return ContactProbability(
        probability=outside * hits / n if n else None,
        interval=(outside * low, outside * high),
        lower=lower,
        upper=upper,
        risk=risk,
        answer=answer,
        why=why,
        samples=n,
        contacts=hits,
        undecided=sample.undecided,
        draws_needed=needed if answer == NOT_SHOWN else None,
        proven_radius=sample.shell.radius,
        outside=outside,
        meets=tuple((a, b, k / n) for (a, b), k in sample.meets.most_common()),
        margin_m=sample.margin,
        level=LEVEL,
        seed=seed,
        names=sample.uncertainty.names,
    )


def _lack(n: int, hits: int, undecided: int, needed: int | None) -> str:
    """Why a risk is neither shown to be kept nor to be exceeded."""
    if n == 0:
        return "no draws were made"
    if undecided and needed is None:
        return f"{undecided:,} of {n:,} draws could not be decided"
    if needed is None:
        return f"{hits:,} of {n:,} draws are in contact, about as many as accepted"
    if needed <= n:
        return f"{hits:,} of {n:,} draws are in contact"
    share = (
        "without contact" if hits + undecided == 0 else "with such a share of contact"
    )
    return f"it takes {needed:,} draws {share}, {n:,} were made"
