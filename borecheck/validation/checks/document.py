"""Document checks: is this a file from which parsers read the same thing."""

from collections.abc import Iterator
from typing import Any

from borecheck.robots.urdf.rules import document, shapes
from borecheck.robots.urdf.schema import SCHEMA
from borecheck.robots.urdf.source import elements
from borecheck.validation.checks.ruled import noted, problems
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem, register


@register("D101", "unreadable", "document", "EEE", "file")
def unreadable(robot: CheckedUrdf) -> Iterator[Problem]:
    """The file cannot be read, or is refused because it could do harm.

    Why: A file that is missing, empty, larger than 50 MB, nested without end or whose
    DOCTYPE declares something is not read further; nothing else about it was checked.

    Fix: Give a readable URDF or xacro file without entity declarations.

    Libraries: tinyxml2 (urdfdom, Pinocchio) has no protection against size; lxml
    (yourdfpy) expands entities by default.
    """
    return noted(robot, "D101")


@register("D102", "not-well-formed", "document", "EEE", "file")
def not_well_formed(robot: CheckedUrdf) -> Iterator[Problem]:
    """The text is not well-formed XML.

    Why: No parser reads such a file; nothing else about it was checked.

    Fix: Look at the line and column: an unclosed tag, a missing quote, a bare & or <.
    """
    return noted(robot, "D102")


@register("D103", "root-not-robot", "document", "EEE")
def root_not_robot(robot: CheckedUrdf) -> Iterator[Problem]:
    """The root element is not <robot>.

    Why: Parsers look for <robot> and find no robot at all.

    Fix: Make <robot name="..."> the outermost element; SDF and MJCF files are other
    formats and must be converted first.
    """
    return problems(robot, document.root)


@register("D104", "robot-without-name", "document", "EEE")
def robot_without_name(robot: CheckedUrdf) -> Iterator[Problem]:
    """The robot has no name.

    Why: The name is required; some parsers stop without it.

    Fix: Write <robot name="...">.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy stops with a KeyError.
    """
    return iter(()) if robot.holds_macros_only else problems(robot, document.robot_name)


@register("D132", "robot-version", "document", "EEE")
def robot_version(robot: CheckedUrdf) -> Iterator[Problem]:
    """The version of the robot is none of URDF.

    Why: The attribute names the version of the format, not of your robot.

    Fix: Leave it out, or write version="1.0".

    Libraries: urdfdom and Pinocchio refuse the file; others do not look.
    """
    return problems(robot, document.robot_version)


@register("D133", "quaternion-origin", "document", "EEE")
def quaternion_origin(robot: CheckedUrdf) -> Iterator[Problem]:
    """An origin is turned by quat_xyzw, which most parsers do not know.

    Why: Older parsers leave the rotation out without a word, so that the same file
    stands otherwise in each library.

    Fix: Write the rotation as rpy.

    Libraries: Pinocchio 4 (urdfdom 6) reads it in files of version 1.1; yourdfpy and
    older parsers do not; borecheck's own checks refuse the file.
    """
    return problems(robot, document.quaternions)


@register("D107", "undeclared-prefix", "document", "WWW")
def undeclared_prefix(robot: CheckedUrdf) -> Iterator[Problem]:
    """A namespace prefix is used but never declared.

    Why: Strict XML parsers refuse the whole file, lenient ones read it.

    Fix: Declare it on <robot>: xmlns:PREFIX="...", or remove the prefixed tag.

    Libraries: lxml (yourdfpy) refuses the file; tinyxml2 (urdfdom, Pinocchio) reads it.
    """
    for defect in robot.source.defects:
        if defect.kind == "prefix":
            yield Problem(_element_at(robot, defect.line), defect.message)


@register("D108", "xml-version", "document", "WWW")
def xml_version(robot: CheckedUrdf) -> Iterator[Problem]:
    """The XML declaration names a version that does not exist.

    Why: Strict XML parsers refuse the whole file, lenient ones read it.

    Fix: Write <?xml version="1.0"?>.

    Libraries: lxml (yourdfpy) refuses the file; tinyxml2 (urdfdom, Pinocchio) reads it.
    """
    for defect in robot.source.defects:
        if defect.kind == "version":
            yield Problem(robot.root, defect.message)


