"""Joint checks: type, axis and origin of every joint."""

import math
from collections.abc import Iterator
from statistics import median
from typing import Any

from borecheck.robots.urdf.attributes import first, number, numbers
from borecheck.robots.urdf.rules import joints
from borecheck.robots.urdf.source import children, tag_of
from borecheck.validation.checks.ruled import problems
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem, register

FAR_RATIO = 30.0  # times the robot's median joint origin
FAR_M = 100.0
FULL_TURN = 2.0 * math.pi * 1.001  # 6.2832 and 6.29 still mean a full turn
ROUNDED = 2e-6, 5e-3  # an angle this close to a multiple of 45 deg was meant to be it
# A mechanism smaller than this has no scale to compare with.
SMALLEST_M = 1e-3


@register("J301", "type-unknown", "joints", "EEE")
def type_unknown(robot: CheckedUrdf) -> Iterator[Problem]:
    """The joint type is none that URDF knows.

    Why: Parsers refuse the file or take the joint for a fixed one.

    Fix: Use revolute, continuous, prismatic, fixed, floating or planar.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy accepts any word.
    """
    return problems(robot, joints.unknown_type)


@register("J302", "axis-zero", "joints", "EEE")
def axis_zero(robot: CheckedUrdf) -> Iterator[Problem]:
    """The axis of a moving joint is 0 0 0.

    Why: There is no such rotation. Libraries load it all the same and place the links
    up to 180 deg apart.

    Fix: Give the axis; for a joint that does not move use type="fixed".

    Libraries: Pinocchio yields rotations that are off; yourdfpy yields another pose;
    Drake and MuJoCo refuse the file.
    """
    return problems(robot, joints.zero_axis)


@register("J303", "axis-not-unit", "joints", "WWW")
def axis_not_unit(robot: CheckedUrdf) -> Iterator[Problem]:
    """The axis of a moving joint is not of length one.

    Why: Some libraries normalise it, others let the joint move by its length: a
    prismatic joint then goes elsewhere (an error), a revolute one may be skewed.

    Fix: Divide the axis by its length (--fix does).

    Libraries: Pinocchio and urdfdom users normalise; yourdfpy multiplies a prismatic
    joint's position with the length.
    """
    return problems(robot, joints.long_axis)


@register("J304", "axis-missing", "joints", "WWW")
def axis_missing(robot: CheckedUrdf) -> Iterator[Problem]:
    """A moving joint names no axis, so it is x.

    Why: The default is rarely what is meant, and nobody sees it in the file.

    Fix: Write <axis xyz="1 0 0"/> if x is meant.

    Libraries: the default of URDF is x; SDF and some exporters mean z.
    """
    for joint in robot.joints:
        if joint.type not in ("revolute", "continuous", "prismatic", "planar"):
            continue
        axis = first(joint.element, "axis")
        if axis is None or "xyz" not in axis.attrib:
            element = joint.element if axis is None else axis
            yield Problem(element, f"joint {joint.name!r} has no axis, so it is 1 0 0")


@register("J314", "origin-far", "joints", "WWW")
def origin_far(robot: CheckedUrdf) -> Iterator[Problem]:
    """An origin is far away compared with the rest of the robot.

    Why: The usual cause is one number in millimetres among metres.

    Fix: Divide by 1000 if it is in millimetres; look for a slipped decimal point.
    """
    steps = [
        math.hypot(*xyz)
        for joint in robot.joints
        if (xyz := numbers(first(joint.element, "origin"), "xyz", 3))
    ]
    typical = median([s for s in steps if s > SMALLEST_M] or [0.0])
    for element in _origins(robot):
        distance = math.hypot(*(numbers(element, "xyz", 3) or (0.0,)))
        if distance > FAR_M:
            message = f"the origin is {distance:.4g} m away"
        elif len(steps) >= 3 and distance > max(FAR_RATIO * typical, 1.0) and typical:
            message = (
                f"the origin is {distance:.4g} m away, {distance / typical:.0f} times "
                f"the robot's usual {typical:.3g} m"
            )
        else:
            continue
        yield Problem(element, message, "xyz")


