"""Links and joints that a xacro file has under other arguments than the present."""

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from xml.etree import ElementTree

from borecheck.errors import BorecheckError
from borecheck.robots.description import Description
from borecheck.robots.urdf.expanded_text import expanded_text
from borecheck.robots.urdf.reach import ANYWHERE
from borecheck.robots.urdf.xacro import expand

# So many combinations of choices are looked at; each takes a tenth of a second once.
MAX_COMBINATIONS = 64

_XACRO = "{http://www.ros.org/wiki/xacro}"
_NAMES_NO_BODY = {f"{_XACRO}{tag}" for tag in ("arg", "property", "macro", "include")}


def names_elsewhere(
    description: Description, arguments: Mapping[str, str], wanted: set[tuple[str, str]]
) -> set[tuple[str, str]]:
    """(kind, name) of bodies under other choices, and of those written in the files.

    Args:
        description: Of a robot or scanner.
        arguments: The present xacro arguments, complete.
        wanted: What is looked for; nothing more is read once it is found.
    """
    found: set[tuple[str, str]] = set()
    for choices in _combinations(description, arguments):
        try:
            text = expanded_text(description.xacro, {**arguments, **choices})
        except BorecheckError:
            continue  # choices that do not go together have no links
        found |= _bodies(text)
        if wanted <= found:
            return found
    if any(not argument.choices for argument in description.arguments.values()):
        for file in expand(description.xacro, arguments, ANYWHERE).files:
            found |= _written(file)
    return found


def _combinations(
    description: Description, arguments: Mapping[str, str]
) -> list[dict[str, str]]:
    """Other choices than the present ones, those with few changes first."""
    choices = {n: a.choices for n, a in description.arguments.items() if a.choices}
    changes = []
    for values in product(*choices.values()):
        chosen = dict(zip(choices, values, strict=True))
        changes.append({n: v for n, v in chosen.items() if v != arguments[n]})
    return sorted(filter(None, changes), key=len)[:MAX_COMBINATIONS]


def _bodies(text: str) -> set[tuple[str, str]]:
    """(kind, name) of the links and joints of a URDF."""
    root = ElementTree.fromstring(text)
    return {
        (kind, element.get("name", ""))
        for kind in ("link", "joint")
        for element in root.iter(kind)
    }


def _written(file: Path) -> set[tuple[str, str]]:
    """What links and joints of a xacro file may be called, conditions left aside.

    A macro's call may hold the name in any attribute.
    """
    root = ElementTree.fromstring(file.read_bytes())
    found = {
        (kind, element.get("name", ""))
        for kind in ("link", "joint")
        for element in root.iter(kind)
    }
    for element in root.iter():
        if element.tag.startswith(_XACRO) and element.tag not in _NAMES_NO_BODY:
            for text in element.attrib.values():
                found |= {("link", text), ("joint", text)}
    return found
