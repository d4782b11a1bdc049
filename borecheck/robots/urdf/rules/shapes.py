"""Rules of shapes: they have a size, and none of them is lost."""

from collections.abc import Iterator
from difflib import get_close_matches
from functools import lru_cache
from typing import Any

from borecheck.robots.urdf.attributes import NotNumbersError, parse_numbers
from borecheck.robots.urdf.draft import UrdfDraft
from borecheck.robots.urdf.draft_elements import DraftShape
from borecheck.robots.urdf.rules.defect import Defect
from borecheck.robots.urdf.rules.names import nearest
from borecheck.robots.urdf.schema import EXTENSIONS, FREE, LINK_TAGS, SCHEMA
from borecheck.robots.urdf.source import children, elements, tag_of

# How alike a misspelt word is (difflib): orign, colision; and axes for axis.
RESEMBLES, NEARLY = 0.8, 0.7
SIZES = {
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "sphere": ("radius",),
}
# Elements in which a misspelt word takes a shape, a place or a limit away in silence.
_SPELT = ("link", "visual", "collision", "mesh", "joint", "limit", "mimic")


def sizes(draft: UrdfDraft) -> Iterator[Defect]:
    """Sizes are positive; nothing that is drawn with none is there at all."""
    for shape in _shapes(draft):
        for attribute in SIZES.get(shape.tag or "", ()):
            values = _numbers(shape.shape.get(attribute))
            if values and min(values) <= 0.0:
                stops = shape.kind == "collision" or min(values) < 0.0
                text = f"{attribute}={shape.shape.get(attribute)!r}"
                yield Defect(shape.shape, f"{text} is not positive", attribute, stops)


def scales(draft: UrdfDraft) -> Iterator[Defect]:
    """No mesh is scaled to nothing."""
    for shape in _shapes(draft):
        if shape.tag == "mesh" and 0.0 in shape.scale:
            text = f"scale={shape.shape.get('scale')!r} makes the mesh flat"
            yield Defect(shape.shape, text, "scale", shape.kind == "collision")


def unknown_elements(draft: UrdfDraft) -> Iterator[Defect]:
    """Elements are known; what reads like a misspelt one stops.

    A shape or a rotation that parsers skip without a word would be missing from every
    verdict. What resembles nothing (an extension) is left alone, unless the link would
    be without the geometry that is in it.
    """
    for element, where in draft.standard:
        if where not in SCHEMA:
            continue
        known = SCHEMA[where][1]
        for child in children(element):
            tag = tag_of(child)
            if tag in known or tag in FREE or ":" in tag:
                continue
            stops = _is_misspelt(where, tag, known) or _is_the_only(child)
            yield _unknown(child, f"<{tag}>", tag, known, None, where, stops)


def unknown_attributes(draft: UrdfDraft) -> Iterator[Defect]:
    """Attributes are known; what reads like a misspelt one stops."""
    for element, where in draft.standard:
        if where not in SCHEMA:
            continue
        known = SCHEMA[where][0]
        for word in element.attrib:
            if word in known or word.startswith("{"):
                continue
            stops = where == "origin" or _is_misspelt(where, word, known)
            what = f"attribute {word!r}"
            yield _unknown(element, what, word, known, word, where, stops)


def misplaced_collisions(draft: UrdfDraft) -> Iterator[Defect]:
    """Every <collision> stands directly in a <link> of the robot."""
    links = {link.element for link in draft.links}
    for element, tag in _outside_extensions(draft.root):
        if element.getparent() not in links and _is_collision(element, tag):
            parent = element.getparent()
            where = "the root" if parent is None else f"<{tag_of(parent)}>"
            message = f"a <collision> in {where} belongs to no link: it is lost"
            yield Defect(element, message)


def lost_shapes(draft: UrdfDraft) -> Iterator[Any]:
    """Elements with a <geometry> that no verdict looks at, the outermost of each.

    In extensions too: a <gazebo> may bring links of its own.
    """
    links = {link.element for link in draft.links}
    stack = list(children(draft.root))
    while stack:
        element = stack.pop(0)
        if element in links or tag_of(element) in LINK_TAGS[1:]:
            inside = children(element)
            stack[:0] = [
                c for c in inside if element in links or tag_of(c) != "geometry"
            ]
        elif tag_of(element) == "geometry" or element.find(".//geometry") is not None:
            yield element


def _shapes(draft: UrdfDraft) -> Iterator[DraftShape]:
    for link in draft.links:
        yield from link.shapes


def _numbers(text: str | None) -> tuple[float, ...]:
    try:
        return parse_numbers(text or "")
    except NotNumbersError:
        return ()


def _is_misspelt(where: str, word: str, known: tuple[str, ...]) -> bool:
    """Whether a word is meant for a known one: alike, or as long and nearly alike."""
    if where not in _SPELT:
        return False
    as_long = tuple(name for name in known if abs(len(name) - len(word)) <= 1)
    return _alike(word, known, RESEMBLES) or _alike(word, as_long, NEARLY)


@lru_cache(maxsize=4096)
def _alike(word: str, known: tuple[str, ...], how: float) -> bool:
    return bool(get_close_matches(word.lower(), known, 1, how))


def _is_the_only(child: Any) -> bool:
    """Whether this unknown element holds the geometry of a link without <collision>."""
    link = child.getparent()
    holds = tag_of(child) == "geometry" or child.find(".//geometry") is not None
    return holds and tag_of(link) == "link" and not children(link, "collision")


def _outside_extensions(root: Any) -> Iterator[tuple[Any, str]]:
    stack = [root]
    while stack:
        element = stack.pop()
        tag = tag_of(element)
        yield element, tag
        if tag not in EXTENSIONS and ":" not in tag:
            stack.extend(reversed(children(element)))


def _is_collision(element: Any, tag: str) -> bool:
    """A <collision> with geometry, however it is spelt (the word alone is a name)."""
    if len(element) == 0 or not _alike(tag, ("collision",), RESEMBLES):
        return False
    return any(tag_of(below) == "geometry" for below in elements(element))


def _unknown(
    element: Any,
    what: str,
    word: str,
    known: tuple[str, ...],
    attribute: str | None,
    where: str,
    stops: bool,
) -> Defect:
    close = nearest(word, known)
    hint = f"Write {close!r}." if close else None
    guess = f"; did you mean {close!r}?" if close else ""
    message = f"{what} is not known in <{where}>{guess}"
    return Defect(element, message, attribute, stops, hint)