@register("J315", "angle-in-degrees", "joints", "WWW")
def angle_in_degrees(robot: CheckedUrdf) -> Iterator[Problem]:
    """A roll, pitch or yaw looks like degrees.

    Why: URDF angles are radians: 90 means 14 turns and a bit.

    Fix: Multiply by pi / 180, if degrees were meant.
    """
    for element in _origins(robot):
        rpy = numbers(element, "rpy", 3)
        if rpy and any(abs(angle) > FULL_TURN for angle in rpy):
            worst = max(rpy, key=abs)
            message = f"rpy={element.get('rpy')!r} turns by {worst:g} rad: degrees?"
            yield Problem(element, message, "rpy")


@register("J325", "free-joint-inside", "joints", "WWW")
def free_joint_inside(robot: CheckedUrdf) -> Iterator[Problem]:
    """A floating or planar joint carries a part of the robot only.

    Why: It has no single position, so where its links stand is not known; many
    libraries keep such joints fixed. One that carries the whole robot is placed by
    --base, or stands at its origin.

    Fix: Replace it by prismatic and revolute joints, or by a fixed one.

    Libraries: yourdfpy keeps floating and planar joints fixed, and a planar one shifts
    its indices of mimic joints; Pinocchio moves them; borecheck's checks refuse them.
    """
    return problems(robot, joints.free_joints)


@register("J329", "damping-negative", "joints", "IWE")
def damping_negative(robot: CheckedUrdf) -> Iterator[Problem]:
    """Damping or friction is negative.

    Why: The joint would gain energy by moving.

    Fix: Remove the sign.

    Libraries: MuJoCo and Drake refuse it; urdfdom accepts it.
    """
    for joint in robot.joints:
        dynamics = first(joint.element, "dynamics")
        for attribute in ("damping", "friction"):
            value = number(dynamics, attribute)
            if value is not None and value < 0.0:
                yield Problem(dynamics, f"{attribute}={value:g} is negative", attribute)


@register("J332", "fixed-with-motion", "joints", "III")
def fixed_with_motion(robot: CheckedUrdf) -> Iterator[Problem]:
    """A fixed joint has a limit that allows motion.

    Why: It may have been meant to move, or the limit is left over.

    Fix: Remove the limit, or correct the type.
    """
    for joint in robot.joints:
        lower, upper = number(joint.limit, "lower"), number(joint.limit, "upper")
        if joint.type != "fixed" or lower is None or upper is None:
            continue
        if lower < upper:
            message = f"fixed joint {joint.name!r} has limits {lower:g} to {upper:g}"
            yield Problem(joint.limit, message)


@register("J338", "angle-rounded", "joints", "III")
def angle_rounded(robot: CheckedUrdf) -> Iterator[Problem]:
    """A roll, pitch or yaw is nearly, but not quite, a multiple of 45 degrees.

    Why: 1.57 instead of pi/2 turns everything after it by 0.8 mrad: 0.8 mm at 1 m.

    Fix: Write all digits (1.5707963267948966), if the right angle is meant.
    """
    worst, distance = None, ROUNDED[0]
    for joint in robot.joints:
        origin = first(joint.element, "origin")
        rpy = numbers(origin, "rpy", 3)
        off = max(map(_off_right, rpy)) if rpy else 0.0
        if off > distance:
            worst, distance = origin, off
    if worst is not None:
        message = f"rpy={worst.get('rpy')!r} is {distance:.2g} rad off a right angle"
        yield Problem(worst, message, "rpy")


def _off_right(angle: float) -> float:
    """How far an angle is from a multiple of 45 deg, if it is surely meant to be."""
    quarter = math.pi / 4.0
    if not 0.5 * quarter < abs(angle) < 100.0:
        return 0.0
    off = abs(angle - quarter * round(angle / quarter))
    return off if off < ROUNDED[1] else 0.0


def _origins(robot: CheckedUrdf) -> Iterator[Any]:
    """Origins of joints, visuals, collisions and inertials."""
    for joint in robot.joints:
        yield from children(joint.element, "origin")
    for link in robot.links:
        for part in children(link.element):
            if tag_of(part) in ("visual", "collision", "inertial"):
                yield from children(part, "origin")
