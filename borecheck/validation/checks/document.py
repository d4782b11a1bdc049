"""Document checks: is this a file from which parsers read the same thing."""

import re
from collections.abc import Iterator
from typing import Any

from borecheck.robots.urdf.source import children, elements, tag_of
from borecheck.robots.urdf.tree import JOINT_TAGS
from borecheck.validation.reading.draft import SHAPES, Robot, numbers
from borecheck.validation.reading.schema import SCHEMA, required_attributes
from borecheck.validation.registry import Hit, check

SINGLE = {
    "link": ("inertial",),
    "joint": JOINT_TAGS,
    "visual": ("origin", "geometry", "material"),
    "collision": ("origin", "geometry"),
    "inertial": ("origin", "mass", "inertia"),
}
REQUIRED = {
    "visual": ("geometry",),
    "collision": ("geometry",),
    "inertial": ("mass", "inertia"),
}

VERSIONS = ("1.0", "1.1", "1.2")

_LEFT_OVER = re.compile(r"\$\{[^}]*\}|\$\([^)]*\)")


def noted(robot: Robot, code: str) -> Iterator[Hit]:
    """What was noticed when the file was read."""
    for element, message in robot.notes.get(code, []):
        yield Hit(robot.root if element is None else element, message)


def standard(robot: Robot) -> Iterator[Any]:
    """Elements of the URDF proper; what is in extensions and unknown ones is not."""
    stack = [robot.root]
    while stack:
        element = stack.pop()
        yield element
        stack.extend(
            child for child in reversed(children(element)) if tag_of(child) in SCHEMA
        )


@check("D101", "unreadable", "document", "EEE", "file")
def unreadable(robot: Robot) -> Iterator[Hit]:
    """The file cannot be read, or is refused because it could do harm.

    Why: A file that is missing, empty, larger than 50 MB, nested without end or whose
    DOCTYPE declares something is not read further; nothing else about it was checked.

    Mend: Give a readable URDF or xacro file without entity declarations.

    Libraries: tinyxml2 (urdfdom, Pinocchio) has no protection against size; lxml
    (yourdfpy) expands entities by default.
    """
    return noted(robot, "D101")


@check("D102", "not-well-formed", "document", "EEE", "file")
def not_well_formed(robot: Robot) -> Iterator[Hit]:
    """The text is not well-formed XML.

    Why: No parser reads such a file; nothing else about it was checked.

    Mend: Look at the line and column: an unclosed tag, a missing quote, a bare & or <.
    """
    return noted(robot, "D102")


@check("D103", "root-not-robot", "document", "EEE")
def root_not_robot(robot: Robot) -> Iterator[Hit]:
    """The root element is not <robot>.

    Why: Parsers look for <robot> and find no robot at all.

    Mend: Make <robot name="..."> the outermost element; SDF and MJCF files are other
    formats and must be converted first.
    """
    tag = tag_of(robot.root)
    if tag != "robot":
        other = {"sdf": " (this is an SDF file)", "mujoco": " (this is an MJCF file)"}
        yield Hit(robot.root, f"the root element is <{tag}>{other.get(tag, '')}")


@check("D104", "robot-without-name", "document", "EEE")
def robot_without_name(robot: Robot) -> Iterator[Hit]:
    """The robot has no name.

    Why: The name is required; some parsers stop without it.

    Mend: Write <robot name="...">.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy stops with a KeyError.
    """
    if robot.holds_macros_only:
        return
    if tag_of(robot.root) == "robot" and not (robot.root.get("name") or "").strip():
        yield Hit(robot.root, "the robot's name is missing or empty", "name")


@check("D132", "robot-version", "document", "EEE")
def robot_version(robot: Robot) -> Iterator[Hit]:
    """The version of the robot is none of URDF.

    Why: The attribute names the version of the format, not of your robot.

    Mend: Leave it out, or write version="1.0".

    Libraries: urdfdom and Pinocchio refuse the file; others do not look.
    """
    version = robot.root.get("version")
    if tag_of(robot.root) == "robot" and version not in (None, *VERSIONS):
        message = f"version={version!r} is none of {', '.join(VERSIONS)}"
        yield Hit(robot.root, message, "version")


