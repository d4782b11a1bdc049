"""What the closed forms of robots share: named numbers and asked needles; numpy only.

No formula of any robot stands here: two robots that shared one would vouch for each
other.
"""

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
D = TypeVar("D")


def number(value: float, source: str) -> Any:
    """A field of a dataclass of dimensions, with the place it is read from."""
    return field(default=value, metadata={"source": source})


def sources(dimensions: type) -> dict[str, str]:
    """Where every number of a class of dimensions comes from, by name."""
    return {item.name: item.metadata["source"] for item in fields(dimensions)}


def values(dimensions: Any) -> dict[str, float]:
    """Every number of some dimensions by its name."""
    return {item.name: getattr(dimensions, item.name) for item in fields(dimensions)}


def moved(nominal: D, by: Mapping[str, float]) -> D:
    """The dimensions with something added to single ones, by name."""
    changed = {name: getattr(nominal, name) + more for name, more in by.items()}
    return replace(nominal, **changed)  # type: ignore[type-var]


def refuse_unknown(arguments: Iterable[str], known: Collection[str]) -> None:
    """Says which argument a closed form does not have.

    Raises:
        ValueError: There is one.
    """
    unknown = sorted(set(arguments) - set(known))
    if unknown:
        raise ValueError(f"unknown argument {unknown[0]!r} (known: {known})")


def finite(name: str, value: str | float) -> float:
    """A number or its text.

    Raises:
        ValueError: It is no finite number.
    """
    try:
        read = float(value)
    except ValueError:
        read = math.nan
    if not math.isfinite(read):
        raise ValueError(f"{name} = {value!r} is no finite number")
    return read


@dataclass(frozen=True)
class Solutions:
    """Every joint position that puts the needle there.

    Attributes:
        configurations: Those within the limits, each (joints,), read-only; may be
            empty.
        rejected: One line for every other branch: which limits it breaks, by how much.
        complete: Whether there are no others with that insertion, turns of a joint
            about the needle's own axis left aside.
    """

    configurations: tuple[Array, ...]
    rejected: tuple[str, ...]
    complete: bool = False


def within_limits(
    found: Iterable[Array],
    limits: Mapping[str, tuple[float, float]],
    angles: Collection[str],
) -> Solutions:
    """Configurations sorted into those within the limits and the others.

    Args:
        found: Joint positions, (joints,) each; those kept become read-only.
        limits: Lower and upper limit by joint, in the order of q, [m] or [rad].
        angles: The joints whose values are angles.
    """
    within: list[Array] = []
    rejected: list[str] = []
    for q in found:
        broken = broken_limits(q, limits, angles)
        if broken:
            rejected.append("; ".join(broken))
        else:
            q.setflags(write=False)
            within.append(q)
    return Solutions(tuple(within), tuple(rejected))


def broken_limits(
    q: ArrayLike,
    limits: Mapping[str, tuple[float, float]],
    angles: Collection[str],
) -> tuple[str, ...]:
    """The joints of q (joints,) beyond their limits, a phrase each; empty if none."""
    phrases = []
    for value, (name, (lower, upper)) in zip(
        np.asarray(q), limits.items(), strict=True
    ):
        if lower <= value <= upper:
            continue
        limit, side = (lower, "below") if value < lower else (upper, "above")
        scale, unit = (math.degrees(1.0), "deg") if name in angles else (1e3, "mm")
        told, bound = f"{scale * value:.3f}", f"{scale * limit:.3f}"
        if told == bound:  # beyond by less than is shown
            told, bound = f"{scale * value:.12g}", f"{scale * limit:.12g}"
        phrases.append(f"{name} = {told} {unit} is {side} its limit {bound} {unit}")
    return tuple(phrases)


def needle_asked_for(
    tip: ArrayLike, direction: ArrayLike, insertion: float
) -> tuple[Array, Array]:
    """A needle's tip [m] and unit direction, (3,) each, once it is sure they are such.

    Raises:
        ValueError: A number is not finite, or the direction has no length.
    """
    tip = np.array(tip, dtype=np.float64)
    direction = np.array(direction, dtype=np.float64)
    if tip.shape != (3,) or direction.shape != (3,):
        raise ValueError(
            f"tip {tip.shape} and direction {direction.shape} must be (3,)"
        )
    if not (np.isfinite(tip).all() and np.isfinite(direction).all()):
        raise ValueError("tip or direction holds a number that is not finite")
    if not math.isfinite(insertion):
        raise ValueError(f"insertion {insertion!r} is not finite")
    if not direction.any():
        raise ValueError("the needle direction has no length")
    # by a power of two, which rounds nothing: lengths near 1e308 and 1e-320 are lengths
    n: Array = np.ldexp(direction, -math.frexp(np.abs(direction).max())[1])
    return tip, n / math.hypot(*n)
