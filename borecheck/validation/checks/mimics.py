"""Mimic checks: followers follow a joint that exists and moves."""

from collections.abc import Iterator

from borecheck.robots.urdf import mimic as chains
from borecheck.robots.urdf.draft import DraftJoint
from borecheck.robots.urdf.rules import joints
from borecheck.validation.checks.ruled import hits
from borecheck.validation.reading.draft import Robot
from borecheck.validation.registry import Hit, check

_TOLERANCE = 1e-6  # limits typed with six digits


def _followers(robot: Robot) -> Iterator[tuple[DraftJoint, DraftJoint]]:
    """Each mimic joint with the joint it names, where that exists and is another."""
    for joint in robot.joints:
        if joint.mimic is not None and joint.mimic.joint != joint.name:
            leader = robot.joint_named.get(joint.mimic.joint)
            if leader is not None:
                yield joint, leader


@check("J316", "mimic-missing", "joints", "EEE")
def mimic_missing(robot: Robot) -> Iterator[Hit]:
    """A joint mimics a joint that does not exist.

    Why: Where the follower goes is undefined.

    Mend: Correct the name.

    Libraries: Pinocchio and urdfdom accept it; yourdfpy crashes or ignores it.
    """
    return hits(robot, joints.missing_leaders)


@check("J317", "mimic-cycle", "joints", "EEE")
def mimic_cycle(robot: Robot) -> Iterator[Hit]:
    """Mimic joints follow each other in a circle, or one follows itself.

    Why: No joint of the circle is free, so none has a position.

    Mend: Let one joint of the circle be free.

    Libraries: Pinocchio and urdfdom accept it; some parsers never return.
    """
    return hits(robot, joints.mimic_cycles)


@check("J318", "mimic-chain", "joints", "WWW")
def mimic_chain(robot: Robot) -> Iterator[Hit]:
    """A joint mimics a joint that mimics another one.

    Why: The meaning is clear, but most libraries get it wrong.

    Mend: Let it mimic the free joint directly, with the composed factor and offset.

    Libraries: Pinocchio refuses chains with mimic=True and ignores mimic without;
    yourdfpy takes the middle joint for zero; borecheck resolves chains.
    """
    follows, _ = chains.try_resolve(robot.joint_named.values())
    for joint, leader in _followers(robot):
        if leader.mimic is not None and joint.name in follows:
            free, multiplier, offset = follows[joint.name]
            yield Hit(
                joint.mimic_element,
                f"mimics {leader.name!r}, which mimics {leader.mimic.joint!r}",
                "joint",
                hint=f'Write <mimic joint="{free}" multiplier="{multiplier:.12g}" '
                f'offset="{offset:.12g}"/>.',
            )


@check("J319", "mimic-fixed-leader", "joints", "WWW")
def mimic_fixed_leader(robot: Robot) -> Iterator[Hit]:
    """A joint mimics a fixed joint.

    Why: A fixed joint has no position: the follower stays at its offset, or the file is
    refused.

    Mend: Correct the leader, or make the follower fixed.

    Libraries: yourdfpy takes 0; Pinocchio with mimic=True refuses the file.
    """
    for joint, leader in _followers(robot):
        if leader.type == "fixed":
            message = f"mimics {leader.name!r}, which is fixed"
            yield Hit(joint.mimic_element, message, "joint")


@check("J320", "mimic-type-mix", "joints", "WWW")
def mimic_type_mix(robot: Robot) -> Iterator[Hit]:
    """A rotating joint mimics a sliding one, or the other way round.

    Why: The multiplier then has a unit (rad/m), which is easily forgotten.

    Mend: Check the multiplier; silence the finding if it is meant (a lead screw).

    Libraries: some refuse a mix of joint types.
    """
    slides = {"prismatic": True, "revolute": False, "continuous": False}
    for joint, leader in _followers(robot):
        kinds = slides.get(joint.type), slides.get(leader.type)
        if None not in kinds and kinds[0] != kinds[1]:
            message = (
                f"{joint.type} joint mimics the {leader.type} joint {leader.name!r}"
            )
            yield Hit(joint.mimic_element, message, "joint")


@check("J321", "mimic-outside-limits", "joints", "WWW")
def mimic_outside_limits(robot: Robot) -> Iterator[Hit]:
    """Following its leader, a joint leaves its own limits.

    Why: Either the limits or the multiplier are wrong; some libraries clip the
    follower, which breaks the mechanism.

    Mend: Widen the follower's limits to multiplier * leader + offset, or correct the
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
            yield Hit(joint.mimic_element, message)


@check("J322", "mimic-leader-later", "joints", "III")
def mimic_leader_later(robot: Robot) -> Iterator[Hit]:
    """The followed joint comes after its follower in the file.

    Why: Parsers that read in one pass do not know it yet.

    Mend: Move the leader before the follower.

    Libraries: some one-pass parsers refuse or ignore such a mimic.
    """
    order = {joint.name: index for index, joint in enumerate(robot.joints)}
    for joint, leader in _followers(robot):
        if order[leader.name] > order[joint.name]:
            message = f"mimics {leader.name!r}, which comes later in the file"
            yield Hit(joint.mimic_element, message, "joint")


@check("J323", "mimic-multiplier-zero", "joints", "WWW")
def mimic_multiplier_zero(robot: Robot) -> Iterator[Hit]:
    """The multiplier of a mimic joint is zero.

    Why: The joint then never moves.

    Mend: Correct the multiplier, or make the joint fixed.
    """
    for joint in robot.joints:
        if joint.mimic is not None and joint.mimic.multiplier == 0.0:
            yield Hit(joint.mimic_element, "multiplier is 0", "multiplier")


@check("J324", "mimic-on-fixed", "joints", "WWW")
def mimic_on_fixed(robot: Robot) -> Iterator[Hit]:
    """A fixed joint mimics another joint.

    Why: It cannot follow anything; perhaps its type is wrong.

    Mend: Correct the type, or remove <mimic>.
    """
    for joint in robot.joints:
        if joint.type == "fixed" and joint.mimic_element is not None:
            yield Hit(joint.mimic_element, f"fixed joint {joint.name!r} has a mimic")
