"""What one expansion may read and spend, and what is noted while it goes on."""

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from borecheck.errors import UrdfError
from borecheck.robots.urdf.reach import Reach, Roots
from borecheck.robots.urdf.text import without_stray
from borecheck.robots.urdf.xacro.values import Budget

MAX_FILE_BYTES = 5_000_000  # one file; the largest public ones are below 1 MB
MAX_FILES = 1_000  # read by one expansion, the same file again included; PR2: 57
MAX_MACRO_CALLS = 3_000  # the PR2 makes 140
MAX_DEFINITIONS = 2_000  # of properties and macros; the PR2 has 330
MAX_ELEMENTS = 15_000  # visited; the PR2 has 3,000
MAX_TEXT = 5_000_000  # letters of all texts, worked out; PR2: 130,000

MARK = "borecheck-place"  # attribute that carries file and line through the expansion


@dataclass
class Run:
    """One expansion.

    Attributes:
        main: The main file.
        roots: Where packages may lie.
        reach: What it may read.
        budget: Steps of its expressions.
        files: XML files read, the main one first.
        data_files: YAML files read.
        declared: Arguments, and the file that declares each.
        referenced: Arguments that something refers to.
        packages: Folders that `$(find ...)` stood for.
        counts: How much was used of what is bounded.
        stray: Bytes around the text of files that were read over, in a line each.
        place: File and line of the element that the expansion is at.
    """

    main: Path
    roots: Roots
    reach: Reach
    budget: Budget = field(default_factory=Budget)
    files: list[Path] = field(default_factory=list)
    data_files: list[Path] = field(default_factory=list)
    declared: dict[str, Path] = field(default_factory=dict)
    referenced: set[str] = field(default_factory=set)
    packages: dict[str, None] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    stray: list[str] = field(default_factory=list)
    place: tuple[Path, int] | None = None

    def enter(self, node: Any) -> None:
        """Notes where the expansion is."""
        mark = node.getAttribute(MARK) if node.hasAttributes() else ""
        if mark:
            self.place = self.place_of(mark)

    def place_of(self, mark: str) -> tuple[Path, int]:
        """File and line of a mark."""
        file, _, line = mark.partition(":")
        return self.files[int(file)], int(line)

    def count(self, what: str, most: int, by: int = 1) -> None:
        """Counts what is bounded.

        Raises:
            UrdfError: There is too much of it.
        """
        self.counts[what] = self.counts.get(what, 0) + by
        if self.counts[what] > most:
            raise self.error(f"more than {most} {what}; refused")

    def read(self, filename: str, element: str) -> bytes:
        """The content of a file that the main file, or one within it, names.

        Args:
            filename: The file.
            element: Who asks for it, for the message.

        Raises:
            UrdfError: Out of reach, missing, no file, too large.
        """
        path = Path(os.path.normpath(filename))
        self.count("files", MAX_FILES)
        self.refuse_outside(path, element)
        try:
            if path.is_dir():
                raise UnreadableError.at(self, f"{path} is a directory")
            if not path.is_file():
                raise UnreadableError.at(self, f"{path}: no such file")
            if path.stat().st_size > MAX_FILE_BYTES:
                problem = f"{path} is larger than {MAX_FILE_BYTES // 10**6} MB"
                raise UnreadableError.at(self, problem)
            raw, stray = without_stray(path.read_bytes())
            self.stray += [f"{path}:{d.line}: {d.message}" for d in stray]
            return raw
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise UnreadableError.at(self, f"{path}: {reason}") from error

    def refuse_outside(self, path: Path, element: str) -> None:
        """Refuses a file that is out of reach; the main file the user named himself.

        Raises:
            UrdfError: It is.
        """
        if self.files and not self.reach.holds(path):
            raise OutsideError.at(self, f"{element}: {self.reach.refusal(path)}")

    def error(self, problem: str) -> UrdfError:
        """An error at the place where the expansion is."""
        return XacroError.at(self, problem)

    def unmarked(self, root: Any) -> Iterator[tuple[Path, int]]:
        """Takes the marks off, in document order; the unmarked lie where parents do."""
        stack = [(root, (self.files[0], 1))]
        while stack:
            element, place = stack.pop()
            mark = element.getAttribute(MARK)
            if mark:
                place = self.place_of(mark)
                element.removeAttribute(MARK)
            yield place
            children = [c for c in element.childNodes if c.nodeType == c.ELEMENT_NODE]
            stack.extend((child, place) for child in reversed(children))


class XacroError(UrdfError):
    """What stops an expansion."""

    @classmethod
    def at(cls, run: Run, problem: str) -> Self:
        """The error with the place where the expansion is."""
        if run.place is None:
            return cls(run.main, f"xacro: {problem}")
        file, line = run.place
        return cls(file, f"xacro: {problem}", f"line {line}")


class OutsideError(XacroError):
    """What the file has no business with."""


class UnreadableError(XacroError):
    """A file that cannot be read; an `optional` include passes over it."""
