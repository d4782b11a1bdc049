"""A certified way from where the robot stands to where it is wanted."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.check import check
from borecheck.contact.queries import queries
from borecheck.contact.verdict import CLEAR, CONTACT, UNKNOWN
from borecheck.errors import UnknownNameError, UsageError
from borecheck.motion.needle_motion import needle_motion
from borecheck.motion.robot_problem import path_problem
from borecheck.motion.search import search
from borecheck.motion.turns import open_turns
from borecheck.planning.connect import connect
from borecheck.planning.edges import Edges
from borecheck.planning.metric import metric_of, sampled_box
from borecheck.planning.ompl import PLANNERS, check_planner, plan
from borecheck.planning.shorten import shorten
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.robots.given import Given, configuration, length, refuse_others
from borecheck.robots.model import RobotModel
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]

# Edges asked for before it is given up: about a minute of a small arm in a bore.
MOST_EDGES = 20_000

# Who searches: two trees of ours, or "ompl:" and the name of one of OMPL's planners.
OURS, OMPL = "connect", "ompl:"
# OMPL's planners count in seconds.
OMPL_SECONDS = 60.0

FOUND, NONE_FOUND, END_TOUCHES = "found", "none found", "an end is not clear"


@dataclass(frozen=True, eq=False)
class Route:
    """A way, or why there is none to show.

    Attributes:
        status: "found"; "none found": nothing is said about whether there is one; or
            "an end is not clear".
        verdict: "clear"; "contact" where an end touches; else "unknown".
        reason: What was found, in words.
        waypoints: Configurations (k, joints), straight between; None without a way.
        length: Of the way: the largest motion of any point of the robot, summed, [m].
        edges: How many were asked for.
        seed: The seed; the same seed, robot and scene give the same way.
    """

    status: str
    verdict: str
    reason: str
    waypoints: Array | None
    length: float
    edges: int
    seed: int

    @property
    def found(self) -> bool:
        """Whether there is a way."""
        return self.waypoints is not None

    def __repr__(self) -> str:
        return f"<Route {self.status}: {self.reason}>"


def route(
    robot: Robot,
    scene: Scene,
    start: Given,
    goal: Given | NeedlePlan,
    margin: float | str = 0.0,
    *,
    planner: str = OURS,
    seed: int = 0,
    most_edges: int = MOST_EDGES,
    most_seconds: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Route:
    """A way on which every instant is proven clear, by two growing trees.

    Needle and patient have no corridor here: the way ends before the skin, where a
    plan's own motion begins.

    Args:
        robot: From `load_robot`.
        scene: From `load_scene`.
        start: Where it stands: positions in the joints' order, by name, or "home".
        goal: Where it is wanted, likewise; or a needle plan: where its own motion
            begins, before the skin.
        margin: Clearance to obstacles that is kept everywhere, [m] or "5mm".
        planner: "connect": two growing trees; "ompl:NAME": one of OMPL's over the same
            edges (extra `planning`), which gives up after a minute unless told.
        seed: Of the random configurations; the answer depends on it, not on time. OMPL
            has random numbers of its own.
        most_edges: Edges asked for at most.
        most_seconds: When to give up, too, [s]; a way that is found in time is the
            same as without.
        progress: Called with edges asked for, and their limit.

    Raises:
        UsageError: A margin or a limit that is none, an obstacle of guessed unit, wrong
            lengths.
        JointLimitError: An end beyond a joint limit.
        UnreachableError: No configuration reaches the plan.
    """
    theirs = _of_ompl(planner)
    if theirs and most_seconds is None:
        most_seconds = OMPL_SECONDS
    _check_limits(most_edges, most_seconds)
    refuse_others(robot, scene)
    margin = length(margin, "margin")
    if isinstance(goal, NeedlePlan):
        # the motion that a check takes: of several ways the one with most room
        goal = needle_motion(robot, scene, goal).waypoints[0]
    ends = np.array([configuration(robot, start), configuration(robot, goal)])
    for name, q in zip(("start", "goal"), ends, strict=True):
        verdict = check(robot, scene, q, margin=margin)
        if verdict.verdict != CLEAR:
            what = "touches" if verdict.verdict == CONTACT else "is not proven clear"
            reason = f"the {name} {what}: {verdict.reason}"
            return Route(END_TOUCHES, verdict.verdict, reason, None, 0.0, 0, seed)
    problem = path_problem(robot, scene, margin)
    edges = Edges(problem, queries(robot, scene, margin))
    metric = metric_of(problem, robot.model)
    rng = np.random.default_rng(seed)
    low, high = sampled_box(robot.model, ends[0])
    out_of_time = _clock(most_seconds)
    if not theirs:
        way = connect(
            ends[0],
            ends[1],
            edges,
            metric,
            lambda: rng.uniform(low, high),
            most_edges,
            progress,
            out_of_time,
        )
    else:

        def give_up() -> bool:
            if progress is not None:
                progress(min(edges.asked, most_edges), most_edges)
            return edges.asked >= most_edges or out_of_time()

        way = plan(theirs, ends, edges, metric.scale, (low, high), give_up)
    if way is None:
        late = f" and {most_seconds:g} s" if out_of_time() else ""
        reason = f"no way found in {edges.asked} edges{late}; there may be one"
        return Route(NONE_FOUND, UNKNOWN, reason, None, 0.0, edges.asked, seed)
    way = with_ways_of_turning(robot.model, shorten(way, edges, metric, rng))
    if not search(problem, way).clear:  # once more, as it is told
        reason = "a way was found, but as a whole it is not proven clear"
        return Route(NONE_FOUND, UNKNOWN, reason, None, 0.0, edges.asked, seed)
    way.setflags(write=False)
    far = metric.length(way)
    taken = "1 edge" if len(way) == 2 else f"{len(way) - 1} edges"
    reason = f"{taken}, {1e3 * far:.0f} mm at most for any point"
    return Route(FOUND, CLEAR, reason, way, far, edges.asked, seed)


def _of_ompl(planner: str) -> str:
    """Which of OMPL's planners is asked for; empty if ours is.

    Raises:
        UnknownNameError: There is none of that name.
        UsageError: OMPL is not installed.
    """
    if planner == OURS:
        return ""
    name = planner.removeprefix(OMPL)
    if name == planner:
        known = (OURS, *(OMPL + each for each in PLANNERS))
        raise UnknownNameError("planner", planner, known)
    check_planner(name)
    return name


def _check_limits(most_edges: int, most_seconds: float | None) -> None:
    if most_edges < 1:
        raise UsageError(f"at least one edge must be asked for, not {most_edges}")
    if most_seconds is not None and not 0.0 < most_seconds < np.inf:
        raise UsageError(f"{most_seconds} s is no time to search for")


def _clock(most_seconds: float | None) -> Callable[[], bool]:
    """Tells whether so many seconds have gone since now."""
    if most_seconds is None:
        return lambda: False
    end = time.monotonic() + most_seconds
    return lambda: time.monotonic() > end


def with_ways_of_turning(model: RobotModel, way: Array) -> Array:
    """The way with more waypoints, so that no step leaves open which way a joint turns.

    A continuous joint that turns by half a turn or more in one step may as well be
    driven the other way. A point of a proven edge is proven.

    Args:
        model: The robot's joints.
        way: Configurations (k, joints).
    """
    while (turns := open_turns(model, way)) is not None:
        steps = sorted(set(turns.steps))
        middles = 0.5 * (way[steps] + way[np.array(steps) + 1])
        way = np.insert(way, np.array(steps) + 1, middles, axis=0)
    return way
