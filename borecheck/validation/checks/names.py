"""Name checks: every link and joint is called something, once, and unmistakably."""

from collections import Counter, defaultdict
from collections.abc import Iterator

from borecheck.validation.reading.draft import DraftJoint, DraftLink, Robot
from borecheck.validation.registry import Hit, check


def _things(robot: Robot) -> list[tuple[str, DraftLink | DraftJoint]]:
    links: list[tuple[str, DraftLink | DraftJoint]] = [("link", x) for x in robot.links]
    return links + [("joint", joint) for joint in robot.joints]


@check("D121", "name-missing", "document", "EEE")
def name_missing(robot: Robot) -> Iterator[Hit]:
    """A link or joint has no name.

    Why: Nothing can refer to it; parsers refuse the file or invent a name.

    Mend: Give it a name.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy may crash.
    """
    for kind, thing in _things(robot):
        if not thing.name:
            yield Hit(thing.element, f"a {kind} has no name", "name")


@check("D122", "name-duplicate", "document", "EEE")
def name_duplicate(robot: Robot) -> Iterator[Hit]:
    """Two links, or two joints, have the same name.

    Why: References to it mean one or the other, depending on the parser.

    Mend: Rename one of them, and what refers to it.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy keeps the last one.
    """
    counts = Counter((kind, thing.name) for kind, thing in _things(robot))
    seen: set[tuple[str, str]] = set()
    for kind, thing in _things(robot):
        key = (kind, thing.name)
        if thing.name and key in seen:
            message = f"{counts[key]} {kind}s are called {thing.name!r}"
            yield Hit(thing.element, message, "name")
        seen.add(key)


@check("D123", "name-whitespace", "document", "WWW")
def name_whitespace(robot: Robot) -> Iterator[Hit]:
    """A name holds white space or control characters.

    Why: References fail when a parser trims them, and tools that split lines break.

    Mend: Use letters, digits, underscore, hyphen and slash.
    """
    for kind, thing in _things(robot):
        raw = thing.element.get("name") or ""
        if thing.name and any(c.isspace() or not c.isprintable() for c in raw):
            yield Hit(thing.element, f"{kind} name {raw!r} holds white space", "name")


@check("D124", "name-case", "document", "WWW")
def name_case(robot: Robot) -> Iterator[Hit]:
    """Two names differ only by upper and lower case.

    Why: They are taken for each other by people and by systems that ignore case.

    Mend: Rename one of them.

    Libraries: USD and file names on Windows and macOS ignore case.
    """
    spelt: dict[tuple[str, str], set[str]] = defaultdict(set)
    for kind, thing in _things(robot):
        others = spelt[kind, thing.name.lower()] - {thing.name}
        if thing.name and others:
            message = f"{kind} {thing.name!r} differs from {min(others)!r} only by case"
            yield Hit(thing.element, message, "name")
        spelt[kind, thing.name.lower()].add(thing.name)
