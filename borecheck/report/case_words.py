"""Which case file a result is of, in words."""

from collections.abc import Mapping
from typing import Any


def case_lines(document: Mapping[str, Any]) -> list[str]:
    """A line with the case file and its hash, and what was typed otherwise."""
    case = document.get("case")
    if case is None:
        return []
    line = f"case file {case['file']}, SHA-256 {case['sha256']}"
    return [line, *case_notes(case)]


def case_notes(case: Mapping[str, Any]) -> list[str]:
    """What of a case the command line gives otherwise, and what was not used."""
    notes = []
    if case["overridden"]:
        keys = ", ".join(case["overridden"])
        notes.append(f"the command line is used instead of its {keys}")
    if case["unused"]:
        notes.append(f"not asked for here: its {', '.join(case['unused'])}")
    return notes
