"""How a configuration is checked: checker, pruning, margin."""

from dataclasses import dataclass

from borecheck.contact.margin import NO_MARGIN, Margin, margin_for
from borecheck.geometry.surfaces import check_pruning, checker_name


@dataclass(frozen=True)
class Settings:
    """How a configuration is checked.

    Attributes:
        checker: The narrowphase, one of `pair_search.CHECKERS`.
        pruning: none, coal or bvh.
        margin: Required clearance to the obstacles.
        link_clearance: Whether to report the clearance of every part.
        pair_by_pair: Whether to ask every pair in a call of its own: the same verdict
            by the long road.
    """

    checker: str = "exact"
    pruning: str = "bvh"
    margin: Margin = NO_MARGIN
    link_clearance: bool = False
    pair_by_pair: bool = False


def settings(
    checker: str = "exact",
    pruning: str = "bvh",
    margin: float = 0.0,
    margin_kind: str | None = None,
    link_clearance: bool = False,
) -> Settings:
    """Settings from names, checked.

    Raises:
        UnknownNameError: A checker, pruning or margin kind that does not exist.
        UsageError: A margin that the checker cannot keep.
    """
    full = checker_name(checker)
    return Settings(
        full,
        check_pruning(pruning),
        margin_for(full, margin, margin_kind),
        link_clearance,
    )
