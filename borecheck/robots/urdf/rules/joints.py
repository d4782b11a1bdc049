"""Rules of joints: a known type, an axis, limits, and somebody who drives them."""

import math
from collections.abc import Iterator

from borecheck.robots.urdf import mimic as chains
from borecheck.robots.urdf.attributes import first
from borecheck.robots.urdf.draft import UrdfDraft
from borecheck.robots.urdf.rules.defect import Defect
from borecheck.robots.urdf.rules.names import guess
from borecheck.robots.urdf.schema import FREE_TYPES, JOINT_TYPES

UNIT_TOLERANCE = 1e-3  # an axis typed with three digits is meant to be a unit vector


def unknown_type(draft: UrdfDraft) -> Iterator[Defect]:
    """The type is one that URDF knows."""
    for joint in draft.joints:
        if joint.type and joint.type not in JOINT_TYPES:
            close = guess(joint.type, JOINT_TYPES)
            message = f"joint type {joint.type!r} is not known{close}"
            yield Defect(joint.element, message, "type")


def zero_axis(draft: UrdfDraft) -> Iterator[Defect]:
    """The axis of a moving joint is a direction."""
    for joint in draft.joints:
        if joint.has_axis and joint.axis is not None and not any(joint.axis):
            yield Defect(first(joint.element, "axis"), "the axis is 0 0 0", "xyz")


def long_axis(draft: UrdfDraft) -> Iterator[Defect]:
    """The axis is of length one; of a sliding joint, the length may be meant."""
    for joint in draft.joints:
        length = math.hypot(*(joint.axis or (1.0,)))
        if joint.has_axis and length > 0.0 and abs(length - 1.0) > UNIT_TOLERANCE:
            message = f"the axis has length {length:.6g}, not 1"
            element = first(joint.element, "axis")
            yield Defect(element, message, "xyz", joint.type == "prismatic")


def missing_limits(draft: UrdfDraft) -> Iterator[Defect]:
    """A revolute or prismatic joint has limits."""
    for joint in draft.joints:
        if joint.is_limited and joint.limit is None:
            message = f"{joint.type} joint {joint.name!r} has no <limit>"
            yield Defect(joint.element, message)


def reversed_limits(draft: UrdfDraft) -> Iterator[Defect]:
    """The lower limit is not above the upper one."""
    for joint in draft.joints:
        if not joint.is_limited or joint.lower is None or joint.upper is None:
            continue
        if joint.lower > joint.upper:
            message = f"lower={joint.lower:g} is above upper={joint.upper:g}"
            yield Defect(joint.limit, message, "lower")


def missing_leaders(draft: UrdfDraft) -> Iterator[Defect]:
    """The joint that a follower mimics exists."""
    for joint in draft.joints:
        if joint.mimic is not None and joint.mimic.joint not in draft.joint_named:
            close = guess(joint.mimic.joint, draft.joint_named)
            message = f"mimics {joint.mimic.joint!r}, which is no joint{close}"
            yield Defect(joint.mimic_element, message, "joint")


def mimic_cycles(draft: UrdfDraft) -> Iterator[Defect]:
    """Followers do not follow each other in a circle."""
    _, problems = chains.try_resolve(draft.joint_named.values())
    for problem in problems:
        if problem.kind != "missing" and problem.joint == problem.names[-1]:
            element = draft.joint_named[problem.joint].mimic_element
            yield Defect(element, problem.text, "joint")


def free_joints(draft: UrdfDraft) -> Iterator[Defect]:
    """A floating or planar joint carries the whole robot, which `--base` places.

    Anywhere else nobody says where the links below it stand.
    """
    free = [joint for joint in draft.joints if joint.type in FREE_TYPES]
    for joint in free:
        below = {name for name, _ in draft.below(joint.child or "")}
        beside = [
            link.name for link in draft.links if link.shapes and link.name not in below
        ]
        message = f"{joint.type} joint {joint.name!r}"
        if beside:
            carried = f"{message} does not carry the whole robot ({beside[0]!r} stands"
            text = f"{carried} elsewhere), so where it stands is not known"
            yield Defect(joint.element, text, "type")
        elif len(free) > 1 and joint is not free[0]:
            text = f"{message} is the second of its kind: --base places one"
            yield Defect(joint.element, text, "type")
