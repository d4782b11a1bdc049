"""Limit checks: position, effort and velocity of every limited joint."""

import math
from collections.abc import Iterator

from borecheck.robots.urdf.attributes import first, number
from borecheck.robots.urdf.draft_elements import DraftJoint
from borecheck.robots.urdf.rules import joints
from borecheck.validation.checks.ruled import problems
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem, register

DEGREES_FROM = 2.0 * math.pi * 1.01  # more than a turn, with room for 6.3
MOST_QUARTERS = 40.5  # ten turns either way
ROUNDED = 0.005  # quarter turns: 9.42 is meant as three times pi
UNLIMITED_FROM = 1e4  # 1e9 or 1e16 stands for "no limit", not for degrees
FAST = 1000.0  # [rad/s] or [m/s]: no joint of a robot turns 10,000 rpm
LONG_STROKE_M = 10.0


def _limited(robot: CheckedUrdf) -> Iterator[DraftJoint]:
    for joint in robot.joints:
        if joint.is_limited and joint.limit is not None:
            yield joint


@register("J305", "limit-missing", "joints", "EEE")
def limit_missing(robot: CheckedUrdf) -> Iterator[Problem]:
    """A revolute or prismatic joint has no <limit>.

    Why: The range is required; without it nobody knows where the joint may go.

    Fix: Add <limit lower upper effort velocity>, or use type="continuous".

    Libraries: urdfdom and Pinocchio refuse the file; MuJoCo moves without limits.
    """
    return problems(robot, joints.missing_limits)


@register("J306", "limit-reversed", "joints", "EEE")
def limit_reversed(robot: CheckedUrdf) -> Iterator[Problem]:
    """The lower limit is above the upper one.

    Why: No position is allowed; libraries swap the two, ignore them or clip to one end.

    Fix: Swap them, or correct the sign.

    Libraries: sdformat swaps them; MuJoCo drops them; Pinocchio and yourdfpy keep them.
    """
    return problems(robot, joints.reversed_limits)


@register("J307", "limit-equal", "joints", "WWW")
def limit_equal(robot: CheckedUrdf) -> Iterator[Problem]:
    """Lower and upper limit are equal, so the joint cannot move.

    Why: It may be a left-over; some libraries take it for "no limits".

    Fix: Use type="fixed", or give the range.

    Libraries: MuJoCo takes equal limits for none.
    """
    for joint in _limited(robot):
        given = {"lower", "upper"} & set(joint.limit.attrib)
        if given and joint.lower is not None and joint.lower == joint.upper:
            message = f"lower and upper are both {joint.lower:g}"
            yield Problem(joint.limit, message, "lower")


@register("J308", "limit-omitted", "joints", "WWW")
def limit_omitted(robot: CheckedUrdf) -> Iterator[Problem]:
    """The lower or upper limit is left out, so it is 0.

    Why: A joint without lower and upper cannot move at all, which is rarely meant.

    Fix: Give both; use type="continuous" for a joint without limits.

    Libraries: Pinocchio takes 0; yourdfpy calls it invalid; others take no limit.
    """
    for joint in _limited(robot):
        missing = [a for a in ("lower", "upper") if a not in joint.limit.attrib]
        if missing:
            yield Problem(joint.limit, f"{' and '.join(missing)} left out, so 0")


@register("J309", "limit-in-degrees", "joints", "WWW")
def limit_in_degrees(robot: CheckedUrdf) -> Iterator[Problem]:
    """A limit of a revolute joint is more than a turn: degrees, or no limit at all.

    Why: URDF limits are radians. A range in degrees lets the joint turn 57 times too
    far, and sampling covers the true range hardly ever.

    Fix: Multiply by pi / 180 if degrees were meant; use type="continuous" if there is
    no limit. A joint of several turns is right as it is: silence the finding there.
    """
    for joint in _limited(robot):
        values = [v for v in (joint.lower, joint.upper) if v is not None]
        if joint.type == "revolute" and values:
            worst = max(values, key=abs)
            if abs(worst) > DEGREES_FROM and not _is_turns(worst):
                kind = "no limit" if abs(worst) > UNLIMITED_FROM else "degrees"
                yield Problem(joint.limit, f"a limit of {worst:g} rad: {kind}?")


def _is_turns(angle: float) -> bool:
    """Whether it is some quarter turns in radians, or uneven and two turns at most."""
    if angle == round(angle):
        return False  # as people write degrees
    quarters = abs(angle) / (0.5 * math.pi)
    is_even = abs(quarters - round(quarters)) < ROUNDED and quarters < MOST_QUARTERS
    return is_even or quarters < 8.0


@register("J310", "zero-outside-limits", "joints", "WWW")
def zero_outside_limits(robot: CheckedUrdf) -> Iterator[Problem]:
    """Position zero is outside the limits.

    Why: Most tools draw, plan and check from zero, where this robot cannot be.

    Fix: Give a home configuration inside the limits wherever one is asked for.

    Libraries: MoveIt and yourdfpy start at zero regardless of limits.
    """
    for joint in _limited(robot):
        lower, upper = joint.lower, joint.upper
        if lower is None or upper is None or lower > upper or joint.mimic is not None:
            continue
        if not lower <= 0.0 <= upper:
            yield Problem(joint.limit, f"0 is not within {lower:g} to {upper:g}")