@check("D133", "quaternion-origin", "document", "EEE")
def quaternion_origin(robot: Robot) -> Iterator[Hit]:
    """An origin is turned by quat_xyzw, which most parsers do not know.

    Why: Older parsers leave the rotation out without a word, so that the same file
    stands otherwise in each library.

    Mend: Write the rotation as rpy.

    Libraries: Pinocchio 4 (urdfdom 6) reads it in files of version 1.1; yourdfpy and
    older parsers do not; borecheck's own checks refuse the file.
    """
    for element in robot.root.iter("origin"):
        if "quat_xyzw" in element.attrib:
            text = f"quat_xyzw={element.get('quat_xyzw')!r}"
            yield Hit(element, text, "quat_xyzw")


@check("D107", "undeclared-prefix", "document", "WWW")
def undeclared_prefix(robot: Robot) -> Iterator[Hit]:
    """A namespace prefix is used but never declared.

    Why: Strict XML parsers refuse the whole file, lenient ones read it.

    Mend: Declare it on <robot>: xmlns:PREFIX="...", or remove the prefixed tag.

    Libraries: lxml (yourdfpy) refuses the file; tinyxml2 (urdfdom, Pinocchio) reads it.
    """
    for defect in robot.source.defects:
        if defect.kind == "prefix":
            yield Hit(_element_at(robot, defect.line), defect.message)


@check("D108", "xml-version", "document", "WWW")
def xml_version(robot: Robot) -> Iterator[Hit]:
    """The XML declaration names a version that does not exist.

    Why: Strict XML parsers refuse the whole file, lenient ones read it.

    Mend: Write <?xml version="1.0"?>.

    Libraries: lxml (yourdfpy) refuses the file; tinyxml2 (urdfdom, Pinocchio) reads it.
    """
    for defect in robot.source.defects:
        if defect.kind == "version":
            yield Hit(robot.root, defect.message)


@check("D109", "left-over-xacro", "document", "EEE")
def left_over_xacro(robot: Robot) -> Iterator[Hit]:
    """Xacro macros or expressions were left in the URDF.

    Why: URDF parsers do not evaluate them: tags are dropped, numbers become garbage.

    Mend: Expand the file with xacro, or give it the suffix .xacro.
    """
    for element in elements(robot.root):
        if tag_of(element).startswith("xacro:"):
            yield Hit(element, f"<{tag_of(element)}> was not expanded")
        for attribute, value in element.attrib.items():
            match = _LEFT_OVER.search(value)
            if match is not None:
                message = f"{attribute}={value!r} holds the expression {match.group()}"
                yield Hit(element, message, attribute)


@check("D110", "xacro-failed", "document", "EEE", "file")
def xacro_failed(robot: Robot) -> Iterator[Hit]:
    """The xacro file could not be expanded.

    Why: There is no URDF to check.

    Mend: Mend the expression, macro or include at that line; give undeclared arguments
    with --arg NAME=VALUE and package roots with --package-path DIR.

    Libraries: the xacro package finds $(find pkg) only through a ROS index; borecheck
    searches the roots it is given, the folders above the file and the environment.
    """
    return noted(robot, "D110")


@check("D111", "xacro-argument-unknown", "document", "WWW")
def xacro_argument_unknown(robot: Robot) -> Iterator[Hit]:
    """An argument was given that the xacro file does not declare.

    Why: It has no effect; a misspelt name leaves the default in force.

    Mend: Use a declared name, or declare the argument with <xacro:arg>.
    """
    return noted(robot, "D111")


@check("D112", "xacro-argument-unused", "document", "III")
def xacro_argument_unused(robot: Robot) -> Iterator[Hit]:
    """The xacro file declares an argument that nothing refers to.

    Why: Setting it changes nothing, though a user may think so.

    Mend: Use it with $(arg name), or remove the declaration.
    """
    return noted(robot, "D112")


@check("D113", "xacro-warning", "document", "III")
def xacro_warning(robot: Robot) -> Iterator[Hit]:
    """The xacro package gave a warning.

    Why: It usually means that a name hides another one.

    Mend: Rename the property or parameter.
    """
    return noted(robot, "D113")


