"""Tree checks: links and joints form one tree."""

from collections.abc import Iterator

from borecheck.robots.urdf.rules import tree
from borecheck.robots.urdf.rules.names import guess
from borecheck.validation.checks.ruled import hits
from borecheck.validation.findings import Severity
from borecheck.validation.reading.draft import Robot
from borecheck.validation.registry import Hit, check

LONG_CHAIN = 60


@check("T201", "no-links", "tree", "EEE")
def no_links(robot: Robot) -> Iterator[Hit]:
    """The robot has no link.

    Why: There is nothing to place or to collide.

    Mend: Add at least one <link>.
    """
    if not robot.holds_macros_only:
        yield from hits(robot, tree.no_links)
    elif not robot.links:
        message = "the file holds macros and no robot: nothing was checked"
        level = None if robot.options.profile == "collision" else Severity.INFO
        yield Hit(robot.root, message, None, level)


@check("T202", "link-unknown", "tree", "EEE")
def link_unknown(robot: Robot) -> Iterator[Hit]:
    """A joint names a link that does not exist.

    Why: The tree falls apart at this joint.

    Mend: Correct the name, or add the link.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy accepts it.
    """
    return hits(robot, tree.unknown_links)


@check("T203", "link-not-named", "tree", "EEE")
def link_not_named(robot: Robot) -> Iterator[Hit]:
    """A joint does not say which links it connects.

    Why: Parsers refuse the file, skip the joint, or crash.

    Mend: Add <parent link="..."/> and <child link="..."/>.

    Libraries: urdfdom and Pinocchio refuse the file; some parsers skip the joint.
    """
    return hits(robot, tree.unnamed_links)


@check("T204", "several-roots", "tree", "EEE")
def several_roots(robot: Robot) -> Iterator[Hit]:
    """More than one link has no parent.

    Why: What hangs on the other root is no part of the robot; its place is undefined.

    Mend: Connect it with a joint (a fixed one, if it does not move), or remove it.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy draws it at the origin;
    MuJoCo attaches it to the world.
    """
    return hits(robot, tree.several_roots)


@check("T205", "cycle", "tree", "EEE")
def cycle(robot: Robot) -> Iterator[Hit]:
    """Joints lead around in a circle, or from a link to itself.

    Why: The links of a circle have no place; some parsers never return.

    Mend: Cut the circle at one joint; a closed mechanism is a tree with mimic joints or
    a declared loop.

    Libraries: urdfdom and Pinocchio refuse the file or leave links out; some Python
    parsers loop for ever.
    """
    return hits(robot, tree.cycles)


@check("T206", "two-parents", "tree", "EEE")
def two_parents(robot: Robot) -> Iterator[Hit]:
    """A link is the child of several joints.

    Why: A URDF is a tree; parsers keep one of the joints, and not the same one.

    Mend: Cut the closed loop: give one joint a child link of its own at the same place,
    and declare the two as a loop.

    Libraries: urdfdom and Pinocchio accept it and lose a joint; yourdfpy accepts it;
    Drake and MuJoCo refuse it.
    """
    return hits(robot, tree.two_parents)


@check("T207", "unreachable", "tree", "EEE")
def unreachable(robot: Robot) -> Iterator[Hit]:
    """Links hang on a circle and are reached from no root.

    Why: Where they are is undefined.

    Mend: Connect the circle to the root; see T205.
    """
    return hits(robot, tree.unreachable)


@check("T208", "long-chain", "tree", "III")
def long_chain(robot: Robot) -> Iterator[Hit]:
    """The tree is very deep.

    Why: Rounding adds up along a chain, and some libraries recurse.

    Mend: Nothing, if the robot really is so long.
    """
    depths = robot.depths
    deepest = max(depths, key=lambda name: depths[name], default=None)
    if deepest is not None and LONG_CHAIN < depths[deepest] <= tree.DEEPEST:
        message = f"link {deepest!r} is {depths[deepest]} joints away from the root"
        yield Hit(robot.link_named[deepest].element, message)


@check("T211", "chain-too-deep", "tree", "EEE")
def chain_too_deep(robot: Robot) -> Iterator[Hit]:
    """The tree is deeper than 1,000 joints.

    Why: Libraries walk it by recursion and crash; no real arm has a tenth of that.

    Mend: Merge links that are fixed to each other; a chain of so many moving joints is
    no robot.

    Libraries: urdfdom and Pinocchio overflow their stack on very deep files.
    """
    return hits(robot, tree.too_deep)


@check("T209", "frame-missing", "tree", "EEE")
def frame_missing(robot: Robot) -> Iterator[Hit]:
    """A frame that was asked for does not exist.

    Why: The tool frame of the drawing, or of the plan, is not in the robot.

    Mend: Add the link, or correct the name that was asked for (--frame).
    """
    for frame in robot.options.frames:
        if frame not in robot.link_named:
            close = guess(frame, robot.link_named)
            yield Hit(robot.root, f"there is no link {frame!r}{close}")


@check("T210", "root-with-inertia", "tree", "III")
def root_with_inertia(robot: Robot) -> Iterator[Hit]:
    """The root link has an inertia.

    Why: Some libraries leave the inertia of the root link out.

    Mend: Add an empty root link above it, with a fixed joint, if dynamics matter.

    Libraries: KDL warns and ignores it.
    """
    for link in robot.roots[:1]:
        if link.inertial is not None and robot.joints:
            yield Hit(link.inertial, f"root link {link.name!r} has an inertia")
