"""Pairs of links that an SRDF lets touch, read as MoveIt 2 reads them.

`disable_collisions` names a pair. `disable_default_collisions` names a link that may
touch every other link, but for the pairs that `enable_collisions` names. Each pair has
a reason: what is geometry or a person's choice is taken, what is statistics is not.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

from borecheck.errors import UrdfError
from borecheck.robots.urdf.reach import NO_ROOTS, Roots
from borecheck.robots.urdf.rules.names import guess
from borecheck.robots.urdf.source import (
    Source,
    children,
    elements,
    read,
    tag_of,
)
from borecheck.robots.urdf.text import read_bytes

DISABLE = "disable_collisions"
ENABLE = "enable_collisions"
BY_DEFAULT = "disable_default_collisions"
PAIR = ("link1", "link2", "reason")
FAMILY = {DISABLE: PAIR, ENABLE: PAIR, BY_DEFAULT: ("link", "reason")}
# What an element begins with that means one of these, however it is spelt.
SWITCHES = ("disable", "enable")

# Reasons that are taken, as MoveIt writes them, short and long, and as we do.
ADJACENT = "Adjacent"
TAKEN = {
    "adjacent": ADJACENT,
    "adjacent links": ADJACENT,
    "default": "Default",
    "collision by default": "Default",
    "always": "Always",
    "always in collision": "Always",
    "always in contact": "Always",
}
NEVER = "Never"
NO_REASON = "no reason given"
LONGEST_REASON = 120
# More would fill the memory; the largest public SRDF has 2,000.
MOST_PAIRS = 1_000_000


@dataclass(frozen=True)
class StatedPair:
    """Two links that an SRDF lets touch.

    Attributes:
        first: One link.
        second: The other.
        kind: Adjacent, Default, Always, Never, the element's name where a link may
            touch every other, or the reason as written.
        reason: As the file has it.
        line: Where it stands.
    """

    first: str
    second: str
    kind: str
    reason: str
    line: int

    @property
    def links(self) -> frozenset[str]:
        """The two links, in no order."""
        return frozenset((self.first, self.second))

    @property
    def is_taken(self) -> bool:
        """Whether it is taken without more trust than the file's own words deserve."""
        return self.kind in (*TAKEN.values(), BY_DEFAULT)


@dataclass(frozen=True, eq=False)
class Srdf:
    """What an SRDF says of a robot's links.

    Attributes:
        file: As the user named it.
        sha256: Hash of its bytes.
        name: The robot it is for, by its own word.
        pairs: Who may touch whom, each pair once, taken ones before others.
    """

    file: str
    sha256: str
    name: str
    pairs: tuple[StatedPair, ...]

    @cached_property
    def taken(self) -> tuple[StatedPair, ...]:
        """Pairs whose reason is known and no statistics."""
        return tuple(pair for pair in self.pairs if pair.is_taken)

    @cached_property
    def left(self) -> tuple[StatedPair, ...]:
        """The others."""
        return tuple(pair for pair in self.pairs if not pair.is_taken)


def read_srdf(
    path: str | Path, links: Collection[str], roots: Roots = NO_ROOTS
) -> Srdf:
    """The pairs of an SRDF.

    Args:
        path: The file.
        links: All links of the robot.
        roots: Where it may lie if it is a link.

    Raises:
        UrdfError: Not readable, no SRDF, or a pair that is none of the robot's links;
            one line with file and line.
    """
    raw = read_bytes(Path(path), roots)
    source = read(raw, str(path))
    if tag_of(source.root) != "robot":
        problem = f"is no SRDF: its root is <{tag_of(source.root)}>, not <robot>"
        raise UrdfError(path, problem, _line(source, source.root))
    _refuse_urdf(source)
    _refuse_misplaced(source)
    pairs = _without_twins(source, _Reader(source, links).pairs())
    name = source.root.get("name") or ""
    return Srdf(str(path), sha256(raw).hexdigest(), name, pairs)


