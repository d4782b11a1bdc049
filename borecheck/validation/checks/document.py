"""Document checks: is this a file from which parsers read the same thing."""

from collections.abc import Iterator
from typing import Any

from borecheck.robots.urdf.attributes import numbers
from borecheck.robots.urdf.rules import document, shapes
from borecheck.robots.urdf.schema import SCHEMA
from borecheck.robots.urdf.source import children, elements, tag_of
from borecheck.validation.checks.ruled import problems
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem, register


def noted(robot: CheckedUrdf, code: str) -> Iterator[Problem]:
    """What was noticed when the file was read."""
    for element, message in robot.notes.get(code, []):
        yield Problem(robot.root if element is None else element, message)


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


@register("D109", "left-over-xacro", "document", "EEE")
def left_over_xacro(robot: CheckedUrdf) -> Iterator[Problem]:
    """Xacro macros or expressions were left in the URDF.

    Why: URDF parsers do not evaluate them: tags are dropped, numbers become garbage.

    Fix: Expand the file with xacro, or give it the suffix .xacro.
    """
    return problems(robot, document.left_over_xacro)


@register("D110", "xacro-failed", "document", "EEE", "file")
def xacro_failed(robot: CheckedUrdf) -> Iterator[Problem]:
    """The xacro file could not be expanded.

    Why: There is no URDF to check.

    Fix: Mend the expression, macro or include at that line; give undeclared arguments
    with --arg NAME=VALUE and package roots with --package-path DIR.

    Libraries: the xacro package finds $(find pkg) only through a ROS index; borecheck
    searches the roots it is given, the folders above the file and the environment.
    """
    return noted(robot, "D110")


@register("D111", "xacro-argument-unknown", "document", "WWW")
def xacro_argument_unknown(robot: CheckedUrdf) -> Iterator[Problem]:
    """An argument was given that the xacro file does not declare.

    Why: It has no effect; a misspelt name leaves the default in force.

    Fix: Use a declared name, or declare the argument with <xacro:arg>.
    """
    return noted(robot, "D111")


@register("D112", "xacro-argument-unused", "document", "III")
def xacro_argument_unused(robot: CheckedUrdf) -> Iterator[Problem]:
    """The xacro file declares an argument that nothing refers to.

    Why: Setting it changes nothing, though a user may think so.

    Fix: Use it with $(arg name), or remove the declaration.
    """
    return noted(robot, "D112")


@register("D113", "xacro-warning", "document", "III")
def xacro_warning(robot: CheckedUrdf) -> Iterator[Problem]:
    """The xacro package gave a warning.

    Why: It usually means that a name hides another one.

    Fix: Rename the property or parameter.
    """
    return noted(robot, "D113")


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


@register("D128", "material-undefined", "document", "WWW")
def material_undefined(robot: CheckedUrdf) -> Iterator[Problem]:
    """A visual refers to a material that is defined nowhere.

    Why: The link is drawn in some default colour, or the file is refused.

    Fix: Define <material name="..."> with <color> or <texture> on the robot.

    Libraries: urdfdom reports an error; yourdfpy draws it grey.
    """
    defined = {
        e.get("name")
        for e in robot.root.iter("material")
        if e.find("color") is not None or e.find("texture") is not None
    }
    for element in robot.root.iter("material"):
        parent = element.getparent()
        if parent is None or tag_of(parent) != "visual" or children(element):
            continue
        if element.get("name") not in defined:
            message = f"material {element.get('name')!r} is not defined"
            yield Problem(element, message, "name")


@register("D129", "material-redefined", "document", "WWW")
def material_redefined(robot: CheckedUrdf) -> Iterator[Problem]:
    """A material is defined several times with different colours.

    Why: Which colour a link gets depends on the parser.

    Fix: Keep one definition, or use different names.

    Libraries: urdfdom refuses a second definition on the robot.
    """
    colours: dict[str, Any] = {}
    for element in robot.root.iter("material"):
        name, colour = element.get("name"), element.find("color")
        if not name or colour is None:
            continue
        value = numbers(colour, "rgba", 4)
        if name in colours and colours[name] != value:
            yield Problem(element, f"material {name!r} has another colour before")
        colours.setdefault(name, value)


@register("D130", "colour-range", "document", "WWW")
def colour_range(robot: CheckedUrdf) -> Iterator[Problem]:
    """A colour component lies outside 0 to 1.

    Why: Values of 0 to 255 are drawn white, or the file is refused.

    Fix: Divide by 255.
    """
    for element in robot.root.iter("color"):
        rgba = numbers(element, "rgba", 4)
        if rgba and (min(rgba) < 0.0 or max(rgba) > 1.0):
            yield Problem(
                element, f"rgba={element.get('rgba')!r} is not 0 to 1", "rgba"
            )


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
