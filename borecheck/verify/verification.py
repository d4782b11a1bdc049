"""What checking a certificate gave."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

# What no certificate can know by itself.
NOT_KNOWN = (
    "whether chain and parts are those of the robot meant, obstacles those of the "
    "scene, and waypoints and corridor those of the path or plan: give --robot, "
    "--scene and --plan or --path",
)


@dataclass(frozen=True)
class Verification:
    """What checking a certificate gave.

    Attributes:
        accepted: Whether every statement was confirmed.
        problems: What was not, one line each. Names in it are the certificate's own:
            show them with `core.text.printable`.
        intervals: How many intervals were checked.
        pairs: How many pairs of surfaces.
        not_covered: Pairs of parts that were not asked because they may touch by the
            files and options that were given, which only a bound check accepts.
        allowed: The same with the reason, one sentence each; it is that of the files
            given, not the certificate's.
        passages: Pairs that may touch, and the corridor stated for each.
        neighbours: Pairs of parts that were not asked: neighbours in the chain, or
            parts of one rigid body.
        bound_to: What it was compared with, or None: it was checked by itself.
        not_known: What could not be known, one sentence each.
        could_not_run: Whether the file itself could not be read.
        stated: The plain values that were checked, if they could be read.
    """

    accepted: bool
    problems: tuple[str, ...]
    intervals: int = 0
    pairs: int = 0
    not_covered: tuple[tuple[str, str], ...] = ()
    passages: tuple[str, ...] = ()
    neighbours: tuple[tuple[str, str], ...] = ()
    allowed: tuple[str, ...] = ()
    bound_to: str | None = None
    not_known: tuple[str, ...] = NOT_KNOWN
    could_not_run: bool = False
    stated: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        if not self.accepted:
            first = self.problems[0] if self.problems else "nothing was confirmed"
            more = len(self.problems) - 1
            said = f"rejected: {first}" + f" and {more} more" * (more > 0)
        else:
            bound = "bound to files" if self.bound_to else "by itself"
            said = (
                f"accepted: {self.intervals} intervals of {self.pairs} pairs, {bound}"
            )
        # names in it are the certificate's own, and may hold anything
        return f"<Verification {''.join(c if c.isprintable() else '?' for c in said)}>"
