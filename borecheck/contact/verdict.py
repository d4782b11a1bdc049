"""What a contact check says, as values: clear, contact or unknown, and why."""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import asdict, dataclass
from html import escape
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from borecheck.core.palette import LIGHT
from borecheck.robots.allowed import AllowedPair

CLEAR = "clear"
CONTACT = "contact"
UNKNOWN = "unknown"


class AnyVerdict:
    """What every verdict has in common: exactly one of three answers holds.

    An answer is neither true nor false. `if check(...)` would take "contact" for yes,
    or for no, as its writer thought; so it is refused, and the question must be named.

    Attributes:
        verdict: clear, contact or unknown.
        reason: One sentence.
    """

    verdict: str
    reason: str

    @property
    def clear(self) -> bool:
        """Whether it is shown that nothing touches."""
        return self.verdict == CLEAR

    @property
    def contact(self) -> bool:
        """Whether something touches, or comes within the margin."""
        return self.verdict == CONTACT

    @property
    def unknown(self) -> bool:
        """Whether neither could be shown."""
        return self.verdict == UNKNOWN

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.verdict}: {self.reason}>"

    def _repr_html_(self) -> str:
        """A card for a notebook, with a picture if there is one to draw."""
        draw = self.__dict__.get("_draw")
        return (
            f'<div style="border-left:6px solid {LIGHT[self.verdict].ink};'
            f'padding:.3em .8em"><b>{self.verdict.upper()}</b> '
            f"{escape(self.reason)}{draw() if draw else ''}</div>"
        )

    def pictured(self, draw: Callable[[], str]) -> Self:
        """The same, whose card shows what `draw` returns (HTML), drawn when shown."""
        found = copy(self)
        # no field: neither compared nor written anywhere
        object.__setattr__(found, "_draw", draw)
        return found

    def __getstate__(self) -> dict[str, Any]:
        """Without the picture, which knows robot and scene."""
        return {name: v for name, v in self.__dict__.items() if name != "_draw"}

    def __bool__(self) -> bool:
        """Refused: see the class.

        Raises:
            TypeError: Always; it names what to ask instead.
        """
        raise TypeError(
            f"a verdict is neither true nor false (this one is {self.verdict!r}): "
            "ask .clear, .contact or .unknown"
        )


@dataclass(frozen=True)
class TrianglePair:
    """Two triangles in contact; the numbers are places in the meshes' triangle lists.

    Attributes:
        link: Robot's part (its link, numbered where a link has several shapes).
        obstacle: Obstacle, or the other part for self contact.
        link_triangle: Triangle of the link.
        obstacle_triangle: Triangle of the obstacle.
    """

    link: str
    obstacle: str
    link_triangle: int
    obstacle_triangle: int


@dataclass(frozen=True)
class Containment:
    """One solid wholly inside another, or a pair for which that cannot be told.

    Attributes:
        link: Robot's part.
        obstacle: Obstacle, or the other part.
        role: The obstacle's role, or "self".
        state: a_in_b (the link is inside), b_in_a, or unknown.
        reason: One sentence.
    """

    link: str
    obstacle: str
    role: str
    state: str
    reason: str

    @property
    def holds(self) -> bool:
        """Whether robot and surroundings are surely in contact by this."""
        return self.state != UNKNOWN and self.role != "self"


@dataclass(frozen=True)
class Closest:
    """The two nearest points between robot and surroundings.

    Attributes:
        link: Robot's part.
        obstacle: Obstacle, or the other part when it is a self distance.
        role: The obstacle's role, or "self".
        distance: Lower bound of the distance, [m].
        upper: Upper bound, [m]: the distance of `points`, and for round shapes how far
            the polyhedra round them lie outside them.
        points: The point on the link and on the obstacle, scanner's frame, [m].
        triangles: The triangle of each.
    """

    link: str
    obstacle: str
    role: str
    distance: float
    upper: float
    points: tuple[tuple[float, float, float], tuple[float, float, float]]
    triangles: tuple[int, int]


@dataclass(frozen=True, repr=False)
class Answer(AnyVerdict):
    """What is said of one of two questions: about the obstacles, or the robot itself.

    Attributes:
        verdict: clear, contact or unknown.
        reason: One sentence.
        qualifiers: See `Verdict`.
        pairs: Links in contact, each with what it touches: an obstacle, or the other
            link.
    """

    verdict: str
    reason: str
    qualifiers: tuple[str, ...] = ()
    pairs: tuple[tuple[str, str], ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Plain values for `json.dumps`."""
        return asdict(self)


@dataclass(frozen=True, repr=False)
class Verdict(AnyVerdict):
    """The answer for one configuration.

    It is the worse of two, which are told apart: that about the obstacles, and that
    about the robot itself.

    Attributes:
        verdict: clear, contact or unknown.
        reason: One sentence.
        qualifiers: touching, within_margin, contained, within_tolerance.
        checker: The narrowphase that was asked.
        checker_verdict: What that checker alone says; a one-sided test may say clear
            where the verdict is not.
        pruning: How pairs were kept from the narrowphase.
        margin_m: Required clearance to obstacles, [m].
        margin_kind: offset, enlarge-axes, enlarge-axes:world or security.
        clearance_m: Distance between robot and obstacles, [m]; in contact None, or 0
            where the clearance of every part was asked for. A solid inside another is
            in contact, however far its surface is from the other's.
        closest: Where that is; None where a solid holds another.
        contacts: Triangle pairs in contact, robot against obstacles.
        self_contacts: Triangle pairs in contact within the robot.
        corridor_contacts: How many pairs of needle and patient lie in the plan's
            corridor and therefore do not count.
        contained: Solids inside others, or pairs where that is unknown.
        not_modelled: What the verdict does not cover.
        pairs_examined: Triangle pairs the narrowphase looked at.
        pairs_pruned: Pairs it did not need to look at.
        seconds: Time taken. The first check of a process also loads the kernels, or
            compiles them; `borecheck check` does that before.
        q: Configuration, in the order of the robot's joints.
        obstacles: Whether the robot touches what stands around it.
        itself: Whether it touches itself.
        allowed: Pairs of links that may touch, and were not asked about.
        link_clearance: Clearance of every part to the obstacles, [m], if asked for.
    """

    verdict: str
    reason: str
    qualifiers: tuple[str, ...]
    checker: str
    checker_verdict: str
    pruning: str
    margin_m: float
    margin_kind: str
    clearance_m: float | None
    closest: Closest | None
    contacts: tuple[TrianglePair, ...]
    self_contacts: tuple[TrianglePair, ...]
    corridor_contacts: int
    contained: tuple[Containment, ...]
    not_modelled: tuple[str, ...]
    pairs_examined: int
    pairs_pruned: int
    seconds: float
    q: tuple[float, ...]
    obstacles: Answer
    itself: Answer
    allowed: tuple[AllowedPair, ...] = ()
    link_clearance: dict[str, float] | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain values for `json.dumps`."""
        return asdict(self)


def pairs_of(
    link: str, obstacle: str, ids: NDArray[np.int64]
) -> tuple[TrianglePair, ...]:
    """Records from triangle numbers (k, 2)."""
    return tuple(TrianglePair(link, obstacle, a, b) for a, b in ids.tolist())


def worst_of(verdicts: Sequence[str]) -> str:
    """Contact beats unknown beats clear; nothing examined is unknown."""
    for verdict in (CONTACT, UNKNOWN):
        if verdict in verdicts:
            return verdict
    return CLEAR if verdicts else UNKNOWN
