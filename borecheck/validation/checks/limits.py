"""Limit checks: position, effort and velocity of every limited joint."""

import math
from collections.abc import Iterator

from borecheck.robots.urdf.draft import DraftJoint, first, number
from borecheck.robots.urdf.rules import joints
from borecheck.validation.checks.ruled import hits
from borecheck.validation.reading.draft import Robot
from borecheck.validation.registry import Hit, check

DEGREES_FROM = 2.0 * math.pi * 1.01  # more than a turn, with room for 6.3
MOST_QUARTERS = 40.5  # ten turns either way
ROUNDED = 0.005  # quarter turns: 9.42 is meant as three times pi
UNLIMITED_FROM = 1e4  # 1e9 or 1e16 stands for "no limit", not for degrees
FAST = 1000.0  # [rad/s] or [m/s]: no joint of a robot turns 10,000 rpm
LONG_STROKE_M = 10.0


def _limited(robot: Robot) -> Iterator[DraftJoint]:
    for joint in robot.joints:
        if joint.is_limited and joint.limit is not None:
            yield joint


@check("J305", "limit-missing", "joints", "EEE")
def limit_missing(robot: Robot) -> Iterator[Hit]:
    """A revolute or prismatic joint has no <limit>.

    Why: The range is required; without it nobody knows where the joint may go.

    Mend: Add <limit lower upper effort velocity>, or use type="continuous".

    Libraries: urdfdom and Pinocchio refuse the file; MuJoCo moves without limits.
    """
    return hits(robot, joints.missing_limits)


@check("J306", "limit-reversed", "joints", "EEE")
def limit_reversed(robot: Robot) -> Iterator[Hit]:
    """The lower limit is above the upper one.

    Why: No position is allowed; libraries swap the two, ignore them or clip to one end.

    Mend: Swap them, or correct the sign.

    Libraries: sdformat swaps them; MuJoCo drops them; Pinocchio and yourdfpy keep them.
    """
    return hits(robot, joints.reversed_limits)


@check("J307", "limit-equal", "joints", "WWW")
def limit_equal(robot: Robot) -> Iterator[Hit]:
    """Lower and upper limit are equal, so the joint cannot move.

    Why: It may be a left-over; some libraries take it for "no limits".

    Mend: Use type="fixed", or give the range.

    Libraries: MuJoCo takes equal limits for none.
    """
    for joint in _limited(robot):
        given = {"lower", "upper"} & set(joint.limit.attrib)
        if given and joint.lower is not None and joint.lower == joint.upper:
            message = f"lower and upper are both {joint.lower:g}"
            yield Hit(joint.limit, message, "lower")


@check("J308", "limit-omitted", "joints", "WWW")
def limit_omitted(robot: Robot) -> Iterator[Hit]:
    """The lower or upper limit is left out, so it is 0.

    Why: A joint without lower and upper cannot move at all, which is rarely meant.

    Mend: Give both; use type="continuous" for a joint without limits.

    Libraries: Pinocchio takes 0; yourdfpy calls it invalid; others take no limit.
    """
    for joint in _limited(robot):
        missing = [a for a in ("lower", "upper") if a not in joint.limit.attrib]
        if missing:
            yield Hit(joint.limit, f"{' and '.join(missing)} left out, so 0")


@check("J309", "limit-in-degrees", "joints", "WWW")
def limit_in_degrees(robot: Robot) -> Iterator[Hit]:
    """A limit of a revolute joint is more than a turn: degrees, or no limit at all.

    Why: URDF limits are radians. A range in degrees lets the joint turn 57 times too
    far, and sampling covers the true range hardly ever.

    Mend: Multiply by pi / 180 if degrees were meant; use type="continuous" if there is
    no limit. A joint of several turns is right as it is: silence the finding there.
    """
    for joint in _limited(robot):
        values = [v for v in (joint.lower, joint.upper) if v is not None]
        if joint.type == "revolute" and values:
            worst = max(values, key=abs)
            if abs(worst) > DEGREES_FROM and not _is_turns(worst):
                kind = "no limit" if abs(worst) > UNLIMITED_FROM else "degrees"
                yield Hit(joint.limit, f"a limit of {worst:g} rad: {kind}?")


def _is_turns(angle: float) -> bool:
    """Whether it is some quarter turns in radians, or uneven and two turns at most."""
    if angle == round(angle):
        return False  # as people write degrees
    quarters = abs(angle) / (0.5 * math.pi)
    is_even = abs(quarters - round(quarters)) < ROUNDED and quarters < MOST_QUARTERS
    return is_even or quarters < 8.0