@check("D117", "repeated-element", "document", "EEE")
def repeated_element(robot: Robot) -> Iterator[Hit]:
    """An element that may stand once stands several times.

    Why: Some parsers take the first, some the last, some refuse the file.

    Mend: Keep one of them; several shapes need several <visual> or <collision>.

    Libraries: urdfdom and Pinocchio take the first; MuJoCo and PyBullet may add both.
    """
    for element in standard(robot):
        for tag in SINGLE.get(tag_of(element), ()):
            for extra in children(element, tag)[1:]:
                count = len(children(element, tag))
                yield Hit(extra, f"<{tag_of(element)}> has {count} <{tag}>, not one")
        if tag_of(element) == "geometry" and len(children(element)) > 1:
            tags = ", ".join(tag_of(child) for child in children(element))
            yield Hit(children(element)[1], f"<geometry> holds several shapes: {tags}")


@check("D118", "missing-element", "document", "EEE")
def missing_element(robot: Robot) -> Iterator[Hit]:
    """A required child element is missing.

    Why: The shape cannot be built; parsers drop it or refuse the file.

    Mend: Add the element, or remove the one that lacks it.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy drops the shape.
    """
    for element in standard(robot):
        for tag in REQUIRED.get(tag_of(element), ()):
            if not children(element, tag):
                yield Hit(element, f"<{tag_of(element)}> has no <{tag}>")
        shapes = [c for c in children(element) if tag_of(c) in SHAPES]
        if tag_of(element) == "geometry" and not shapes:
            yield Hit(element, "<geometry> holds no shape that URDF knows")


@check("D119", "missing-attribute", "document", "EEE")
def missing_attribute(robot: Robot) -> Iterator[Hit]:
    """A required attribute is missing or empty.

    Why: Parsers put a default in its place, drop the element, or refuse the file.

    Mend: Add the attribute.

    Libraries: urdfdom and Pinocchio refuse most of them; yourdfpy crashes on some.
    """
    for element in standard(robot):
        for attribute in required_attributes(element):
            if not (element.get(attribute) or "").strip():
                message = f"<{tag_of(element)}> has no {attribute!r}"
                yield Hit(element, message, attribute)


@check("D127", "stray-text", "document", "WWW")
def stray_text(robot: Robot) -> Iterator[Hit]:
    """Text stands where only elements may stand.

    Why: Parsers skip it; it is often the rest of a broken comment or tag.

    Mend: Remove it, or make it a comment.
    """
    for element in standard(robot):
        if tag_of(element) not in SCHEMA:
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
                yield Hit(near, f"<{tag_of(element)}> holds the text {shown!r}")


@check("D128", "material-undefined", "document", "WWW")
def material_undefined(robot: Robot) -> Iterator[Hit]:
    """A visual refers to a material that is defined nowhere.

    Why: The link is drawn in some default colour, or the file is refused.

    Mend: Define <material name="..."> with <color> or <texture> on the robot.

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
            yield Hit(element, message, "name")


@check("D129", "material-redefined", "document", "WWW")
def material_redefined(robot: Robot) -> Iterator[Hit]:
    """A material is defined several times with different colours.

    Why: Which colour a link gets depends on the parser.

    Mend: Keep one definition, or use different names.

    Libraries: urdfdom refuses a second definition on the robot.
    """
    colours: dict[str, Any] = {}
    for element in robot.root.iter("material"):
        name, colour = element.get("name"), element.find("color")
        if not name or colour is None:
            continue
        value = numbers(colour, "rgba", 4)
        if name in colours and colours[name] != value:
            yield Hit(element, f"material {name!r} has another colour before")
        colours.setdefault(name, value)


@check("D130", "colour-range", "document", "WWW")
def colour_range(robot: Robot) -> Iterator[Hit]:
    """A colour component lies outside 0 to 1.

    Why: Values of 0 to 255 are drawn white, or the file is refused.

    Mend: Divide by 255.
    """
    for element in robot.root.iter("color"):
        rgba = numbers(element, "rgba", 4)
        if rgba and (min(rgba) < 0.0 or max(rgba) > 1.0):
            yield Hit(element, f"rgba={element.get('rgba')!r} is not 0 to 1", "rgba")


@check("D131", "suppression-without-reason", "document", "WWW")
def suppression_without_reason(robot: Robot) -> Iterator[Hit]:
    """A comment that silences a finding gives no reason or names no check.

    Why: Nobody can tell later whether the finding was understood; the comment has no
    effect until it gives its reason.

    Mend: Write <!-- borecheck: ignore CODE: the reason -->.
    """
    return noted(robot, "D131")


def _element_at(robot: Robot, line: int) -> Any:
    for element in elements(robot.root):
        if (element.sourceline or 0) >= line:
            return element
    return robot.root
