"""Rules of names: every link and joint is called something, and each otherwise."""

from collections import Counter
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from functools import lru_cache

from borecheck.robots.urdf.draft import UrdfDraft
from borecheck.robots.urdf.draft_elements import DraftJoint, DraftLink
from borecheck.robots.urdf.rules.defect import Defect


def things(draft: UrdfDraft) -> list[tuple[str, DraftLink | DraftJoint]]:
    """Links, then joints, each with what it is."""
    links: list[tuple[str, DraftLink | DraftJoint]] = [("link", x) for x in draft.links]
    return links + [("joint", joint) for joint in draft.joints]


def missing(draft: UrdfDraft) -> Iterator[Defect]:
    """Every link and joint has a name."""
    for kind, thing in things(draft):
        if not thing.name:
            yield Defect(thing.element, f"a {kind} has no name", "name")


def duplicate(draft: UrdfDraft) -> Iterator[Defect]:
    """No two links, and no two joints, have the same name."""
    counts = Counter((kind, thing.name) for kind, thing in things(draft))
    seen: set[tuple[str, str]] = set()
    for kind, thing in things(draft):
        key = (kind, thing.name)
        if thing.name and key in seen:
            message = f"{counts[key]} {kind}s are called {thing.name!r}"
            yield Defect(thing.element, message, "name")
        seen.add(key)


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known word that is most like a misspelt one."""
    return _nearest(word, tuple(known))


@lru_cache(maxsize=256)  # thousands of elements may be misspelt alike
def _nearest(word: str, names: tuple[str, ...]) -> str | None:
    by_letters = {"".join(sorted(name.lower())): name for name in names}
    same_letters = by_letters.get("".join(sorted(word.lower())))
    if same_letters is not None:
        return same_letters
    lowered = {name.lower(): name for name in names}
    close = get_close_matches(word.lower(), lowered, n=1, cutoff=0.7)
    return lowered[close[0]] if close else None


def guess(word: str, known: Iterable[str]) -> str:
    """What to add to "there is no such ..."."""
    close = nearest(word, known)
    return f"; did you mean {close!r}?" if close else ""
