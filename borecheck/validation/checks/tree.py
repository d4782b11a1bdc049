"""Tree checks: links and joints form one tree."""

from collections.abc import Iterator

from borecheck.robots.urdf.source import children, tag_of
from borecheck.validation.checks.spelling import nearest
from borecheck.validation.findings import Severity
from borecheck.validation.reading.draft import DraftJoint, Robot
from borecheck.validation.registry import Hit, check

LONG_CHAIN = 60


@check("T201", "no-links", "tree", "EEE")
def no_links(robot: Robot) -> Iterator[Hit]:
    """The robot has no link.

    Why: There is nothing to place or to collide.

    Mend: Add at least one <link>.
    """
    if tag_of(robot.root) == "robot" and not robot.links:
        if robot.holds_macros_only:
            message = "the file holds macros and no robot: nothing was checked"
            yield Hit(robot.root, message, None, Severity.INFO)
        else:
            yield Hit(robot.root, "the robot has no link")


@check("T202", "link-unknown", "tree", "EEE")
def link_unknown(robot: Robot) -> Iterator[Hit]:
    """A joint names a link that does not exist.

    Why: The tree falls apart at this joint.

    Mend: Correct the name, or add the link.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy accepts it.
    """
    for joint in robot.joints:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name is not None and name not in robot.link_named:
                close = nearest(name, robot.link_named)
                guess = f"; did you mean {close!r}?" if close else ""
                message = f"{role} link {name!r} does not exist{guess}"
                yield Hit(children(joint.element, role)[0], message, "link")


@check("T203", "link-not-named", "tree", "EEE")
def link_not_named(robot: Robot) -> Iterator[Hit]:
    """A joint does not say which links it connects.

    Why: Parsers refuse the file, skip the joint, or crash.

    Mend: Add <parent link="..."/> and <child link="..."/>.

    Libraries: urdfdom and Pinocchio refuse the file; some parsers skip the joint.
    """
    for joint in robot.joints:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name is None:
                label = f"joint {joint.name!r}" if joint.name else "a joint"
                yield Hit(joint.element, f"{label} has no {role} link")


@check("T204", "several-roots", "tree", "EEE")
def several_roots(robot: Robot) -> Iterator[Hit]:
    """More than one link has no parent.

    Why: What hangs on the other root is no part of the robot; its place is undefined.

    Mend: Connect it with a joint (a fixed one, if it does not move), or remove it.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy draws it at the origin;
    MuJoCo attaches it to the world.
    """
    for link in robot.roots[1:]:
        below = len(list(robot.below(link.name)))
        also = f" and {below - 1} links below it" if below > 1 else ""
        message = (
            f"link {link.name!r}{also} is not connected to {robot.roots[0].name!r}"
        )
        yield Hit(link.element, message)


@check("T205", "cycle", "tree", "EEE")
def cycle(robot: Robot) -> Iterator[Hit]:
    """Joints lead around in a circle, or from a link to itself.

    Why: The links of a circle have no place; some parsers never return.

    Mend: Cut the circle at one joint; a closed mechanism is a tree with mimic joints or
    a declared loop.

    Libraries: urdfdom and Pinocchio refuse the file or leave links out; some Python
    parsers loop for ever.
    """
    done: set[str] = set()
    for link in robot.links:
        road: list[str] = []
        joints: list[DraftJoint] = []
        name = link.name
        while name not in done and robot.joints_into.get(name):
            if name in road:
                circle = [*road[road.index(name) :], name]
                joint = joints[road.index(name)]
                way = " -> ".join(reversed(circle))
                yield Hit(joint.element, f"links form a circle: {way}")
                break
            road.append(name)
            joints.append(robot.joints_into[name][0])
            name = joints[-1].parent or ""
        done.update(road)


@check("T206", "two-parents", "tree", "EEE")
def two_parents(robot: Robot) -> Iterator[Hit]:
    """A link is the child of several joints.

    Why: A URDF is a tree; parsers keep one of the joints, and not the same one.

    Mend: Cut the closed loop: give one joint a child link of its own at the same place,
    and declare the two as a loop.

    Libraries: urdfdom and Pinocchio accept it and lose a joint; yourdfpy accepts it;
    Drake and MuJoCo refuse it.
    """
    for name, joints in robot.joints_into.items():
        for joint in joints[1:]:
            message = f"link {name!r} is already the child of joint {joints[0].name!r}"
            yield Hit(joint.element, message)


@check("T207", "unreachable", "tree", "EEE")
def unreachable(robot: Robot) -> Iterator[Hit]:
    """Links hang on a circle and are reached from no root.

    Why: Where they are is undefined.

    Mend: Connect the circle to the root; see T205.
    """
    reached = {name for root in robot.roots for name, _ in robot.below(root.name)}
    lost = [link for link in robot.links if link.name and link.name not in reached]
    if lost:
        names = ", ".join(link.name for link in lost[:5])
        more = f" and {len(lost) - 5} more" if len(lost) > 5 else ""
        yield Hit(lost[0].element, f"no root leads to {names}{more}")


@check("T208", "long-chain", "tree", "III")
def long_chain(robot: Robot) -> Iterator[Hit]:
    """The tree is very deep.

    Why: Rounding adds up along a chain, and some libraries recurse.

    Mend: Nothing, if the robot really is so long.
    """
    depth: dict[str, int] = {}
    if robot.roots:
        for name, joint in robot.below(robot.roots[0].name):
            above = depth.get(joint.parent or "", 0) if joint is not None else -1
            depth[name] = above + 1
    deepest = max(depth, key=lambda name: depth[name], default=None)
    if deepest is not None and depth[deepest] > LONG_CHAIN:
        message = f"link {deepest!r} is {depth[deepest]} joints away from the root"
        yield Hit(robot.link_named[deepest].element, message)


@check("T209", "frame-missing", "tree", "EEE")
def frame_missing(robot: Robot) -> Iterator[Hit]:
    """A frame that was asked for does not exist.

    Why: The tool frame of the drawing, or of the plan, is not in the robot.

    Mend: Add the link, or correct the name that was asked for (--frame).
    """
    for frame in robot.options.frames:
        if frame not in robot.link_named:
            close = nearest(frame, robot.link_named)
            guess = f"; did you mean {close!r}?" if close else ""
            yield Hit(robot.root, f"there is no link {frame!r}{guess}")


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
