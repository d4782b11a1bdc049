"""What the rules of the one judge find, as hits of checks."""

from collections.abc import Callable, Iterator

from borecheck.robots.urdf.draft import UrdfDraft
from borecheck.robots.urdf.rules.problem import Problem
from borecheck.validation.findings import Severity
from borecheck.validation.reading.draft import Robot
from borecheck.validation.registry import Hit

Rule = Callable[[UrdfDraft], Iterator[Problem]]


def hits(robot: Robot, rule: Rule) -> Iterator[Hit]:
    """The problems of one rule.

    What stops a check is an error whatever the profile. What does not has the check's
    own severity for dynamics, and is a warning where only contacts are asked for.
    """
    harmless = None if robot.options.profile == "dynamics" else Severity.WARNING
    for problem in rule(robot):
        level = Severity.ERROR if problem.stops else harmless
        yield Hit(
            problem.element, problem.message, problem.attribute, level, problem.hint
        )
