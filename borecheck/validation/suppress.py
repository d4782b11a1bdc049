"""Comments that silence findings: `<!-- borecheck: ignore J303: the reason -->`.

A comment holds for the element after it and everything in it (as the last thing in an
element: for that element); `ignore-file` holds for the whole file. Without a reason it
has no effect and is itself a finding.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from borecheck.errors import UrdfError
from borecheck.robots.urdf.source import Source, read
from borecheck.robots.urdf.text import read_bytes
from borecheck.validation.codes import code_of
from borecheck.validation.findings import Finding

_COMMENT = re.compile(
    r"^\s*borecheck\s*:\s*(?P<scope>ignore(?:-file)?)\b\s*(?P<codes>[^:]*?)\s*"
    r"(?::\s*(?P<reason>.*?))?\s*$",
    re.S | re.I,
)


@dataclass(frozen=True)
class Suppression:
    """Codes that are silent in a range of lines of a file, and why."""

    file: str
    first: int
    last: int
    codes: tuple[str, ...]
    reason: str

    def covers(self, finding: Finding) -> bool:
        """Whether it silences a finding."""
        here = finding.file == self.file and self.first <= finding.line <= self.last
        return here and finding.code.startswith(self.codes)


@dataclass(frozen=True)
class Comment:
    """A comment addressed to borecheck that has no effect, and why."""

    element: Any
    problem: str


def suppressions_in(
    source: Source, file: str
) -> tuple[tuple[Suppression, ...], tuple[Comment, ...]]:
    """What the comments of one XML tree silence, and those that lack something."""
    from lxml import etree

    found, faulty = [], []
    for comment in source.root.getroottree().xpath("//comment()"):
        match = _COMMENT.match(comment.text or "")
        if match is None:
            continue
        words = [word for word in re.split(r"[,\s]+", match["codes"]) if word]
        codes = tuple(code for code in map(code_of, words) if code is not None)
        unknown = [word for word in words if code_of(word) is None]
        if unknown or not codes:
            named = f" ({', '.join(unknown)})" if unknown else ""
            faulty.append(Comment(comment, f"names no check{named}"))
        elif not (match["reason"] or "").strip():
            faulty.append(Comment(comment, "gives no reason"))
        else:
            whole = match["scope"].lower() == "ignore-file"
            first, last = (
                (0, 2**31) if whole else _range(comment, etree.Comment, source)
            )
            reason = " ".join(match["reason"].split())
            found.append(Suppression(file, first, last, codes, reason))
    return tuple(found), tuple(faulty)


def suppressions_of(files: Iterable[Path]) -> tuple[Suppression, ...]:
    """What the comments of included files silence; unreadable ones say nothing."""
    found: list[Suppression] = []
    for path in files:
        try:
            source = read(read_bytes(path), str(path))
        except UrdfError:
            continue  # the expansion has said so already
        found.extend(suppressions_in(source, str(path))[0])
    return tuple(found)


def _range(comment: Any, is_comment: Any, source: Source) -> tuple[int, int]:
    target = comment.getnext()
    while target is not None and target.tag is is_comment:
        target = target.getnext()
    if target is None:
        target = comment.getparent()
    if target is None:
        return comment.sourceline, comment.sourceline
    # The start tag may begin before the line libxml2 names for the element.
    first = comment.sourceline if target.getparent() is not None else 0
    if target is comment.getparent():
        first = source.line(target)
    return first, max(e.sourceline or 0 for e in target.iter())
