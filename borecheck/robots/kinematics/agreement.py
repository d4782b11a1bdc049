"""Do independent kinematics put every frame in the same place, and where not?

The comparator is blind: it takes functions q -> {frame: T} and knows no robot and no
engine. `cross_check` hands it the closed form, Pinocchio and yourdfpy.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import rotation_angle
from borecheck.errors import UnknownNameError, UsageError
from borecheck.robots.kinematics.sources import Placements

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tolerances:
    """How far two placements may differ and still count as the same.

    Two roads of about 30 operations on numbers of about 1 m differ by 1e-14; a
    dimension wrong by one micrometre differs by 1e-6.
    """

    position_m: float = 1e-9
    rotation_rad: float = 1e-9


@dataclass(frozen=True)
class Disagreement:
    """The largest difference of two sources about one frame.

    Attributes:
        frame: The frame.
        position_m: Largest distance of the two origins, [m].
        rotation_rad: Largest angle between the two orientations, [rad].
        q_position: Where the origins differ most, (n,).
        q_rotation: Where the orientations differ most, (n,).
    """

    frame: str
    position_m: float
    rotation_rad: float
    q_position: tuple[float, ...]
    q_rotation: tuple[float, ...]

    def exceeds(self, tolerances: Tolerances) -> bool:
        """Whether it is more than the tolerances allow (NaN is)."""
        within = (
            self.position_m <= tolerances.position_m
            and self.rotation_rad <= tolerances.rotation_rad
        )
        return not within


def differences(
    first: Placements, second: Placements, configurations: Iterable[ArrayLike]
) -> dict[str, Disagreement]:
    """Largest difference of two sources about each frame, over all configurations.

    Args:
        first: Function q -> {frame: T_base_frame}.
        second: Another one; both must know the same frames.
        configurations: Joint positions, (k, n).

    Raises:
        UnknownNameError: One knows a frame that the other does not.
        UsageError: No configuration, or no frame, to compare.
    """
    worst: dict[str, Disagreement] = {}
    for row in configurations:
        q = np.array(row, dtype=np.float64)
        one, other = first(q), second(q)
        _same_frames(one, other)
        for frame, T in one.items():
            found = _difference(frame, q, T, other[frame])
            worst[frame] = _larger(worst[frame], found) if frame in worst else found
    if not worst:
        raise UsageError("no configuration or no frame to compare: nothing was checked")
    return worst


def disagreements(
    first: Placements,
    second: Placements,
    configurations: Iterable[ArrayLike],
    tolerances: Tolerances | None = None,
) -> list[Disagreement]:
    """The frames about which two sources differ beyond the tolerances."""
    allowed = Tolerances() if tolerances is None else tolerances
    worst = differences(first, second, configurations)
    return [found for found in worst.values() if found.exceeds(allowed)]


def _same_frames(one: Mapping[str, Array], other: Mapping[str, Array]) -> None:
    for extra in sorted(set(one) ^ set(other)):
        knows = one if extra not in one else other
        raise UnknownNameError("frame", extra, sorted(knows))


def _difference(frame: str, q: Array, T: Array, T_other: Array) -> Disagreement:
    at = tuple(float(v) for v in q)
    distance = float(np.linalg.norm(T[:3, 3] - T_other[:3, 3]))
    return Disagreement(
        frame, distance, rotation_angle(T[:3, :3], T_other[:3, :3]), at, at
    )


def _larger(one: Disagreement, other: Disagreement) -> Disagreement:
    """The larger of each kind; NaN counts as larger than anything."""
    p = max(one, other, key=lambda d: _size(d.position_m))
    r = max(one, other, key=lambda d: _size(d.rotation_rad))
    return Disagreement(
        one.frame, p.position_m, r.rotation_rad, p.q_position, r.q_rotation
    )


def _size(value: float) -> float:
    return np.inf if np.isnan(value) else value
