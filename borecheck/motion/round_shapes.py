"""A motion of round shapes: contact only where polyhedra within the shapes touch too.

As `contact.round_shapes` does for a pose: what is clear is so by the polyhedra round
the shapes, what is contact by those within; between the two it is unknown.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise

from borecheck.contact.verdict import CLEAR, CONTACT, UNKNOWN
from borecheck.motion.outcome import PathVerdict, Stretch


def between(
    around: PathVerdict, inside: PathVerdict, excess: Mapping[str, float]
) -> PathVerdict:
    """The verdict of a motion in which polyhedra round the shapes touch.

    Args:
        around: Of those; it is contact.
        inside: Of the polyhedra within the shapes.
        excess: By how much each body may be larger than its shape, [m].
    """
    intervals = tuple(_joined(around, inside))
    found = replace(around, intervals=intervals, certified=False)
    if inside.contact:
        first, reason = inside.first_contact, inside.reason
        if first is not None and around.first_contact is not None:
            first = (min(first[0], around.first_contact[0]), *first[1:])
            reason = f"{' and '.join(first[2])} meet {_place(*first[:2])}"
        return replace(
            found,
            reason=reason,
            qualifiers=inside.qualifiers,
            first_contact=first,
            worst=_first(intervals, CONTACT),
        )
    return replace(
        found,
        verdict=UNKNOWN,
        reason=_reason(around, excess),
        qualifiers=(),
        first_contact=None,
        worst=_first(intervals, UNKNOWN),
    )


def _joined(around: PathVerdict, inside: PathVerdict) -> Iterator[Stretch]:
    """Stretches between all ends: clear by one, contact by the other, or neither."""
    ends = {0.0, 1.0}
    ends |= {s.start for found in (around, inside) for s in found.intervals}
    for start, end in pairwise(sorted(ends)):
        outer, inner = _at(around, start, end), _at(inside, start, end)
        if outer.verdict == CLEAR:
            yield replace(outer, start=start, end=end)
        elif inner.verdict == CONTACT:
            yield replace(inner, start=start, end=end)
        else:
            yield Stretch(start, end, UNKNOWN, outer.pairs)


def _at(found: PathVerdict, start: float, end: float) -> Stretch:
    middle = 0.5 * (start + end)
    return next(s for s in found.intervals if s.start <= middle <= s.end)


def _first(intervals: tuple[Stretch, ...], verdict: str) -> float:
    return min((s.start for s in intervals if s.verdict == verdict), default=0.0)


def _reason(around: PathVerdict, excess: Mapping[str, float]) -> str:
    touching = [s for s in around.intervals if s.verdict == CONTACT and s.pairs]
    if not touching:
        return f"{around.reason}, or so it seems of the polyhedra round the shapes"
    names = touching[0].pairs[0]
    known = " and ".join(
        f"{name} is round and known to {1e3 * excess[name]:.3f} mm"
        for name in names
        if excess[name] > 0.0
    )
    where = _place(touching[0].start, touching[0].end)
    return f"{' and '.join(names)} {where}: no gap and no contact shown; {known}"


def _place(start: float, end: float) -> str:
    return f"between {start:.4%} and {end:.4%} of the motion"
