"""What the findings of a check amount to: clear, contact or unknown, and why."""

from dataclasses import dataclass, field

from borecheck.contact.margin import OFFSET, SECURITY, Margin
from borecheck.contact.verdict import (
    CLEAR,
    CONTACT,
    UNKNOWN,
    Closest,
    Containment,
    TrianglePair,
)
from borecheck.geometry.surfaces import Found, Surface


@dataclass
class Findings:
    """What is gathered while pairs are examined."""

    contacts: list[TrianglePair]
    self_contacts: list[TrianglePair]
    contained: list[Containment]
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


@dataclass(frozen=True)
class Answer:
    """A verdict with its reason and qualifiers, see `Verdict`."""

    verdict: str
    reason: str
    qualifiers: tuple[str, ...] = ()


def decide(
    findings: Findings, checker: str, margin: Margin, closest: Closest | None
) -> Answer:
    """The verdict that the findings and the nearest distance allow.

    Args:
        findings: Of all pairs.
        checker: Whose contacts they are.
        margin: Required clearance.
        closest: Nearest points of robot and obstacles; None without obstacles.
    """
    inside = [c for c in findings.contained if c.state != UNKNOWN]
    if findings.contacts or findings.self_contacts:
        return _contact_answer(findings, margin)
    if inside:
        reason = f"{inside[0].link}: {inside[0].reason}"
        return Answer(CONTACT, reason, ("contained",))
    if findings.within_growth:
        part, obstacle = findings.within_growth[0]
        reason = f"{obstacle} lies wholly within the margin of {part}"
        return Answer(CONTACT, reason, ("within_margin",))
    if closest is None:
        return Answer(UNKNOWN, "there is no obstacle to be clear of")
    answer = _clearance_answer(checker, margin, closest)
    open_pairs = [c for c in findings.contained if c.state == UNKNOWN]
    if answer.verdict == CLEAR and open_pairs:
        return Answer(UNKNOWN, open_pairs[0].reason)
    return answer


def _contact_answer(findings: Findings, margin: Margin) -> Answer:
    parts = [*findings.contacts, *findings.self_contacts]
    names = sorted({(pair.link, pair.obstacle) for pair in parts})
    listed = ", ".join(f"{a} with {b}" for a, b in names[:3])
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    qualifiers = []
    # with `offset` the triangles that are found meet as they are, margin or not
    if margin.size > 0.0 and margin.kind != OFFSET and findings.contacts:
        qualifiers.append("within_margin")
    elif findings.only_tolerance:
        qualifiers.append("within_tolerance")
    elif not findings.crossing:
        qualifiers.append("touching")
    verb = "is within the margin of" if "within_margin" in qualifiers else "meets"
    if len(names) == 1:
        reason = f"{names[0][0]} {verb} {names[0][1]} ({len(parts)} triangle pairs)"
    else:
        reason = f"{listed}{more} ({len(parts)} triangle pairs)"
    return Answer(CONTACT, reason, tuple(qualifiers))


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
        return Answer(CONTACT, reason, ("within_margin",))
    if closest.distance <= required:
        return Answer(UNKNOWN, f"{where}: {distance} does not decide the margin")
    return Answer(CLEAR, f"nearest: {where}, {distance}")