@check("J310", "zero-outside-limits", "joints", "WWW")
def zero_outside_limits(robot: Robot) -> Iterator[Hit]:
    """Position zero is outside the limits.

    Why: Most tools draw, plan and check from zero, where this robot cannot be.

    Mend: Give a home configuration inside the limits wherever one is asked for.

    Libraries: MoveIt and yourdfpy start at zero regardless of limits.
    """
    for joint in _limited(robot):
        lower, upper = joint.lower, joint.upper
        if lower is None or upper is None or lower > upper or joint.mimic is not None:
            continue
        if not lower <= 0.0 <= upper:
            yield Hit(joint.limit, f"0 is not within {lower:g} to {upper:g}")


@check("J311", "effort-or-velocity-missing", "joints", "WWE")
def effort_or_velocity_missing(robot: Robot) -> Iterator[Hit]:
    """The effort or velocity limit is left out.

    Why: Both are required by the specification.

    Mend: Give the drive's numbers.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy takes none.
    """
    for joint in _limited(robot):
        missing = [a for a in ("effort", "velocity") if a not in joint.limit.attrib]
        if missing:
            yield Hit(joint.limit, f"{' and '.join(missing)} left out")


@check("J312", "effort-or-velocity-negative", "joints", "WWE")
def effort_or_velocity_negative(robot: Robot) -> Iterator[Hit]:
    """The effort or velocity limit is negative.

    Why: It is a size, and cannot be negative; a library may refuse the whole file.

    Mend: Remove the sign.

    Libraries: Pinocchio 4 refuses the file; others accept it.
    """
    for joint in robot.joints:
        for attribute in ("effort", "velocity"):
            value = number(joint.limit, attribute)
            if value is not None and value < 0.0:
                yield Hit(joint.limit, f"{attribute}={value:g} is negative", attribute)


@check("J313", "effort-or-velocity-zero", "joints", "IWW")
def effort_or_velocity_zero(robot: Robot) -> Iterator[Hit]:
    """The effort or velocity limit is zero.

    Why: Taken at its word, the joint cannot move; usually it was never filled in.

    Mend: Give the drive's numbers.

    Libraries: simulators and planners that respect the limits never move the joint.
    """
    for joint in _limited(robot):
        zero = [a for a in ("effort", "velocity") if number(joint.limit, a) == 0.0]
        if zero:
            yield Hit(joint.limit, f"{' and '.join(zero)} is 0", zero[0])


@check("J326", "continuous-with-limits", "joints", "III")
def continuous_with_limits(robot: Robot) -> Iterator[Hit]:
    """A continuous joint has position limits, which are ignored.

    Why: If the limits are meant, the joint goes where it must not.

    Mend: Use type="revolute" if the limits are meant; remove them otherwise.

    Libraries: urdfdom, Pinocchio and yourdfpy ignore them; some simulators do not.
    """
    for joint in robot.joints:
        lower, upper = number(joint.limit, "lower"), number(joint.limit, "upper")
        if joint.type != "continuous" or lower is None or upper is None:
            continue
        if lower < upper and upper - lower < 2.0 * math.pi:
            message = f"continuous joint has limits {lower:g} to {upper:g}"
            yield Hit(joint.limit, message)


@check("J330", "soft-limit-outside", "joints", "IWW")
def soft_limit_outside(robot: Robot) -> Iterator[Hit]:
    """A soft limit of the safety controller lies outside the joint limits.

    Why: The controller would stop the joint only after it has passed its limit.

    Mend: Move the soft limits inside lower and upper.
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
            yield Hit(safety, message, "soft_lower_limit")
        if low is not None and not lower <= low <= upper and low != 0.0:
            yield Hit(
                safety, f"soft_lower_limit={low:g} is outside", "soft_lower_limit"
            )
        if high is not None and not lower <= high <= upper and high != 0.0:
            yield Hit(
                safety, f"soft_upper_limit={high:g} is outside", "soft_upper_limit"
            )


@check("J335", "stroke-in-millimetres", "joints", "WWW")
def stroke_in_millimetres(robot: Robot) -> Iterator[Hit]:
    """The stroke of a prismatic joint is huge compared with the robot.

    Why: The usual cause is millimetres where URDF means metres.

    Mend: Divide by 1000 if it is in millimetres.
    """
    for joint in _limited(robot):
        values = [abs(v) for v in (joint.lower, joint.upper) if v is not None]
        if joint.type == "prismatic" and values:
            bound = max(LONG_STROKE_M, 20.0 * robot.size)
            if bound < max(values) < UNLIMITED_FROM * 100:
                message = (
                    f"a stroke of {max(values):g} m on a robot of {robot.size:.3g} m"
                )
                yield Hit(joint.limit, message)


@check("J337", "velocity-absurd", "joints", "III")
def velocity_absurd(robot: Robot) -> Iterator[Hit]:
    """The velocity limit is absurdly high.

    Why: It is no limit; perhaps it is in degrees or millimetres per second.

    Mend: Give the drive's number in rad/s or m/s.
    """
    for joint in _limited(robot):
        value = number(joint.limit, "velocity")
        if value is not None and value > FAST:
            yield Hit(joint.limit, f"velocity={value:g}", "velocity")
