"""The list of checks: each is a small function with a code, and its docstring tells.

A check's docstring is its page: the first line says what is wrong, and paragraphs
beginning with `Why:`, `Fix:` and `Libraries:` (separated by semicolons) say the rest.
"""

import inspect
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from borecheck.errors import UnknownNameError
from borecheck.validation.findings import Severity
from borecheck.validation.options import PROFILES

if TYPE_CHECKING:
    from borecheck.validation.reading.checked_urdf import CheckedUrdf

TIERS = ("document", "tree", "joints", "inertia", "geometry", "kinematics")
STAGES = ("file", "robot", "meshes", "run", "last")

_LEVELS = {"E": Severity.ERROR, "W": Severity.WARNING, "I": Severity.INFO}


class Problem(NamedTuple):
    """What a check met: the element and a message; the rest comes from the check.

    `severity` and `hint` override the check's own; `attribute` names the attribute.
    """

    element: Any
    message: str
    attribute: str | None = None
    severity: Severity | None = None
    hint: str | None = None


CheckFunction = Callable[["CheckedUrdf"], Iterator[Problem]]


@dataclass(frozen=True)
class Check:
    """One check, with everything that `explain` and the docs say about it.

    Attributes:
        code: Stable code; its letter is the tier's.
        name: Stable name in words.
        tier: One of TIERS.
        levels: Severity under each profile.
        stage: What it needs: the file, the robot's records, read meshes, a run; what
            the others found (last).
        find: The function.
        title: What is wrong, in one line.
        why: Why it matters.
        fix: How to mend it.
        libraries: Libraries that behave differently.
    """

    code: str
    name: str
    tier: str
    levels: dict[str, Severity]
    stage: str
    find: CheckFunction
    title: str
    why: str
    fix: str
    libraries: tuple[str, ...]

    @property
    def module(self) -> str:
        """Where the function stands."""
        return self.find.__module__.rpartition(".")[2]


_CHECKS: dict[str, Check] = {}


def register(
    code: str, name: str, tier: str, levels: str, stage: str = "robot"
) -> Callable[[CheckFunction], CheckFunction]:
    """Enters a function in the list.

    Args:
        code: Stable code.
        name: Stable name.
        tier: One of TIERS.
        levels: One letter per profile (kinematics, collision, dynamics): E, W or I.
        stage: One of STAGES.
    """

    def enter(find: CheckFunction) -> CheckFunction:
        if code in _CHECKS:
            raise ValueError(f"two checks are called {code}")
        title, why, fix, libraries = _docstring_parts(find)
        by_profile = {p: _LEVELS[c] for p, c in zip(PROFILES, levels, strict=True)}
        _CHECKS[code] = Check(
            code, name, tier, by_profile, stage, find, title, why, fix, libraries
        )
        return find

    return enter


def all_checks() -> tuple[Check, ...]:
    """Every check, by code."""
    return tuple(_CHECKS[code] for code in sorted(_CHECKS))


def find_check(code: str) -> Check:
    """The check of a code or a name.

    Raises:
        UnknownNameError: There is none.
    """
    checks = all_checks()
    for candidate in checks:
        if code.upper() == candidate.code or code.lower() == candidate.name:
            return candidate
    raise UnknownNameError("check", code, [c.code for c in checks])


def _docstring_parts(find: CheckFunction) -> tuple[str, str, str, tuple[str, ...]]:
    """Title, why, fix and libraries, out of a docstring."""
    paragraphs = [
        " ".join(p.split()) for p in re.split(r"\n\s*\n", inspect.getdoc(find) or "")
    ]
    said = {"Why": "", "Fix": "", "Libraries": ""}
    for paragraph in paragraphs[1:]:
        heading, _, text = paragraph.partition(":")
        if heading in said:
            said[heading] = text.strip()
    libraries = tuple(part.strip() for part in said["Libraries"].split(";") if part)
    return paragraphs[0], said["Why"], said["Fix"], libraries
