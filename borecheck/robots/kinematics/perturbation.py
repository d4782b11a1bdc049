"""Would the cross-check notice a wrong number? Every one is changed and looked for.

A check that cannot fail says nothing. Each dimension of the closed form, and each
number of each origin, axis and mimic of the URDF, is changed by 0.1 mm or 1e-4; the two
sources must then disagree. Numbers whose change goes unseen are named, with what they
do.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import UrdfError, UsageError
from borecheck.robots.description import hook, plugin_hook
from borecheck.robots.kinematics import sources
from borecheck.robots.kinematics.agreement import Tolerances, disagreements
from borecheck.robots.kinematics.sources import Placements, RobotLike
from borecheck.robots.model import RobotModel

Array = NDArray[np.float64]

BY = 1e-4  # 0.1 mm; as an angle 0.006 deg

# Below this a link counts as not moved: two builds of the same number differ by 1e-15.
UNMOVED = 1e-12


@dataclass(frozen=True)
class Unseen:
    """A changed number that the compared frames do not show.

    Attributes:
        number: Its name: a dimension, or `joint/origin xyz[0]`.
        why: What the change does instead.
    """

    number: str
    why: str


@dataclass(frozen=True)
class PerturbationStudy:
    """Which changed numbers the cross-check notices.

    Attributes:
        seen: Names of the numbers whose change was noticed.
        unseen: The others, each with the reason.
        configurations: How many configurations were looked at.
        by: The change, [m], [rad] or 1.
    """

    seen: tuple[str, ...]
    unseen: tuple[Unseen, ...]
    configurations: int
    by: float


def unseen_perturbations(
    robot: RobotLike,
    configurations: ArrayLike,
    by: float = BY,
    tolerances: Tolerances | None = None,
) -> PerturbationStudy:
    """Change every number of both descriptions in turn and look for disagreement.

    Args:
        robot: A robot with a closed form that takes `perturbed={dimension: change}`.
        configurations: Joint positions in the order of the model, (k, n).
        by: The change.
        tolerances: As for the cross-check.

    Raises:
        UsageError: No closed form, or the two disagree before anything is changed.
    """
    allowed = Tolerances() if tolerances is None else tolerances
    qs = np.atleast_2d(np.array(configurations, dtype=np.float64))
    closed, engine = sources.analytic(robot), sources.pinocchio(robot)
    if closed is None:
        raise UsageError(f"{robot.model.name} has no closed form to compare with")
    if disagreements(closed, engine, qs, allowed):
        raise UsageError("the sources disagree before any number is changed")
    seen: list[str] = []
    unseen: list[Unseen] = []
    for name, changed in _changed_dimensions(robot, by):
        if _noticed(changed, engine, qs, allowed):
            seen.append(name)
        else:
            unseen.append(Unseen(name, "moves none of the compared frames"))
    for name, text in changed_urdfs(robot.urdf_text, by):
        why = _why_unseen(robot, closed, text, qs, allowed)
        if why is None:
            seen.append(name)
        else:
            unseen.append(Unseen(name, why))
    return PerturbationStudy(tuple(seen), tuple(unseen), len(qs), by)


def changed_urdfs(urdf_text: str, by: float = BY) -> Iterator[tuple[str, str]]:
    """(name, URDF text) with one number changed at a time.

    Every number of every `<origin>` of a joint (absent ones count as 0), of every
    `<axis>` (and the axis reversed), and of every `<mimic>`.
    """
    root = ElementTree.fromstring(urdf_text)
    for joint in root.findall("joint"):
        name = joint.get("name", "")
        for attribute in ("xyz", "rpy"):
            yield from _changed(root, joint, name, "origin", attribute, "0 0 0", by)
        if joint.get("type") in ("revolute", "continuous", "prismatic"):
            yield from _changed(root, joint, name, "axis", "xyz", "1 0 0", by)
            yield from _reversed(root, joint, name)
        if joint.find("mimic") is not None:
            yield from _changed(root, joint, name, "mimic", "multiplier", "1", by)
            yield from _changed(root, joint, name, "mimic", "offset", "0", by)


def _changed(
    root: ElementTree.Element,
    joint: ElementTree.Element,
    name: str,
    tag: str,
    attribute: str,
    default: str,
    by: float,
) -> Iterator[tuple[str, str]]:
    element = joint.find(tag)
    added = element is None
    if element is None:
        element = ElementTree.SubElement(joint, tag)
    before = element.get(attribute)
    numbers = [float(text) for text in (before or default).split()]
    for i, number in enumerate(numbers):
        moved = [*numbers[:i], number + by, *numbers[i + 1 :]]
        element.set(attribute, " ".join(repr(value) for value in moved))
        place = f"[{i}]" if len(numbers) > 1 else ""
        yield f"{name}/{tag} {attribute}{place}", ElementTree.tostring(root, "unicode")
    _restore(joint, element, attribute, before, added)


def _reversed(
    root: ElementTree.Element, joint: ElementTree.Element, name: str
) -> Iterator[tuple[str, str]]:
    element = joint.find("axis")
    added = element is None
    if element is None:
        element = ElementTree.SubElement(joint, "axis")
    before = element.get("xyz")
    numbers = [float(text) for text in (before or "1 0 0").split()]
    element.set("xyz", " ".join(repr(-value) for value in numbers))
    yield f"{name}/axis reversed", ElementTree.tostring(root, "unicode")
    _restore(joint, element, "xyz", before, added)


def _restore(
    joint: ElementTree.Element,
    element: ElementTree.Element,
    attribute: str,
    before: str | None,
    added: bool,
) -> None:
    if added:
        joint.remove(element)
    elif before is None:
        del element.attrib[attribute]
    else:
        element.set(attribute, before)


def _changed_dimensions(
    robot: RobotLike, by: float
) -> Iterator[tuple[str, Placements]]:
    description = robot.description
    if description is None or description.dimensions is None:
        return
    dimensions = plugin_hook(description, "dimensions", hook, sources.not_dimensions)
    named: Mapping[str, float] = dimensions(**sources.closed_form_arguments(robot))
    for name in named:
        changed = sources.analytic(robot, perturbed={name: by})
        assert changed is not None  # the caller has made sure that there is one
        yield name, changed


def _why_unseen(
    robot: RobotLike, closed: Placements, text: str, qs: Array, allowed: Tolerances
) -> str | None:
    """None if the change is noticed; otherwise what it does."""
    try:
        changed = RobotModel(text)
    except UrdfError:
        return None  # a robot that cannot be built is noticed
    if _noticed(sources.pinocchio(robot, changed), closed, qs, allowed):
        return None
    moved = _moved_links(robot.model, changed, qs)
    if not moved:
        return "moves no link (an axis made longer is the same axis)"
    return "moves only links without a closed form: " + ", ".join(moved)


def _noticed(
    first: Placements, second: Placements, qs: Array, allowed: Tolerances
) -> bool:
    """Whether one configuration shows it; stops at the first that does."""
    return any(disagreements(first, second, [q], allowed) for q in qs)


def _moved_links(model: RobotModel, changed: RobotModel, qs: Array) -> list[str]:
    moved = set()
    for q in qs:
        before, after = model.placements(q), changed.placements(q)
        moved |= {n for n, T in before.items() if np.abs(T - after[n]).max() > UNMOVED}
    return [name for name in model.link_names if name in moved]