@register("D134", "collision-misplaced", "document", "EEE")
def collision_misplaced(robot: CheckedUrdf) -> Iterator[Problem]:
    """A <collision> with geometry stands elsewhere than directly in a link.

    Why: Parsers skip it without a word: what it was to protect is not checked. It may
    stand in a joint, in a <visual>, in a group, or beside the links.

    Fix: Move it into the <link> it belongs to.

    Libraries: every parser is silent; borecheck's own checks refuse the file.
    """
    return problems(robot, shapes.misplaced_collisions)


@register("D135", "stray-bytes", "document", "WWW")
def stray_bytes(robot: CheckedUrdf) -> Iterator[Problem]:
    """Something lies before the XML declaration or behind the end.

    Why: Strict XML parsers refuse the whole file, lenient ones read it.

    Fix: Begin the file with <?xml, and end it with </robot>.

    Libraries: lxml (yourdfpy) refuses the file; tinyxml2 (urdfdom, Pinocchio) reads
    white space before the declaration.
    """
    yield from noted(robot, "D135")
    for defect in robot.source.defects:
        if defect.kind == "stray":
            yield Problem(robot.root, defect.message)


@register("D117", "repeated-element", "document", "EEE")
def repeated_element(robot: CheckedUrdf) -> Iterator[Problem]:
    """An element that may stand once stands several times.

    Why: Some parsers take the first, some the last, some refuse the file.

    Fix: Keep one of them; several shapes need several <visual> or <collision>.

    Libraries: urdfdom and Pinocchio take the first; MuJoCo and PyBullet may add both.
    """
    return problems(robot, document.repeated)


@register("D118", "missing-element", "document", "EEE")
def missing_element(robot: CheckedUrdf) -> Iterator[Problem]:
    """A required child element is missing.

    Why: The shape cannot be built; parsers drop it or refuse the file.

    Fix: Add the element, or remove the one that lacks it.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy drops the shape.
    """
    return problems(robot, document.missing)


@register("D119", "missing-attribute", "document", "EEE")
def missing_attribute(robot: CheckedUrdf) -> Iterator[Problem]:
    """A required attribute is missing or empty.

    Why: Parsers put a default in its place, drop the element, or refuse the file.

    Fix: Add the attribute.

    Libraries: urdfdom and Pinocchio refuse most of them; yourdfpy crashes on some.
    """
    return problems(robot, document.missing_attributes)


@register("D127", "stray-text", "document", "WWW")
def stray_text(robot: CheckedUrdf) -> Iterator[Problem]:
    """Text stands where only elements may stand.

    Why: Parsers skip it; it is often the rest of a broken comment or tag.

    Fix: Remove it, or make it a comment.
    """
    for element, tag in robot.standard:
        if tag not in SCHEMA:
            continue
        # Text after a child is told at the child: the line is nearer.
        texts = [(element, element.text)]
        texts += [
            (child if isinstance(child.tag, str) else element, child.tail)
            for child in element
        ]
        for near, text in texts:
            if text and text.strip():
                shown = " ".join(text.split())[:40]
                yield Problem(near, f"<{tag}> holds the text {shown!r}")


@register("D131", "suppression-without-reason", "document", "WWW")
def suppression_without_reason(robot: CheckedUrdf) -> Iterator[Problem]:
    """A comment that silences a finding gives no reason or names no check.

    Why: Nobody can tell later whether the finding was understood; the comment has no
    effect until it gives its reason.

    Fix: Write <!-- borecheck: ignore CODE: the reason -->.
    """
    return noted(robot, "D131")


def _element_at(robot: CheckedUrdf, line: int) -> Any:
    for element in elements(robot.root):
        if (element.sourceline or 0) >= line:
            return element
    return robot.root
