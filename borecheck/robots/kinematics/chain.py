"""A robot's joints as arrays: one chain for placements and for bounds on motion.

T_parent_child(theta) = T_parent_joint * motion(theta), as URDF defines it: turning
about or sliding along the axis by theta = factor * q[source] + offset. Mimic joints are
joints whose source is another joint's variable.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import check_transform
from borecheck.errors import GeometryError
from borecheck.robots.kinematics.forward import (
    FIXED,
    SLIDES,
    TURNS,
    WORLD,
    joint_parts,
    place_all,
    place_many,
)

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class JointChain:
    """A tree of frames, each placed by one joint on the frame before it.

    Frame i is the frame of joint i's child. The arrays are copied and frozen.

    Attributes:
        parent: Frame before each joint, (n,); WORLD (-1), or a smaller index.
        origin: T_parent_joint at theta = 0, (n, 4, 4), [m].
        kind: FIXED, TURNS (continuous, too) or SLIDES, (n,).
        axis: Axis in the joint's frame, (n, 3); brought to length 1.
        source: Entry of q, (n,); -1 for fixed joints.
        factor: Multiplier, (n,).
        offset: Added, (n,), [rad] or [m].

    Raises:
        GeometryError: Arrays that do not fit together, parents behind their children,
            origins that are not rigid, axes of length 0.
    """

    parent: Ids
    origin: Array
    kind: Ids
    axis: Array
    source: Ids
    factor: Array
    offset: Array

    def __post_init__(self) -> None:
        for name, dtype in _TYPES.items():
            object.__setattr__(self, name, _copied(getattr(self, name), name, dtype))
        _check(self)
        object.__setattr__(self, "axis", _unit_axes(self.axis, self.kind))
        for name in _TYPES:
            getattr(self, name).setflags(write=False)

    @cached_property
    def parts(self) -> Array:
        """What each joint's motion is made of, (n, 3, 3, 4); see `joint_parts`."""
        return joint_parts(self.origin, self.kind, self.axis)

    @cached_property
    def length(self) -> Array:
        """Length of every joint's fixed offset, (n,), [m]."""
        return np.linalg.norm(self.origin[:, :3, 3], axis=1)

    def extent(self, largest: Array) -> float:
        """Bound on the distance of any frame's origin from the world's, [m].

        Args:
            largest: Largest |theta| of every joint, (n,).
        """
        slide = np.where(self.kind == SLIDES, largest, 0.0)
        # No way through the chain is longer than all of it.
        return float((self.length + slide).sum())

    @property
    def frame_count(self) -> int:
        """Number of frames."""
        return len(self.parent)

    @cached_property
    def joint_count(self) -> int:
        """Length of q."""
        return int(self.source.max(initial=-1)) + 1

    def thetas(self, q: ArrayLike) -> Array:
        """Joint values (..., n) of configurations (..., nq); 0 for fixed joints."""
        q = np.asarray(q, dtype=np.float64)
        if self.joint_count == 0:  # nothing that an entry of q could move
            return np.zeros((*q.shape[:-1], self.frame_count))
        values = self.factor * q[..., self.source] + self.offset
        values[..., self.kind == FIXED] = 0.0
        return np.ascontiguousarray(values)

    def placed(self, theta: Array) -> Array:
        """T_world_frame of every frame for joint values (n,), (n, 4, 4)."""
        placed = np.zeros((self.frame_count, 4, 4))
        place_all(theta, self.parent, self.kind, self.parts, placed)
        return placed

    def placements(self, qs: ArrayLike, frames: ArrayLike | None = None) -> Array:
        """T_world_frame for every configuration, (k, frames, 4, 4).

        Args:
            qs: Configurations, (k, nq), [rad] and [m]; limits are not looked at.
            frames: Frames to give, in this order; default: all.

        Raises:
            GeometryError: Wrong shape, a number that is not finite, no such frame.
        """
        qs = np.array(qs, np.float64, order="C")
        if qs.ndim != 2 or qs.shape[1] != self.joint_count:
            raise GeometryError(
                f"qs have shape {qs.shape}, not (n, {self.joint_count})"
            )
        if not np.isfinite(qs).all():
            bad = int(np.flatnonzero(~np.isfinite(qs).all(axis=1))[0])
            raise GeometryError(
                f"configuration {bad} holds a number that is not finite"
            )
        wanted = self._wanted(frames)
        placements = np.zeros((len(qs), len(wanted), 4, 4))
        place_many(
            self.parent,
            self.kind,
            self.source,
            self.factor,
            self.offset,
            self.parts,
            qs,
            wanted,
            placements,
        )
        return placements

    def _wanted(self, frames: ArrayLike | None) -> Ids:
        if frames is None:
            return np.arange(self.frame_count)
        wanted = np.array(frames, np.int64, order="C")
        inside = wanted.ndim == 1 and (
            len(wanted) == 0 or (wanted.min() >= 0 and wanted.max() < self.frame_count)
        )
        if not inside:
            raise GeometryError(
                f"frames must be a list of numbers below {self.frame_count}"
            )
        return wanted


_TYPES: dict[str, type] = {
    "parent": np.int64,
    "origin": np.float64,
    "kind": np.int64,
    "axis": np.float64,
    "source": np.int64,
    "factor": np.float64,
    "offset": np.float64,
}


def _copied(values: Any, name: str, dtype: type) -> NDArray[Any]:
    try:
        return np.array(values, dtype=dtype, order="C")
    except (TypeError, ValueError):
        raise GeometryError(f"chain: {name} holds what is no number") from None


def _unit_axes(axis: Array, kind: Ids) -> Array:
    """Axes of length 1; a URDF's digits leave them a little off."""
    length = np.linalg.norm(axis, axis=-1, keepdims=True)
    if not (length[kind != FIXED] > 1e-6).all():
        raise GeometryError("chain: a joint moves along or about an axis of length 0")
    return axis / np.where(length > 1e-6, length, 1.0)


def _check(chain: JointChain) -> None:
    n = len(chain.parent)
    shapes = {"origin": (n, 4, 4), "axis": (n, 3)}
    for name in _TYPES:
        shape = getattr(chain, name).shape
        if shape != shapes.get(name, (n,)):
            raise GeometryError(f"chain: {name} has shape {shape} for {n} joints")
    for i in range(n):
        check_transform(chain.origin[i], f"chain: origin of joint {i}")
        if not WORLD <= chain.parent[i] < i:
            raise GeometryError(f"chain: joint {i} comes before its parent")
        if chain.kind[i] not in (FIXED, TURNS, SLIDES):
            raise GeometryError(f"chain: joint {i} is of kind {chain.kind[i]}")
        if chain.kind[i] == FIXED:
            continue
        if chain.source[i] < 0:
            raise GeometryError(f"chain: joint {i} moves but has no source in q")
        if not np.isfinite([*chain.axis[i], chain.factor[i], chain.offset[i]]).all():
            raise GeometryError(
                f"chain: axis or mimic numbers of joint {i} are not finite"
            )
