"""The robot that checks look at: its draft, and what was asked for."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from borecheck.robots.urdf.draft import UrdfDraft
from borecheck.validation.options import Options


@dataclass(eq=False, kw_only=True)
class CheckedUrdf(UrdfDraft):
    """Everything that checks look at.

    Attributes:
        source: The XML tree.
        file: The file as the user named it.
        options: What was asked for.
        folder: Where relative mesh names start.
        notes: What reading the file left to say, by code: (element, message).
        holds_macros_only: A xacro file that defines macros and no robot.
        found_packages: Folders that `$(find ...)` of a xacro stood for.
        has_errors: Whether an error was found so far, silenced or not.
    """

    file: str
    options: Options
    folder: Path
    notes: dict[str, list[tuple[Any, str]]] = field(default_factory=dict)
    holds_macros_only: bool = False
    found_packages: tuple[str, ...] = ()
    has_errors: bool = False

    def is_by_find(self, filename: str) -> bool:
        """Whether a file is absolute only because `$(find ...)` made it so."""
        path = filename.removeprefix("file://")
        return any(path.startswith(f"{folder}/") for folder in self.found_packages)

    def remembered(self, what: str, key: Hashable, make: Callable[[], Any]) -> Any:
        """What was made for a key before, or is made now."""
        known = self.memory.setdefault(what, {})
        if key not in known:
            known[key] = make()
        return known[key]

    @cached_property
    def memory(self) -> dict[str, Any]:
        """What checks share between them (meshes read, a run's outcome)."""
        return {}
