"""One judge: what stops a check of a robot file, in the order in which it is told."""

from collections.abc import Iterator

from borecheck.errors import UrdfError
from borecheck.robots.urdf.draft import UrdfDraft
from borecheck.robots.urdf.rules import document, joints, names, numbers, shapes, tree
from borecheck.robots.urdf.rules.defect import Defect
from borecheck.robots.urdf.source import Place

RULES = (
    document.root,
    document.left_over_xacro,
    document.robot_name,
    document.robot_version,
    document.missing,
    document.repeated,
    document.quaternions,
    shapes.unknown_attributes,
    shapes.unknown_elements,
    shapes.misplaced_collisions,
    document.missing_attributes,
    numbers.no_numbers,
    numbers.locale,
    numbers.not_finite,
    numbers.count,
    shapes.sizes,
    shapes.scales,
    names.missing,
    names.duplicate,
    tree.no_links,
    tree.unnamed_links,
    tree.unknown_links,
    tree.two_parents,
    tree.cycles,
    tree.several_roots,
    tree.unreachable,
    tree.too_deep,
    joints.unknown_type,
    joints.zero_axis,
    joints.long_axis,
    joints.missing_limits,
    joints.reversed_limits,
    joints.missing_leaders,
    joints.mimic_cycles,
    joints.free_joints,
)


def problems(draft: UrdfDraft) -> Iterator[Defect]:
    """Everything that stops a check."""
    for rule in RULES:
        yield from (problem for problem in rule(draft) if problem.stops)


def refuse(draft: UrdfDraft) -> None:
    """Nothing, if a check can be made.

    Raises:
        UrdfError: The first thing that stops it, with file, line and element.
    """
    for problem in problems(draft):
        raise refusal(draft.source.place(problem.element), problem.message)


def refusal(place: Place, message: str) -> UrdfError:
    """What is wrong at a place, as the one line that stops a command."""
    return UrdfError(f"{place.file}:{place.line}", message, place.path)