@register("J311", "effort-or-velocity-missing", "joints", "WWE")
def effort_or_velocity_missing(robot: CheckedUrdf) -> Iterator[Problem]:
    """The effort or velocity limit is left out.

    Why: Both are required by the specification.

    Fix: Give the drive's numbers.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy takes none.
    """
    for joint in _limited(robot):
        missing = [a for a in ("effort", "velocity") if a not in joint.limit.attrib]
        if missing:
            yield Problem(joint.limit, f"{' and '.join(missing)} left out")


@register("J312", "effort-or-velocity-negative", "joints", "WWE")
def effort_or_velocity_negative(robot: CheckedUrdf) -> Iterator[Problem]:
    """The effort or velocity limit is negative.

    Why: It is a size, and cannot be negative; a library may refuse the whole file.

    Fix: Remove the sign.

    Libraries: Pinocchio 4 refuses the file; others accept it.
    """
    for joint in robot.joints:
        for attribute in ("effort", "velocity"):
            value = number(joint.limit, attribute)
            if value is not None and value < 0.0:
                yield Problem(
                    joint.limit, f"{attribute}={value:g} is negative", attribute
                )


@register("J313", "effort-or-velocity-zero", "joints", "IWW")
def effort_or_velocity_zero(robot: CheckedUrdf) -> Iterator[Problem]:
    """The effort or velocity limit is zero.

    Why: Taken at its word, the joint cannot move; usually it was never filled in.

    Fix: Give the drive's numbers.

    Libraries: simulators and planners that respect the limits never move the joint.
    """
    for joint in _limited(robot):
        zero = [a for a in ("effort", "velocity") if number(joint.limit, a) == 0.0]
        if zero:
            yield Problem(joint.limit, f"{' and '.join(zero)} is 0", zero[0])


@register("J326", "continuous-with-limits", "joints", "III")
def continuous_with_limits(robot: CheckedUrdf) -> Iterator[Problem]:
    """A continuous joint has position limits, which are ignored.

    Why: If the limits are meant, the joint goes where it must not.

    Fix: Use type="revolute" if the limits are meant; remove them otherwise.

    Libraries: urdfdom, Pinocchio and yourdfpy ignore them; some simulators do not.
    """
    for joint in robot.joints:
        lower, upper = number(joint.limit, "lower"), number(joint.limit, "upper")
        if joint.type != "continuous" or lower is None or upper is None:
            continue
        if lower < upper and upper - lower < 2.0 * math.pi:
            message = f"continuous joint has limits {lower:g} to {upper:g}"
            yield Problem(joint.limit, message)


@register("J330", "soft-limit-outside", "joints", "IWW")
def soft_limit_outside(robot: CheckedUrdf) -> Iterator[Problem]:
    """A soft limit of the safety controller lies outside the joint limits.

    Why: The controller would stop the joint only after it has passed its limit.

    Fix: Move the soft limits inside lower and upper.
    """
    for joint in _limited(robot):
        safety = first(joint.element, "safety_controller")
        low, high = (
            number(safety, "soft_lower_limit"),
            number(safety, "soft_upper_limit"),
        )
        lower, upper = joint.lower, joint.upper
        if lower is None or upper is None:
            continue
        if low is not None and high is not None and low > high:
            message = f"soft_lower_limit={low:g} is above soft_upper_limit={high:g}"
            yield Problem(safety, message, "soft_lower_limit")
        if low is not None and not lower <= low <= upper and low != 0.0:
            yield Problem(
                safety, f"soft_lower_limit={low:g} is outside", "soft_lower_limit"
            )
        if high is not None and not lower <= high <= upper and high != 0.0:
            yield Problem(
                safety, f"soft_upper_limit={high:g} is outside", "soft_upper_limit"
            )


@register("J335", "stroke-in-millimetres", "joints", "WWW")
def stroke_in_millimetres(robot: CheckedUrdf) -> Iterator[Problem]:
    """The stroke of a prismatic joint is huge compared with the robot.

    Why: The usual cause is millimetres where URDF means metres.

    Fix: Divide by 1000 if it is in millimetres.
    """
    for joint in _limited(robot):
        values = [abs(v) for v in (joint.lower, joint.upper) if v is not None]
        if joint.type == "prismatic" and values:
            bound = max(LONG_STROKE_M, 20.0 * robot.size)
            if bound < max(values) < UNLIMITED_FROM * 100:
                message = (
                    f"a stroke of {max(values):g} m on a robot of {robot.size:.3g} m"
                )
                yield Problem(joint.limit, message)


@register("J337", "velocity-absurd", "joints", "III")
def velocity_absurd(robot: CheckedUrdf) -> Iterator[Problem]:
    """The velocity limit is absurdly high.

    Why: It is no limit; perhaps it is in degrees or millimetres per second.

    Fix: Give the drive's number in rad/s or m/s.
    """
    for joint in _limited(robot):
        value = number(joint.limit, "velocity")
        if value is not None and value > FAST:
            yield Problem(joint.limit, f"velocity={value:g}", "velocity")
