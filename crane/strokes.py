"""An insertion deeper than one stroke of q8: two clutches take turns; numpy only.

[CRANE] section III, "stepwise, iteratively performing short insertions and grasping the
needle": the driving clutch moves the needle with q8; then the clutch that is a brake
holds it, the driving clutch opens, q8 goes back, and grips it farther back. The needle
stands still meanwhile: what q8 loses `needle_ahead` gains.
"""

from dataclasses import dataclass

from crane.dimensions import LIMITS
from crane.refusals import refuse_no_numbers

# Of the needle behind frame 8, for the two clutches, [m]; assumed, as the model has it.
CLUTCHES = 0.09
# Less than this is no motion, [m].
ROUNDING = 1e-12


@dataclass(frozen=True)
class Stroke:
    """One motion of q8 with the driving clutch closed.

    Attributes:
        needle_ahead: Of frame 8 to the tip while it lasts, [m]: the robot's argument.
        begin: q8 at its beginning, [m].
        end: q8 at its end, [m].
    """

    needle_ahead: float
    begin: float
    end: float


def strokes(
    depth: float,
    *,
    needle_length: float = 0.15,
    needle_ahead: float = 0.05,
    begin: float = LIMITS["q8"][0],
) -> tuple[Stroke, ...]:
    """The strokes that drive the needle on by a depth, as few as there may be.

    All but the last go to the end of q8; between two, q8 goes back as far as the needle
    lets the clutches, and the tip stays. The arm stands as it did all the while.

    Args:
        depth: How far the tip is to go along the needle, [m].
        needle_length: Of the whole needle, [m].
        needle_ahead: Before the first stroke, [m].
        begin: q8 before the first stroke, [m].

    Raises:
        ValueError: A number that is none, or a needle too short for its clutches at
            that depth; says how deep it goes.
    """
    refuse_no_numbers(
        depth=depth, needle_length=needle_length, needle_ahead=needle_ahead, begin=begin
    )
    low, high = LIMITS["q8"]
    most_ahead = needle_length - CLUTCHES
    if depth < 0.0:
        raise ValueError(f"a depth of {depth!r} m: strokes drive the needle on")
    if not low <= begin <= high:
        raise ValueError(f"q8 = {begin!r} m is not within {low} to {high} m")
    if not 0.0 <= needle_ahead <= most_ahead:
        raise ValueError(
            f"needle_ahead = {needle_ahead!r} m is not within 0 and {most_ahead:.4g} "
            f"m, as two clutches hold {CLUTCHES} m of {needle_length} m"
        )
    deepest = (high - begin) + (most_ahead - needle_ahead)
    if depth > deepest + ROUNDING:
        raise ValueError(
            f"{1e3 * depth:.4g} mm is deeper than a needle of "
            f"{1e3 * needle_length:.4g} mm goes from here: {1e3 * deepest:.4g} mm"
        )
    found, ahead, at, left = [], needle_ahead, begin, depth
    while left > ROUNDING:
        go = min(left, high - at)
        if go > 0.0:
            found.append(Stroke(ahead, at, at + go))
        left -= go
        back = min(high - low, most_ahead - ahead)  # while the brake holds the needle
        ahead, at = ahead + back, high - back
    return tuple(found)
