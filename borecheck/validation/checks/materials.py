"""Material checks: names that exist, once, and colours from 0 to 1."""

from collections.abc import Iterator
from typing import Any

from borecheck.robots.urdf.attributes import numbers
from borecheck.robots.urdf.source import children, tag_of
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem, register


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
