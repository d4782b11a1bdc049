"""Name checks: every link and joint is called something, once, and unmistakably."""

from collections import defaultdict
from collections.abc import Iterator

from borecheck.robots.urdf.rules import names
from borecheck.validation.checks.ruled import problems
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem, register


@register("D121", "name-missing", "document", "EEE")
def name_missing(robot: CheckedUrdf) -> Iterator[Problem]:
    """A link or joint has no name.

    Why: Nothing can refer to it; parsers refuse the file or invent a name.

    Fix: Give it a name.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy may crash.
    """
    return problems(robot, names.missing)


@register("D122", "name-duplicate", "document", "EEE")
def name_duplicate(robot: CheckedUrdf) -> Iterator[Problem]:
    """Two links, or two joints, have the same name.

    Why: References to it mean one or the other, depending on the parser.

    Fix: Rename one of them, and what refers to it.

    Libraries: urdfdom and Pinocchio refuse the file; yourdfpy keeps the last one.
    """
    return problems(robot, names.duplicate)


@register("D123", "name-whitespace", "document", "WWW")
def name_whitespace(robot: CheckedUrdf) -> Iterator[Problem]:
    """A name holds white space or control characters.

    Why: References fail when a parser trims them, and tools that split lines break.

    Fix: Use letters, digits, underscore, hyphen and slash.
    """
    for kind, thing in names.things(robot):
        raw = thing.element.get("name") or ""
        if thing.name and any(c.isspace() or not c.isprintable() for c in raw):
            yield Problem(
                thing.element, f"{kind} name {raw!r} holds white space", "name"
            )


@register("D124", "name-case", "document", "WWW")
def name_case(robot: CheckedUrdf) -> Iterator[Problem]:
    """Two names differ only by upper and lower case.

    Why: They are taken for each other by people and by systems that ignore case.

    Fix: Rename one of them.

    Libraries: USD and file names on Windows and macOS ignore case.
    """
    spelt: dict[tuple[str, str], set[str]] = defaultdict(set)
    for kind, thing in names.things(robot):
        others = spelt[kind, thing.name.lower()] - {thing.name}
        if thing.name and others:
            message = f"{kind} {thing.name!r} differs from {min(others)!r} only by case"
            yield Problem(thing.element, message, "name")
        spelt[kind, thing.name.lower()].add(thing.name)