class _Reader:
    """The elements of one file, each asked for links that exist."""

    def __init__(self, source: Source, links: Collection[str]) -> None:
        self.source = source
        self.links = links

    def pairs(self) -> Iterator[StatedPair]:
        """Pairs as they are written, then those of links that may touch all others."""
        enabled = {
            frozenset(self._ends(element)): element for element in self._all(ENABLE)
        }
        for element in self._all(DISABLE):
            first, second = self._ends(element)
            again = enabled.get(frozenset((first, second)))
            if again is not None:
                line = self.source.line(again)
                problem = f"<{ENABLE}> in line {line} names the same pair: one must go"
                raise self._error(element, problem)
            reason = _short(" ".join((element.get("reason") or "").split()))
            yield StatedPair(
                first, second, kind_of(reason), reason, self.source.line(element)
            )
        yield from self._by_default(enabled)

    def _by_default(self, enabled: Collection[frozenset[str]]) -> Iterator[StatedPair]:
        """Pairs of links that may touch every other."""
        said = {self._link(e, "link"): e for e in self._all(BY_DEFAULT)}
        for link, element in said.items():
            if len(said) * len(self.links) > MOST_PAIRS:
                raise self._error(element, f"makes more than {MOST_PAIRS:,} pairs")
            line = self.source.line(element)
            for other in self.links:
                if other != link and frozenset((link, other)) not in enabled:
                    yield StatedPair(link, other, BY_DEFAULT, BY_DEFAULT, line)

    def _all(self, tag: str) -> list[Any]:
        return children(self.source.root, tag)

    def _ends(self, element: Any) -> tuple[str, str]:
        first, second = self._link(element, "link1"), self._link(element, "link2")
        if first == second:
            raise self._error(element, f"names the link {first!r} with itself")
        return first, second

    def _link(self, element: Any, attribute: str) -> str:
        name = element.get(attribute)
        if not name:
            raise self._error(element, f"has no {attribute}")
        if name not in self.links:
            raise self._error(element, no_link(name, self.links))
        return str(name)

    def _error(self, element: Any, problem: str) -> UrdfError:
        return _error(self.source, element, f"<{tag_of(element)}> {problem}")


def no_link(name: str, links: Collection[str]) -> str:
    """Why a name cannot stand in a pair."""
    return (
        f"names {name!r}, which is no link of the robot{guess(name, links)} (only its "
        "links may be let touch each other, never an obstacle)"
    )


def _short(reason: str) -> str:
    """A reason of sane length: it is repeated wherever the pair is named."""
    if len(reason) <= LONGEST_REASON:
        return reason
    return f"{reason[: LONGEST_REASON - 3]}..."


def kind_of(reason: str) -> str:
    """Adjacent, Default, Always or Never, where the reason is one of these."""
    known = TAKEN.get(reason.casefold())
    if known is not None:
        return known
    if reason.casefold().split(" ")[0].rstrip(":,;") == NEVER.casefold():
        return NEVER
    return reason or NO_REASON


def _refuse_urdf(source: Source) -> None:
    """Refuses the robot's own file, given by mistake: it has joints and links."""
    for tag in ("joint", "link"):
        for element in children(source.root, tag):
            problem = f"<{tag}> below <robot>: this is a URDF, not an SRDF"
            raise _error(source, element, problem)


def _refuse_misplaced(source: Source) -> None:
    """Refuses what speaks of collisions and would be read over.

    A misspelt `enable_collisions` would let a pair touch that must not, and so would
    an attribute that takes back what its element says.
    """
    found = list(elements(source.root))
    for element in found:
        if tag_of(element).startswith("xacro:"):
            problem = f"<{tag_of(element)}>: expand the xacro first (xacro IN > OUT)"
            raise _error(source, element, problem)
    for element in found:
        tag = tag_of(element)
        if tag in FAMILY and element.getparent() is not source.root:
            above = tag_of(element.getparent())
            problem = f"<{tag}> stands in <{above}>, where nobody reads it"
            raise _error(source, element, problem)
        if tag not in FAMILY and _sounds_like_one(tag):
            problem = f"<{tag}> is not known in an SRDF{guess(tag, FAMILY)}"
            raise _error(source, element, problem)
        for name in element.attrib if tag in FAMILY else ():
            if name not in FAMILY[tag]:
                problem = f"<{tag}> has {name}, which nobody reads"
                raise _error(source, element, problem + guess(name, FAMILY[tag]))


def _sounds_like_one(tag: str) -> bool:
    word = tag.casefold()
    return "collision" in word or word.startswith(SWITCHES) or bool(guess(word, FAMILY))


def _without_twins(
    source: Source, pairs: Iterator[StatedPair]
) -> tuple[StatedPair, ...]:
    """Each pair once: what is taken before what is not, else the first."""
    found: dict[frozenset[str], StatedPair] = {}
    for pair in sorted(pairs, key=lambda pair: not pair.is_taken):
        found.setdefault(pair.links, pair)
    return tuple(found.values())


def _error(source: Source, element: Any, problem: str) -> UrdfError:
    return UrdfError(source.file, problem, _line(source, element))


def _line(source: Source, element: Any) -> str:
    return f"line {source.line(element)}"
