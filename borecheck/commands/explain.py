"""`borecheck explain CODE`: what a check looks for, why, and how to mend it."""

import argparse
import re
import sys
from difflib import get_close_matches

from borecheck.errors import UnknownNameError, UsageError
from borecheck.validation.catalogue import all_checks, find_check
from borecheck.validation.registry import Check

NEAREST = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the options of `borecheck explain`."""
    parser.add_argument("codes", nargs="+", metavar="CODE", help="such as J302")


def run(args: argparse.Namespace) -> int:
    """Prints what the codes mean."""
    texts = [explained(_check(code)) for code in args.codes]
    sys.stdout.write("\n\n".join(texts) + "\n")
    return 0


def _check(code: str) -> Check:
    """The check of a code or a name.

    Raises:
        UsageError: There is none; the nearest ones are named, not all of them.
    """
    try:
        return find_check(code)
    except UnknownNameError as error:
        near = ", ".join(_nearest(code))
        raise UsageError(
            f"no check is called {code!r}; nearest: {near} "
            "(all: borecheck validate --list-checks)"
        ) from error


def _nearest(code: str) -> list[str]:
    """Names that look alike, else the codes of the same tier nearest in number."""
    checks = all_checks()
    alike = get_close_matches(code.lower(), [c.name for c in checks], n=NEAREST)
    if alike:
        return alike
    same = [c.code for c in checks if c.code[0] == code[:1].upper()]
    known = same or [c.code for c in checks]
    digits = re.sub(r"\D", "", code)[:9]
    number = int(digits) if digits else 0
    return sorted(known, key=lambda c: (abs(int(c[1:]) - number), c))[:NEAREST]


def explained(check: Check) -> str:
    """A check in words, as text."""
    levels = ", ".join(f"{name}: {level}" for name, level in check.levels.items())
    lines = [f"{check.code} {check.name} ({check.tier})", check.title, "", levels]
    for heading, text in (("Why", check.why), ("Fix", check.fix)):
        lines += ["", f"{heading}: {text}"] if text else []
    if check.libraries:
        lines += ["", "Libraries:", *(f"- {library}" for library in check.libraries)]
    return "\n".join(lines)
