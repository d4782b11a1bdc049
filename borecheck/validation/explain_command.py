"""`borecheck explain CODE`: what a check looks for, why, and how to mend it."""

import argparse
import sys

from borecheck.validation.registry import Check, find_check


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the options of `borecheck explain`."""
    parser.add_argument("codes", nargs="+", metavar="CODE", help="such as J302")


def run(args: argparse.Namespace) -> int:
    """Prints what the codes mean."""
    texts = [explained(find_check(code)) for code in args.codes]
    sys.stdout.write("\n\n".join(texts) + "\n")
    return 0


def explained(check: Check) -> str:
    """A check in words, as text."""
    levels = ", ".join(f"{name}: {level}" for name, level in check.levels.items())
    lines = [f"{check.code} {check.name} ({check.tier})", check.title, "", levels]
    for heading, text in (("Why", check.why), ("Mend", check.mend)):
        lines += ["", f"{heading}: {text}"] if text else []
    if check.libraries:
        lines += ["", "Libraries:", *(f"- {library}" for library in check.libraries)]
    return "\n".join(lines)
