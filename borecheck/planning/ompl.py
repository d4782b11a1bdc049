"""OMPL's planners over the same certified edges: the extra `planning`.

What they are given is an answer to "is this straight way clear" that is proven, so that
what they join is proven too. Their own checks by samples are not used. A way that only
comes near the goal is none.

OMPL's random numbers and its clock are its own: another run may give another way.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import UnknownNameError, UsageError
from borecheck.planning.edges import Edges

Array = NDArray[np.float64]

# PRM and PRMstar ask from threads of their own while Python waits for them: they are
# left out. The rest of what the Python package offers is here.
PLANNERS = (
    *("RRTConnect", "RRT", "RRTstar", "InformedRRTstar", "SORRTstar", "AORRTC"),
    *("BITstar", "FMT", "BFMT", "KPIECE1", "BKPIECE1", "LBKPIECE1"),
)


def check_planner(name: str) -> None:
    """That there is such a planner, and OMPL to run it.

    Raises:
        UnknownNameError: No planner is called so.
        UsageError: OMPL is not installed.
    """
    if name not in PLANNERS:
        raise UnknownNameError("planner of OMPL", name, PLANNERS)
    _library()


def plan(
    name: str,
    ends: Array,
    edges: Edges,
    scale: Array,
    box: tuple[Array, Array],
    give_up: Callable[[], bool],
) -> Array | None:
    """A way of certified edges by one of OMPL's planners, or None.

    Those that improve their way (names with star, AORRTC) do so until they give up.

    Args:
        name: One of PLANNERS.
        ends: Start and goal (2, joints), clear.
        edges: What proves an edge.
        scale: Of each joint, what a change of it moves a point by at most, [m/rad] or
            1: OMPL's distances are of joints in metres, squared and summed.
        box: Lowest and highest configuration that may be drawn.
        give_up: Whether to end the search.

    Returns:
        Configurations (k, joints), straight between them.
    """
    base, geometric = _library()
    count = len(scale)
    space = base.RealVectorStateSpace(count)
    space.setBounds(_bounds(base, scale, box))
    information = base.SpaceInformation(space)
    validator, pose = _certified(base, information, edges, scale)
    information.setMotionValidator(validator)
    information.setStateValidityChecker(pose)
    information.setup()
    problem = base.ProblemDefinition(information)
    # nearer than any edge is long: no goal but the goal itself
    problem.setStartAndGoalStates(*(_state(space, q * scale) for q in ends), 1e-12)
    problem.setOptimizationObjective(base.PathLengthOptimizationObjective(information))
    planner = getattr(geometric, name)(information)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(base.PlannerTerminationCondition(give_up))
    if not problem.hasExactSolution():
        return None
    states = problem.getSolutionPath().getStates()
    way = np.array([[state[j] for j in range(count)] for state in states]) / scale
    return np.array([ends[0], *way[1:-1], ends[1]])


def _library() -> tuple[Any, Any]:
    try:
        from ompl import base, geometric, util
    except ImportError as error:
        raise UsageError(
            f"OMPL's planners need the package ompl, which is not installed ({error}): "
            "pip install 'borecheck[planning]'"
        ) from error
    util.setLogLevel(util.LogLevel.LOG_NONE)
    return base, geometric


def _bounds(base: Any, scale: Array, box: tuple[Array, Array]) -> Any:
    bounds = base.RealVectorBounds(len(scale))
    for j in range(len(scale)):
        bounds.setLow(j, float(box[0][j] * scale[j]))
        bounds.setHigh(j, float(box[1][j] * scale[j]))
    return bounds


def _state(space: Any, values: Array) -> Any:
    state = space.allocState()
    for j, value in enumerate(values):
        state[j] = float(value)
    return state


def _certified(
    base: Any, information: Any, edges: Edges, scale: Array
) -> tuple[Any, Any]:
    """What OMPL asks about edges and about single configurations."""

    def configuration(state: Any) -> Array:
        return np.array([state[j] for j in range(len(scale))]) / scale

    class Motions(base.MotionValidator):  # type: ignore[misc]
        def checkMotion(self, a: Any, b: Any, _: Any = None) -> bool:
            return bool(edges.clear(configuration(a), configuration(b)))

    class Poses(base.StateValidityChecker):  # type: ignore[misc]
        def isValid(self, state: Any) -> bool:
            return bool(edges.free(configuration(state)))

    return Motions(information), Poses(information)
