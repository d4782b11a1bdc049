"""Mimic checks: followers follow a joint that exists and moves."""

from collections.abc import Iterator

from borecheck.robots.urdf import mimic as chains
from borecheck.robots.urdf.draft_elements import DraftJoint
from borecheck.robots.urdf.rules import joints
from borecheck.validation.checks.ruled import problems
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem, register

_TOLERANCE = 1e-6  # limits typed with six digits


def _followers(robot: CheckedUrdf) -> Iterator[tuple[DraftJoint, DraftJoint]]:
    """Each mimic joint with the joint it names, where that exists and is another."""
    for joint in robot.joints:
        if joint.mimic is not None and joint.mimic.joint != joint.name:
            leader = robot.joint_named.get(joint.mimic.joint)
            if leader is not None:
                yield joint, leader


@register("J316", "mimic-missing", "joints", "EEE")
def mimic_missing(robot: CheckedUrdf) -> Iterator[Problem]:
    """A joint mimics a joint that does not exist.

    Why: Where the follower goes is undefined.

    Fix: Correct the name.

    Libraries: Pinocchio and urdfdom accept it; yourdfpy crashes or ignores it.
    """
    return problems(robot, joints.missing_leaders)


@register("J317", "mimic-cycle", "joints", "EEE")
def mimic_cycle(robot: CheckedUrdf) -> Iterator[Problem]:
    """Mimic joints follow each other in a circle, or one follows itself.

    Why: No joint of the circle is free, so none has a position.

    Fix: Let one joint of the circle be free.

    Libraries: Pinocchio and urdfdom accept it; some parsers never return.
    """
    return problems(robot, joints.mimic_cycles)


@register("J318", "mimic-chain", "joints", "WWW")
def mimic_chain(robot: CheckedUrdf) -> Iterator[Problem]:
    """A joint mimics a joint that mimics another one.

    Why: The meaning is clear, but most libraries get it wrong.

    Fix: Let it mimic the free joint directly, with the composed factor and offset.

    Libraries: Pinocchio refuses chains with mimic=True and ignores mimic without;
    yourdfpy takes the middle joint for zero; borecheck resolves chains.
    """
    follows, _ = chains.try_resolve(robot.joint_named.values())
    for joint, leader in _followers(robot):
        if leader.mimic is not None and joint.name in follows:
            free, multiplier, offset = follows[joint.name]
            yield Problem(
                joint.mimic_element,
                f"mimics {leader.name!r}, which mimics {leader.mimic.joint!r}",
                "joint",
                hint=f'Write <mimic joint="{free}" multiplier="{multiplier:.12g}" '
                f'offset="{offset:.12g}"/>.',
            )


@register("J319", "mimic-fixed-leader", "joints", "WWW")
def mimic_fixed_leader(robot: CheckedUrdf) -> Iterator[Problem]:
    """A joint mimics a fixed joint.

    Why: A fixed joint has no position: the follower stays at its offset, or the file is
    refused.

    Fix: Correct the leader, or make the follower fixed.

    Libraries: yourdfpy takes 0; Pinocchio with mimic=True refuses the file.
    """
    for joint, leader in _followers(robot):
        if leader.type == "fixed":
            message = f"mimics {leader.name!r}, which is fixed"
            yield Problem(joint.mimic_element, message, "joint")


@register("J320", "mimic-type-mix", "joints", "WWW")
def mimic_type_mix(robot: CheckedUrdf) -> Iterator[Problem]:
    """A rotating joint mimics a sliding one, or the other way round.

    Why: The multiplier then has a unit (rad/m), which is easily forgotten.

    Fix: Check the multiplier; silence the finding if it is meant (a lead screw).

    Libraries: some refuse a mix of joint types.
    """
    slides = {"prismatic": True, "revolute": False, "continuous": False}
    for joint, leader in _followers(robot):
        kinds = slides.get(joint.type), slides.get(leader.type)
        if None not in kinds and kinds[0] != kinds[1]:
            message = (
                f"{joint.type} joint mimics the {leader.type} joint {leader.name!r}"
            )
            yield Problem(joint.mimic_element, message, "joint")


@register("J321", "mimic-outside-limits", "joints", "WWW")
def mimic_outside_limits(robot: CheckedUrdf) -> Iterator[Problem]:
    """Following its leader, a joint leaves its own limits.

    Why: Either the limits or the multiplier are wrong; some libraries clip the
    follower, which breaks the mechanism.

    Fix: Widen the follower's limits to multiplier * leader + offset, or correct the
    multiplier's sign.
    """
    for joint, leader in _followers(robot):
        mimic = joint.mimic
        if mimic is None or not (joint.is_limited and leader.is_limited):
            continue
        bounds = (leader.lower, leader.upper, joint.lower, joint.upper)
        if None in bounds:
            continue
        ends = [mimic.multiplier * (b or 0.0) + mimic.offset for b in bounds[:2]]
        low, high = bounds[2] or 0.0, bounds[3] or 0.0
        room = _TOLERANCE + 1e-3 * (high - low)
        if min(ends) < low - room or max(ends) > high + room:
            message = (
                f"goes from {min(ends):.6g} to {max(ends):.6g}, but its limits are "
                f"{low:g} to {high:g}"
            )
            yield Problem(joint.mimic_element, message)


@register("J322", "mimic-leader-later", "joints", "III")
def mimic_leader_later(robot: CheckedUrdf) -> Iterator[Problem]:
    """The followed joint comes after its follower in the file.

    Why: Parsers that read in one pass do not know it yet.

    Fix: Move the leader before the follower.

    Libraries: some one-pass parsers refuse or ignore such a mimic.
    """
    order = {joint.name: index for index, joint in enumerate(robot.joints)}
    for joint, leader in _followers(robot):
        if order[leader.name] > order[joint.name]:
            message = f"mimics {leader.name!r}, which comes later in the file"
            yield Problem(joint.mimic_element, message, "joint")


@register("J323", "mimic-multiplier-zero", "joints", "WWW")
def mimic_multiplier_zero(robot: CheckedUrdf) -> Iterator[Problem]:
    """The multiplier of a mimic joint is zero.

    Why: The joint then never moves.

    Fix: Correct the multiplier, or make the joint fixed.
    """
    for joint in robot.joints:
        if joint.mimic is not None and joint.mimic.multiplier == 0.0:
            yield Problem(joint.mimic_element, "multiplier is 0", "multiplier")


@register("J324", "mimic-on-fixed", "joints", "WWW")
def mimic_on_fixed(robot: CheckedUrdf) -> Iterator[Problem]:
    """A fixed joint mimics another joint.

    Why: It cannot follow anything; perhaps its type is wrong.

    Fix: Correct the type, or remove <mimic>.
    """
    for joint in robot.joints:
        if joint.type == "fixed" and joint.mimic_element is not None:
            yield Problem(
                joint.mimic_element, f"fixed joint {joint.name!r} has a mimic"
            )
