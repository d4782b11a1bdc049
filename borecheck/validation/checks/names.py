"""Name checks: every link and joint is called something, once, and unmistakably."""

from collections import defaultdict
from collections.abc import Iterator

from borecheck.robots.urdf.rules import names
from borecheck.validation.checks.ruled import hits
from borecheck.validation.reading.draft import Robot
from borecheck.validation.registry import Hit, check


@check("D121", "name-missing", "document", "EEE")
def name_missing(robot: Robot) -> Iterator[Hit]:
    """A link or joint has no name.

    Why: Nothing can refer to it; parsers refuse the file or invent a name.

    Mend: Give it a name.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy may crash.
    """
    return hits(robot, names.missing)


@check("D122", "name-duplicate", "document", "EEE")
def name_duplicate(robot: Robot) -> Iterator[Hit]:
    """Two links, or two joints, have the same name.

    Why: References to it mean one or the other, depending on the parser.

    Mend: Rename one of them, and what refers to it.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy keeps the last one.
    """
    return hits(robot, names.duplicate)


@check("D123", "name-whitespace", "document", "WWW")
def name_whitespace(robot: Robot) -> Iterator[Hit]:
    """A name holds white space or control characters.

    Why: References fail when a parser trims them, and tools that split lines break.

    Mend: Use letters, digits, underscore, hyphen and slash.
    """
    for kind, thing in names.things(robot):
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
    for kind, thing in names.things(robot):
        others = spelt[kind, thing.name.lower()] - {thing.name}
        if thing.name and others:
            message = f"{kind} {thing.name!r} differs from {min(others)!r} only by case"
            yield Hit(thing.element, message, "name")
        spelt[kind, thing.name.lower()].add(thing.name)
