"""A finding: one thing that is wrong, where, why it matters and how to mend it."""

from dataclasses import dataclass
from enum import StrEnum


class Severity(StrEnum):
    """How bad a finding is; compare with `rank`."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"

    @property
    def rank(self) -> int:
        """0 for information, 1 for a warning, 2 for an error."""
        return ("info", "warning", "error").index(self.value)


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with a file.

    Attributes:
        code: Stable code of the check, such as "J302".
        severity: Under the profile that was asked for.
        tier: document, tree, joints, inertia, geometry or kinematics.
        element: Element path, such as `robot/joint[@name='theta']/axis`.
        file: The file in which the element stands (of the xacro, if there is one).
        line: Line in that file, from 1.
        message: What is wrong, with the offending value.
        why: Why it matters.
        hint: How to mend it.
        libraries: Libraries that behave differently, and how.
        name: The check's name, such as "axis-zero".
        attribute: The attribute that is wrong, if one is.
    """

    code: str
    severity: Severity
    tier: str
    element: str
    file: str
    line: int
    message: str
    why: str
    hint: str
    libraries: tuple[str, ...]
    name: str = ""
    attribute: str | None = None

    def __repr__(self) -> str:
        place = f"{self.file}:{self.line}"
        return f"<Finding {self.code} {self.severity.value}, {place}: {self.message}>"
