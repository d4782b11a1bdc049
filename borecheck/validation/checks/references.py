"""Checks against a second source: a closed form, or another file of the same robot.

A flipped axis or a wrong length is a sound file; only a stranger to it can tell.
"""

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from borecheck.core.se3 import Array, inverse
from borecheck.errors import InputError, UsageError
from borecheck.robots.description import hook
from borecheck.robots.urdf.attributes import Vector, placement
from borecheck.robots.urdf.draft_elements import DraftJoint
from borecheck.validation.checks.running import TOLERANCE, gap
from borecheck.validation.findings import Finding
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.reading.moving_tree import MovingTree, moving_tree_of
from borecheck.validation.registry import Problem, register

NAMED = 5  # so many names are listed


@dataclass(frozen=True)
class ClosedForm:
    """A closed form named as `module:function`, imported when it is first asked.

    Raises:
        UsageError: It cannot be imported, or fails on a configuration.
    """

    reference: str

    def __post_init__(self) -> None:
        sys.path.insert(0, str(Path.cwd()))
        try:
            hook(self.reference)
        except Exception as error:  # a stranger's module may raise anything
            raise self._unusable(error) from error
        finally:
            sys.path.pop(0)

    def __call__(self, positions: Mapping[str, float]) -> Mapping[str, Any]:
        """The frames of one configuration."""
        try:
            return dict(hook(self.reference)(positions))
        except Exception as error:
            raise self._unusable(error) from error

    def _unusable(self, error: Exception) -> UsageError:
        what = f"{type(error).__name__}: {error}"
        return UsageError(
            f"closed form {self.reference!r}: {what} (it is named module:function, and "
            "takes {joint: position} to {frame: T_root_frame})"
        )


@register("K602", "closed-form-disagrees", "kinematics", "EEE")
def closed_form_disagrees(robot: CheckedUrdf) -> Iterator[Problem]:
    """The analytic model places a frame elsewhere than the URDF.

    Why: The two were written down separately; one of them has a wrong number, sign or
    axis. No URDF parser can see this.

    Fix: Compare both with the drawing at the named frame.
    """
    closed_form, moving = robot.options.closed_form, moving_tree_of(robot)
    if closed_form is None or moving is None:
        return
    worst: dict[str, tuple[float, float, float]] = {}
    strange: set[str] = set()
    for free in moving.sampled(robot.options.seed, robot.options.samples):
        placed = moving.placements(moving.positions(free))
        for frame, T in closed_form(free).items():
            if frame not in placed:
                strange.add(frame)
                continue
            found = gap(placed[frame], np.asarray(T, dtype=float))
            worst[frame] = max(worst.get(frame, found), found)
    if strange or not worst:
        names = ", ".join(map(repr, sorted(strange))) or "none"
        yield Problem(
            robot.root, f"frames of the closed form that are no links: {names}"
        )
    for frame, (size, distance, angle) in worst.items():
        if size > TOLERANCE * max(1.0, robot.size):
            message = f"frame {frame!r} is {distance:.3g} m and {angle:.3g} rad away"
            yield Problem(robot.link_named[frame].element, message)


@register("K614", "reference-differs", "kinematics", "EEE")
def reference_differs(robot: CheckedUrdf) -> Iterator[Problem]:
    """The robot moves differently from the reference file.

    Why: A new export with a flipped axis, a shifted origin or other limits is a sound
    file; the arm then stands elsewhere than everything that was checked with the old.

    Fix: Correct the joint, or take the new file as the reference if it is meant.
    """
    moving = moving_tree_of(robot)
    if robot.options.reference is None or moving is None:
        return
    other = _reference(robot)
    other_tree = moving_tree_of(other)
    if other_tree is None:
        raise InputError(
            str(robot.options.reference),
            "cannot be moved, so it is no reference; run borecheck validate on it",
        )
    yield from _other_links(robot, other)
    into = {link: joint for link, joint, _ in other_tree.steps}
    apart = _apart(robot, moving, other_tree)
    for link, joint, _ in moving.steps:
        if link in into:
            said = list(_differences(joint, into[link]))
            if link in apart and not said:
                said = [f"the link stands {apart[link]:.3g} m or rad away"]
            if said:
                yield Problem(joint.element, f"joint {joint.name!r}: {'; '.join(said)}")


def _reference(robot: CheckedUrdf) -> CheckedUrdf:
    from borecheck.validation.load import load_file

    path = robot.options.reference
    assert path is not None  # asked before
    options = replace(robot.options, reference=None, closed_form=None)
    found, _ = load_file(path, options)
    if isinstance(found, Finding):
        raise InputError(path, found.message)
    return found


def _other_links(robot: CheckedUrdf, other: CheckedUrdf) -> Iterator[Problem]:
    """Links that only one of the files has."""
    for one, two, text in (
        (robot, other, "links that the reference has not"),
        (other, robot, "links of the reference that are missing"),
    ):
        names = [link.name for link in one.links if link.name not in two.link_named]
        if names:
            more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
            listed = ", ".join(repr(name) for name in names[:NAMED])
            yield Problem(robot.root, f"{text}: {listed}{more}")


def _differences(joint: DraftJoint, other: DraftJoint) -> Iterator[str]:
    """What is written differently and changes how the robot moves."""
    for word in ("name", "type", "parent"):
        ours, theirs = getattr(joint, word), getattr(other, word)
        if ours != theirs:
            yield f"{word} {ours!r}, in the reference {theirs!r}"
    T, T_other = placement(joint.element), placement(other.element)
    if T is not None and T_other is not None:
        size, distance, angle = gap(T_other, T)
        if size > TOLERANCE:
            yield f"origin {distance:.3g} m and {angle:.3g} rad from the reference's"
    if joint.has_axis and other.has_axis and joint.axis and other.axis:
        axis, other_axis = _unit(joint.axis), _unit(other.axis)
        if float(np.abs(axis - other_axis).max()) > TOLERANCE:
            yield f"axis {_text(joint.axis)}, in the reference {_text(other.axis)}"
    if joint.is_limited and other.is_limited:
        bounds, others = (joint.lower, joint.upper), (other.lower, other.upper)
        if bounds != others:
            yield f"limits {_text(bounds)}, in the reference {_text(others)}"
    if joint.mimic != other.mimic:
        ours, theirs = _follows(joint), _follows(other)
        yield f"{ours}, in the reference {theirs}"


def _follows(joint: DraftJoint) -> str:
    mimic = joint.mimic
    if mimic is None:
        return "follows no joint"
    return f"is {mimic.multiplier:g} x {mimic.joint} + {mimic.offset:g}"


def _apart(
    robot: CheckedUrdf, moving: MovingTree, other: MovingTree
) -> dict[str, float]:
    """Links that stand elsewhere relative to their parents, and how far at most."""
    worst: dict[str, float] = {}
    parents = {link: joint.parent or "" for link, joint, _ in moving.steps}
    for free in moving.sampled(robot.options.seed, robot.options.samples):
        placed = moving.placements(moving.positions(free))
        theirs = other.placements(other.positions(free))
        for link, parent in parents.items():
            if link in theirs and parent in theirs:
                T = inverse(placed[parent]) @ placed[link]
                size, _, _ = gap(inverse(theirs[parent]) @ theirs[link], T)
                worst[link] = max(worst.get(link, 0.0), size)
    return {link: size for link, size in worst.items() if size > TOLERANCE}


def _unit(axis: Vector) -> Array:
    vector = np.array(axis, dtype=float)
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else vector


def _text(values: tuple[float | None, ...]) -> str:
    return " ".join("none" if v is None else f"{v:g}" for v in values)
