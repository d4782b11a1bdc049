"""What the findings of a check amount to: clear, contact or unknown, and why.

Two questions are answered, so that one never hides the other: whether the robot touches
what stands around it, and whether it touches itself. The verdict is the worse answer.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from borecheck.contact.margin import NO_MARGIN, OFFSET, SECURITY, Margin
from borecheck.contact.verdict import (
    CLEAR,
    CONTACT,
    UNKNOWN,
    Answer,
    Closest,
    Containment,
    TrianglePair,
    worst_of,
)
from borecheck.geometry.surfaces import Found, Surface

WITHIN_MARGIN = "within_margin"


@dataclass
class Findings:
    """What is gathered about one question, about the obstacles or the robot itself."""

    contacts: list[TrianglePair] = field(default_factory=list)
    contained: list[Containment] = field(default_factory=list)
    punctured: set[tuple[str, str]] = field(default_factory=set)
    corridor_contacts: int = 0
    examined: int = 0
    total: int = 0
    within_growth: list[tuple[str, str]] = field(default_factory=list)
    only_tolerance: bool = True
    crossing: bool = False

    def count(self, found: Found, a: Surface, b: Surface) -> None:
        """Adds the triangle pairs of one pair of surfaces."""
        self.examined += found.examined
        self.total += a.count * b.count

    @property
    def held(self) -> list[Containment]:
        """Solids that surely are one inside another."""
        return [c for c in self.contained if c.state != UNKNOWN]

    @property
    def undecided(self) -> list[Containment]:
        """Solids of which that cannot be told."""
        return [c for c in self.contained if c.state == UNKNOWN]


def about_obstacles(
    findings: Findings, checker: str, margin: Margin, closest: Closest | None
) -> Answer:
    """What findings and the nearest distance allow to say about the obstacles.

    Args:
        findings: Of all pairs of a part and an obstacle.
        checker: Whose contacts they are.
        margin: Required clearance.
        closest: Nearest points of robot and obstacles; None without obstacles.
    """
    if findings.contacts:
        return _contact_answer(findings, margin)
    if findings.held:
        return _held_answer(findings.held)
    if findings.within_growth:
        part, obstacle = findings.within_growth[0]
        reason = f"{obstacle} lies wholly within the margin of {part}"
        return Answer(CONTACT, reason, (WITHIN_MARGIN,), _once(findings.within_growth))
    if closest is None:
        return Answer(UNKNOWN, "there is no obstacle to be clear of")
    answer = _clearance_answer(checker, margin, closest)
    if answer.verdict == CLEAR and findings.undecided:
        return Answer(UNKNOWN, findings.undecided[0].reason)
    return answer


def about_itself(findings: Findings, pairs: int, allowed: int = 0) -> Answer:
    """What findings allow to say about the robot itself.

    Args:
        findings: Of all pairs of parts that must not touch.
        pairs: How many these are.
        allowed: How many pairs of links were not asked about, because they may touch.
    """
    if findings.contacts:
        return _contact_answer(findings, NO_MARGIN)
    if findings.held:
        return _held_answer(findings.held)
    if findings.undecided:
        return Answer(UNKNOWN, findings.undecided[0].reason)
    more = f"; {counted(allowed, 'pair')} of links may touch" if allowed else ""
    return Answer(CLEAR, f"none of {counted(pairs, 'pair')} of parts meet{more}")


def worse_of(obstacles: Answer, itself: Answer) -> Answer:
    """The whole verdict: contact beats unknown beats clear."""
    verdict = worst_of([obstacles.verdict, itself.verdict])
    deciding = [one for one in (obstacles, itself) if one.verdict == verdict]
    if len(deciding) == 1:
        return replace(deciding[0], pairs=())
    if verdict != CONTACT:
        return replace(obstacles, pairs=())
    shared = set(itself.qualifiers) | {WITHIN_MARGIN}
    return Answer(
        verdict,
        f"{obstacles.reason}; and the robot itself: {itself.reason}",
        tuple(name for name in obstacles.qualifiers if name in shared),
    )


def counted(number: int, noun: str) -> str:
    """A number with its noun."""
    return f"{number} {noun}" + "s" * (number != 1)


def _held_answer(held: list[Containment]) -> Answer:
    pairs = _once([(c.link, c.obstacle) for c in held])
    return Answer(CONTACT, f"{held[0].link}: {held[0].reason}", ("contained",), pairs)


def _once(pairs: Iterable[tuple[str, str]]) -> tuple[tuple[str, str], ...]:
    return tuple(sorted(set(pairs)))


def _contact_answer(findings: Findings, margin: Margin) -> Answer:
    pairs = findings.contacts
    names = _once((pair.link, pair.obstacle) for pair in pairs)
    listed = ", ".join(f"{a} with {b}" for a, b in names[:3])
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    qualifiers = []
    # with `offset` the triangles that are found meet as they are, margin or not
    if margin.size > 0.0 and margin.kind != OFFSET:
        qualifiers.append(WITHIN_MARGIN)
    elif findings.only_tolerance:
        qualifiers.append("within_tolerance")
    elif not findings.crossing:
        qualifiers.append("touching")
    verb = "is within the margin of" if WITHIN_MARGIN in qualifiers else "meets"
    if len(names) == 1:
        reason = f"{names[0][0]} {verb} {names[0][1]} ({len(pairs)} triangle pairs)"
    else:
        reason = f"{listed}{more} ({len(pairs)} triangle pairs)"
    return Answer(CONTACT, reason, tuple(qualifiers), names)


def _clearance_answer(checker: str, margin: Margin, closest: Closest) -> Answer:
    where = f"{closest.link} to {closest.obstacle}"
    distance = f"{1e3 * closest.distance:.3f} mm"
    kept = margin.kind in (OFFSET, SECURITY)
    required = margin.size if kept else 0.0
    if closest.upper <= 0.0:
        return Answer(
            UNKNOWN,
            f"{checker} sees no contact, but the surfaces meet ({where}); "
            "its blind spots are in docs/contact.md",
        )
    if closest.upper <= required and margin.kind == OFFSET:
        reason = f"{where}: {distance} is within the margin of {1e3 * required:g} mm"
        return Answer(CONTACT, reason, (WITHIN_MARGIN,))
    if closest.distance <= required:
        return Answer(UNKNOWN, f"{where}: {distance} does not decide the margin")
    return Answer(CLEAR, f"nearest: {where}, {distance}")
