"""Tree checks: links and joints form one tree."""

from collections.abc import Iterator

from borecheck.robots.urdf.rules import tree
from borecheck.robots.urdf.rules.names import guess
from borecheck.validation.checks.ruled import problems
from borecheck.validation.findings import Severity
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem, register

LONG_CHAIN = 60


@register("T201", "no-links", "tree", "EEE")
def no_links(robot: CheckedUrdf) -> Iterator[Problem]:
    """The robot has no link.

    Why: There is nothing to place or to collide.

    Fix: Add at least one <link>.
    """
    if not robot.holds_macros_only:
        yield from problems(robot, tree.no_links)
    elif not robot.links:
        message = "the file holds macros and no robot: nothing was checked"
        level = None if robot.options.profile == "collision" else Severity.INFO
        yield Problem(robot.root, message, None, level)


@register("T202", "link-unknown", "tree", "EEE")
def link_unknown(robot: CheckedUrdf) -> Iterator[Problem]:
    """A joint names a link that does not exist.

    Why: The tree falls apart at this joint.

    Fix: Correct the name, or add the link.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy accepts it.
    """
    return problems(robot, tree.unknown_links)


@register("T203", "link-not-named", "tree", "EEE")
def link_not_named(robot: CheckedUrdf) -> Iterator[Problem]:
    """A joint does not say which links it connects.

    Why: Parsers refuse the file, skip the joint, or crash.

    Fix: Add <parent link="..."/> and <child link="..."/>.

    Libraries: urdfdom and Pinocchio refuse the file; some parsers skip the joint.
    """
    return problems(robot, tree.unnamed_links)


@register("T204", "several-roots", "tree", "EEE")
def several_roots(robot: CheckedUrdf) -> Iterator[Problem]:
    """More than one link has no parent.

    Why: What hangs on the other root is no part of the robot; its place is undefined.

    Fix: Connect it with a joint (a fixed one, if it does not move), or remove it.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy draws it at the origin;
    MuJoCo attaches it to the world.
    """
    return problems(robot, tree.several_roots)


@register("T205", "cycle", "tree", "EEE")
def cycle(robot: CheckedUrdf) -> Iterator[Problem]:
    """Joints lead around in a circle, or from a link to itself.

    Why: The links of a circle have no place; some parsers never return.

    Fix: Cut the circle at one joint; a closed mechanism is a tree with mimic joints or
    a declared loop.

    Libraries: urdfdom and Pinocchio refuse the file or leave links out; some Python
    parsers loop for ever.
    """
    return problems(robot, tree.cycles)


@register("T206", "two-parents", "tree", "EEE")
def two_parents(robot: CheckedUrdf) -> Iterator[Problem]:
    """A link is the child of several joints.

    Why: A URDF is a tree; parsers keep one of the joints, and not the same one.

    Fix: Cut the closed loop: give one joint a child link of its own at the same place,
    and declare the two as a loop.

    Libraries: urdfdom and Pinocchio accept it and lose a joint; yourdfpy accepts it;
    Drake and MuJoCo refuse it.
    """
    return problems(robot, tree.two_parents)


@register("T207", "unreachable", "tree", "EEE")
def unreachable(robot: CheckedUrdf) -> Iterator[Problem]:
    """Links hang on a circle and are reached from no root.

    Why: Where they are is undefined.

    Fix: Connect the circle to the root; see T205.
    """
    return problems(robot, tree.unreachable)


@register("T208", "long-chain", "tree", "III")
def long_chain(robot: CheckedUrdf) -> Iterator[Problem]:
    """The tree is very deep.

    Why: Rounding adds up along a chain, and some libraries recurse.

    Fix: Nothing, if the robot really is so long.
    """
    depths = robot.depths
    deepest = max(depths, key=lambda name: depths[name], default=None)
    if deepest is not None and LONG_CHAIN < depths[deepest] <= tree.DEEPEST:
        message = f"link {deepest!r} is {depths[deepest]} joints away from the root"
        yield Problem(robot.link_named[deepest].element, message)


@register("T211", "chain-too-deep", "tree", "EEE")
def chain_too_deep(robot: CheckedUrdf) -> Iterator[Problem]:
    """The tree is deeper than 1,000 joints.

    Why: Libraries walk it by recursion and crash; no real arm has a tenth of that.

    Fix: Merge links that are fixed to each other; a chain of so many moving joints is
    no robot.

    Libraries: urdfdom and Pinocchio overflow their stack on very deep files.
    """
    return problems(robot, tree.too_deep)


@register("T209", "frame-missing", "tree", "EEE")
def frame_missing(robot: CheckedUrdf) -> Iterator[Problem]:
    """A frame that was asked for does not exist.

    Why: The tool frame of the drawing, or of the plan, is not in the robot.

    Fix: Add the link, or correct the name that was asked for (--frame).
    """
    for frame in robot.options.frames:
        if frame not in robot.link_named:
            close = guess(frame, robot.link_named)
            yield Problem(robot.root, f"there is no link {frame!r}{close}")


@register("T210", "root-with-inertia", "tree", "III")
def root_with_inertia(robot: CheckedUrdf) -> Iterator[Problem]:
    """The root link has an inertia.

    Why: Some libraries leave the inertia of the root link out.

    Fix: Add an empty root link above it, with a fixed joint, if dynamics matter.

    Libraries: KDL warns and ignores it.
    """
    for link in robot.roots[:1]:
        if link.inertial is not None and robot.joints:
            yield Problem(link.inertial, f"root link {link.name!r} has an inertia")
