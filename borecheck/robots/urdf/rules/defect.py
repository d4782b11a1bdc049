"""What a rule finds: an element, what is wrong with it, and whether that stops."""

from typing import Any, NamedTuple

from borecheck.robots.urdf.source import tag_of

# What is wrong in here changes neither where a robot's shapes are nor which there are.
WITHOUT_SHAPE = (
    *("material", "color", "texture", "dynamics", "calibration"),
    "safety_controller",
)


class Defect(NamedTuple):
    """One thing that is wrong.

    Attributes:
        element: The XML element.
        message: What is wrong, with the offending value.
        attribute: The attribute that is wrong, if one is.
        stops: Whether no contact check can be made of the file; else it is harmless
            for contacts.
        hint: How to mend it, where that can be said.
    """

    element: Any
    message: str
    attribute: str | None = None
    stops: bool = True
    hint: str | None = None


def matters(element: Any) -> bool:
    """Whether an element has a say in where the robot's shapes are."""
    return tag_of(element) not in WITHOUT_SHAPE
