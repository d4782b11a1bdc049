"""What the command's exit status means."""

from enum import IntEnum

from borecheck.contact.verdict import CLEAR, CONTACT


class ExitStatus(IntEnum):
    """0 clean, 1 findings, 2 could not run or could not decide, 130 interrupted."""

    CLEAN = 0
    FINDINGS = 1
    COULD_NOT = 2
    INTERRUPTED = 130


def of_verdict(verdict: str) -> ExitStatus:
    """Status of a contact check: 0 clear, 1 contact, 2 unknown."""
    known = {CLEAR: ExitStatus.CLEAN, CONTACT: ExitStatus.FINDINGS}
    return known.get(verdict, ExitStatus.COULD_NOT)
