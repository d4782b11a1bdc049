"""What the one judge's rules find, and what reading left to say, as problems."""

from collections.abc import Callable, Iterator

from borecheck.robots.urdf.draft import UrdfDraft
from borecheck.robots.urdf.rules.defect import Defect
from borecheck.validation.findings import Severity
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem

Rule = Callable[[UrdfDraft], Iterator[Defect]]


def problems(robot: CheckedUrdf, rule: Rule) -> Iterator[Problem]:
    """The problems of one rule.

    What stops a check is an error whatever the profile. What does not has the check's
    own severity for dynamics, and is a warning where only contacts are asked for.
    """
    harmless = None if robot.options.profile == "dynamics" else Severity.WARNING
    for problem in rule(robot):
        level = Severity.ERROR if problem.stops else harmless
        yield Problem(
            problem.element, problem.message, problem.attribute, level, problem.hint
        )


def noted(robot: CheckedUrdf, code: str) -> Iterator[Problem]:
    """What was noticed when the file was read."""
    for element, message in robot.notes.get(code, []):
        yield Problem(robot.root if element is None else element, message)
