"""The errors that stop borecheck: each says what, where, and which names exist."""

from collections.abc import Iterable
from difflib import get_close_matches
from os import PathLike

# Of a file with many problems, so many are told.
_SHOWN = 20


class BorecheckError(Exception):
    """Base of all errors raised on purpose; its text is one clear line."""

    @property
    def lines(self) -> tuple[str, ...]:
        """What is wrong, a line for each problem."""
        return (str(self),)


class UsageError(BorecheckError):
    """The request itself makes no sense (an option, a quantity, a combination)."""


class UnknownNameError(BorecheckError):
    """A robot, frame, joint, checker ... that does not exist.

    Args:
        kind: What was looked for, in the singular: "joint", "robot".
        name: The name that was given.
        known: The names that exist.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        names = list(known)
        close = get_close_matches(name, names, n=1)
        hint = f"; did you mean {close[0]!r}?" if close else ""
        listed = ", ".join(names) if names else "none"
        super().__init__(f"unknown {kind} {name!r}{hint} (known: {listed})")
        self.kind = kind
        self.name = name
        self.known = names


class InputError(BorecheckError):
    """A file that cannot be used.

    Args:
        file: The file as the user named it.
        problem: What is wrong with it.
        element: Where in the file (an element path, a line, a triangle), if known.
    """

    def __init__(
        self, file: str | PathLike[str], problem: str, element: str | None = None
    ) -> None:
        where = f"{file}: {element}" if element else f"{file}"
        super().__init__(f"{where}: {problem}")
        self.file = str(file)
        self.problem = problem
        self.element = element


class MeshError(InputError):
    """A mesh that cannot be read or holds no usable triangles."""


class UrdfError(InputError):
    """A URDF or xacro file from which no robot can be built."""


class PlanError(InputError):
    """A needle plan or path file that cannot be used."""


class CaseError(InputError):
    """A case file with keys that it may not hold, or that hold what they may not.

    Args:
        file: The file as the user named it.
        problems: What is wrong, each with its key.
    """

    def __init__(self, file: str | PathLike[str], problems: Iterable[str]) -> None:
        self.problems = tuple(problems)
        super().__init__(file, "; ".join(self.problems))

    @property
    def lines(self) -> tuple[str, ...]:
        """A line for each problem, the first of very many."""
        shown = self.problems[:_SHOWN]
        more = len(self.problems) - len(shown)
        lines = tuple(f"{self.file}: {problem}" for problem in shown)
        return (*lines, f"{self.file}: and {more} more problems") if more else lines


class JointLimitError(BorecheckError):
    """A configuration outside the joint limits; never clipped, never driven."""


class GeometryError(BorecheckError):
    """Geometry handed to a Python function that no verdict can be given for."""
